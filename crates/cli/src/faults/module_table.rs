//! The modules as a table.

use names::ModuleName;
use observer::{Member, ModulePicture};
use wire::{JournalStatus, ModuleStatus};

use crate::paint::Colour;
use crate::paint::phase_colour;
use crate::table::{TextTable, table};
use wording::{NOTHING, or_nothing, phase_in_words, printable, span, until};

/// The table, and the colour of each row.
pub(super) fn modules(modules: &[ModulePicture]) -> (TextTable, Vec<Option<Colour>>) {
    let mut table = table(&["module", "phase", "step", "lag", "sample age", "journal", "remarks"]);
    for module in modules {
        table.add_row(row(module));
    }
    table.align_right(2..5);
    (table, modules.iter().map(colour).collect())
}

fn row(module: &ModulePicture) -> [String; 7] {
    let member = &module.member;
    let status = member.status.as_ref();
    // Between clocks that differ, no time is measured.
    let timed = status.filter(|status| status.clock_difference().is_none());
    [
        member.module.to_string(),
        phase(module),
        or_nothing(status.and_then(|status| status.step)),
        or_nothing(timed.and_then(|status| status.lag_ms).map(span)),
        or_nothing(timed.and_then(|status| status.sample_age_ms).map(span)),
        or_nothing(status.map(|status| journal(&status.journal))),
        remarks(module),
    ]
}

/// A module that does not answer is shown as such, whatever its last status was.
fn phase(module: &ModulePicture) -> String {
    if !module.answers() {
        return "NOT ANSWERING".to_owned();
    }
    module.member.phase().map_or("unknown", phase_in_words).to_owned()
}

fn colour(module: &ModulePicture) -> Option<Colour> {
    if module.answers() {
        module.member.phase().map_or(Some(Colour::Yellow), phase_colour)
    } else {
        Some(Colour::Red)
    }
}

fn journal(journal: &JournalStatus) -> String {
    let mut problems = Vec::new();
    problems.extend(journal.problem.as_ref().map(|problem| printable(problem)));
    for (count, what) in
        [(journal.unsaved, "not saved"), (journal.lost, "lost"), (journal.damaged, "damaged")]
    {
        if count > 0 {
            problems.push(format!("{count} {what}"));
        }
    }
    match (&problems[..], &journal.directory) {
        ([], Some(_)) => "ok".to_owned(),
        ([], None) => "none".to_owned(),
        (problems, _) => problems.join(", "),
    }
}

fn remarks(module: &ModulePicture) -> String {
    let member = &module.member;
    let mut remarks = Vec::new();
    if module.answers() {
        if member.status.is_none() {
            remarks.push("publishes no status".to_owned());
        }
        if !member.present {
            remarks.push("no liveliness token".to_owned());
        }
        let suppression =
            module.suppression().map(|shelving| format!("suppressed {}", until(shelving)));
        remarks.extend(suppression);
        let difference = member.status.as_ref().and_then(ModuleStatus::clock_difference);
        remarks.extend(difference.map(|difference| difference.to_string()));
    } else {
        remarks.extend(why_missed(member));
    }
    if remarks.is_empty() { NOTHING.to_owned() } else { remarks.join(", ") }
}

/// How it is known that a module should be there.
fn why_missed(member: &Member) -> Option<String> {
    let namers: Vec<&str> = member.peer_of.iter().map(ModuleName::as_str).collect();
    if member.present {
        Some("is present, but does not report its components".to_owned())
    } else if member.expected {
        Some("expected".to_owned())
    } else if namers.is_empty() {
        None
    } else {
        Some(format!("peer of {}", namers.join(", ")))
    }
}
