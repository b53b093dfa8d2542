//! An event as one line.

use names::{ModuleName, StructureName};
use observer::News;
use serde::Serialize;
use wire::{FaultTransition, Identification, PhaseChange, Symptom};

use crate::paint::{Colour, Paint};
use crate::paint::{phase_colour, state_colour};
use shell::clock::unix_ns;
use wording::{NOTHING, identified, phase_in_words, printable, reason, utc};

/// For machines.
#[derive(Debug, Serialize)]
#[serde(tag = "news", rename_all = "snake_case")]
pub(super) enum Document<'a> {
    Fault(&'a FaultTransition),
    Identification(&'a Identification),
    Phase(&'a PhaseChange),
    Presence {
        structure: &'a StructureName,
        who: &'a str,
        there: bool,
        time_unix_ns: u64,
    },
    SeveralProcesses {
        structure: &'a StructureName,
        module: &'a ModuleName,
        time_unix_ns: u64,
    },
    Missed {
        structure: &'a StructureName,
        module: &'a ModuleName,
        from: u64,
        to: u64,
        reason: &'a str,
        time_unix_ns: u64,
    },
    Unreadable {
        problem: &'a str,
        time_unix_ns: u64,
    },
    Lost {
        count: u64,
        time_unix_ns: u64,
    },
}

impl Document<'_> {
    pub(super) fn of(event: &News) -> Document<'_> {
        let time_unix_ns = unix_ns();
        match event {
            News::Fault(transition) => Document::Fault(transition),
            News::Identification(found) => Document::Identification(found),
            News::Phase(change) => Document::Phase(change),
            News::Presence { structure, who, there } => {
                Document::Presence { structure, who, there: *there, time_unix_ns }
            }
            News::SeveralProcesses { structure, module } => {
                Document::SeveralProcesses { structure, module, time_unix_ns }
            }
            News::Missed { structure, module, from, to, reason } => {
                let (from, to) = (*from, *to);
                Document::Missed { structure, module, from, to, reason, time_unix_ns }
            }
            News::Unreadable { problem, .. } => Document::Unreadable { problem, time_unix_ns },
            News::Lost(count) => Document::Lost { count: *count, time_unix_ns },
        }
    }
}

/// For people: when, where if several structures may be seen, who, what, why. What has no time of its own is printed with
/// the present one.
pub(super) fn line(event: &News, names_structure: bool, paint: Paint) -> String {
    let (time, who, what, why, colour) = match event {
        News::Fault(transition) => fault(transition),
        News::Identification(found) => kind(found),
        News::Phase(change) => phase(change),
        News::Presence { who, there, .. } => {
            let (what, colour) = if *there { ("there", None) } else { ("GONE", Some(Colour::Red)) };
            (unix_ns(), who.clone(), what.to_owned(), String::new(), colour)
        }
        News::SeveralProcesses { module, .. } => {
            let (what, why) = ("SEVERAL", "several processes run as this module: end all but one");
            let colour = Some(Colour::Yellow);
            (unix_ns(), module.to_string(), what.to_owned(), why.to_owned(), colour)
        }
        News::Missed { module, from, to, reason, .. } => {
            let why = format!("transitions {from} to {to} could not be had: {}", printable(reason));
            (unix_ns(), module.to_string(), "MISSED".to_owned(), why, Some(Colour::Red))
        }
        News::Unreadable { problem, .. } => {
            let what = format!("not understood: {}", printable(problem));
            (unix_ns(), "-".to_owned(), what, String::new(), Some(Colour::Yellow))
        }
        News::Lost(count) => {
            let what = format!("{count} messages lost: this output is not read fast enough");
            (unix_ns(), "-".to_owned(), what, String::new(), Some(Colour::Red))
        }
    };
    let place = if names_structure { format!("{:<10}  ", place(event)) } else { String::new() };
    let text = format!("{}  {place}{who:<20}  {what:<14}  {why}", utc(time));
    let text = text.trim_end();
    colour.map_or_else(|| text.to_owned(), |colour| paint.in_colour(colour, text))
}

