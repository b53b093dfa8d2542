//! Questions in the parameters of a query.

use std::fmt::Debug;

use vocabulary::{
    FreezeFrameQuestion, HistoryQuestion, QuestionError, SampleQuestion, StateQuestion,
};

use crate::refusal::is_bearable;

/// What is a question is written and read back; what is none names the parameter.
pub(super) fn check(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    comes_back(text, StateQuestion::from_parameters, StateQuestion::to_parameters);
    comes_back(text, SampleQuestion::from_parameters, SampleQuestion::to_parameters);
    comes_back(text, HistoryQuestion::from_parameters, HistoryQuestion::to_parameters);
    comes_back(text, FreezeFrameQuestion::from_parameters, FreezeFrameQuestion::to_parameters);
}

fn comes_back<Q: Debug + PartialEq>(
    text: &str,
    read: fn(&str) -> Result<Q, QuestionError>,
    write: fn(&Q) -> String,
) {
    match read(text) {
        Ok(question) => assert_eq!(read(&write(&question)), Ok(question)),
        Err(error) => {
            let refusal = error.to_string();
            is_bearable(&refusal);
            let named = ["run", "from", "to", "step", "window", "since", "limit", "transition"];
            assert!(named.iter().any(|name| refusal.contains(name)), "{refusal}: which parameter?");
        }
    }
}
