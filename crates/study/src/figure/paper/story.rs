//! A run with given faults, and its result.

use vocabulary::{ComponentKind, ComponentPath, Step};

use super::verdict::{self, FigureVerdict};
use crate::error::StudyError;
use crate::rig::TimedFault;
use crate::scenarios::ScenarioCampaign;
use crate::trace::{ModuleTrace, RunTrace};

/// The time window of the paper's figures \[s\].
pub(super) const WINDOW_S: [f64; 2] = [10.4, 11.8];

/// Components of one kind in one module, or in several.
pub(super) struct FigureChannels<'a> {
    pub(super) modules: Vec<&'a ModuleTrace>,
    pub(super) kind: ComponentKind,
}

impl FigureChannels<'_> {
    pub(super) fn holds(&self, path: &ComponentPath) -> bool {
        path.component.kind() == self.kind
            && self.modules.iter().any(|module| module.module == path.module)
    }

    /// A component's name, with its module's if there are several.
    pub(super) fn name(&self, path: &ComponentPath) -> String {
        match self.modules.len() {
            1 => path.component.name().to_owned(),
            _ => format!("{} {}", path.module, path.component.name()),
        }
    }
}

/// A run shown in a figure.
pub(super) struct FigureRun {
    pub(super) trace: RunTrace,
    pub(super) findings: Vec<FigureVerdict>,
    pub(super) injections: Vec<TimedFault>,
    pub(super) step_s: f64,
}

impl FigureRun {
    /// Runs the campaign's plant with faults that begin at these times \[s\].
    pub(super) fn run(
        campaign: &ScenarioCampaign,
        seed: u64,
        faults: Vec<(f64, ComponentPath, vocabulary::fault::Fault)>,
    ) -> Result<Self, StudyError> {
        let step_s = campaign.system.parameters.step_s;
        let injections: Vec<TimedFault> = (faults.into_iter())
            .map(|(at_s, component, fault)| {
                let at = Step((at_s / step_s).round() as u64);
                TimedFault { at, until: None, component, fault }
            })
            .collect();
        let mut rig = campaign.system.rig(seed, injections.clone())?;
        let trace = RunTrace::record(&mut rig, (WINDOW_S[1] / step_s).ceil() as u64)?;
        Ok(Self { findings: verdict::findings(&trace), trace, injections, step_s })
    }

    /// Components of this kind in equipped module `number`, counted from 1.
    pub(super) fn channels(&self, number: usize, kind: ComponentKind) -> FigureChannels<'_> {
        let module = self.trace.modules.get(number.saturating_sub(1));
        FigureChannels { modules: module.into_iter().collect(), kind }
    }

    /// Components of this kind in all modules.
    pub(super) fn all_channels(&self, kind: ComponentKind) -> FigureChannels<'_> {
        FigureChannels { modules: self.trace.modules.iter().collect(), kind }
    }

    /// Time of a step \[s\].
    pub(super) fn seconds(&self, step: Step) -> f64 {
        step.0 as f64 * self.step_s
    }

    /// The verdict on a faulty component: that it is faulty or, failing that, that another component explains its
    /// change.
    pub(super) fn finding_of(&self, injection: &TimedFault) -> Option<&FigureVerdict> {
        let is_of = |found: &&FigureVerdict| {
            found.component == injection.component && found.detection >= injection.at
        };
        let mut all = self.findings.iter().filter(is_of);
        let named = all.clone().find(|found| found.by.is_none());
        named.or_else(|| all.next())
    }

    /// Time from a fault to a step \[ms\].
    pub(super) fn ms_since(&self, injection: &TimedFault, step: Step) -> f64 {
        1e3 * self.step_s * step.since(injection.at) as f64
    }

    /// The outcome for these channels, module by module.
    pub(super) fn summary(&self, channels: &FigureChannels) -> String {
        let summaries: Vec<String> = (channels.modules.iter())
            .map(|module| {
                let count = module.of_kind(channels.kind).count();
                verdict::summary(&self.findings, &module.module, channels.kind, count)
            })
            .collect();
        let several = summaries.len() > 1;
        let named = summaries.iter().zip(&channels.modules).map(|(summary, module)| {
            if several { format!("{}: {summary}", module.module) } else { summary.clone() }
        });
        named.collect::<Vec<_>>().join(" · ")
    }

    /// A description of these faults in one sentence.
    pub(super) fn faults(&self) -> String {
        let fault = |injection: &TimedFault| {
            let TimedFault { at, component, fault, .. } = injection;
            format!("{} in {component} at {:.1} s", fault.kind().words(), self.seconds(*at))
        };
        self.injections.iter().map(fault).collect::<Vec<_>>().join(" and ")
    }

    /// The outcome in one sentence.
    pub(super) fn outcome(&self) -> String {
        let outcome = |injection: &TimedFault| {
            let component = &injection.component;
            let Some(found) = self.finding_of(injection) else {
                return format!("{component} is not found");
            };
            let [changed, decided] =
                [found.detection, found.decided].map(|step| self.ms_since(injection, step));
            match &found.by {
                None => format!(
                    "{component} changes after {changed:.0} ms and is named after {decided:.0} ms"
                ),
                Some(by) => format!(
                    "{component} changes after {changed:.0} ms and is taken for an effect of {by}"
                ),
            }
        };
        let mut outcomes: Vec<String> = self.injections.iter().map(outcome).collect();
        outcomes.extend(self.wrong().map(|mark| mark.label));
        outcomes.join("; ")
    }
}
