//! A component over the windows: when what they say is found.

use vocabulary::{ComponentPath, Step};

use vocabulary::Symptom;
use vocabulary::{Condition, Obstacle};

/// Windows one after the other without a mean of a component, from which on nothing is known of it.
const MISSED: u32 = 2;

/// How a component departs from its reference.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Departed {
    pub(crate) symptom: Symptom,
    pub(crate) of_gage: bool,
    /// What was measured, and what the reference expects, in the symptom's unit.
    pub(crate) measured: f64,
    pub(crate) expected: f64,
    /// The statistic and its threshold.
    pub(crate) statistic: f64,
    pub(crate) threshold: f64,
}

impl Departed {
    /// What a new tare would make up for, if one can.
    fn shift(&self) -> Option<f64> {
        let off = self.measured - self.expected;
        match (self.symptom, self.of_gage) {
            (Symptom::Departure, true) | (Symptom::OilContent, _) => Some(off),
            _ => None,
        }
    }
}

/// What one window says of a component.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum WindowOutcome {
    /// The window has no mean for it.
    Missing,
    /// This window says nothing of it; what was known holds.
    NotTold,
    Agrees,
    Departs(Departed),
    OneOf(Vec<ComponentPath>),
    CannotTell(Obstacle),
}

/// What is found of a component.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum WindowFinding {
    /// It agrees with its reference, in so many windows one after the other.
    Agrees { windows: u32 },
    /// It has departed. It was first compared so late that it may have done so before.
    Departed { departed: Departed, onset: Step, before_service: bool },
    /// It or another of these has.
    OneOf { components: Vec<ComponentPath>, onset: Step },
}

/// A component over the windows.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct Track {
    pub(super) condition: Condition,
    /// By how much its mean, or its oil content, was off in the latest window that was compared.
    pub(super) off: Option<f64>,
    /// How it departed in that window, if it did.
    pub(super) departed: Option<Departed>,
    /// The last window that it agreed in ended here.
    pub(super) agreed: Option<Step>,
    /// Windows one after the other in which it agreed, in which it or another one departed, in which it did.
    pub(super) agreeing: u32,
    pub(super) departing: u32,
    pub(super) certain: u32,
    /// Windows one after the other without a mean of it.
    pub(super) missing: u32,
    /// In how many of them a departure has to show.
    pub(super) held: u32,
    /// Did the latest window in which something changed not count?
    pub(super) doubted: bool,
    /// How near it was to its limits in the latest window in which the peers were asked.
    pub(super) shares: Shares,
}

/// How near a component is to its limits: statistics as shares of their thresholds, with the sign of the deviation.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Shares {
    /// Of its mean.
    pub(crate) departure: Option<f64>,
    /// Of a cylinder's oil content.
    pub(crate) oil_content: Option<f64>,
    /// Of the logarithm of a gage's white noise.
    pub(crate) scatter: Option<f64>,
}

impl Track {
    /// Not compared yet; a departure is found in so many windows.
    pub(super) fn new(held: u32) -> Self {
        Self {
            condition: Condition::NotCompared,
            off: None,
            departed: None,
            agreed: None,
            agreeing: 0,
            departing: 0,
            certain: 0,
            missing: 0,
            held,
            doubted: false,
            shares: Shares::default(),
        }
    }

    /// Takes what a window from one step to another says. A departure began at `onset` or later.
    pub(super) fn take(
        &mut self,
        outcome: WindowOutcome,
        (from, until): (Step, Step),
        onset: Step,
    ) -> Option<WindowFinding> {
        if !matches!(outcome, WindowOutcome::Missing) {
            self.missing = 0;
        }
        match outcome {
            WindowOutcome::NotTold => None,
            // One window tells little; without two, what was known says nothing of the present.
            WindowOutcome::Missing => {
                self.missing += 1;
                if self.missing >= MISSED {
                    self.condition = Condition::NotCompared;
                    self.agreeing = 0;
                }
                None
            }
            WindowOutcome::CannotTell(obstacle) => {
                self.condition = Condition::CannotTell { obstacle };
                self.agreeing = 0;
                None
            }
            WindowOutcome::Agrees => {
                self.condition = Condition::Agrees { from, as_of: until };
                (self.off, self.departed) = (Some(0.0), None);
                self.agreed = Some(until);
                (self.departing, self.certain) = (0, 0);
                self.agreeing += 1;
                Some(WindowFinding::Agrees { windows: self.agreeing })
            }
            WindowOutcome::Departs(departed) => {
                (self.off, self.departed) = (departed.shift(), Some(departed));
                self.depart();
                self.certain += 1;
                let held = self.certain >= self.held;
                self.condition = match held {
                    true => Condition::Departed { as_of: until },
                    false => Condition::Doubtful { as_of: until },
                };
                let before_service = self.agreed.is_none();
                held.then_some(WindowFinding::Departed { departed, onset, before_service })
            }
            WindowOutcome::OneOf(components) => {
                self.departed = None;
                self.depart();
                self.certain = 0;
                let held = self.departing >= self.held;
                self.condition = match held {
                    true => Condition::OneOf { as_of: until, components: components.clone() },
                    false => Condition::Doubtful { as_of: until },
                };
                held.then_some(WindowFinding::OneOf { components, onset })
            }
        }
    }

    /// A window was not compared: what follows does not go on from what was before.
    pub(super) fn skip(&mut self) {
        (self.agreeing, self.departing, self.certain) = (0, 0, 0);
    }

    /// It departed in a window in which something changed: every other one of these counts, for each demand that jumps makes
    /// a healthy cylinder depart, and a fault departs in all of them. Does this one not count?
    pub(super) fn doubts(&mut self, until: Step) -> bool {
        self.doubted = !self.doubted;
        if self.doubted {
            self.condition = Condition::Doubtful { as_of: until };
        }
        self.doubted
    }

    fn depart(&mut self) {
        self.agreeing = 0;
        self.departing += 1;
    }
}
