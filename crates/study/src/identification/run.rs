//! A commissioned plant and its diagnosers go through a case, and what they say of its fault.

use diagnosis::identification::{DECIDED, Identification};
use diagnosis::{ModuleSetup, Verdict};
use names::fault::{Fault, FaultKind};
use names::{Component, ComponentPath, ModuleName, RunId, Step};
use serde::Serialize;

use super::draw::{IdentificationCase, IdentificationSituation};
use crate::commissioning::Site;
use crate::error::StudyError;
use crate::rig::{Occurrence, Rig};

/// What was said of the fault as of some time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Word {
    /// Since the component was declared faulty \[s\].
    pub after_s: f64,
    /// What it may be with its probability, the most probable first.
    pub kinds: Vec<(FaultKind, f64)>,
    /// The size of the most probable one, if it has one: lower end, middle, upper end.
    pub size: Option<[f64; 3]>,
}

impl Word {
    fn of(found: &Identification, after_s: f64) -> Self {
        let size = found.candidates.first().and_then(|first| first.size);
        Self {
            after_s,
            kinds: found.candidates.iter().map(|c| (c.kind, c.probability)).collect(),
            size: size.map(|size| [size.low, size.value, size.high]),
        }
    }

    /// The kind, if it is decided.
    #[must_use]
    pub fn decided(&self) -> Option<FaultKind> {
        self.kinds.first().filter(|(_, probability)| *probability >= DECIDED).map(|(kind, _)| *kind)
    }
}

/// What came of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IdentificationRecord {
    /// Its number.
    pub number: u64,
    /// What else happened.
    pub situation: IdentificationSituation,
    /// The faulty component.
    pub component: ComponentPath,
    /// The fault in words.
    pub fault: String,
    /// Its kind.
    pub kind: FaultKind,
    /// Its size in the unit of its parameter, if a diagnoser states it for this kind.
    pub size: Option<f64>,
    /// The size in limits of its kind, if it has one.
    pub in_limits: Option<f64>,
    /// From the fault's first sample to the step as of which the component was declared faulty \[s\]; `None` if it never
    /// was, or was before.
    pub named_after_s: Option<f64>,
    /// What was said of it, in order.
    pub words: Vec<Word>,
}

impl IdentificationRecord {
    /// The latest word within a time from when the component was declared faulty.
    #[must_use]
    pub fn within(&self, time_s: f64) -> Option<&Word> {
        self.words.iter().rev().find(|word| word.after_s <= time_s + 1e-9)
    }
}

/// Goes through a case.
///
/// # Errors
/// A plant or diagnosers that cannot be made.
pub fn run_case(
    site: &Site,
    setups: &[ModuleSetup],
    case: &IdentificationCase,
) -> Result<IdentificationRecord, StudyError> {
    let plant = site.plant(case.seed)?;
    let step_s = site.nominal_parameters.step_s;
    let mut rig = Rig::new(plant, setups.to_vec(), case.schedule(), RunId(case.seed))?;
    rig.identify();
    rig.run(case.steps)?;
    let subject = &case.subject;
    let mut record = IdentificationRecord {
        number: case.number,
        situation: case.situation,
        component: subject.component.clone(),
        fault: subject.fault.to_string(),
        kind: subject.fault.kind(),
        size: stated_size(&subject.fault),
        in_limits: case.in_limits,
        named_after_s: None,
        words: Vec::new(),
    };
    let mut named = None;
    for occurrence in rig.take_occurrences() {
        match occurrence {
            Occurrence::Transition { module, transition }
                if transition.verdict == Verdict::Latched
                    && is(&subject.component, &module, &transition.component) =>
            {
                named.get_or_insert(transition.decided);
            }
            Occurrence::Identified { module, identification }
                if is(&subject.component, &module, &identification.component) =>
            {
                let since = named.unwrap_or(subject.at);
                record
                    .words
                    .push(Word::of(&identification, seconds(since, identification.as_of, step_s)));
            }
            _ => {}
        }
    }
    let named = named.filter(|step| *step >= subject.at);
    record.named_after_s = named.map(|step| seconds(subject.at, step, step_s));
    Ok(record)
}

fn is(path: &ComponentPath, module: &ModuleName, component: &Component) -> bool {
    path.module == *module && path.component == *component
}

fn seconds(from: Step, until: Step, step_s: f64) -> f64 {
    // A billionth of a second is finer than any step.
    (until.since(from) as f64 * step_s * 1e9).round() / 1e9
}

/// The size that [`Candidate::size`](diagnosis::identification::Candidate::size) is about.
fn stated_size(fault: &Fault) -> Option<f64> {
    match *fault {
        Fault::InternalLeakage { area_m2 }
        | Fault::ExternalLeakageA { area_m2 }
        | Fault::ExternalLeakageB { area_m2 } => Some(area_m2),
        Fault::Bias { offset_m } | Fault::Intermittent { offset_m, .. } => Some(offset_m),
        Fault::Drift { drift_m_per_s } => Some(drift_m_per_s),
        Fault::RandomWalk { increment_m, .. } => Some(increment_m),
        Fault::Gain { gain } => Some(gain),
        Fault::HardOver {}
        | Fault::Stiction { .. }
        | Fault::ZeroOutput {}
        | Fault::Stuck {}
        | Fault::NoSignal {} => None,
    }
}
