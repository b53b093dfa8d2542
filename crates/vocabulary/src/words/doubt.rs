//! Why a verdict is unconfirmed.

use crate::Doubt;
use crate::{ComponentPath, ModuleName};

/// In words.
pub(crate) fn why_unconfirmed(doubt: &Doubt) -> String {
    match doubt {
        Doubt::RunEnded => "the run ended before there was a verdict".to_owned(),
        Doubt::Assumed(actuator) => {
            format!("it depends on the force of {actuator}, which has no signal")
        }
        Doubt::Unknowing(modules) => unknown_to(modules),
        Doubt::Silent(modules) => no_answer_from(modules),
        Doubt::OneOf(components) => one_of(components),
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
        [] => "its peers were not monitoring at that step".to_owned(),
        [one] => format!("{one} was not monitoring at that step"),
        _ => format!("{} were not monitoring at that step", listed(modules)),
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
        let both = vec![m1.clone(), m2];
        let one = vec![m1];
        assert_eq!(why_unconfirmed(&Doubt::Silent(both.clone())), "no answer from m1, m2");
        let unknowing = why_unconfirmed(&Doubt::Unknowing(one));
        assert_eq!(unknowing, "m1 was not monitoring at that step");
        let unknowing = why_unconfirmed(&Doubt::Unknowing(both));
        assert_eq!(unknowing, "m1, m2 were not monitoring at that step");
        let suspects = ["m1/sensor/g1", "m2/sensor/g3"].map(|path| path.parse().unwrap());
        let one_of = why_unconfirmed(&Doubt::OneOf(suspects.to_vec()));
        assert_eq!(one_of, "one of these departs from its reference: m1/sensor/g1, m2/sensor/g3");
        let ended = why_unconfirmed(&Doubt::RunEnded);
        assert_eq!(ended, "the run ended before there was a verdict");
    }
}
