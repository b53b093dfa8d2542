//! The life of a verdict on one component.

use std::fmt;

use names::{Component, ComponentPath, ModuleName, RunId, Step};
use serde::{Deserialize, Serialize};
use wire::Symptom;

use wire::Evidence;
use wire::GivenOrder;
use wire::Shelving;

/// The verdict of a module on one of its components.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum Verdict {
    /// No change, or the explained one is over.
    Normal,
    /// A change, not yet judged.
    Tentative,
    /// A change that cannot be judged.
    Unconfirmed {
        /// Why.
        doubt: Doubt,
    },
    /// A change that another component's fault explains.
    Explained {
        /// The component that changed first.
        by: ComponentPath,
        /// When it changed.
        since: Step,
    },
    /// A fault of this component; stays until reset.
    Latched,
    /// A fault of this component that an operator has seen; stays until reset.
    Acknowledged,
}

/// Why a change cannot be judged.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "doubt", content = "modules", rename_all = "snake_case")]
pub enum Doubt {
    /// These peers do not answer. They are asked again.
    Silent(Vec<ModuleName>),
    /// These modules, perhaps this one, were not watching when it happened: it can never be judged.
    Unknowing(Vec<ModuleName>),
    /// The residual rests on the force that is assumed of this actuator, which has no signal.
    Assumed(ComponentPath),
    /// One of these has departed from its reference, itself included, the likeliest first. More answers, or more load, may tell.
    OneOf(Vec<ComponentPath>),
    /// The run ended before the judgement.
    RunEnded,
}

impl Doubt {
    /// Will there be no verdict any more?
    #[must_use]
    pub fn is_final(&self) -> bool {
        !matches!(self, Doubt::Silent(_) | Doubt::OneOf(_))
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |modules: &[ModuleName]| {
            modules.iter().map(ModuleName::as_str).collect::<Vec<_>>().join(", ")
        };
        match self {
            Doubt::Silent(modules) => write!(f, "no usable answer from {}", list(modules)),
            Doubt::Unknowing(modules) => write!(f, "not watched at the time by {}", list(modules)),
            Doubt::Assumed(actuator) => {
                write!(f, "it rests on the force of {actuator}, which has no signal")
            }
            Doubt::OneOf(components) => {
                let all: Vec<String> = components.iter().map(ToString::to_string).collect();
                write!(f, "one of {}", all.join(", "))
            }
            Doubt::RunEnded => f.write_str("the run ended before it was judged"),
        }
    }
}

impl Verdict {
    /// A fault of this very component, acknowledged or not.
    #[must_use]
    pub fn is_latched(&self) -> bool {
        matches!(self, Verdict::Latched | Verdict::Acknowledged)
    }

    /// A change that will never be judged.
    #[must_use]
    pub fn is_undecidable(&self) -> bool {
        matches!(self, Verdict::Unconfirmed { doubt } if doubt.is_final())
    }

    /// The state's name as on the wire.
    #[must_use]
    pub fn as_str(&self) -> &'static str {
        match self {
            Verdict::Normal => "normal",
            Verdict::Tentative => "tentative",
            Verdict::Unconfirmed { .. } => "unconfirmed",
            Verdict::Explained { .. } => "explained",
            Verdict::Latched => "latched",
            Verdict::Acknowledged => "acknowledged",
        }
    }
}

/// One numbered step in the life of a verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Counts the transitions of this module from 1, without a gap.
    pub sequence: u64,
    /// The run that the steps are counted in.
    pub run: RunId,
    /// That run has ended since, though another with the same number may be under way.
    pub run_ended: bool,
    /// The component.
    pub component: Component,
    /// The new verdict.
    pub verdict: Verdict,
    /// What it rests on.
    pub symptom: Symptom,
    /// Since when the residual has been changing, as far back as the divergence shows it.
    pub onset: Step,
    /// When the divergence reached its threshold.
    pub detection: Step,
    /// As of which step the verdict was found.
    pub decided: Step,
    /// The channel at the detection.
    pub evidence: Evidence,
    /// It was so when it was first compared with its reference: it may have begun at any time before.
    pub before_service: bool,
    /// What was said to explain the change, though its module does not stand by that.
    pub disputed: Option<ComponentPath>,
    /// What an operator has commanded to subtract from what the component measures, before a comparison with its reference:
    /// of a gage \[m\], of a cylinder's oil content \[Pa\].
    pub tare: Option<f64>,
    /// The command that led to this, if one did.
    pub order: Option<GivenOrder>,
    /// If that was about the alarm alone: the command that led to the verdict, if one did.
    pub verdict_order: Option<Box<GivenOrder>>,
    /// If its alarm is set aside by an operator, by whom, why and until when. No verdict depends on it.
    pub shelved: Option<Box<Shelving>>,
    /// If its alarm is set aside while its module is maintained, the same.
    pub suppressed: Option<Box<Shelving>>,
}

impl Transition {
    /// Whether its steps are those of the run with this number that is under way.
    #[must_use]
    pub fn is_of(&self, run: RunId) -> bool {
        self.run == run && !self.run_ended
    }

    /// The command that led to the verdict, by this transition or by an earlier one since when nothing but the alarm's
    /// shelving changed.
    #[must_use]
    pub fn command(&self) -> Option<&GivenOrder> {
        let own = self.order.as_ref().filter(|order| order.kind.is_about_verdict());
        own.or(self.verdict_order.as_deref())
    }
}
