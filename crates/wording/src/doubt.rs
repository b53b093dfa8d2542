//! Why a verdict is unconfirmed.

use names::{ComponentPath, ModuleName};
use wire::Doubt;

/// In words. Without a reason given, silent modules are one.
pub(crate) fn why_unconfirmed(
    doubt: Option<Doubt>,
    silent: &[ModuleName],
    unknowing: &[ModuleName],
    suspects: &[ComponentPath],
) -> String {
    match doubt {
        Some(Doubt::RunEnded) => "the run ended before there was a verdict".to_owned(),
        Some(Doubt::Assumed) => "it rests on the force of an actuator without a signal".to_owned(),
        Some(Doubt::Unknowing) => unknown_to(unknowing),
        Some(Doubt::Silent) => no_answer_from(silent),
        Some(Doubt::OneOf) => one_of(suspects),
        None if silent.is_empty() => "for an unknown reason".to_owned(),
        None => no_answer_from(silent),
    }
}

fn no_answer_from(modules: &[ModuleName]) -> String {
    match modules {
        [] => "no answer from its peers".to_owned(),
        _ => format!("no answer from {}", listed(modules)),
    }
}

fn one_of(suspects: &[ComponentPath]) -> String {
    let names: Vec<String> = suspects.iter().map(ToString::to_string).collect();
    format!("one of these departs from its reference: {}", names.join(", "))
}

fn unknown_to(modules: &[ModuleName]) -> String {
    match modules {
        [] => "its peers were not watching when it happened".to_owned(),
        [one] => format!("{one} was not watching when it happened"),
        _ => format!("{} were not watching when it happened", listed(modules)),
    }
}

fn listed(modules: &[ModuleName]) -> String {
    let names: Vec<&str> = modules.iter().map(ModuleName::as_str).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reason_has_its_words() {
        let [m1, m2] = ["m1", "m2"].map(|name| name.parse::<ModuleName>().unwrap());
        let both = [m1.clone(), m2];
        let why = |doubt, silent: &[ModuleName], unknowing: &[ModuleName]| {
            why_unconfirmed(doubt, silent, unknowing, &[])
        };
        assert_eq!(why(Some(Doubt::Silent), &both, &[]), "no answer from m1, m2");
        assert_eq!(why(None, &both[..1], &[]), "no answer from m1");
        let unknowing = why(Some(Doubt::Unknowing), &[], &both[..1]);
        assert_eq!(unknowing, "m1 was not watching when it happened");
        let unknowing = why(Some(Doubt::Unknowing), &[], &both);
        assert_eq!(unknowing, "m1, m2 were not watching when it happened");
        let suspects = ["m1/sensor/g1", "m2/sensor/g3"].map(|path| path.parse().unwrap());
        let one_of = why_unconfirmed(Some(Doubt::OneOf), &[], &[], &suspects);
        assert_eq!(one_of, "one of these departs from its reference: m1/sensor/g1, m2/sensor/g3");
        let ended = why(Some(Doubt::RunEnded), &[m1], &[]);
        assert_eq!(ended, "the run ended before there was a verdict");
    }
}
