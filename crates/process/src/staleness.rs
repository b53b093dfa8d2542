//! Detects whether samples arrive: without samples, health is unknown.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use vocabulary::words::utc;
use vocabulary::{ComponentPath, ModulePhase, Step};

/// The reason for the unknown state right after the start.
pub const NO_SAMPLE_YET: &str = "no sample received yet";

/// Monitors the arrival of samples and changes of phase.
#[derive(Debug)]
pub struct Staleness {
    stale_after: Duration,
    latest: Option<Instant>,
    stale: bool,
    /// When the latest sample before the silence was diagnosed \[ns since 1970\].
    stale_since_unix_ns: u64,
    published: Option<ModulePhase>,
    /// The components that are not monitored, as published, and since when that is so.
    not_monitored: BTreeMap<ComponentPath, LostComponent>,
    changed: Option<ClockReading>,
}

/// A component is reported as monitored again after it has been monitored for this time, so that one that is monitored
/// now and then does not fill the journal.
const MONITORED_AGAIN_AFTER: Duration = Duration::from_secs(10);

/// A component whose loss was published, and its return not yet.
#[derive(Debug)]
struct LostComponent {
    reason: String,
    monitored_since: Option<ClockReading>,
}

/// The clocks and the latest step at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ClockReading {
    /// On the monotonic clock.
    pub at: Instant,
    /// On the system clock \[ns since 1970\].
    pub time_unix_ns: u64,
    /// The latest step processed.
    pub step: Option<Step>,
}

impl Staleness {
    /// Samples count as missing after this time without one.
    #[must_use]
    pub fn new(stale_after: Duration) -> Self {
        Self {
            stale_after,
            latest: None,
            stale: false,
            stale_since_unix_ns: 0,
            published: None,
            not_monitored: BTreeMap::new(),
            changed: None,
        }
    }

    /// Records that a sample was diagnosed.
    pub fn sample(&mut self, now: Instant) {
        self.latest = Some(now);
        self.stale = false;
    }

    /// Checks whether samples have stopped; returns true the first time.
    pub fn look(&mut self, now: Instant, now_unix_ns: u64) -> bool {
        let age = self.latest.map(|latest| now.duration_since(latest));
        let silent = age.filter(|age| *age >= self.stale_after);
        let begins = silent.filter(|_| !self.stale);
        self.stale = silent.is_some();
        if let Some(age) = begins {
            let age_ns = u64::try_from(age.as_nanos()).unwrap_or(u64::MAX);
            self.stale_since_unix_ns = now_unix_ns.saturating_sub(age_ns);
        }
        begins.is_some()
    }

    /// Whether samples have stopped.
    #[must_use]
    pub fn is_stale(&self) -> bool {
        self.stale
    }

    /// The phase as published.
    #[must_use]
    pub fn phase(&self, diagnosed: ModulePhase) -> ModulePhase {
        if self.stale { ModulePhase::Stale } else { diagnosed }
    }

    /// If `phase` differs from the phase published before, records it as published and returns the former one.
    pub fn change_to(&mut self, phase: ModulePhase) -> Option<Option<ModulePhase>> {
        if self.published == Some(phase) {
            return None;
        }
        // In the new phase nothing has been published of its components.
        self.not_monitored.clear();
        self.changed = None;
        Some(self.published.replace(phase))
    }

