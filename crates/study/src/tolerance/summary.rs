//! Many cases in tables.

use std::collections::BTreeMap;

use serde::Serialize;
use vocabulary::fault::FaultKind;

use super::Measure;
use super::row::{CorrectedError, ToleranceRow};
use crate::campaign::{Rows, grouped};
use crate::conditions::Situation;
use crate::report::{Table, percent};
use crate::statistics::nearest_rank;

/// Of many values: median, 95 % of them, the largest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// What 95 % do not exceed.
    pub p95: f64,
    /// The largest.
    pub worst: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_by(f64::total_cmp);
        let at = |share| nearest_rank(&sorted, share);
        Some(Self { median: at(0.5)?, p95: at(0.95)?, worst: at(1.0)? })
    }

    fn scaled(self, by: f64) -> Self {
        Self { median: by * self.median, p95: by * self.p95, worst: by * self.worst }
    }

    fn cell(self) -> String {
        format!("{:.2} / {:.2} / {:.2}", self.median, self.p95, self.worst)
    }
}

/// What a measure leaves of the faults' cost, relative to runs without the fault.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MeasureRow {
    /// Root mean square of the top's motion.
    pub rms_top: Spread,
    /// Its peak.
    pub peak_top: Spread,
    /// Peak strain.
    pub peak_strain: Spread,
    /// Root mean square of the forces of the other cylinders.
    pub rms_force: Spread,
    /// The energy that these spend.
    pub energy: Spread,
    /// The largest demand \[N\].
    pub largest_demand_n: Spread,
}

/// What each measure leaves in these cases.
fn measures(rows: &[&ToleranceRow]) -> BTreeMap<Measure, MeasureRow> {
    let of = |measure: Measure| {
        let relative = rows.iter().filter_map(|row| row.relative.get(&measure));
        Some((
            measure,
            MeasureRow {
                rms_top: Spread::of(relative.clone().map(|motion| motion.rms_top_m))?,
                peak_top: Spread::of(relative.clone().map(|motion| motion.peak_top_m))?,
                peak_strain: Spread::of(relative.clone().map(|motion| motion.peak_strain))?,
                rms_force: Spread::of(relative.clone().map(|motion| motion.rms_force_n))?,
                energy: Spread::of(relative.clone().map(|motion| motion.energy_j))?,
                largest_demand_n: Spread::of(relative.map(|motion| motion.largest_demand_n))?,
            },
        ))
    };
    Measure::ALL.into_iter().filter_map(of).collect()
}

/// How true corrected readings were.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ReadingRow {
    /// The number of cases.
    pub cases: u64,
    /// Root mean square of the error of all, as strain.
    pub rms_strain: f64,
    /// The share of all steps within their intervals.
    pub covered: f64,
    /// Half the interval's width, as strain.
    pub half_width_strain: f64,
    /// The share of steps without a reading.
    pub not_valid: f64,
}

impl ReadingRow {
    fn of(all: &[CorrectedError]) -> Option<Self> {
        let count = all.len() as f64;
        let mean = |of: fn(&CorrectedError) -> f64| all.iter().map(of).sum::<f64>() / count;
        (!all.is_empty()).then(|| Self {
            cases: all.len() as u64,
            rms_strain: mean(|one| one.rms_strain.powi(2)).sqrt(),
            covered: mean(|one| one.covered),
            half_width_strain: mean(|one| one.half_width_strain),
            not_valid: mean(|one| one.not_valid),
        })
    }
}

/// The result of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToleranceSummary {
    /// Cases.
    pub cases: u64,
    /// Cases in which the faulty component and no other was named; the figures are about them.
    pub named: u64,
    /// Those of them in which a healthy component was named with any measure.
    pub wrong_with_any: u64,
    /// That of them in which the fault moved the top most.
    pub worst: Option<ToleranceRow>,
    /// What measures leave.
    pub measures: BTreeMap<Measure, MeasureRow>,
    /// The same by kind of fault.
    pub by_kind: BTreeMap<FaultKind, BTreeMap<Measure, MeasureRow>>,
    /// Corrected readings, by what else happens.
    pub readings: BTreeMap<Situation, ReadingRow>,
    /// Those of faults that begin in service, by gage.
    pub by_gage: BTreeMap<String, ReadingRow>,
    /// Largest step of a demand at the verdict \[N\].
    pub demand_step_n: BTreeMap<Measure, Spread>,
    /// At the reset \[N\].
    pub return_step_n: BTreeMap<Measure, Spread>,
}

/// How much the fault moved the top with nothing done about it.
fn harm(row: &ToleranceRow) -> f64 {
    row.relative.get(&Measure::Nothing).map_or(0.0, |motion| motion.rms_top_m)
}

