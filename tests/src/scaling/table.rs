//! The figures, row by row.

use super::figures::Figures;
use super::row::Setting;
use crate::grid;
use crate::quantiles::quantiles;

const HEADING: [&str; 14] = [
    "diagnosers",
    "network",
    "peers of each",
    "pace",
    "block",
    "idle",
    "CPU of a diagnoser",
    "per sample",
    "PSS",
    "onset to decision",
    "to the verdict at a third party, p50, max",
    "questions per verdict",
    "plant",
    "router",
];

/// Rows that were measured.
#[derive(Default)]
pub struct Table {
    rows: Vec<Figures>,
}

impl Table {
    /// Adds a row.
    pub fn add(&mut self, figures: Figures) {
        self.rows.push(figures);
    }

    /// The table as text.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut grid = grid::headed(HEADING);
        for figures in &self.rows {
            grid.add_row(cells(figures));
        }
        grid.to_string()
    }
}

fn cells(figures: &Figures) -> Vec<String> {
    let Figures { setting, diagnoser, plant, .. } = figures;
    let Setting { topology, speed, .. } = setting;
    let peers = figures.peers_of_each();
    let process = |percent: f64, mib: f64| format!("{percent:.0} %, {mib:.0} MiB");
    let [p50, max] = quantiles(figures.delays_ms.clone(), [0.5, 1.0]);
    let [steps] = quantiles(figures.steps.clone(), [0.5]);
    vec![
        setting.diagnosers().to_string(),
        topology.to_string(),
        format!("{peers:.0}"),
        speed.to_string(),
        setting.block_steps.to_string(),
        format!("{:.2} %", figures.idle_percent),
        format!("{:.2} %", diagnoser.percent),
        format!("{:.0} µs", figures.per_sample_us()),
        format!("{:.1} MiB", diagnoser.mib),
        format!("{steps:.0} steps"),
        format!("{p50:.1} ms, {max:.1} ms"),
        format!("{:.1}", figures.questions_per_verdict()),
        process(plant.percent, plant.mib),
        figures.router.map_or("-".into(), |router| process(router.percent, router.mib)),
    ]
}

impl Figures {
    /// Processor time of a diagnoser for a sample, everything included \[µs\].
    #[must_use]
    pub fn per_sample_us(&self) -> f64 {
        // A share of a core over samples per millisecond.
        self.diagnoser.percent / 100.0 * 1000.0 / self.setting.speed
    }

    /// Questions for each final verdict.
    #[must_use]
    pub fn questions_per_verdict(&self) -> f64 {
        self.questions as f64 / self.verdicts as f64
    }

    /// How many a module in the middle of the row may ask.
    #[must_use]
    pub fn peers_of_each(&self) -> f64 {
        let reach = (2 * self.setting.neighbours + 1).min(self.setting.copies);
        (2 * reach - 1) as f64
    }
}