    /// Records which components are not monitored. If that is to be published, returns since when it is so: a loss at
    /// once, a return after ten seconds. Only a module in service has such components.
    pub fn change_of_monitored(
        &mut self,
        not_monitored: &BTreeMap<ComponentPath, String>,
        now: ClockReading,
    ) -> Option<ClockReading> {
        let is_known = |component| self.not_monitored.contains_key(component);
        let loss = not_monitored.keys().any(|component| !is_known(component)).then_some(now);
        for (component, lost) in &mut self.not_monitored {
            if !not_monitored.contains_key(component) {
                lost.monitored_since.get_or_insert(now);
            }
        }
        for (component, reason) in not_monitored {
            let lost = LostComponent { reason: reason.clone(), monitored_since: None };
            self.not_monitored.insert(component.clone(), lost);
        }
        let is_back = |lost: &LostComponent| {
            let since = lost.monitored_since;
            since.is_some_and(|since| now.at.duration_since(since.at) >= MONITORED_AGAIN_AFTER)
        };
        let back = self.not_monitored.values().filter(|lost| is_back(lost));
        let back = back.filter_map(|lost| lost.monitored_since).max();
        self.not_monitored.retain(|_, lost| !is_back(lost));
        let change = loss.or(back)?;
        // What was lost later than another component came back is not monitored since it was lost.
        self.changed = self.changed.max(Some(change));
        self.changed
    }

    /// The components that are not monitored, as published, and why. They include those that have been monitored again
    /// for less than ten seconds.
    #[must_use]
    pub fn not_monitored(&self) -> BTreeMap<ComponentPath, String> {
        let lost = self.not_monitored.iter();
        lost.map(|(component, lost)| (component.clone(), lost.reason.clone())).collect()
    }

    /// In words, how many of `all` components are not monitored, as published.
    #[must_use]
    pub fn monitored_in_words(&self, all: usize) -> String {
        let Some(first) = self.not_monitored.values().next() else {
            return "all components are monitored again".to_owned();
        };
        let is_returning = self.not_monitored.values().any(|lost| lost.monitored_since.is_some());
        let seconds = MONITORED_AGAIN_AFTER.as_secs();
        let or_were_not = if is_returning {
            format!(", or were not within the last {seconds} s")
        } else {
            String::new()
        };
        let (count, reason) = (self.not_monitored.len(), &first.reason);
        format!("{count} of {all} components are not monitored{or_were_not}: {reason}")
    }

    /// The reason for this phase.
    #[must_use]
    pub fn reason(&self, phase: ModulePhase, refusals: &RecentRefusals, now: Instant) -> String {
        let without_samples = matches!(phase, ModulePhase::Waiting | ModulePhase::Stale);
        let refused = refusals.present(now, self.stale_after);
        if let Some(refused) = refused.filter(|_| without_samples) {
            return refused;
        }
        match phase {
            ModulePhase::Waiting => NO_SAMPLE_YET.to_owned(),
            ModulePhase::Initialising => {
                "a channel rests on too few samples, or samples are missing".to_owned()
            }
            ModulePhase::InService => "every channel with a signal is watched".to_owned(),
            // A duration would be outdated as soon as it is read.
            ModulePhase::Stale => format!("no sample since {}", utc(self.stale_since_unix_ns)),
        }
    }
}

/// Refusals are counted over periods of this length.
const SPAN: Duration = Duration::from_secs(1);

/// Recently refused samples: the reason for an unknown state.
#[derive(Debug, Clone, Default)]
pub struct RecentRefusals(Option<LatestRefusal>);

#[derive(Debug, Clone)]
struct LatestRefusal {
    reason: String,
    at: Instant,
    span_began: Instant,
    in_span: u64,
    in_span_before: Option<u64>,
}

impl RecentRefusals {
    /// Records a refused sample.
    pub fn note(&mut self, reason: String, now: Instant) {
        let latest = self.0.get_or_insert_with(|| LatestRefusal::begins(now));
        latest.count(now);
        latest.reason = reason;
    }

    /// The reason for refusals within the last `span`, and their rate per second.
    #[must_use]
    pub fn present(&self, now: Instant, span: Duration) -> Option<String> {
        let latest = self.0.as_ref().filter(|latest| now.duration_since(latest.at) < span)?;
        let LatestRefusal { reason, in_span, in_span_before, .. } = latest;
        let rate = in_span_before.unwrap_or(*in_span);
        Some(format!("samples arrive and are refused: {reason} ({rate} a second)"))
    }
}

