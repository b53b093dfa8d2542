//! Lines in the panels of a run: faults, and the verdicts on them.

use vocabulary::ComponentPath;

use super::story::{FigureChannels, FigureRun};
use super::verdict::FigureVerdict;
use crate::rig::TimedFault;
use figure::plot::{MarkKind, PanelMark};

impl FigureRun {
    /// Faults and the verdicts on them, with labels.
    pub(super) fn marks(&self) -> Vec<PanelMark> {
        let mut marks = Vec::new();
        for injection in &self.injections {
            let component = injection.component.component.name();
            let label = format!("{component}: {}", injection.fault.kind().words());
            marks.push(PanelMark::new(MarkKind::Onset, self.seconds(injection.at), label));
            marks.extend(self.judgement(injection));
        }
        marks.extend(self.wrong());
        marks
    }

    /// The same lines without labels, for panels below.
    pub(super) fn bare_marks(&self) -> Vec<PanelMark> {
        let bare = |mark: PanelMark| PanelMark { label: String::new(), ..mark };
        self.marks().into_iter().map(bare).collect()
    }

    /// The fault, the change of the faulty component with its verdict, and the first explained change of another of
    /// these channels, in milliseconds since the fault.
    pub(super) fn close_up_marks(
        &self,
        channels: &FigureChannels,
        injection: &TimedFault,
    ) -> Vec<PanelMark> {
        let mut marks = vec![PanelMark::new(MarkKind::Onset, 0.0, "fault")];
        let mut verdict = |at_ms: f64, what: &str| {
            let words = format!("{what}, {at_ms:.0} ms");
            marks.push(PanelMark::new(MarkKind::Verdict, at_ms, words));
        };
        if let Some(found) = self.finding_of(injection) {
            let [detection, decided] =
                [found.detection, found.decided].map(|step| self.ms_since(injection, step));
            if decided > detection {
                verdict(detection, "changed");
            }
            verdict(decided, if found.by.is_none() { "named" } else { "explained" });
        }
        let explained = self.findings.iter().find(|found| {
            channels.holds(&found.component) && found.by.as_ref() == Some(&injection.component)
        });
        if let Some(found) = explained {
            verdict(self.ms_since(injection, found.decided), "effect explained");
        }
        marks
    }

    /// The verdict on a faulty component.
    fn judgement(&self, injection: &TimedFault) -> Option<PanelMark> {
        let found = self.finding_of(injection)?;
        let name = injection.component.component.name();
        let delay_ms = self.ms_since(injection, found.decided);
        let label = match &found.by {
            None => format!("{name} named after {delay_ms:.0} ms"),
            Some(by) => format!("{name} taken for an effect of {}", by.component.name()),
        };
        Some(PanelMark::new(MarkKind::Verdict, self.seconds(found.decided), label))
    }

    /// One mark for all healthy components that were named, at the first of them.
    pub(super) fn wrong(&self) -> Option<PanelMark> {
        let is_faulty = |path: &ComponentPath| self.injections.iter().any(|i| i.component == *path);
        let named = self.findings.iter().filter(|found| found.by.is_none());
        let wrong: Vec<&FigureVerdict> =
            named.filter(|found| !is_faulty(&found.component)).collect();
        let first = wrong.iter().min_by_key(|found| found.decided)?;
        let others = match wrong.len() - 1 {
            0 => String::new(),
            others => format!(" and {others} more"),
        };
        let label = format!("wrongly named: {}{others}", first.component);
        Some(PanelMark::new(MarkKind::Verdict, self.seconds(first.decided), label))
    }

    /// The time when the first change of these channels is explained by a component of another module, if any is.
    pub(super) fn explanation(&self, channels: &FigureChannels) -> Option<PanelMark> {
        let found = self.findings.iter().find(|found| {
            let by = found.by.as_ref();
            channels.holds(&found.component)
                && by.is_some_and(|by| by.module != found.component.module)
        })?;
        let by = found.by.as_ref()?;
        let label = format!("explained by {by}");
        Some(PanelMark::new(MarkKind::Verdict, self.seconds(found.decided), label))
    }
}
