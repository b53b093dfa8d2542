//! What the references can tell, for people and for machines.

use std::io::{self, Write};
use std::path::Path;

use diagnosis::ModuleSetup;
use diagnosis::state::{ForceRange, LEAST_THRESHOLD, Reference};
use serde::Serialize;
use vocabulary::{Component, ComponentPath, ModuleName};

use super::references::Written;
use crate::failure::Failure;
use crate::output;
use crate::table::{TextTable, table, terminal_width};

/// What was learnt of all modules.
#[derive(Debug, Serialize)]
pub(super) struct Report<'a> {
    snippets: usize,
    /// Of these, so many were added from earlier.
    earlier_snippets: usize,
    modules: Vec<OfModule<'a>>,
}

/// What was learnt of a module.
#[derive(Debug, Serialize)]
struct OfModule<'a> {
    module: &'a ModuleName,
    file: &'a Path,
    snippets: usize,
    hours: f64,
    peers: Vec<&'a ModuleName>,
    /// If all peers have answered, and if not.
    gage_threshold: f64,
    gage_threshold_alone: f64,
    /// The same over windows of a tenth of a second.
    short_gage_threshold: f64,
    short_gage_threshold_alone: f64,
    cylinder_threshold: f64,
    largest_left_out: LeftOut,
    /// The rate of false alarms that the thresholds are for, at most (95 %) \[1/h\].
    false_alarms_per_hour: f64,
    gages: Vec<OfGage>,
    forces: Vec<&'a ForceRange>,
}

/// The largest departure of a healthy gage in snippets that had been left out.
#[derive(Debug, Serialize)]
struct LeftOut {
    alone: f64,
    with_peers: f64,
}

/// The smallest bias that is found on average \[m/m\].
#[derive(Debug, Serialize)]
struct OfGage {
    gage: ComponentPath,
    alone_strain: f64,
    with_peers_strain: f64,
}

impl<'a> Report<'a> {
    pub(super) fn of(
        setups: &[ModuleSetup],
        written: &'a [Written],
        snippets: usize,
        earlier_snippets: usize,
    ) -> Self {
        let both = setups.iter().zip(written);
        let modules = both.map(|(setup, written)| OfModule::of(setup, written)).collect();
        Self { snippets, earlier_snippets, modules }
    }

    /// Prints it on standard output.
    pub(super) fn print(&self, json: bool) -> Result<(), Failure> {
        let mut out = io::stdout().lock();
        if json {
            write!(out, "{}", output::text(self)?)?;
        } else {
            self.modules.iter().try_for_each(|module| module.print(&mut out))?;
        }
        Ok(out.flush()?)
    }
}

impl<'a> OfModule<'a> {
    fn of(setup: &ModuleSetup, Written { reference, file }: &'a Written) -> Self {
        let [alone, with_peers] = reference.long.largest_left_out;
        let is_own = |force: &&ForceRange| force.actuator.module == reference.module;
        OfModule {
            module: &reference.module,
            file,
            snippets: reference.long.means.snippets,
            hours: reference.hours,
            peers: reference.peers().collect(),
            gage_threshold: reference.long.gage_threshold,
            gage_threshold_alone: reference.long.gage_threshold_alone,
            short_gage_threshold: reference.short.gage_threshold,
            short_gage_threshold_alone: reference.short.gage_threshold_alone,
            cylinder_threshold: reference.cylinder_threshold,
            largest_left_out: LeftOut { alone, with_peers },
            false_alarms_per_hour: reference.false_alarms_per_hour,
            gages: gages(setup, reference),
            forces: reference.forces.iter().filter(is_own).collect(),
        }
    }

    fn print(&self, out: &mut impl Write) -> io::Result<()> {
        writeln!(out, "{}\n", self.table().text(terminal_width()))?;
        let Self { snippets, hours, gage_threshold, cylinder_threshold, .. } = self;
        let (gages_alone, rate) = (self.gage_threshold_alone, self.false_alarms_per_hour);
        let (short, short_alone) = (self.short_gage_threshold, self.short_gage_threshold_alone);
        writeln!(out, "learnt from {snippets} snippets, {hours:.3} h")?;
        for range in &self.forces {
            writeln!(out, "{}: {}", range.actuator, seen(range))?;
        }
        let LeftOut { alone, with_peers } = self.largest_left_out;
        writeln!(
            out,
            "thresholds: gages {gage_threshold:.1} with all peers, {gages_alone:.1} alone (over tenths \
             of a second {short:.1} and {short_alone:.1}), cylinders {cylinder_threshold:.1}; the largest departure of a healthy gage in snippets left out: \
             {alone:.1} alone, {with_peers:.1} with all peers"
        )?;
        writeln!(
            out,
            "for {rate} false alarms an hour at most (95 %), if what healthy values reach falls off \
             further as it does in these {hours:.3} h; {LEAST_THRESHOLD} at least"
        )?;
        writeln!(out, "{}: the reference of {}\n", self.file.display(), self.module)
    }

    fn table(&self) -> TextTable {
        let mut heading = vec!["gage", "smallest bias found alone [µε]"];
        heading.extend((!self.peers.is_empty()).then_some("with all peers [µε]"));
        let mut lines = table(&heading);
        for OfGage { gage, alone_strain, with_peers_strain } in &self.gages {
            let figures = [alone_strain, with_peers_strain].map(|s| format!("{:.2}", 1e6 * s));
            let row = std::iter::once(gage.to_string()).chain(figures);
            lines.add_row(row.take(heading.len()));
        }
        lines.align_right(1..heading.len());
        lines
    }
}

fn gages(setup: &ModuleSetup, reference: &Reference) -> Vec<OfGage> {
    let [alone, with_peers] = reference.smallest_biases_m();
    let module = setup.structure.module(&setup.module);
    let gages = module.map(|module| module.gages.as_slice()).unwrap_or_default();
    let of_gage = |(gage, (alone_m, with_peers_m)): (&truss::Gage, (&f64, &f64))| {
        let length_m = setup.structure.gage_length_m(gage);
        let component = Component::Sensor(gage.name.clone());
        OfGage {
            gage: ComponentPath { module: setup.module.clone(), component },
            alone_strain: alone_m / length_m,
            with_peers_strain: with_peers_m / length_m,
        }
    };
    gages.iter().zip(alone.iter().zip(&with_peers)).map(of_gage).collect()
}

/// The forces of a cylinder, in words.
fn seen(range: &ForceRange) -> String {
    let kilonewtons = |newtons: f64| format!("{:+.1}", newtons / 1e3).replace('-', "−");
    let (least, largest) = (kilonewtons(range.least_n), kilonewtons(range.largest_n));
    format!("{least} to {largest} kN, not seen beyond")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_have_their_signs() {
        let actuator = "m1/actuator/a1".parse().unwrap();
        let range = ForceRange { actuator, least_n: -6140.0, largest_n: 5210.0 };
        assert_eq!(seen(&range), "−6.1 to +5.2 kN, not seen beyond");
    }
}
