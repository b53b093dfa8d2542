//! Runs with one random fault each, and runs without any: exact isolation, delays, false alarms, the paper's table.

mod paper_table;
mod record;
mod summary;
mod tables;

use rand::Rng;
use vocabulary::{
    ComponentPath, Step,
    fault::{Fault, FaultKind},
};

pub use paper_table::{PAPER_TABLE, PaperTable};
pub(crate) use record::GageReading;
pub use record::{Closest, Conversation, ScenarioRow};
pub use summary::{FoundCount, Isolation, Nominal, READABLE, ScenarioSummary};

use crate::campaign::{Campaign, Rows};
use crate::case::{CampaignCase, CaseRun};
use crate::draw::Draw;
use crate::error::StudyError;
use crate::figure::{figure4, figure5, figure6};
use crate::report::{ReportFigure, Table};
use crate::rig::TimedFault;
use crate::system::{CommissionedPlant, System, gage_length_m, generator};

/// Random stream of nominal runs, far from those of the scenarios.
const FIRST_NOMINAL_STREAM: u64 = 1 << 63;

/// Ranges from which a scenario is drawn uniformly; defaults as in the tower's figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScenarioRanges {
    /// Length of a run with a fault \[s\].
    pub length_s: f64,
    /// Length of a run without a fault \[s\].
    pub nominal_s: f64,
    /// Onset of the fault \[s\].
    pub onset_s: [f64; 2],
    /// Leak coefficient \[m²\].
    pub leak_area_m2: [f64; 2],
    /// Bias, as strain of the gage \[m/m\].
    pub bias_strain: [f64; 2],
    /// Mean drift of a random walk, as strain \[1/s\].
    pub drift_strain_per_s: [f64; 2],
    /// Standard deviation of a random walk's increment in a step, as strain \[m/m\].
    pub increment_strain: [f64; 2],
    /// Sizes are drawn log-uniformly, and biases in both directions.
    pub log_uniform: bool,
}

impl Default for ScenarioRanges {
    fn default() -> Self {
        Self {
            length_s: 15.0,
            nominal_s: 15.0,
            onset_s: [10.5, 11.5],
            leak_area_m2: [1e-7, 5e-7],
            bias_strain: [0.0, 100e-6],
            drift_strain_per_s: [-20e-6, 20e-6],
            increment_strain: [1e-6, 3e-6],
            log_uniform: false,
        }
    }
}

/// From the end of the warm-up to the earliest fault \[s\].
const QUIET_BEFORE_S: f64 = 2.0;

impl ScenarioRanges {
    /// The same with sizes on both sides of the smallest that is isolated: from a fifth of it.
    #[must_use]
    pub fn across_the_limit(self) -> Self {
        Self {
            leak_area_m2: [8e-9, 5e-7],
            bias_strain: [0.4e-6, 100e-6],
            increment_strain: [0.08e-6, 3e-6],
            log_uniform: true,
            ..self
        }
    }

    /// The same with everything so much later that every channel has been watched for a while before the fault; it is as
    /// long in seconds, and slow sampling takes long to warm up.
    #[must_use]
    pub fn watched(mut self, system: &System) -> Self {
        let watched_s = system.watched_from() as f64 * system.parameters.step_s;
        let later_s = (watched_s + QUIET_BEFORE_S - self.onset_s[0]).max(0.0);
        self.onset_s = self.onset_s.map(|onset_s| onset_s + later_s);
        self.length_s += later_s;
        self.nominal_s += later_s;
        self
    }

    /// Draws a fault of this kind for a component. `None` for a kind that scenarios do not include.
    pub(crate) fn fault(
        &self,
        kind: FaultKind,
        component: &ComponentPath,
        draw: &mut Draw,
    ) -> Option<Fault> {
        let length_m = gage_length_m(&draw.system.structure, component);
        // The range is for steps of a millisecond; the spread of a walk grows with the square root of time.
        let per_ms = (draw.system.parameters.step_s / 1e-3).sqrt();
        let size = |draw: &mut Draw, range| match self.log_uniform {
            true => draw.log_uniform(range),
            false => draw.uniform(range),
        };
        Some(match kind {
            FaultKind::InternalLeakage
            | FaultKind::ExternalLeakageA
            | FaultKind::ExternalLeakageB => Fault::of_size(kind, size(draw, self.leak_area_m2)),
            FaultKind::Bias => {
                let strain = size(draw, self.bias_strain);
                let sign = if self.log_uniform { draw.sign() } else { 1.0 };
                Fault::of_size(kind, sign * length_m * strain)
            }
            FaultKind::RandomWalk => Fault::RandomWalk {
                drift_m_per_s: length_m * draw.uniform(self.drift_strain_per_s),
                increment_m: length_m * size(draw, self.increment_strain) * per_ms,
            },
            FaultKind::HardOver | FaultKind::ZeroOutput => Fault::of_size(kind, 0.0),
            _ => return None,
        })
    }
}

