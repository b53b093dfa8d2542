//! Cells of a terminal, each with the dots of a braille character, and with a line or without.

/// Dots of a cell, across and down.
const ACROSS: usize = 2;
const DOWN: usize = 4;
/// The character without dots; those with some follow it.
const NO_DOTS: u32 = 0x2800;
/// The bit of each dot, by row and column: <https://www.unicode.org/charts/PDF/U2800.pdf>.
const BITS: [[u8; ACROSS]; DOWN] = [[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]];

/// What is in a cell.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Cell {
    dots: u8,
    line: bool,
}

impl Cell {
    /// Is the line in it?
    pub(super) fn is_line(self) -> bool {
        self.line
    }

    pub(super) fn character(self) -> char {
        match (self.line, self.dots) {
            (true, 0) => '─',
            (true, _) => '━',
            (false, 0) => ' ',
            (false, dots) => char::from_u32(NO_DOTS + u32::from(dots)).unwrap_or(' '),
        }
    }
}

/// The cells.
#[derive(Debug)]
pub(super) struct Canvas {
    columns: usize,
    cells: Vec<Cell>,
}

impl Canvas {
    /// An empty one with at least one cell.
    pub(super) fn new(columns: usize, rows: usize) -> Self {
        let columns = columns.max(1);
        Self { columns, cells: vec![Cell::default(); columns * rows.max(1)] }
    }

    /// From the top down.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[Cell]> {
        self.cells.chunks(self.columns)
    }

    fn height(&self) -> usize {
        self.cells.len() / self.columns
    }

    /// A dot, so far from left to right and from the bottom up, each from 0 to 1.
    pub(super) fn dot(&mut self, along: f64, up: f64) {
        let across = place(along, self.columns * ACROSS);
        let down = place(1.0 - up, self.height() * DOWN);
        let cell = &mut self.cells[down / DOWN * self.columns + across / ACROSS];
        cell.dots |= BITS[down % DOWN][across % ACROSS];
    }

    /// A line through these places, which are in order from left to right. In each column it is where it passes the
    /// middle.
    pub(super) fn line(&mut self, through: &[[f64; 2]]) {
        for column in 0..self.columns {
            #[expect(clippy::cast_precision_loss, reason = "columns of a terminal")]
            let along = (column as f64 + 0.5) / self.columns as f64;
            let Some(up) = height_at(through, along) else { continue };
            let row = place(1.0 - up, self.height());
            self.cells[row * self.columns + column].line = true;
        }
    }
}

/// Which of so many places, from 0 to 1, this is.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "a share of a terminal's width or height"
)]
fn place(share: f64, places: usize) -> usize {
    ((share * places as f64) as usize).min(places - 1)
}

/// Between two places on a straight line; beyond the ends as at the ends.
fn height_at(through: &[[f64; 2]], along: f64) -> Option<f64> {
    let next = through.partition_point(|[x, _]| *x < along);
    let after = through.get(next).or(through.last())?;
    let before = &through[next.saturating_sub(1)];
    let [x0, y0] = *before;
    let [x1, y1] = *after;
    let share = if x1 > x0 { ((along - x0) / (x1 - x0)).clamp(0.0, 1.0) } else { 1.0 };
    Some(y0 + share * (y1 - y0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(canvas: &Canvas) -> Vec<String> {
        canvas.rows().map(|row| row.iter().map(|cell| cell.character()).collect()).collect()
    }

    #[test]
    fn dots_are_where_they_belong() {
        let mut canvas = Canvas::new(2, 2);
        for (along, up) in [(0.0, 1.0), (0.3, 1.0), (1.0, 1.0), (0.0, 0.0), (1.0, 0.0)] {
            canvas.dot(along, up);
        }
        assert_eq!(text(&canvas), ["⠉⠈", "⡀⢀"]);
    }

    #[test]
    fn a_line_passes_each_column_once_and_is_thick_where_dots_are() {
        let mut canvas = Canvas::new(4, 2);
        canvas.dot(0.9, 0.9);
        canvas.line(&[[0.0, 0.0], [0.5, 0.0], [0.5, 1.0], [1.0, 1.0]]);
        assert_eq!(text(&canvas), ["  ─━", "──  "]);
    }

    #[test]
    fn between_its_places_a_line_is_straight() {
        let through = [[0.0, 0.0], [1.0, 1.0]];
        assert_eq!([0.0, 0.25, 1.0].map(|x| height_at(&through, x)), [0.0, 0.25, 1.0].map(Some));
        assert_eq!(height_at(&[[0.5, 0.7]], 0.1), Some(0.7));
        assert_eq!(height_at(&[], 0.1), None);
    }
}
