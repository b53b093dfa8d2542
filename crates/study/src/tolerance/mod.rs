//! What a fault costs the structure, and what corrected readings take off that.

mod motion;
mod row;
mod summary;

use std::fmt;

use rand::Rng;

use vocabulary::fault::{Fault, FaultKind};
use vocabulary::{ComponentKind, ComponentPath, Step};

pub use motion::RunMotion;
pub use row::{CorrectedError, ToleranceRow};
pub use summary::{MeasureRow, ReadingRow, Spread, ToleranceSummary};

use crate::campaign::{Campaign, Rows};
use crate::case::{CampaignCase, CaseRun};
use crate::conditions::Situation;
use crate::draw::Draw;
use crate::error::StudyError;
use crate::report::Table;
use crate::rig::TimedFault;
use crate::system::{CommissionedPlant, System, gage_length_m};

/// Random stream of cases.
const FIRST_STREAM: u64 = 11 << 60;
/// Onset of the fault \[s\].
const ONSET_S: [f64; 2] = [10.5, 11.5];
/// What happens this long after the onset counts \[s\].
const COUNTED_S: f64 = 10.0;
/// A cylinder is hard over so long before the gage fails \[s\].
const HARD_OVER_BEFORE_S: [f64; 2] = [3.5, 5.0];
/// Size of a fault that is none \[m\], \[m²\].
const NEGLIGIBLE: f64 = 1e-12;
/// Leaks \[m²\] and bands of stiction \[m³/s\].
const LEAKS_M2: [f64; 2] = [3e-8, 5e-7];
const BANDS_M3_PER_S: [f64; 2] = [1e-6, 1e-4];
/// The situations, in turn.
const TURNS: [Situation; 4] =
    [Situation::Alone, Situation::Alone, Situation::DuringHardOver, Situation::FromTheStart];

/// What is done about a fault.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Nothing.
    Nothing,
    /// The controller uses corrected readings.
    Corrected,
    /// The controller limits innovations.
    Limited,
    /// Both.
    CorrectedAndLimited,
    /// The other cylinders make up for one that is hard over.
    Reallocated,
    /// A cylinder that is hard over is shut off.
    ShutOff,
    /// Both.
    ShutOffAndReallocated,
}

impl Measure {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Nothing,
        Self::Corrected,
        Self::Limited,
        Self::CorrectedAndLimited,
        Self::Reallocated,
        Self::ShutOff,
        Self::ShutOffAndReallocated,
    ];

    /// What can be done about faults of such components.
    #[must_use]
    pub fn against(kind: ComponentKind) -> &'static [Self] {
        match kind {
            ComponentKind::Sensor => &Self::ALL[1..4],
            ComponentKind::Actuator => &Self::ALL[4..],
        }
    }

    /// Do other cylinders make up for one that is lost?
    #[must_use]
    pub fn reallocates(self) -> bool {
        matches!(self, Self::Reallocated | Self::ShutOffAndReallocated)
    }

    /// Is a cylinder shut off that is hard over?
    #[must_use]
    pub fn shuts_off(self) -> bool {
        matches!(self, Self::ShutOff | Self::ShutOffAndReallocated)
    }

    /// Does the controller use corrected readings?
    #[must_use]
    pub fn corrects(self) -> bool {
        matches!(self, Self::Corrected | Self::CorrectedAndLimited)
    }

    /// Does the controller limit innovations?
    #[must_use]
    pub fn limits(self) -> bool {
        matches!(self, Self::Limited | Self::CorrectedAndLimited)
    }

    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Corrected => "corrected",
            Self::Limited => "limited",
            Self::CorrectedAndLimited => "corrected, limited",
            Self::Reallocated => "reallocated",
            Self::ShutOff => "shut off",
            Self::ShutOffAndReallocated => "shut off, reallocated",
        }
    }
}

/// Faults of components of commissioned plants, each with every measure against it, divided by the run without the fault.
#[derive(Debug, Clone)]
pub struct ToleranceCampaign {
    /// The system.
    pub system: System,
    /// The number of commissioned plants.
    pub plants: u64,
    /// Faults per plant.
    pub cases: u64,
    /// The kinds of faults, which take turns.
    pub kinds: Vec<FaultKind>,
    /// Only in this situation.
    pub situation: Option<Situation>,
    /// What is done about a fault is done so long after it could be \[s\].
    pub late_s: f64,
    /// Nothing fails: healthy components are declared faulty.
    pub wrong: bool,
}

impl ToleranceCampaign {
    /// The situations.
    pub const SITUATIONS: [Situation; 3] =
        [Situation::Alone, Situation::DuringHardOver, Situation::FromTheStart];

    /// The kinds of faults that such components have.
    #[must_use]
    pub fn kinds_of(components: ComponentKind) -> Vec<FaultKind> {
        let is_theirs = |kind: &FaultKind| kind.component_kind() == components;
        FaultKind::ALL.into_iter().filter(is_theirs).collect()
    }
}

