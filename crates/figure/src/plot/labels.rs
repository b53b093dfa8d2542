//! Places labels of vertical marks in lanes above a panel, so that they do not overlap each other or the line of a
//! mark.

/// Space between a label and the line of a mark \[px\].
const GAP: f64 = 4.0;

/// A label to be placed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WantedLabel {
    /// The position of its mark \[px\].
    pub(super) x: f64,
    /// The width of its text \[px\].
    pub(super) width: f64,
    /// Whether it prefers the left side of its mark.
    pub(super) leftwards: bool,
}

/// The position of a label.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlacedLabel {
    /// The left end of the text \[px\].
    pub(super) start: f64,
    /// 0 directly above the panel; the mark's line extends up to the label.
    pub(super) lane: i32,
}

/// Places the labels, each within the limits if it fits.
pub(super) fn place(wanted: &[WantedLabel], limits: [f64; 2]) -> Vec<PlacedLabel> {
    let mut taken: Vec<(WantedLabel, PlacedLabel)> = Vec::new();
    let most = i32::try_from(wanted.len()).unwrap_or(i32::MAX);
    for want in wanted {
        let starts = starts(want, limits);
        // Lanes above or below labels placed earlier, nearest first.
        let lanes = (0..=most).flat_map(|lane| [lane, -lane]);
        let mut places = lanes.flat_map(|lane| starts.map(|start| PlacedLabel { start, lane }));
        let free = places.find(|place| is_free(&taken, want, place));
        taken.push((*want, free.unwrap_or(PlacedLabel { start: starts[0], lane: most })));
    }
    let lowest = taken.iter().map(|(_, placed)| placed.lane).min().unwrap_or(0);
    let raised = |placed: PlacedLabel| PlacedLabel { lane: placed.lane - lowest, ..placed };
    taken.into_iter().map(|(_, placed)| raised(placed)).collect()
}

/// Positions right and left of the mark, the preferred one first; shifted to stay within the limits.
fn starts(want: &WantedLabel, [low, high]: [f64; 2]) -> [f64; 2] {
    let right = want.x + GAP;
    let left = want.x - GAP - want.width;
    let fits = |start: f64| low <= start && start + want.width <= high;
    let (first, second) = if want.leftwards { (left, right) } else { (right, left) };
    let [first, second] =
        if fits(first) || !fits(second) { [first, second] } else { [second, first] };
    [first, second].map(|start| start.min(high - want.width).max(low))
}

fn is_free(taken: &[(WantedLabel, PlacedLabel)], want: &WantedLabel, place: &PlacedLabel) -> bool {
    let covers = |start: f64, width: f64, x: f64| start - GAP < x && x < start + width + GAP;
    taken.iter().all(|(other, placed)| {
        let beside = place.start + want.width + GAP < placed.start
            || placed.start + other.width + GAP < place.start;
        let overlaps = place.lane == placed.lane && !beside;
        // The line of the higher label passes through the lanes below it.
        let struck_out = (placed.lane >= place.lane
            && covers(place.start, want.width - GAP, other.x)
            && other.x != want.x)
            || (place.lane >= placed.lane
                && covers(placed.start, other.width - GAP, want.x)
                && other.x != want.x);
        !overlaps && !struck_out
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn want(x: f64, width: f64, leftwards: bool) -> WantedLabel {
        WantedLabel { x, width, leftwards }
    }

    #[test]
    fn neighbours_stand_back_to_back() {
        let placed = place(&[want(100.0, 50.0, true), want(103.0, 50.0, false)], [0.0, 500.0]);
        assert_eq!(placed[0], PlacedLabel { start: 46.0, lane: 0 });
        assert_eq!(placed[1], PlacedLabel { start: 107.0, lane: 0 });
    }

    #[test]
    fn crowded_labels_overlap_neither_each_other_nor_lines() {
        let crowd: Vec<WantedLabel> =
            (0..7).map(|i| want(100.0 + 12.0 * f64::from(i), 90.0, i % 2 == 0)).collect();
        let placed = place(&crowd, [0.0, 400.0]);
        for (i, a) in placed.iter().enumerate() {
            assert!(a.start >= 0.0 && a.start + 90.0 <= 400.0);
            for (j, b) in placed.iter().enumerate().filter(|(j, _)| *j != i) {
                assert!(a.lane != b.lane || (a.start - b.start).abs() >= 90.0, "{i} {j}");
                let struck = a.start < crowd[j].x && crowd[j].x < a.start + 85.0;
                assert!(b.lane < a.lane || !struck, "{j} strikes out {i}");
            }
        }
    }

    #[test]
    fn a_label_at_the_edge_turns_round() {
        assert_eq!(place(&[want(490.0, 50.0, false)], [0.0, 500.0])[0].start, 436.0);
        assert_eq!(place(&[want(10.0, 50.0, true)], [0.0, 500.0])[0].start, 14.0);
    }
}
