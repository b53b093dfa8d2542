//! Draws the fault to be identified in a case, its size, and the other events; all determined by the seed and the
//! case's number.

use std::fmt;

use rand::{Rng, RngExt};
use vocabulary::{
    ComponentPath, Step,
    fault::{Fault, FaultKind},
};

use crate::case::CampaignCase;
use crate::conditions::Situation;
use crate::draw::Draw;
use crate::rig::TimedFault;
use crate::system::{System, gage_length_m};

/// Random stream of these cases.
const FIRST_STREAM: u64 = 5 << 60;
/// Range of sizes in limits of their kind, from which sizes are drawn log-uniformly.
const IN_LIMITS: [f64; 2] = [0.5, 64.0];
/// Time in service, with several comparisons, before the first fault \[s\].
const BEFORE_S: [f64; 2] = [6.0, 8.0];
/// Time after the fault \[s\].
const AFTER_S: f64 = 12.0;

/// How long before the fault to be identified the other fault begins \[s\].
fn earlier_s(situation: Situation) -> Option<[f64; 2]> {
    match situation {
        Situation::AfterEffects => Some([0.2, 1.0]),
        Situation::DuringHardOver => Some([1.0, 5.0]),
        Situation::Second => Some([1.0, 10.0]),
        _ => None,
    }
}

/// Restrictions on the cases drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct IdentificationCases {
    /// Only this kind of fault; otherwise all kinds take turns.
    pub kind: Option<FaultKind>,
    /// Only this situation, one of [`Situation::IDENTIFIED`]; otherwise they take turns, with no other event in two of
    /// five.
    pub situation: Option<Situation>,
    /// All faults with a size have this multiple of the limit of their kind.
    pub in_limits: Option<f64>,
}

impl IdentificationCases {
    fn turn(self, number: u64) -> (FaultKind, Situation) {
        use Situation::{AfterEffects, Alone, DuringHardOver, Second};
        const TURNS: [Situation; 5] = [Alone, AfterEffects, Alone, DuringHardOver, Second];
        let kinds = FaultKind::ALL.len() as u64;
        let kind = self.kind.unwrap_or(FaultKind::ALL[(number % kinds) as usize]);
        let round = if self.kind.is_some() { number } else { number / kinds };
        (kind, self.situation.unwrap_or(TURNS[(round % 5) as usize]))
    }

    /// Draws a case, whose last fault is to be identified. `None` if no component can have the fault.
    pub(super) fn draw(
        self,
        system: &System,
        number: u64,
    ) -> Option<CampaignCase<IdentificationTask>> {
        let mut draw = Draw::new(system, FIRST_STREAM | number);
        let seed = draw.generator.next_u64();
        let (kind, situation) = self.turn(number);
        let begin_s = draw.uniform(BEFORE_S);
        let later_s = earlier_s(situation).map_or(0.0, |range| draw.uniform(range));
        let begin = system.steps(begin_s);
        let component = draw.component(kind, &[])?;
        let in_limits = limit(kind).map(|_| {
            let drawn = draw.log_uniform(IN_LIMITS);
            self.in_limits.unwrap_or(drawn)
        });
        let fault = draw.fault(kind, &component, in_limits.unwrap_or(1.0));
        let at = Step(begin + system.steps(later_s));
        let other = match situation {
            Situation::Alone => None,
            _ => Some(draw.other(situation, Step(begin), &component)?),
        };
        let subject = TimedFault { at, until: None, component, fault };
        let faults = other.into_iter().chain([subject]).collect();
        let (subject, steps) =
            (IdentificationTask { situation, in_limits }, at.0 + system.steps(AFTER_S));
        Some(CampaignCase::new(number, subject, seed, faults, steps))
    }
}

/// The smallest size of a kind that either detector finds within about two seconds; `None` if the kind has no size. The
/// unit is that of the fault's parameter; for gages per metre of their length.
#[must_use]
fn limit(kind: FaultKind) -> Option<f64> {
    match kind {
        // See LIMITS.md.
        FaultKind::InternalLeakage | FaultKind::ExternalLeakageA | FaultKind::ExternalLeakageB => {
            Some(1e-8)
        }
        FaultKind::Bias | FaultKind::Intermittent => Some(3e-6),
        // Reaches a detectable bias in a second.
        FaultKind::Drift => Some(3e-6),
        // Deviates by a detectable bias after a hundred steps of a millisecond.
        FaultKind::RandomWalk => Some(0.3e-6),
        // For a load of 100 µε.
        FaultKind::Gain => Some(0.03),
        FaultKind::Stiction => Some(1e-6),
        FaultKind::HardOver | FaultKind::ZeroOutput | FaultKind::Stuck | FaultKind::NoSignal => {
            None
        }
    }
}

/// The situation and size of a fault to be identified.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IdentificationTask {
    /// The other events.
    pub situation: Situation,
    /// The size of the fault in limits of its kind; `None` if it has no size.
    pub in_limits: Option<f64>,
}

/// `second, 3.2 times the limit of its kind`
impl fmt::Display for IdentificationTask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.situation.as_str())?;
        self.in_limits.map_or(Ok(()), |size| write!(f, ", {size:.1} times the limit of its kind"))
    }
}

impl Draw<'_> {
    /// A fault of a kind, so many times its limit.
    fn fault(&mut self, kind: FaultKind, component: &ComponentPath, in_limits: f64) -> Fault {
        let size = in_limits * limit(kind).unwrap_or(0.0);
        let size_m = size * gage_length_m(&self.system.structure, component);
        match kind {
            FaultKind::Bias | FaultKind::Drift => Fault::of_size(kind, self.sign() * size_m),
            // The limit is for steps of a millisecond; a walk's spread grows with the root of time.
            FaultKind::RandomWalk => {
                Fault::of_size(kind, size_m * (self.system.parameters.step_s / 1e-3).sqrt())
            }
            // A gain below one can deviate by at most one.
            FaultKind::Gain => match size < 0.9 && self.generator.random() {
                true => Fault::of_size(kind, 1.0 - size),
                false => Fault::of_size(kind, 1.0 + size),
            },
            FaultKind::Intermittent => Fault::Intermittent {
                offset_m: self.sign() * size_m,
                closed_s: self.log_uniform([0.02, 1.0]),
                open_s: self.log_uniform([0.02, 0.5]),
            },
            _ => Fault::of_size(kind, size),
        }
    }

    /// An earlier fault in another component, well above its limit.
    fn other(
        &mut self,
        situation: Situation,
        at: Step,
        taken: &ComponentPath,
    ) -> Option<TimedFault> {
        const OF_CYLINDERS: &[FaultKind] = &[
            FaultKind::InternalLeakage,
            FaultKind::ExternalLeakageA,
            FaultKind::ExternalLeakageB,
            FaultKind::HardOver,
        ];
        let kinds = match situation {
            Situation::DuringHardOver => &[FaultKind::HardOver],
            Situation::AfterEffects => OF_CYLINDERS,
            _ => FaultKind::OF_RESIDUALS,
        };
        let kind = self.one_of(kinds);
        let component = self.component(kind, std::slice::from_ref(taken))?;
        let in_limits = self.log_uniform([8.0, IN_LIMITS[1]]);
        let fault = self.fault(kind, &component, in_limits);
        Some(TimedFault { at, until: None, component, fault })
    }
}
