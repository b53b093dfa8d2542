//! Finds space for symbols and their labels.

use super::projection::PagePoint;

/// The elements placed so far.
#[derive(Default)]
pub(super) struct Placement {
    lines: Vec<[PagePoint; 2]>,
    marks: Vec<PagePoint>,
}

impl Placement {
    /// Records a line.
    pub(super) fn line(&mut self, line: [PagePoint; 2]) {
        self.lines.push(line);
    }

    /// Records a symbol or label.
    pub(super) fn mark(&mut self, at: PagePoint) {
        self.marks.push(at);
    }

    /// The candidate with the most space around it, the first among equals. Lines count less than symbols: a label may
    /// be near a line but never on a symbol.
    pub(super) fn roomiest(
        &self,
        candidates: impl IntoIterator<Item = PagePoint>,
        own: Option<[PagePoint; 2]>,
    ) -> Option<PagePoint> {
        let mut best: Option<(PagePoint, f64)> = None;
        for candidate in candidates {
            let room = self.room(candidate, own);
            if best.is_none_or(|(_, most)| room > most + 0.5) {
                best = Some((candidate, room));
            }
        }
        best.map(|(point, _)| point)
    }

    fn room(&self, at: PagePoint, own: Option<[PagePoint; 2]>) -> f64 {
        let marks = self.marks.iter().map(|mark| 0.5 * at.distance(*mark));
        let lines = self.lines.iter().filter(|line| Some(**line) != own);
        let lines = lines.map(|line| at.distance_from_line(*line));
        marks.chain(lines).fold(18.0, f64::min)
    }
}
