//! Lines in a story's panels: faults, and what was said of them.

use truss::ids::ComponentPath;

use super::channels::Channels;
use super::faults;
use super::story::Story;
use super::told::Told;
use crate::figure::{Mark, MarkKind};
use crate::schedule::Injection;

impl Story {
    /// Faults and the verdicts on them, with labels.
    pub(super) fn marks(&self) -> Vec<Mark> {
        let mut marks = Vec::new();
        for injection in &self.injections {
            let component = injection.component.component.name();
            let label = format!("{component}: {}", faults::words(&injection.fault));
            marks.push(Mark::new(MarkKind::Onset, self.seconds(injection.at), label));
            marks.extend(self.judgement(injection));
        }
        marks.extend(self.wrong());
        marks
    }

    /// The same lines without labels, for panels below.
    pub(super) fn bare_marks(&self) -> Vec<Mark> {
        let bare = |mark: Mark| Mark { label: String::new(), ..mark };
        self.marks().into_iter().map(bare).collect()
    }

    /// The fault, when the faulty component changed and what was said of it, and when the first other
    /// change of these channels was explained; in milliseconds since the fault.
    pub(super) fn close_up_marks(&self, channels: &Channels, injection: &Injection) -> Vec<Mark> {
        let mut marks = vec![Mark::new(MarkKind::Onset, 0.0, "fault")];
        let mut verdict = |at_ms: f64, what: &str| {
            let words = format!("{what}, {at_ms:.0} ms");
            marks.push(Mark::new(MarkKind::Verdict, at_ms, words));
        };
        if let Some(told) = self.told_of(injection) {
            let [detection, decided] =
                [told.detection, told.decided].map(|step| self.ms_since(injection, step));
            if decided > detection {
                verdict(detection, "changed");
            }
            verdict(decided, if told.by.is_none() { "named" } else { "explained" });
        }
        let explained = self.told.iter().find(|told| {
            channels.holds(&told.component) && told.by.as_ref() == Some(&injection.component)
        });
        if let Some(told) = explained {
            verdict(self.ms_since(injection, told.decided), "effect explained");
        }
        marks
    }

    /// What was found of a component that is faulty.
    fn judgement(&self, injection: &Injection) -> Option<Mark> {
        let told = self.told_of(injection)?;
        let name = injection.component.component.name();
        let delay_ms = self.ms_since(injection, told.decided);
        let label = match &told.by {
            None => format!("{name} named after {delay_ms:.0} ms"),
            Some(by) => format!("{name} taken for an effect of {}", by.component.name()),
        };
        Some(Mark::new(MarkKind::Verdict, self.seconds(told.decided), label))
    }

    /// One mark for all components that are named and healthy: where the first of them is.
    pub(super) fn wrong(&self) -> Option<Mark> {
        let is_faulty = |path: &ComponentPath| self.injections.iter().any(|i| i.component == *path);
        let named = self.told.iter().filter(|told| told.by.is_none());
        let wrong: Vec<&Told> = named.filter(|told| !is_faulty(&told.component)).collect();
        let first = wrong.iter().min_by_key(|told| told.decided)?;
        let others = match wrong.len() - 1 {
            0 => String::new(),
            others => format!(" and {others} more"),
        };
        let label = format!("wrongly named: {}{others}", first.component);
        Some(Mark::new(MarkKind::Verdict, self.seconds(first.decided), label))
    }

    /// Where the first change of these channels is explained by another module's component, if any
    /// is.
    pub(super) fn explanation(&self, channels: &Channels) -> Option<Mark> {
        let told = self.told.iter().find(|told| {
            let by = told.by.as_ref();
            channels.holds(&told.component)
                && by.is_some_and(|by| by.module != told.component.module)
        })?;
        let by = told.by.as_ref()?;
        let label = format!("explained by {by}");
        Some(Mark::new(MarkKind::Verdict, self.seconds(told.decided), label))
    }
}
