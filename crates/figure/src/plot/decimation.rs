//! Reduces the number of points without losing peaks: keeps the lowest and the highest point within each pixel column,
//! which is all that is visible.

/// The lowest and the highest point of each column one unit wide, in their order. Points must have ascending x.
pub(super) fn extremes(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let same_column = |a: &[f64; 2], b: &[f64; 2]| a[0].floor() == b[0].floor();
    let mut kept = Vec::with_capacity(points.len());
    for column in points.chunk_by(same_column) {
        let by_height = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        let Some(low) = column.iter().min_by(by_height) else { continue };
        let Some(high) = column.iter().max_by(by_height) else { continue };
        let (first, second) = if low[0] <= high[0] { (low, high) } else { (high, low) };
        kept.push(*first);
        if first != second {
            kept.push(*second);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_and_the_smallest_value_of_every_column_stay() {
        let height = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 20);
        let points: Vec<[f64; 2]> = (0..5000).map(|i| [f64::from(i) / 37.0, height(i)]).collect();
        let kept = extremes(&points);
        assert!(kept.len() <= 2 * 136, "{}", kept.len());
        for column in 0..136 {
            let of = |points: &[[f64; 2]]| {
                let inside = points.iter().filter(|p| p[0].floor() == f64::from(column));
                let ends = [f64::MAX, f64::MIN];
                inside.fold(ends, |[low, high], p| [low.min(p[1]), high.max(p[1])])
            };
            assert_eq!(of(&kept), of(&points), "{column}");
        }
        assert!(kept.is_sorted_by(|a, b| a[0] <= b[0]));
    }

    #[test]
    fn few_points_stay_as_they_are() {
        let points = [[0.5, 1.0], [1.5, 2.0], [4.0, 0.0]];
        assert_eq!(extremes(&points), points);
        assert!(extremes(&[]).is_empty());
    }
}
