//! What the references can tell, for people and for machines.

use std::path::Path;

use diagnosis::ModuleSetup;
use diagnosis::state::{ForceRange, LEAST_THRESHOLD, Reference};
use serde_json::{Value, json};
use vocabulary::{Component, ComponentPath};

use crate::table::{TextTable, table, terminal_width};

/// A module's reference and its file.
#[derive(Debug)]
pub(super) struct ReferenceReport<'a> {
    pub(super) setup: &'a ModuleSetup,
    pub(super) reference: &'a Reference,
    pub(super) file: &'a Path,
}

impl ReferenceReport<'_> {
    /// For machines.
    pub(super) fn document(&self) -> Value {
        let Reference { module, hours, long, short, .. } = self.reference;
        let [alone, with_peers] = long.largest_left_out;
        let gage = |(gage, [alone_strain, with_peers_strain]): (ComponentPath, [f64; 2])| {
            json!({
                "gage": gage,
                "alone_strain": alone_strain,
                "with_peers_strain": with_peers_strain,
            })
        };
        json!({
            "module": module,
            "file": self.file,
            "snippets": long.means.snippets,
            "hours": hours,
            "peers": self.reference.peers().collect::<Vec<_>>(),
            // If all peers have answered, and if not.
            "gage_threshold": long.gage_threshold,
            "gage_threshold_alone": long.gage_threshold_alone,
            // The same over windows of a tenth of a second.
            "short_gage_threshold": short.gage_threshold,
            "short_gage_threshold_alone": short.gage_threshold_alone,
            "cylinder_threshold": self.reference.cylinder_threshold,
            // The largest departure of a healthy gage in snippets that had been left out.
            "largest_left_out": { "alone": alone, "with_peers": with_peers },
            // The rate of false alarms that the thresholds are for, at most (95 %) [1/h].
            "false_alarms_per_hour": self.reference.false_alarms_per_hour,
            "gages": self.smallest_strains().map(gage).collect::<Vec<_>>(),
            "forces": self.forces().collect::<Vec<_>>(),
        })
    }

    /// For people.
    pub(super) fn text(&self) -> String {
        let Reference { module, hours, long, short, cylinder_threshold, .. } = self.reference;
        let (snippets, rate) = (long.means.snippets, self.reference.false_alarms_per_hour);
        let [alone, with_peers] = long.largest_left_out;
        let forces = self.forces().map(|range| format!("{}: {}\n", range.actuator, seen(range)));
        format!(
            "{}\n\n\
             learnt from {snippets} snippets, {hours:.3} h\n\
             {}\
             thresholds: gages {:.1} with all peers, {:.1} alone (over tenths of a second {:.1} and {:.1}), \
             cylinders {cylinder_threshold:.1}; the largest departure of a healthy gage in snippets left out: \
             {alone:.1} alone, {with_peers:.1} with all peers\n\
             for {rate} false alarms an hour at most (95 %), if what healthy values reach falls off \
             further as it does in these {hours:.3} h; {LEAST_THRESHOLD} at least\n\
             {}: the reference of {module}\n\n",
            self.table().text(terminal_width()),
            forces.collect::<String>(),
            long.gage_threshold,
            long.gage_threshold_alone,
            short.gage_threshold,
            short.gage_threshold_alone,
            self.file.display(),
        )
    }

    fn table(&self) -> TextTable {
        let mut heading = vec!["gage", "smallest bias found alone [µε]"];
        let has_peers = self.reference.peers().next().is_some();
        heading.extend(has_peers.then_some("with all peers [µε]"));
        let mut lines = table(&heading);
        for (gage, strains) in self.smallest_strains() {
            let figures = strains.map(|strain| format!("{:.2}", 1e6 * strain));
            let row = std::iter::once(gage.to_string()).chain(figures);
            lines.add_row(row.take(heading.len()));
        }
        lines.align_right(1..heading.len());
        lines
    }

    /// The smallest bias of each gage that is found on average, alone and with all peers \[m/m\].
    fn smallest_strains(&self) -> impl Iterator<Item = (ComponentPath, [f64; 2])> {
        let Self { setup, reference, .. } = *self;
        let biases_m = reference.smallest_biases_m();
        let module = setup.structure.module(&setup.module);
        let gages = module.map(|module| module.gages.as_slice()).unwrap_or_default();
        let [alone, with_peers] = biases_m;
        let biases_m = alone.into_iter().zip(with_peers);
        gages.iter().zip(biases_m).map(move |(gage, (alone_m, with_peers_m))| {
            let length_m = setup.structure.gage_length_m(gage);
            let component = Component::Sensor(gage.name.clone());
            let path = ComponentPath { module: setup.module.clone(), component };
            (path, [alone_m / length_m, with_peers_m / length_m])
        })
    }

    /// The forces of the module's own cylinders.
    fn forces(&self) -> impl Iterator<Item = &ForceRange> {
        let is_own = |force: &&ForceRange| force.actuator.module == self.reference.module;
        self.reference.forces.iter().filter(is_own)
    }
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
