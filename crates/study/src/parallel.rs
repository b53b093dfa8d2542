//! Processes independent items in parallel.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use parking_lot::Mutex;

/// Calls `work` for every item, `jobs` at a time, approximately in order. `done` receives the results one at a time, as
/// they become available. No new work is started once `stop` is set, or `work` or `done` has failed.
///
/// # Errors
/// The first error of `work` or `done`.
pub fn for_each<I: Sync, T: Send, E: Send>(
    items: &[I],
    jobs: usize,
    stop: &AtomicBool,
    work: impl Fn(&I) -> Result<T, E> + Sync,
    done: impl FnMut(&I, T) -> Result<(), E> + Send,
) -> Result<(), E> {
    let next = AtomicUsize::new(0);
    let sink = Mutex::new((done, Ok(())));
    let failed = AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, items.len().max(1)) {
            scope.spawn(|| {
                while !stop.load(Ordering::Relaxed) && !failed.load(Ordering::Relaxed) {
                    let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
                    let result = work(item);
                    let mut sink = sink.lock();
                    let (done, outcome) = &mut *sink;
                    if outcome.is_ok() {
                        *outcome = result.and_then(|result| done(item, result));
                    }
                    failed.fetch_or(outcome.is_err(), Ordering::Relaxed);
                }
            });
        }
    });
    sink.into_inner().1
}

/// The results of `work` on every item, in the items' order, `jobs` at a time. `done` is called after each.
///
/// # Errors
/// The first error of `work`.
pub fn map<I: Sync, T: Send, E: Send>(
    items: &[I],
    jobs: usize,
    work: impl Fn(&I) -> Result<T, E> + Sync,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<T>, E> {
    let places: Vec<usize> = (0..items.len()).collect();
    let mut results: Vec<Option<T>> = items.iter().map(|_| None).collect();
    let keep = |place: &usize, result| {
        results[*place] = Some(result);
        done();
        Ok(())
    };
    for_each(&places, jobs, &AtomicBool::new(false), |place| work(&items[*place]), keep)?;
    Ok(results.into_iter().flatten().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_done_once_whatever_the_number_of_jobs() {
        let items: Vec<u64> = (0..50).collect();
        for jobs in [0, 1, 3, 100] {
            let mut results = Vec::new();
            let done = |item: &u64, result: u64| {
                results.push((*item, result));
                Ok(())
            };
            let stop = AtomicBool::new(false);
            let work = |item: &u64| Ok::<_, String>(item * item);
            for_each(&items, jobs, &stop, work, done).unwrap();
            results.sort_unstable();
            assert_eq!(results, items.iter().map(|i| (*i, i * i)).collect::<Vec<_>>());
        }
    }

    #[test]
    fn results_come_in_the_order_of_the_items() {
        let items: Vec<u64> = (0..50).collect();
        let count = AtomicUsize::new(0);
        let done = || {
            count.fetch_add(1, Ordering::Relaxed);
        };
        let squares = map(&items, 3, |item| Ok::<_, String>(item * item), &done).unwrap();
        assert_eq!(squares, items.iter().map(|i| i * i).collect::<Vec<_>>());
        assert_eq!(count.into_inner(), 50);
        let refused = |item: &u64| if *item == 7 { Err("seven") } else { Ok(()) };
        assert_eq!(map(&items, 3, refused, &|| ()), Err("seven"));
    }

    #[test]
    fn an_error_ends_it_and_nothing_is_reported_afterwards() {
        let items: Vec<u64> = (0..1000).collect();
        let stop = AtomicBool::new(false);
        let mut reported = 0;
        let work = |item: &u64| if *item == 3 { Err("three") } else { Ok(()) };
        let done = |_: &u64, ()| {
            reported += 1;
            Ok(())
        };
        assert_eq!(for_each(&items, 2, &stop, work, done), Err("three"));
        assert!(reported <= 5, "{reported}");
    }

    #[test]
    fn nothing_new_is_begun_once_stopped() {
        let items = [(); 100];
        let stop = AtomicBool::new(false);
        let mut reported = 0;
        let done = |_: &(), ()| {
            reported += 1;
            stop.store(true, Ordering::Relaxed);
            Ok::<_, String>(())
        };
        for_each(&items, 1, &stop, |()| Ok(()), done).unwrap();
        assert_eq!(reported, 1);
    }
}
