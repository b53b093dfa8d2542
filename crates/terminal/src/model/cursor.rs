//! The selected row. The selection stays on its row while other rows appear and disappear.

/// A selection among rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RowCursor<K> {
    on: Option<K>,
    place: usize,
}

impl<K> Default for RowCursor<K> {
    fn default() -> Self {
        Self { on: None, place: 0 }
    }
}

impl<K: Clone + PartialEq> RowCursor<K> {
    /// The position of the selected row, or its last position if the row has disappeared.
    pub(crate) fn place(&self, rows: &[K]) -> usize {
        let own = self.on.as_ref().and_then(|key| rows.iter().position(|row| row == key));
        own.unwrap_or_else(|| self.place.min(rows.len().saturating_sub(1)))
    }

    pub(crate) fn row<'a>(&self, rows: &'a [K]) -> Option<&'a K> {
        rows.get(self.place(rows))
    }

    /// Moves the selection by so many rows within the list.
    pub(crate) fn step(&mut self, rows: &[K], by: isize) {
        let last = rows.len().saturating_sub(1);
        self.place = self.place(rows).saturating_add_signed(by).min(last);
        self.on = rows.get(self.place).cloned();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_stays_on_its_row_while_others_come_and_go() {
        let mut cursor = RowCursor::default();
        cursor.step(&["a", "b", "c"], 1);
        assert_eq!(cursor.row(&["new", "a", "b"]), Some(&"b"));
        assert_eq!(cursor.row(&["a", "c"]), Some(&"c"));
        assert_eq!(cursor.row(&["a"]), Some(&"a"));
        assert_eq!(cursor.row(&[]), None);
        cursor.step(&["a", "b", "c"], -9);
        assert_eq!(cursor.row(&["a", "b"]), Some(&"a"));
    }

    #[test]
    fn until_it_is_moved_it_is_on_the_first_row_whichever_that_is() {
        let cursor = RowCursor::default();
        assert_eq!(cursor.row(&["a"]), Some(&"a"));
        assert_eq!(cursor.row(&["new", "a"]), Some(&"new"));
    }
}
