//! What is wrong with a module: it gives no verdicts, or they cannot be relied on.

use observer::LiveModule;
use wire::ModulePhase;
use wording::{Tone, phase_in_words, printable, utc};

/// Something that is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Trouble {
    pub(crate) tone: Tone,
    pub(crate) words: String,
}

/// Everything that is wrong with a module, the worst first.
pub(crate) fn troubles(module: &LiveModule) -> Vec<Trouble> {
    if let Some(since) = module.silent_since_unix_ns {
        return vec![silent(since)];
    }
    let member = &module.picture.member;
    let mut troubles = Vec::new();
    if let Some(phase) = member.phase().filter(|phase| *phase != ModulePhase::InService) {
        let change = member.phase_change.as_ref().filter(|change| change.phase == phase);
        let why =
            change.map_or_else(String::new, |change| format!(": {}", printable(&change.reason)));
        let tone = wording::phase_tone(phase);
        troubles.push(Trouble { tone, words: format!("{}{why}", phase_in_words(phase)) });
    }
    if !module.picture.answers() {
        let words = "does not answer: nothing is known of its components".to_owned();
        troubles.push(Trouble { tone: Tone::Alarm, words });
    }
    if module.picture.has_several_processes() {
        let words = "several processes run as this module: stop all but one".to_owned();
        troubles.push(Trouble { tone: Tone::Alarm, words });
    }
    if let Some(status) = &member.status {
        troubles.extend(status.journal.problem.as_ref().map(|problem| Trouble {
            tone: Tone::Alarm,
            words: format!("its journal cannot be written: {}", printable(problem)),
        }));
        if status.journal.lost > 0 {
            let words = format!("{} records are missing from its journal", status.journal.lost);
            troubles.push(Trouble { tone: Tone::Doubt, words });
        }
    }
    troubles.sort_by_key(|trouble| trouble.tone);
    troubles
}

fn silent(since_unix_ns: u64) -> Trouble {
    let words = match since_unix_ns {
        0 => "NOT HEARD, and has not been since this page was started".to_owned(),
        since => format!("NOT HEARD since {}", utc(since)),
    };
    Trouble { tone: Tone::Alarm, words }
}
