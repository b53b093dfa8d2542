//! What rows are looked for.

/// Words that all have to be in a row, whatever their case.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Filter(pub(crate) String);

impl Filter {
    pub(crate) fn is_empty(&self) -> bool {
        self.0.trim().is_empty()
    }

    pub(crate) fn admits(&self, text: &str) -> bool {
        let text = text.to_lowercase();
        self.0.to_lowercase().split_whitespace().all(|word| text.contains(word))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_has_to_be_there_in_any_order_and_case() {
        let filter = Filter("G2 latched".to_owned());
        assert!(filter.admits("Latched module1/sensor/g2"));
        assert!(!filter.admits("latched module1/sensor/g1"));
        assert!(Filter::default().admits("") && Filter(" ".to_owned()).is_empty());
    }
}
