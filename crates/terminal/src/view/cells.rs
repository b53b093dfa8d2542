//! Places text in cells, truncated to the available width.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::text::Span;
use vocabulary::words::Tone;

use super::palette::Palette;

/// Marks truncated text.
const CUT: &str = "…";
/// Columns between table columns.
const GAP: u16 = 2;

/// The buffer and styles for drawing.
pub(super) struct Cells<'a> {
    pub(super) buffer: &'a mut Buffer,
    pub(super) palette: Palette,
}

/// An area of so many lines, from this line on.
pub(super) fn part(area: Rect, from: u16, lines: u16) -> Rect {
    let from = from.min(area.height);
    let height = lines.min(area.height - from);
    Rect { y: area.y + from, height, ..area }
}

impl Cells<'_> {
    /// Draws text on a line of an area; nothing if the area has no such line.
    pub(super) fn text(&mut self, area: Rect, line: u16, text: &str, style: Style) {
        if line < area.height {
            let text = cut(text, area.width);
            let width = usize::from(area.width);
            self.buffer.set_stringn(area.x, area.y + line, text, width, style);
        }
    }

    /// Likewise, aligned right.
    pub(super) fn right(&mut self, area: Rect, line: u16, text: &str, style: Style) {
        let width = columns(text).min(area.width);
        let place = Rect { x: area.x + area.width - width, width, ..area };
        self.text(place, line, text, style);
    }

    /// Draws a table: its heading and, of the rows below it, those around the selected one, which is highlighted in the
    /// active table. `texts` begins with the heading, `tones` with the first row. Columns are as wide as needed, at most
    /// `most`; the last one takes the remaining width. Columns without text are left out, except the first.
    pub(super) fn table<const N: usize>(
        &mut self,
        area: Rect,
        (texts, most): (&[[String; N]], [u16; N]),
        tones: &[Tone],
        (selected, is_active): (usize, bool),
    ) {
        let widths = widths(texts, most);
        let is_shown = |place: usize| place == 0 || place + 1 == N || widths[place] > 0;
        let columns = |texts: &[String; N]| -> Vec<(String, u16)> {
            let columns = texts.iter().cloned().zip(widths).enumerate();
            columns.filter(|(place, _)| is_shown(*place)).map(|(_, column)| column).collect()
        };
        let height = usize::from(area.height).saturating_sub(1);
        let first = (selected + 1).saturating_sub(height);
        self.row(area, 0, &columns(&texts[0]), self.palette.heading(is_active));
        let rows = texts[1..].iter().zip(tones).enumerate().skip(first).take(height);
        for (line, (number, (texts, tone))) in (1..).zip(rows) {
            let mut style = self.palette.tone(*tone);
            if is_active && number == selected {
                style = style.add_modifier(Modifier::REVERSED);
            }
            self.row(area, line, &columns(texts), style);
        }
    }

    /// Draws a table row with columns of these widths; the last column takes the remaining width.
    pub(super) fn row(
        &mut self,
        area: Rect,
        line: u16,
        cells: &[(impl AsRef<str>, u16)],
        style: Style,
    ) {
        if line >= area.height {
            return;
        }
        let whole = Rect { y: area.y + line, height: 1, ..area };
        self.buffer.set_style(whole, style);
        let mut left = area.x;
        for (place, (text, width)) in cells.iter().enumerate() {
            let rest = (area.x + area.width).saturating_sub(left);
            let is_last = place + 1 == cells.len();
            let width = if is_last { rest } else { rest.min(*width) };
            self.text(Rect { x: left, width, ..area }, line, text.as_ref(), style);
            left += width + GAP;
        }
    }
}

/// The column widths that these rows need, at most `most`.
fn widths<const N: usize>(rows: &[[String; N]], most: [u16; N]) -> [u16; N] {
    std::array::from_fn(|column| {
        let needed = rows.iter().map(|row| columns(&row[column])).max().unwrap_or_default();
        needed.min(most[column])
    })
}

/// The text, truncated to the width.
pub(super) fn cut(text: &str, width: u16) -> String {
    if columns(text) <= width {
        return text.to_owned();
    }
    let mut kept = String::new();
    for character in text.chars() {
        kept.push(character);
        if columns(&kept) + columns(CUT) > width {
            kept.pop();
            break;
        }
    }
    if width == 0 { String::new() } else { kept + CUT }
}

/// The text wrapped between words, at most so many lines.
pub(super) fn folded(text: &str, width: u16, lines: usize) -> Vec<String> {
    let mut folded: Vec<String> = vec![String::new()];
    for word in text.split(' ') {
        let last = folded.len() - 1;
        let line = &mut folded[last];
        if line.is_empty() {
            line.push_str(word);
        } else if columns(line) + 1 + columns(word) <= width || folded.len() == lines {
            folded[last].push(' ');
            folded[last].push_str(word);
        } else {
            folded.push(word.to_owned());
        }
    }
    folded.iter().map(|line| cut(line, width)).collect()
}

/// The width of a text in columns.
pub(super) fn columns(text: &str) -> u16 {
    u16::try_from(Span::raw(text).width()).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_ends_in_a_mark() {
        assert_eq!(cut("module1", 7), "module1");
        assert_eq!(cut("module1", 4), "mod…");
        assert_eq!((cut("塔塔塔", 5), cut("x", 0)), ("塔塔…".to_owned(), String::new()));
    }

    #[test]
    fn words_stay_whole_and_what_is_left_is_cut() {
        assert_eq!(folded("one two three four", 9, 3), ["one two", "three", "four"]);
        assert_eq!(folded("one two three four", 9, 2), ["one two", "three fo…"]);
    }
}
