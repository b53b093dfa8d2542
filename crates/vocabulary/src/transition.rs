//! One transition of the verdict on a component.

use crate::{ComponentPath, ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::condition::Condition;
use crate::corrected::ReplacedReading;
use crate::encoding::{Message, tagged_by_word};
use crate::evidence::Evidence;
use crate::fault_state::FaultState;
use crate::given_order::GivenOrder;
use crate::identification::Identification;
use crate::shelving::{Aside, Shelving};
use crate::verdict::Verdict;

/// What a verdict rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Symptom {
    /// The residual changed.
    #[default]
    Change,
    /// No usable signal: values are missing, not numbers or implausible.
    NoSignal,
    /// Its mean departs from its reference: a gage's residual \[m\], a cylinder's tracking residual \[N\].
    Departure,
    /// The oil content of a cylinder departs from its reference \[Pa\].
    OilContent,
    /// The white noise of a gage departs from its reference: standard deviation \[m\].
    Scatter,
    /// In a learned module: its reading is not what the other channels say, or has changed without them; in its own unit.
    Reading,
}

/// Why nothing is known of a component at present.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Unknown {
    /// Since when \[ns since 1970\].
    pub since_unix_ns: u64,
    /// In words.
    pub reason: String,
}

/// A transition, published when it happens and returned by queries for the present state.
///
/// In answer to a question, a component that has had no transition yet is `normal` with sequence 0
/// and without run, steps and evidence. As long as its module does not watch it, or cannot compare it with its
/// reference, what would be `normal` is `unknown`, and every state says since when and why. `normal` without a reference
/// means that no change was seen; the condition says so.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FaultTransition {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// The component.
    pub component: ComponentPath,
    /// The new verdict.
    #[serde(flatten, deserialize_with = "tagged_by_word")]
    pub verdict: Verdict,
    /// What the state rests on.
    pub symptom: Symptom,
    /// Counts the module's transitions from 1, without a gap.
    pub sequence: u64,
    /// What `sequence` counts in: when the journal began \[ms since 1970\]. A wiped state directory begins a later one, and
    /// counts from 1 again.
    pub incarnation: u64,
    /// The run that the steps are counted in.
    pub run: Option<RunId>,
    /// That run had ended when this was sent, though another with the same number may be under way.
    #[serde(default)]
    pub run_ended: bool,
    /// Since when the residual has been changing; of a departure, the first step at which it may have begun.
    pub onset_step: Option<Step>,
    /// When the divergence reached its threshold.
    pub detection_step: Option<Step>,
    /// As of which step the state was found, or an operator reset it; acknowledging leaves it.
    pub decided_step: Option<Step>,
    /// The channel at the detection.
    pub evidence: Option<Evidence>,
    /// It was so when it was first compared with its reference, and may have been before the module was in service.
    pub before_service: bool,
    /// If latched, what was said to explain the change, though its module does not raise the alarm for it.
    pub disputed: Option<ComponentPath>,
    /// If peers do not answer, why each of them has not so far, in their order.
    pub silent_because: Vec<String>,
    /// If the module does not watch its components at present, since when and why. A fault that was latched
    /// before stays one.
    pub unknown: Option<Unknown>,
    /// What is subtracted from what the component measures before it is compared with its reference, by order: of a gage
    /// \[m\], of a cylinder's oil content \[Pa\].
    pub tare: Option<f64>,
    /// How the component stands to its reference. Only in answer to a question.
    pub condition: Option<Condition>,
    /// Of a faulty gage, what it reads and what it should read. Only in answer to a question.
    pub reading: Option<ReplacedReading>,
    /// Of a fault that has been identified, the latest word on its kind and size, without the signature.
    pub identification: Option<Box<Identification>>,
    /// The order that led to this transition, if one did.
    pub order: Option<GivenOrder>,
    /// If that order was about shelving or suppression alone: the one that led to the state, if one did.
    pub state_order: Option<Box<GivenOrder>>,
    /// If its alarm is shelved: by whom, why and until when. The state does not depend on it.
    pub shelved: Option<Shelving>,
    /// If its alarm is suppressed during maintenance: by whom, why and until when.
    pub suppressed: Option<Shelving>,
    /// If it is a cylinder that is shut off: the order.
    pub shut_off: Option<GivenOrder>,
    /// Whether the journal had this before it was published. If not, a disk is full or broken.
    pub durable: bool,
    /// Since when the component has been in this state \[ns since 1970\]: when its alarm began, whatever was ordered later.
    /// 0 if it has never been in another, and only its alarm was shelved or suppressed.
    pub since_unix_ns: u64,
    /// When this was published \[ns since 1970\].
    pub time_unix_ns: u64,
}

