//! How long it takes until a leak that grows is as wide as its cylinder's valve.
//!
//! In steady state the force control makes up for a leak: it commands the flow K_P·(u − F). Valve and leak are both orifices,
//! whose flow goes with the root of the pressure across them; at full pressure the valve lets q_max through. A leak as wide as
//! the valve leaves the chamber at most half the supply's pressure, and the force follows no more. Flow and pressures are
//! averaged over blocks, so that a moving demand does not count, and a straight line is put through the blocks of the last
//! hours.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use vocabulary::fault::FaultKind;

use crate::ledger::Ledger;
use crate::residual::NominalHydraulics;
use crate::sample::Measurements;
use crate::settings::ModuleSetup;

/// The length of a block \[s\], and how many are kept.
const BLOCK_S: f64 = 30.0;
const MOST_BLOCKS: usize = 240;
/// A leak grows if it is known from so many blocks, by so many standard deviations of the slope, and by so much of the valve's
/// width: the mean demand differs from block to block with the wind.
const LEAST_BLOCKS: usize = 10;
const LEAST_DEVIATIONS: f64 = 6.0;
const LEAST_RISE: f64 = 0.02;

/// What a module's cylinders leak.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Leaking {
    hydraulics: Option<NominalHydraulics>,
    steps_per_block: u64,
    /// By cylinder, while it is declared faulty: the blocks, oldest first. The last one is not full.
    blocks: Vec<VecDeque<Block>>,
}

impl Leaking {
    pub(crate) fn new(setup: &ModuleSetup) -> Self {
        Self {
            hydraulics: setup.hydraulics,
            steps_per_block: setup.sampling().steps(BLOCK_S),
            blocks: vec![VecDeque::new(); setup.actuators()],
        }
    }

    pub(crate) fn restart(&mut self) {
        self.blocks.iter_mut().for_each(VecDeque::clear);
    }

    /// Follows the cylinders that are declared faulty; their channels come first.
    pub(crate) fn follow(&mut self, ledger: &Ledger, sample: &Measurements) {
        let Some(hydraulics) = &self.hydraulics else { return };
        for (cylinder, blocks) in self.blocks.iter_mut().enumerate() {
            if !ledger.verdict(cylinder).is_latched() {
                blocks.clear();
                continue;
            }
            if blocks.back().is_none_or(|block| block.steps == self.steps_per_block) {
                if blocks.len() > MOST_BLOCKS {
                    blocks.pop_front();
                }
                blocks.push_back(Block::default());
            }
            let pressures_pa = sample.pressures_pa[cylinder];
            let missing_n = sample.demands_n[cylinder] - hydraulics.force_n(pressures_pa);
            if let Some(block) = blocks.back_mut() {
                block.add(hydraulics.force_gain_m3_per_s_n * missing_n, pressures_pa);
            }
        }
    }

    /// When the leak of a cylinder, which is of this kind, will be as wide as its valve, if it grows \[s\].
    pub(crate) fn ends_in_s(&self, cylinder: usize, kind: FaultKind) -> Option<f64> {
        let hydraulics = self.hydraulics.as_ref()?;
        let blocks = self.blocks.get(cylinder)?;
        let full = blocks.range(..blocks.len().saturating_sub(1)).enumerate();
        let widths = full.filter_map(|(place, block)| {
            let width = block.width(kind, hydraulics)?;
            Some([place as f64, width])
        });
        Some(BLOCK_S * blocks_until(1.0, &widths.collect::<Vec<_>>())?)
    }
}

/// Sums over a block.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Block {
    steps: u64,
    /// Steps with values.
    known: u64,
    flow: f64,
    pressures_pa: [f64; 2],
}

impl Block {
    fn add(&mut self, flow: f64, [a, b]: [f64; 2]) {
        self.steps += 1;
        if flow.is_finite() {
            self.known += 1;
            self.flow += flow;
            self.pressures_pa = [self.pressures_pa[0] + a, self.pressures_pa[1] + b];
        }
    }

    /// The width of a leak of this kind relative to the valve's; `None` for other kinds, and without values.
    fn width(&self, kind: FaultKind, hydraulics: &NominalHydraulics) -> Option<f64> {
        let known = self.known as f64;
        let [a, b] = self.pressures_pa.map(|sum_pa| sum_pa / known);
        let across_pa = match kind {
            FaultKind::InternalLeakage => (a - b).abs(),
            FaultKind::ExternalLeakageA => a - hydraulics.tank_pa,
            FaultKind::ExternalLeakageB => b - hydraulics.tank_pa,
            _ => return None,
        };
        let full_pa = hydraulics.supply_pa - hydraulics.tank_pa;
        let share = (self.flow / known).abs() / hydraulics.valve_flow_m3_per_s;
        let width = share * (full_pa / across_pa).sqrt();
        width.is_finite().then_some(width)
    }
}

/// A straight line through points of which the first coordinates are numbers of blocks: how many blocks after the last it
/// reaches the limit, if it rises.
fn blocks_until(limit: f64, points: &[[f64; 2]]) -> Option<f64> {
    let (&[first, _], &[last, _]) = (points.first()?, points.last()?);
    if points.len() < LEAST_BLOCKS {
        return None;
    }
    let count = points.len() as f64;
    let mean = |place: usize| points.iter().map(|point| point[place]).sum::<f64>() / count;
    let (time, level) = (mean(0), mean(1));
    let product = |a: usize, b: usize| {
        let means = [time, level];
        points.iter().map(|point| (point[a] - means[a]) * (point[b] - means[b])).sum::<f64>()
    };
    let slope = product(0, 1) / product(0, 0);
    let rest = (product(1, 1) - slope * product(0, 1)).max(0.0);
    let deviation = (rest / (count - 2.0) / product(0, 0)).sqrt();
    let rises = slope > LEAST_DEVIATIONS * deviation && slope * (last - first) > LEAST_RISE;
    let now = level + slope * (last - time);
    rises.then(|| ((limit - now) / slope).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn until(blocks: u32, width: impl Fn(f64) -> f64) -> Option<f64> {
        let point = |block: u32| [f64::from(block), width(f64::from(block))];
        blocks_until(1.0, &(0..blocks).map(point).collect::<Vec<_>>())
    }

    #[test]
    fn a_line_that_rises_reaches_the_limit_when_it_does() {
        let line = |block: f64| 0.1 + 0.003 * block;
        for blocks in [10, 100, 240] {
            let left = until(blocks, line).unwrap();
            let expected = 301.0 - f64::from(blocks);
            assert!((left / expected - 1.0).abs() < 1e-9, "{left} {expected}");
        }
        assert_eq!(until(240, |block| 0.5 + line(block)), Some(0.0));
    }

    #[test]
    fn what_is_level_falls_or_is_known_from_few_blocks_reaches_nothing() {
        let noise = |block: f64| 0.01 * (block * 7919.0 % 13.0 - 6.0) / 6.0;
        let of = |slope: f64, blocks| until(blocks, |block| 0.3 + slope * block + noise(block));
        assert_eq!(of(0.0, 240), None);
        assert_eq!(of(-0.002, 240), None);
        assert_eq!(of(0.01, 9), None);
        let left = of(0.002, 200).unwrap();
        assert!((left / 151.0 - 1.0).abs() < 0.1, "{left}");
    }
}