/// The fault of a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToleranceTask {
    /// Its kind.
    pub kind: FaultKind,
    /// What else happens.
    pub situation: Situation,
    /// What happens from this step on counts.
    pub from: Step,
    /// A healthy component is declared faulty at that step.
    pub wrong: bool,
}

/// `bias, alone`
impl fmt::Display for ToleranceTask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.kind.words(), self.situation.as_str().replace('_', " "))
    }
}

impl Campaign for ToleranceCampaign {
    type Kind = ToleranceTask;
    type Row = ToleranceRow;
    type Summary = ToleranceSummary;

    fn systems(&self) -> &[System] {
        std::slice::from_ref(&self.system)
    }

    fn cases(&self) -> u64 {
        self.plants * self.cases
    }

    fn plant_of(&self, case: u64) -> (usize, Option<u64>) {
        (0, Some(case / self.cases.max(1)))
    }

    fn draw(
        &self,
        number: u64,
        _: Option<&CommissionedPlant>,
    ) -> Result<CampaignCase<ToleranceTask>, StudyError> {
        let mut draw = Draw::new(&self.system, FIRST_STREAM | number);
        let seed = draw.generator.next_u64();
        let kinds = self.kinds.len().max(1) as u64;
        let kind = self.kinds.get((number % kinds) as usize);
        let kind = *kind.ok_or(StudyError::NothingToBreak)?;
        let round = number / kinds;
        let situation = self.situation.unwrap_or(TURNS[(round % TURNS.len() as u64) as usize]);
        let from = Step(self.system.steps(draw.uniform(ONSET_S)));
        let component = draw.component(kind, &[]).ok_or(StudyError::NothingToBreak)?;
        let fault = match self.wrong {
            true => Fault::of_size(kind, NEGLIGIBLE),
            false => draw.harmful(kind, &component),
        };
        let at = if situation == Situation::FromTheStart { Step(0) } else { from };
        let fault = TimedFault { at, until: None, component, fault };
        let hard_over = match situation {
            Situation::DuringHardOver => {
                let kind = FaultKind::HardOver;
                let taken = [fault.component.clone()];
                let component = draw.component(kind, &taken).ok_or(StudyError::NothingToBreak)?;
                let at = from.minus(self.system.steps(draw.uniform(HARD_OVER_BEFORE_S)));
                Some(TimedFault { at, until: None, component, fault: Fault::of_size(kind, 0.0) })
            }
            _ => None,
        };
        let faults = [fault].into_iter().chain(hard_over).collect();
        let steps = from.0 + self.system.steps(COUNTED_S);
        let task = ToleranceTask { kind, situation, from, wrong: self.wrong };
        Ok(CampaignCase::new(number, task, seed, faults, steps))
    }

    fn judge(
        &self,
        case: &CampaignCase<ToleranceTask>,
        run: &mut CaseRun,
    ) -> Result<ToleranceRow, StudyError> {
        ToleranceRow::of(case, run, &self.system, self.system.steps(self.late_s))
    }

    fn summarize(&self, rows: &Rows<ToleranceRow>) -> ToleranceSummary {
        ToleranceSummary::of(rows)
    }

    fn tables(
        &self,
        _: &Rows<ToleranceRow>,
        summary: &ToleranceSummary,
    ) -> (Vec<Table>, Vec<String>) {
        (summary.tables(), Vec::new())
    }
}

impl Draw<'_> {
    /// A fault large enough to do harm where the kind has a size.
    fn harmful(&mut self, kind: FaultKind, component: &ComponentPath) -> Fault {
        const MICROSTRAIN: f64 = 1e-6;
        let scale = match component.component.kind() {
            ComponentKind::Sensor => MICROSTRAIN * gage_length_m(&self.system.structure, component),
            ComponentKind::Actuator => 1.0,
        };
        match kind {
            FaultKind::InternalLeakage
            | FaultKind::ExternalLeakageA
            | FaultKind::ExternalLeakageB => Fault::of_size(kind, self.log_uniform(LEAKS_M2)),
            FaultKind::Stiction => Fault::of_size(kind, self.log_uniform(BANDS_M3_PER_S)),
            FaultKind::Bias => {
                Fault::of_size(kind, self.sign() * scale * self.log_uniform([5.0, 1000.0]))
            }
            FaultKind::Drift => {
                Fault::of_size(kind, self.sign() * scale * self.log_uniform([5.0, 200.0]))
            }
            FaultKind::RandomWalk => {
                let per_ms = (self.system.parameters.step_s / 1e-3).sqrt();
                Fault::of_size(kind, scale * per_ms * self.log_uniform([0.3, 3.0]))
            }
            FaultKind::Gain => Fault::of_size(kind, self.uniform([0.0, 2.0])),
            FaultKind::Intermittent => Fault::Intermittent {
                offset_m: self.sign() * scale * self.log_uniform([5.0, 1000.0]),
                closed_s: self.log_uniform([0.02, 1.0]),
                open_s: self.log_uniform([0.02, 0.5]),
            },
            _ => Fault::of_size(kind, 0.0),
        }
    }
}