/// Scenarios with one fault each, followed by nominal runs without a fault. Kinds of fault take turns, so that all are
/// equally frequent.
#[derive(Debug, Clone)]
pub struct ScenarioCampaign {
    /// The system; each run has its own plant.
    pub system: System,
    /// The ranges.
    pub ranges: ScenarioRanges,
    /// The number of runs with a fault.
    pub scenarios: u64,
    /// The number of runs without a fault.
    pub nominal: u64,
}

impl ScenarioCampaign {
    /// Draws a scenario.
    ///
    /// # Errors
    /// No component of the structure can have the scenario's fault.
    pub fn scenario(&self, number: u64) -> Result<CampaignCase<&'static str>, StudyError> {
        let mut draw = Draw::new(&self.system, number);
        let kinds = FaultKind::OF_RESIDUALS;
        let kind = kinds[(number % kinds.len() as u64) as usize];
        let seed = draw.generator.next_u64();
        let onset_s = draw.uniform(self.ranges.onset_s);
        let component = draw.component(kind, &[]).ok_or(StudyError::NothingToBreak)?;
        let fault = self.ranges.fault(kind, &component, &mut draw);
        let fault = fault.ok_or(StudyError::NothingToBreak)?;
        let fault =
            TimedFault { at: Step(self.system.steps(onset_s)), until: None, component, fault };
        let steps = self.system.steps(self.ranges.length_s);
        Ok(CampaignCase::new(number, kind.words(), seed, vec![fault], steps))
    }

    fn nominal_run(&self, number: u64) -> CampaignCase<&'static str> {
        let stream = FIRST_NOMINAL_STREAM | (number - self.scenarios);
        let seed = generator(self.system.seed, stream).next_u64();
        let steps = self.system.steps(self.ranges.nominal_s);
        CampaignCase::new(number, "nominal run", seed, Vec::new(), steps)
    }

    /// A description of the campaign.
    #[must_use]
    pub fn heading(&self, rows: &Rows<ScenarioRow>) -> String {
        let step_s = self.system.parameters.step_s;
        let hours = rows.values().map(|row| row.steps as f64).sum::<f64>() * step_s / 3600.0;
        let nominal = rows.values().filter(|row| row.injection.is_none()).count();
        let scenarios = rows.len() - nominal;
        format!(
            "{scenarios} scenarios and {nominal} nominal runs, {hours:.2} h of the tower's time"
        )
    }
}

impl Campaign for ScenarioCampaign {
    type Kind = &'static str;
    type Row = ScenarioRow;
    type Summary = ScenarioSummary;

    fn systems(&self) -> &[System] {
        std::slice::from_ref(&self.system)
    }

    fn cases(&self) -> u64 {
        self.scenarios + self.nominal
    }

    fn plant_of(&self, _: u64) -> (usize, Option<u64>) {
        (0, None)
    }

    fn draw(
        &self,
        number: u64,
        _: Option<&CommissionedPlant>,
    ) -> Result<CampaignCase<&'static str>, StudyError> {
        if number < self.scenarios { self.scenario(number) } else { Ok(self.nominal_run(number)) }
    }

    fn judge(
        &self,
        case: &CampaignCase<&'static str>,
        run: &mut CaseRun,
    ) -> Result<ScenarioRow, StudyError> {
        ScenarioRow::of(&self.system, case, run)
    }

    fn summarize(&self, rows: &Rows<ScenarioRow>) -> ScenarioSummary {
        ScenarioSummary::of(rows, self.system.parameters.step_s, self.system.watched_from())
    }

    fn tables(
        &self,
        rows: &Rows<ScenarioRow>,
        summary: &ScenarioSummary,
    ) -> (Vec<Table>, Vec<String>) {
        let notes = [Some(self.heading(rows)), tables::not_exact(summary)];
        (tables::tables(summary), notes.into_iter().flatten().collect())
    }

    fn figures(&self, _: &ScenarioSummary) -> Result<Vec<ReportFigure>, StudyError> {
        type Drawing = fn(&ScenarioCampaign, u64) -> Result<String, StudyError>;
        let figures: [(&'static str, &str, Drawing); 3] = [
            (
                "figure4",
                "A random walk and a bias in two gages of one module (Fig. 4 of the paper)",
                figure4,
            ),
            ("figure5", "An external leakage of one cylinder (Fig. 5 of the paper)", figure5),
            (
                "figure6",
                "A valve that stands open: the neighbour changes too, and its change is explained (Fig. 6 of the paper)",
                figure6,
            ),
        ];
        let mut drawn = Vec::new();
        for (name, caption, draw) in figures {
            match draw(self, self.system.seed) {
                Ok(svg) => drawn.push(ReportFigure { name, caption: caption.to_owned(), svg }),
                // The figures are of structures with as many cylinders and gages as the paper's.
                Err(StudyError::Lacks { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(drawn)
    }
}