impl FaultTransition {
    /// What there is to say about a component that never had a transition.
    #[must_use]
    pub fn untouched(
        structure: StructureName,
        component: ComponentPath,
        time_unix_ns: u64,
    ) -> FaultTransition {
        FaultTransition {
            structure,
            module: component.module.clone(),
            component,
            verdict: Verdict::Normal,
            symptom: Symptom::Change,
            sequence: 0,
            incarnation: 0,
            run: None,
            run_ended: false,
            onset_step: None,
            detection_step: None,
            decided_step: None,
            evidence: None,
            before_service: false,
            disputed: None,
            silent_because: Vec::new(),
            unknown: None,
            tare: None,
            condition: None,
            reading: None,
            identification: None,
            order: None,
            state_order: None,
            shelved: None,
            suppressed: None,
            shut_off: None,
            durable: true,
            since_unix_ns: time_unix_ns,
            time_unix_ns,
        }
    }

    /// The word of its verdict.
    #[must_use]
    pub fn state(&self) -> FaultState {
        self.verdict.state()
    }

    /// Whether the state is that of an earlier transition, and for the same change: acknowledging, shelving and
    /// suppressing begin no new alarm.
    #[must_use]
    pub fn continues(&self, earlier: &Self) -> bool {
        let alarm = |transition: &Self| {
            let state = match transition.state() {
                FaultState::Acknowledged => FaultState::Latched,
                other => other,
            };
            (state, transition.run, transition.detection_step)
        };
        alarm(self) == alarm(earlier)
    }

    /// Whether it states a verdict. A reply that the state is unknown, or that there was no transition so far, states none.
    #[must_use]
    pub fn is_verdict(&self) -> bool {
        self.state() != FaultState::Unknown && self.run.is_some() && self.sequence > 0
    }

    /// Whether its state was found before its module ceased to monitor it, and may not hold any more.
    #[must_use]
    pub fn is_last_known(&self) -> bool {
        self.unknown.is_some() && self.state() != FaultState::Unknown
    }

    /// Its place among the transitions of its module: the higher one is the later one.
    #[must_use]
    pub fn place(&self) -> (u64, u64) {
        (self.incarnation, self.sequence)
    }

    /// Did it agree with its reference in the latest window, and did that window begin after its fault was detected?
    #[must_use]
    pub fn is_verified(&self) -> bool {
        let Some(Condition::Agrees { from, .. }) = self.condition else { return false };
        let is_of_present = self.state().is_fault() && !self.run_ended;
        !(is_of_present && self.detection_step.is_some_and(|detected| from <= detected))
    }

    /// How its alarm is hidden at present, if it is; of two ways the one that ends later.
    #[must_use]
    pub fn aside(&self) -> Option<Aside<'_>> {
        let shelved = self.shelved.as_ref();
        let suppressed = self.suppressed.as_ref();
        match (shelved, suppressed) {
            (Some(own), Some(all)) if own.until_unix_ns > all.until_unix_ns => {
                Some(Aside::Shelved(own))
            }
            (_, Some(all)) => Some(Aside::Suppressed(all)),
            (Some(own), None) => Some(Aside::Shelved(own)),
            (None, None) => None,
        }
    }

    /// The same as long as the module does not watch.
    #[must_use]
    pub fn while_unknown(self, unknown: Unknown) -> FaultTransition {
        let verdict = match self.verdict {
            Verdict::Normal => Verdict::Unknown,
            other => other,
        };
        FaultTransition { verdict, unknown: Some(unknown), ..self }
    }
}

impl Message for FaultTransition {
    const WHAT: &'static str = "fault transition";
}
