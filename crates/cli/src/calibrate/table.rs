//! Thresholds for people.

use study::ModulePeaks;

use super::gamma::Gamma;
use crate::table::{TextTable, table};

/// A line for each channel: its largest divergence, what was fitted, its threshold.
pub(super) fn of_module(module: &ModulePeaks, gammas: &[Gamma]) -> TextTable {
    let fitted = gammas.iter().any(|gamma| gamma.tail.is_some());
    let channels = module.channels.iter().map(|channel| &channel.component).zip(gammas);
    let name = |component| format!("{}/{component}", module.module);
    if !fitted {
        let mut lines = table(&["channel", "largest", "threshold"]);
        for (component, gamma) in channels {
            lines.add_row([name(component), number(gamma.largest), number(gamma.threshold)]);
        }
        return lines;
    }
    let mut lines = table(&["channel", "largest", "shape", "scale", "known within", "threshold"]);
    for (component, gamma) in channels {
        let of_tail = |text: &dyn Fn(&study::tail::TailThreshold) -> String| {
            gamma.tail.as_ref().map_or_else(String::new, text)
        };
        lines.add_row([
            name(component),
            number(gamma.largest),
            of_tail(&|tail| format!("{:.2}", tail.tail.shape)),
            of_tail(&|tail| number(tail.tail.scale)),
            of_tail(&|tail| format!("×{:.2}", tail.log_spread.exp())),
            number(gamma.threshold),
        ]);
    }
    lines
}

fn number(x: f64) -> String {
    format!("{x:.3e}")
}
