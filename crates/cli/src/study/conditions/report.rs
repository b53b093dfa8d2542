//! What came of the cases, for people and for machines.

use std::io::{self, Write};

use diagnosis::ModuleSetup;
use names::ModuleName;
use serde::Serialize;
use study::conditions::{
    CaseRecord, CommissionedPlant, ConditionCampaign, Situation, SituationTally, Standing, tally,
};
use study::summary::Interval95;

use super::Arguments;
use crate::failure::Failure;
use crate::study::tables::{self, Titled, interval};
use crate::table::terminal_width;
use crate::versioned;

/// Faults that passed for healthy and are listed one by one.
const SHOWN: usize = 10;

/// What was asked for and what came of it.
#[derive(Serialize)]
pub(super) struct Report<'a> {
    weather: &'static str,
    seed: u64,
    mismatch: f64,
    alone: bool,
    situation: Option<Situation>,
    bias_strain: Option<f64>,
    cases_per_plant: u64,
    from: u64,
    complete: bool,
    plants: Vec<OfPlant<'a>>,
    situations: Vec<OfSituation>,
    all: OfSituation,
    cases: &'a [CaseRecord],
    #[serde(skip)]
    passed_for_normal: Vec<String>,
}

/// A plant and what its references can tell.
#[derive(Serialize)]
struct OfPlant<'a> {
    number: u64,
    seed: u64,
    references: Vec<OfReference<'a>>,
}

#[derive(Serialize)]
struct OfReference<'a> {
    module: &'a ModuleName,
    hours: f64,
    gage_threshold: f64,
    cylinder_threshold: f64,
    largest_left_out: [f64; 2],
}

/// What came of the cases of one situation; without one, of all.
#[derive(Serialize)]
struct OfSituation {
    situation: Option<Situation>,
    cases: u64,
    faults: u64,
    named: u64,
    named_95: Interval95,
    /// One of several, as the likeliest.
    likeliest: u64,
    /// One of several, as another one.
    in_a_group: u64,
    cannot_tell: u64,
    normal: u64,
    healthy_named: u64,
    healthy_named_95: Interval95,
    hours: f64,
    questions_per_hour: f64,
}

impl<'a> Report<'a> {
    pub(super) fn of(
        arguments: &Arguments,
        campaign: &ConditionCampaign,
        plants: &'a [CommissionedPlant],
        records: &'a [CaseRecord],
        complete: bool,
    ) -> Self {
        let step_s = campaign.parameters.step_s;
        let tallies = tally(records, step_s);
        let of_situation = |(situation, tally): (&Situation, &SituationTally)| {
            OfSituation::of(Some(*situation), tally)
        };
        Report {
            weather: arguments.weather_name(),
            seed: campaign.seed,
            mismatch: campaign.mismatch,
            alone: arguments.alone,
            situation: campaign.kind.situation,
            bias_strain: campaign.kind.bias_strain,
            cases_per_plant: campaign.cases_per_plant,
            from: arguments.from,
            complete,
            plants: plants.iter().map(OfPlant::of).collect(),
            situations: tallies.iter().map(of_situation).collect(),
            all: OfSituation::of(None, &SituationTally::of(records, step_s)),
            passed_for_normal: passed_for_normal(records),
            cases: records,
        }
    }

    /// Prints it on standard output.
    pub(super) fn print(&self, json: bool) -> Result<(), Failure> {
        let mut out = io::stdout().lock();
        if json {
            write!(out, "{}", versioned::text(self)?)?;
        } else {
            tables::write(&[self.table()], terminal_width(), &mut out)?;
            self.print_passed(&mut out)?;
        }
        Ok(out.flush()?)
    }

    fn table(&self) -> Titled {
        let mut rows: Vec<Vec<String>> = self.situations.iter().map(OfSituation::row).collect();
        rows.push(self.all.row());
        Titled {
            title: "Faults that no change shows, and how they stand at the end",
            note: match self.alone {
                true => "Without peers a module takes what another's fault does to it for its own."
                    .to_owned(),
                false => String::new(),
            },
            heading: vec![
                "situation",
                "cases",
                "faults",
                "named",
                "95 %",
                "likeliest of a group",
                "in a group",
                "cannot tell",
                "normal",
                "healthy named",
                "95 %",
                "hours",
                "questions per hour",
            ],
            rows,
        }
    }

    fn print_passed(&self, out: &mut impl Write) -> io::Result<()> {
        let passed = &self.passed_for_normal;
        if passed.is_empty() {
            return Ok(());
        }
        writeln!(out, "\nPassed for normal:")?;
        passed.iter().take(SHOWN).try_for_each(|line| writeln!(out, "  {line}"))?;
        match passed.len().saturating_sub(SHOWN) {
            0 => Ok(()),
            more => writeln!(out, "  and {more} more"),
        }
    }
}

fn passed_for_normal(records: &[CaseRecord]) -> Vec<String> {
    let of_case = |record: &CaseRecord| {
        let passed =
            record.faulty.iter().filter(|(_, _, standing, _)| *standing == Standing::Normal);
        let line = |(component, fault, ..): &(_, String, _, _)| {
            format!("case {}: {component}, {fault}", record.number)
        };
        passed.map(line).collect::<Vec<String>>()
    };
    records.iter().flat_map(of_case).collect()
}

impl<'a> OfPlant<'a> {
    fn of(plant: &'a CommissionedPlant) -> Self {
        let of_setup = |setup: &'a ModuleSetup| {
            let reference = setup.reference.as_deref()?;
            Some(OfReference {
                module: &reference.module,
                hours: reference.hours,
                gage_threshold: reference.long.gage_threshold,
                cylinder_threshold: reference.cylinder_threshold,
                largest_left_out: reference.long.largest_left_out,
            })
        };
        let references = plant.setups.iter().filter_map(of_setup).collect();
        OfPlant { number: plant.number, seed: plant.seed, references }
    }
}

impl OfSituation {
    fn of(situation: Option<Situation>, tally: &SituationTally) -> Self {
        OfSituation {
            situation,
            cases: tally.cases,
            faults: tally.all_faults(),
            named: tally.faults_that_are(Standing::Named),
            named_95: tally.share_95(Standing::Named),
            likeliest: tally.faults_that_are(Standing::Likeliest),
            in_a_group: tally.faults_that_are(Standing::InAGroup),
            cannot_tell: tally.faults_that_are(Standing::CannotTell),
            normal: tally.faults_that_are(Standing::Normal),
            healthy_named: tally.healthy_named,
            healthy_named_95: tally.healthy_named_95(),
            hours: tally.hours,
            questions_per_hour: if tally.hours > 0.0 {
                tally.questions as f64 / tally.hours
            } else {
                0.0
            },
        }
    }

    fn row(&self) -> Vec<String> {
        let situation = self.situation.map_or("all", Situation::as_str).replace('_', " ");
        let named_95 = if self.faults > 0 { interval(self.named_95) } else { "–".to_owned() };
        vec![
            situation,
            self.cases.to_string(),
            self.faults.to_string(),
            self.named.to_string(),
            named_95,
            self.likeliest.to_string(),
            self.in_a_group.to_string(),
            self.cannot_tell.to_string(),
            self.normal.to_string(),
            self.healthy_named.to_string(),
            interval(self.healthy_named_95),
            format!("{:.2}", self.hours),
            format!("{:.0}", self.questions_per_hour),
        ]
    }
}
