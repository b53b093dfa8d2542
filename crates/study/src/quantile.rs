//! Quantiles of sorted values. Each is a value that occurred; they differ in which of two neighbours it
//! is. What is published was computed by each of them, so all three stay.

/// The smallest value that at least this share of all values does not exceed (nearest rank).
pub(crate) fn nearest_rank<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied()
}

/// The value nearest to this share of the way from the first to the last; of two as near, the larger.
pub(crate) fn on_the_way<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((share * last as f64).round() as usize).copied()
}

/// The first value beyond this share of all values.
pub(crate) fn first_beyond<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    sorted.get((share * sorted.len() as f64) as usize).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conventions_differ_in_the_neighbour_that_they_take() {
        let of = |sorted: &[u8], share: f64| {
            [nearest_rank(sorted, share), on_the_way(sorted, share), first_beyond(sorted, share)]
        };
        assert_eq!(of(&[1, 2, 3, 4], 0.5), [Some(2), Some(3), Some(3)]);
        assert_eq!(of(&[1, 2, 3, 4, 5], 0.5), [Some(3); 3]);
        assert_eq!(of(&[1, 2, 3, 4], 0.0), [Some(1); 3]);
        assert_eq!(of(&[1, 2, 3, 4], 1.0), [Some(4), Some(4), None]);
        assert_eq!(of(&[], 0.5), [None; 3]);
    }
}