/// The structure that it is about.
fn place(event: &News) -> &str {
    match event {
        News::Fault(transition) => transition.structure.as_str(),
        News::Identification(found) => found.structure.as_str(),
        News::Phase(change) => change.structure.as_str(),
        News::Presence { structure, .. }
        | News::SeveralProcesses { structure, .. }
        | News::Missed { structure, .. } => structure.as_str(),
        News::Unreadable { .. } | News::Lost(_) => NOTHING,
    }
}

type Parts = (u64, String, String, String, Option<Colour>);

fn fault(transition: &FaultTransition) -> Parts {
    let began = match transition.symptom {
        Symptom::Change => transition.detection_step.map(|step| format!("changed at step {step}")),
        Symptom::NoSignal => transition.onset_step.map(|step| format!("since step {step}")),
        // Their reason tells since when.
        Symptom::Departure | Symptom::OilContent | Symptom::Scatter => None,
    };
    let mut why: Vec<String> = began.into_iter().collect();
    why.extend(Some(reason(transition)).filter(|reason| !reason.is_empty()));
    (
        transition.time_unix_ns,
        transition.component.to_string(),
        transition.state().to_string(),
        why.join("; "),
        Some(state_colour(transition.state())),
    )
}

fn kind(found: &Identification) -> Parts {
    let what = if found.decided { "identified" } else { "not identified" };
    (found.time_unix_ns, found.component.to_string(), what.to_owned(), identified(found), None)
}

fn phase(change: &PhaseChange) -> Parts {
    (
        change.time_unix_ns,
        change.module.to_string(),
        phase_in_words(change.phase).to_owned(),
        printable(&change.reason),
        phase_colour(change.phase),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::identification;
    use crate::history::testing::{acknowledged, transition};

    #[test]
    fn each_kind_of_news_has_its_line() {
        let paint = Paint::for_terminal(false);
        let text = |event: &News| line(event, false, paint);
        let fault = text(&News::Fault(Box::new(transition("m1", 1, 0))));
        assert!(fault.starts_with("1970-01-01T00:00:00.000Z  m1/sensor/g1"), "{fault}");
        assert!(fault.ends_with("  latched"), "{fault}");
        let fault = text(&News::Fault(Box::new(acknowledged("m1", 2))));
        assert!(fault.ends_with("acknowledged by ada@station: looks loose"), "{fault}");
        let found = identification(false, &["bias", "drift"]);
        let found = text(&News::Identification(Box::new(found)));
        let expected = "m1/sensor/g2          not identified  bias or drift: not yet decided";
        assert!(found.ends_with(expected), "{found}");
        let gone = News::Presence {
            structure: "tower".parse().unwrap(),
            who: "module2".to_owned(),
            there: false,
        };
        assert!(text(&gone).ends_with("  module2               GONE"), "{}", text(&gone));
        let several = News::SeveralProcesses {
            structure: "tower".parse().unwrap(),
            module: "m1".parse().unwrap(),
        };
        let expected = "SEVERAL         several processes run as this module: end all but one";
        assert!(text(&several).ends_with(expected), "{}", text(&several));
        let missed = News::Missed {
            structure: "tower".parse().unwrap(),
            module: "m1".parse().unwrap(),
            from: 3,
            to: 4,
            reason: "refused".to_owned(),
        };
        let expected = "MISSED          transitions 3 to 4 could not be had: refused";
        assert!(text(&missed).ends_with(expected), "{}", text(&missed));
        let elsewhere = line(&missed, true, paint);
        assert!(elsewhere.contains("Z  tower       m1                    MISSED"), "{elsewhere}");
        assert!(text(&News::Lost(3)).contains("3 messages lost"));
        let hostile =
            text(&News::Unreadable { problem: "k: \x1b[2J\u{202e}".to_owned(), state: None });
        assert!(hostile.ends_with(r"k: \u{1b}[2J\u{202e}"), "{hostile}");
    }
}