impl ToleranceSummary {
    pub(super) fn of(rows: &Rows<ToleranceRow>) -> Self {
        let is_right = |row: &&ToleranceRow| row.named_after_s.is_some() && row.wrong.is_empty();
        let right: Vec<&ToleranceRow> = rows.values().filter(is_right).collect();
        let readings = |rows: &[&ToleranceRow]| {
            let errors: Vec<_> = rows.iter().filter_map(|row| row.corrected).collect();
            ReadingRow::of(&errors)
        };
        let alone: Vec<&ToleranceRow> =
            right.iter().copied().filter(|row| row.situation == Situation::Alone).collect();
        let is_held = |row: &&&ToleranceRow| row.situation != Situation::FromTheStart;
        let kinds = grouped(alone.iter().copied(), |row| row.kind);
        let situations = grouped(right.iter().copied(), |row| row.situation);
        let gages = grouped(right.iter().filter(is_held).copied(), |row| row.component.to_string());
        let steps = |of: fn(&ToleranceRow) -> &BTreeMap<Measure, f64>| {
            let spread = |measure: Measure| {
                let steps = alone.iter().filter_map(|row| of(row).get(&measure).copied());
                Some((measure, Spread::of(steps)?))
            };
            Measure::ALL.into_iter().filter_map(spread).collect()
        };
        Self {
            cases: rows.len() as u64,
            named: right.len() as u64,
            wrong_with_any: right.iter().filter(|row| !row.wrong_with.is_empty()).count() as u64,
            worst: alone.iter().copied().max_by(|a, b| harm(a).total_cmp(&harm(b))).cloned(),
            measures: measures(&alone),
            by_kind: kinds.into_iter().map(|(kind, rows)| (kind, measures(&rows))).collect(),
            readings: situations
                .into_iter()
                .filter_map(|(situation, rows)| Some((situation, readings(&rows)?)))
                .collect(),
            by_gage: gages
                .into_iter()
                .filter_map(|(gage, rows)| Some((gage, readings(&rows)?)))
                .collect(),
            demand_step_n: steps(|row| &row.demand_step_n),
            return_step_n: steps(|row| &row.return_step_n),
        }
    }

    pub(super) fn tables(&self) -> Vec<Table> {
        let row = |name: String, (measure, row): (&Measure, &MeasureRow)| {
            let kilonewtons = row.largest_demand_n.scaled(1e-3);
            let MeasureRow { rms_top, peak_top, peak_strain, rms_force, energy, .. } = *row;
            let spreads = [rms_top, peak_top, peak_strain, rms_force, energy, kilonewtons];
            let cells = spreads.map(Spread::cell);
            [name, measure.words().to_owned()].into_iter().chain(cells).collect::<Vec<_>>()
        };
        let all = self.measures.iter().map(|one| row("all".to_owned(), one));
        let several = self.by_kind.iter().filter(|_| self.by_kind.len() > 1);
        let by_kind = several.flat_map(|(kind, measures)| {
            measures.iter().map(move |one| row(kind.words().to_owned(), one))
        });
        let costs = Table::new(
            "What faults cost, relative to the runs without them",
            &[
                "",
                "measure",
                "rms top",
                "peak top",
                "peak strain",
                "rms force",
                "energy",
                "largest demand kN",
            ],
            all.chain(by_kind).collect(),
        )
        .with_note(format!(
            "Median / 95 % / worst. The tables are about the {} of {} cases in which the faulty component and no healthy one \
             was named; this one about single faults that begin in service. With a measure, a healthy component was named in \
             {} of them.",
            self.named, self.cases, self.wrong_with_any
        ));
        let microstrain = |strain: f64| format!("{:.2}", 1e6 * strain);
        let reading = |name: String, row: &ReadingRow| {
            vec![
                name,
                row.cases.to_string(),
                microstrain(row.rms_strain),
                percent(row.covered),
                microstrain(row.half_width_strain),
                percent(row.not_valid),
            ]
        };
        let situations = self.readings.iter();
        let situations = situations.map(|(of, row)| reading(of.as_str().replace('_', " "), row));
        let gages = self.by_gage.iter().map(|(gage, row)| reading(gage.clone(), row));
        let readings = Table::new(
            "How true corrected readings are",
            &["", "cases", "rms µε", "covered", "± µε", "not valid"],
            situations.chain(gages).collect(),
        )
        .with_note(
            "Error against what the gage would read without fault and noise. covered: within the 95 % interval. Gages: faults that begin in service.",
        );
        let step = |(measure, spread): (&Measure, &Spread)| {
            let at_return =
                self.return_step_n.get(measure).map(|spread| spread.scaled(1e-3).cell());
            let at_verdict = spread.scaled(1e-3).cell();
            vec![measure.words().to_owned(), at_verdict, at_return.unwrap_or_default()]
        };
        let steps = Table::new(
            "Largest step of a demand, kN",
            &["measure", "at the verdict", "at the reset"],
            self.demand_step_n.iter().map(step).collect(),
        );
        if self.readings.is_empty() { vec![costs] } else { vec![costs, readings, steps] }
    }
}
