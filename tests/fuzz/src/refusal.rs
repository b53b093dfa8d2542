//! Properties of a refusal.

use std::fs;

use settings::ConfigErrors;

/// Longer ones fill a log.
const LONGEST: usize = 6000;

/// A refusal is one line of bearable length: what it quotes must neither forge further lines of a log, nor turn
/// its letters around, nor fill it.
pub(crate) fn is_bearable(refusal: &str) {
    assert!(!refusal.trim().is_empty(), "a refusal without words");
    assert!(refusal.len() <= LONGEST, "{} bytes: {refusal}", refusal.len());
    assert!(refusal.chars().all(vocabulary::is_printable), "not to be printed: {refusal:?}");
}

/// Every mistake in a configuration names its line or its key.
pub(crate) fn names_places(errors: &ConfigErrors) {
    assert!(!errors.0.is_empty(), "refused without a mistake");
    for error in &errors.0 {
        is_bearable(&error.problem);
        let lines = fs::read(&error.file).map_or(0, |text| lines(&text));
        match error.line {
            Some(line) => assert!((1..=lines).contains(&line), "{error}: of {lines} lines"),
            None => assert!(names_something(&error.problem), "{error}: where?"),
        }
    }
}

/// Number of lines, a last one without its end included.
pub(crate) fn lines(text: &[u8]) -> usize {
    1 + text.iter().filter(|byte| **byte == b'\n').count()
}

fn names_something(problem: &str) -> bool {
    // What cannot be read is named by its path, which stands before the problem.
    problem.contains('`') || problem.starts_with("cannot be read")
}
