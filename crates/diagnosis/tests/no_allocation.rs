//! The hot path allocates nothing.
#![expect(clippy::unwrap_used, reason = "test code")]

mod fixture;

use std::alloc::System;

use diagnosis::Rule;
use diagnosis::divergence::{DivergenceBank, DivergenceSettings, Interval};
use fixture::Bench;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static GLOBAL: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

// A program of its own: the test harness's own thread allocates too, now and then, and would be counted.
fn main() {
    neither_a_channel_step_nor_a_diagnoser_step_allocates();
}

fn neither_a_channel_step_nor_a_diagnoser_step_allocates() {
    for window in [10, 20, 32] {
        let interval = Interval::Sliding { vectors: 100 };
        let settings = DivergenceSettings { window, lag: window, interval };
        let mut bank = DivergenceBank::new(settings, &[1.0; 12]).unwrap();
        let mut push = |k: u32| bank.push(&[f64::from(k % 7); 12])[0].divergence();
        assert_eq!((0..150).filter(|&k| push(k).is_none()).count(), 2 * window);
        let region = Region::new(GLOBAL);
        let defined = (150..1000).filter(|&k| push(k).is_some()).count();
        assert_eq!(region.change().allocations, 0, "window {window}");
        assert_eq!(defined, 850);
    }
    let mut bench = Bench::in_service("lower", Rule::FirstChange);
    let samples: Vec<_> = (0..1000).map(|_| bench.signals.sample()).collect();
    let region = Region::new(GLOBAL);
    for sample in &samples {
        bench.diagnoser.take_sample(sample, &mut bench.actions);
    }
    assert_eq!(region.change().allocations, 0);
    assert_eq!(bench.diagnoser.last_step(), samples.last().map(|sample| sample.step));
}