impl LatestRefusal {
    fn begins(now: Instant) -> Self {
        Self { reason: String::new(), at: now, span_began: now, in_span: 0, in_span_before: None }
    }

    fn count(&mut self, now: Instant) {
        let spans = now.duration_since(self.span_began).as_nanos() / SPAN.as_nanos();
        if spans > 0 {
            self.in_span_before = (spans == 1).then_some(self.in_span);
            self.span_began = now;
            self.in_span = 0;
        }
        self.in_span += 1;
        self.at = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_begins_once_and_ends_with_a_sample() {
        let limit = Duration::from_millis(500);
        let mut staleness = Staleness::new(limit);
        let start = Instant::now();
        assert!(
            !staleness.look(start + 10 * limit, 0),
            "before the first sample it is waiting, not stale"
        );
        staleness.sample(start);
        assert!(!staleness.look(start + limit / 2, 0));
        assert!(staleness.look(start + limit, 1_500_000_000) && staleness.is_stale());
        assert!(!staleness.look(start + 2 * limit, 2_000_000_000) && staleness.is_stale());
        let (refusals, later) = (RecentRefusals::default(), start + 20 * limit);
        let reason = staleness.reason(ModulePhase::Stale, &refusals, later);
        assert_eq!(reason, "no sample since 1970-01-01T00:00:01.000Z", "true whenever it is read");
        assert_eq!(staleness.phase(ModulePhase::InService), ModulePhase::Stale);
        staleness.sample(start + 3 * limit);
        assert_eq!(staleness.phase(ModulePhase::InService), ModulePhase::InService);
    }

    #[test]
    fn a_phase_is_published_once() {
        let mut staleness = Staleness::new(Duration::from_millis(500));
        assert_eq!(staleness.change_to(ModulePhase::Waiting), Some(None));
        assert_eq!(staleness.change_to(ModulePhase::Waiting), None);
        assert_eq!(staleness.change_to(ModulePhase::Stale), Some(Some(ModulePhase::Waiting)));
    }

    /// A tick each half second, with the components lost then; the published changes: when, since when, and what.
    fn published(
        seconds: std::ops::Range<u64>,
        lost: impl Fn(f64) -> Vec<&'static str>,
    ) -> Vec<(f64, f64, String)> {
        let mut staleness = Staleness::new(Duration::from_millis(500));
        let start = Instant::now();
        let mut published = Vec::new();
        for tick in 2 * seconds.start..2 * seconds.end {
            let time = f64::from(u32::try_from(tick).unwrap()) / 2.0;
            let lost: BTreeMap<ComponentPath, String> =
                lost(time).iter().map(|name| (name.parse().unwrap(), "why".to_owned())).collect();
            if let Some(since) = staleness.change_of_monitored(&lost, moment(start, tick)) {
                assert_eq!(since.at - start, Duration::from_nanos(since.time_unix_ns));
                let since = since.at.duration_since(start).as_secs_f64();
                published.push((time, since, staleness.monitored_in_words(12)));
            }
            let said = staleness.not_monitored();
            assert!(lost.keys().all(|component| said.contains_key(component)), "at {time} s");
        }
        published
    }

    fn moment(start: Instant, tick: u64) -> ClockReading {
        let after = Duration::from_millis(500 * tick);
        let time_unix_ns = u64::try_from(after.as_nanos()).unwrap();
        ClockReading { at: start + after, time_unix_ns, step: Some(Step(tick)) }
    }

    const ALL_AGAIN: &str = "all components are monitored again";
    const ONE: &str = "1 of 12 components are not monitored: why";
    const TWO: &str = "2 of 12 components are not monitored: why";

    fn told(expected: &[(f64, f64, &str)]) -> Vec<(f64, f64, String)> {
        expected.iter().map(|(at, since, what)| (*at, *since, (*what).to_owned())).collect()
    }

    #[test]
    fn a_loss_is_reported_at_once_and_a_return_after_ten_seconds_with_its_own_time() {
        let (g1, both) = (vec!["m1/sensor/g1"], vec!["m1/sensor/g1", "m1/sensor/g2"]);
        let lost = |time: f64| match time {
            1.0..2.0 => g1.clone(),
            2.0..30.0 => both.clone(),
            30.0..31.0 => g1.clone(),
            _ => Vec::new(),
        };
        // At 40 s the other one has been back for 9 s only.
        let and_not_yet =
            "1 of 12 components are not monitored, or were not within the last 10 s: why";
        let lost_so_far = [(1.0, 1.0, ONE), (2.0, 2.0, TWO)];
        let expected =
            [&lost_so_far[..], &[(40.0, 30.0, and_not_yet), (41.0, 31.0, ALL_AGAIN)]].concat();
        assert_eq!(published(0..60, lost), told(&expected));
    }

    #[test]
    fn a_component_that_is_lost_each_second_is_reported_once() {
        let lost = |time: f64| match time {
            1.0..100.0 if time.fract() < 0.5 => vec!["m1/sensor/g1"],
            _ => Vec::new(),
        };
        let expected = [(1.0, 1.0, ONE), (109.5, 99.5, ALL_AGAIN)];
        assert_eq!(published(0..200, lost), told(&expected));
        // Two in turn.
        let in_turn = |time: f64| match time {
            1.0..100.0 if time.fract() < 0.5 => vec!["m1/sensor/g1"],
            1.0..100.0 => vec!["m1/sensor/g2"],
            _ => Vec::new(),
        };
        let told: Vec<f64> = published(0..200, in_turn).iter().map(|(at, ..)| *at).collect();
        assert_eq!(told, [1.0, 1.5, 109.5, 110.0]);
    }

    #[test]
    fn a_return_that_is_reported_after_a_later_loss_holds_since_that_loss() {
        let lost = |time: f64| match time {
            1.0..5.0 => vec!["m1/sensor/g1"],
            8.0.. => vec!["m1/sensor/g2"],
            _ => Vec::new(),
        };
        let both = "2 of 12 components are not monitored, or were not within the last 10 s: why";
        let expected = [(1.0, 1.0, ONE), (8.0, 8.0, both), (15.0, 8.0, ONE)];
        assert_eq!(published(0..60, lost), told(&expected));
    }

    #[test]
    fn a_new_phase_begins_without_components_that_are_not_monitored() {
        let mut staleness = Staleness::new(Duration::from_millis(500));
        let now = moment(Instant::now(), 0);
        let lost = BTreeMap::from([("m1/sensor/g1".parse().unwrap(), "why".to_owned())]);
        let _ = staleness.change_to(ModulePhase::InService);
        assert_eq!(staleness.change_of_monitored(&lost, now), Some(now));
        let _ = staleness.change_to(ModulePhase::Stale);
        let _ = staleness.change_to(ModulePhase::InService);
        assert_eq!(staleness.change_of_monitored(&lost, now), Some(now), "it is reported again");
        let _ = staleness.change_to(ModulePhase::Stale);
        assert_eq!(
            staleness.change_of_monitored(&BTreeMap::new(), now),
            None,
            "nothing is claimed to be back"
        );
    }

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn the_reason_is_the_latest_and_the_rate_that_of_the_last_second() {
        let mut refusals = RecentRefusals::default();
        let start = Instant::now();
        assert_eq!(refusals.present(start, SPAN), None);
        for ms in 0..1500 {
            refusals.note("wrong number of values".to_owned(), start + ms * MS);
        }
        let now = start + 1500 * MS;
        let expected = "samples arrive and are refused: wrong number of values (1000 a second)";
        assert_eq!(refusals.present(now, 500 * MS).as_deref(), Some(expected));
        assert_eq!(refusals.present(now + 500 * MS, 500 * MS), None, "they have stopped");
    }
}
