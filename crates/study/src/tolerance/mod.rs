//! What a fault costs the structure, and what corrected readings take off that.

mod motion;
mod row;
mod summary;

use std::fmt;

use rand::Rng;

use vocabulary::fault::{Fault, FaultKind};
use vocabulary::{ComponentKind, ComponentPath, Step};

pub use motion::{RunMotion, TRACE_EVERY_S};
pub use row::{CorrectedError, ToleranceRow};
pub use summary::{MeasureRow, ReadingRow, Spread, ToleranceSummary};

use crate::campaign::{Campaign, Rows};
use crate::case::{CampaignCase, CaseRun};
use crate::conditions::Situation;
use crate::draw::Draw;
use crate::error::StudyError;
use crate::figure::tolerance_figure;
use crate::report::{ReportFigure, Table};
use crate::rig::TimedFault;
use crate::system::{CommissionedPlant, System, gage_length_m};

/// Random stream of cases.
const FIRST_STREAM: u64 = 11 << 60;
/// Onset of the fault \[s\].
const ONSET_S: [f64; 2] = [10.5, 11.5];
/// What happens this long after the onset counts, unless a campaign says otherwise \[s\].
pub const COUNTED_S: f64 = 10.0;
/// Then a gage's fault goes, its gage is reset, and the run ends \[s\].
const GONE_S: f64 = 0.05;
const RESET_S: f64 = 0.15;
const END_S: f64 = 0.2;
/// A cylinder is hard over so long before the gage fails \[s\].
const HARD_OVER_BEFORE_S: [f64; 2] = [3.5, 5.0];
/// Another gage fails so long after the first \[s\].
const SECOND_AFTER_S: [f64; 2] = [0.5, 4.0];
/// A negligible size \[m\], \[m²\].
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
    /// What happens this long after the onset counts \[s\].
    pub counted_s: f64,
    /// What goes wrong besides.
    pub impediments: Impediments,
}

/// What goes wrong besides the faults.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Impediments {
    /// What is done about a fault is done so long after it could be \[s\].
    pub late_s: f64,
    /// Nothing fails: healthy components are declared faulty.
    pub wrong: bool,
    /// Modules do not hear each other's forces.
    pub silent_peers: bool,
    /// The share of the messages about gages and forces that is lost.
    pub lost: f64,
    /// A column of each plant, drawn at random, has lost this share of its stiffness since the commissioning.
    pub softened: f64,
}

impl ToleranceCampaign {
    /// The situations.
    pub const SITUATIONS: [Situation; 4] =
        [Situation::Alone, Situation::DuringHardOver, Situation::FromTheStart, Situation::Second];

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
    /// What happens up to this step counts.
    pub until: Step,
    /// The fault has gone, and its gage is reset, before this step is computed.
    pub resets_at: Option<Step>,
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

    fn alter(&self, plant: &mut CommissionedPlant) {
        if self.impediments.softened > 0.0 {
            plant.soften(self.impediments.softened);
        }
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
        let wrong = self.impediments.wrong;
        let fault = match wrong {
            true => Fault::of_size(kind, NEGLIGIBLE),
            false => draw.harmful(kind, &component),
        };
        let at = if situation == Situation::FromTheStart { Step(0) } else { from };
        let until = from.plus(self.system.steps(self.counted_s));
        let returns = component.component.kind() == ComponentKind::Sensor;
        let [gone, reset, end] =
            [GONE_S, RESET_S, END_S].map(|time_s| until.plus(self.system.steps(time_s)));
        let fault = TimedFault { at, until: returns.then_some(gone), component, fault };
        let other = match situation {
            Situation::DuringHardOver => {
                let kind = FaultKind::HardOver;
                let taken = [fault.component.clone()];
                let component = draw.component(kind, &taken).ok_or(StudyError::NothingToBreak)?;
                let at = from.minus(self.system.steps(draw.uniform(HARD_OVER_BEFORE_S)));
                Some(TimedFault { at, until: None, component, fault: Fault::of_size(kind, 0.0) })
            }
            Situation::Second => {
                let kind = draw.one_of(&ToleranceCampaign::kinds_of(ComponentKind::Sensor));
                let taken = [fault.component.clone()];
                let component = draw.component(kind, &taken).ok_or(StudyError::NothingToBreak)?;
                let at = from.plus(self.system.steps(draw.uniform(SECOND_AFTER_S)));
                let second = draw.harmful(kind, &component);
                Some(TimedFault { at, until: None, component, fault: second })
            }
            _ => None,
        };
        let faults = [fault].into_iter().chain(other).collect();
        let resets_at = returns.then_some(reset);
        let task = ToleranceTask { kind, situation, from, until, resets_at, wrong };
        Ok(CampaignCase::new(number, task, seed, faults, end.0))
    }

    fn judge(
        &self,
        case: &CampaignCase<ToleranceTask>,
        run: &mut CaseRun,
    ) -> Result<ToleranceRow, StudyError> {
        if self.impediments.silent_peers {
            run.rig.silence_forces();
        }
        run.rig.lose_readings(self.impediments.lost, case.seed);
        let late_steps = self.system.steps(self.impediments.late_s);
        ToleranceRow::of(case, run, &self.system, late_steps)
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

    fn figures(&self, summary: &ToleranceSummary) -> Result<Vec<ReportFigure>, StudyError> {
        let figure = |row: &ToleranceRow| ReportFigure {
            name: "top",
            caption: "The top with a fault".to_owned(),
            svg: tolerance_figure(row),
        };
        let worst = summary.worst.iter().filter(|row| !row.without_fault.top_um.is_empty());
        Ok(worst.map(figure).collect())
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
