//! Which of a sample's values can be used. Each is judged by itself: a broken wire costs one channel, not the
//! module.
//!
//! A value that is missing, not a number or outside its plausible range is replaced, so that the models go on:
//! for a few steps by the last good one, then a pressure by the one that the nominal force loop expects. A signal
//! that was missing for [`LOST_S`] in a row is lost; every good value pays one fiftieth of a missing one back,
//! so an intermittent one is lost as well if more than one in fifty of its values is missing.

use vocabulary::Step;

use crate::channels::ChannelLayout;
use crate::sample::{Measurements, Signal};
use crate::settings::{ModuleSetup, Sampling};

/// Time without a value after which a signal is lost \[s\].
const LOST_S: f64 = 0.05;
/// A lost signal is used again after so long with good values only \[s\]: what comes and goes would keep the models
/// from settling.
const BACK_S: f64 = 1.0;
/// Good values that make up for one that is missing.
const GOOD_FOR_ONE: u64 = 50;

/// A pressure above this multiple of the supply pressure is implausible, unless the settings specify another limit.
const MOST_SUPPLIES: f64 = 2.0;
/// So is a pressure below the tank pressure by more than this share of the supply pressure.
const BELOW_TANK: f64 = 0.05;
/// A demand above this multiple of the cylinder's capacity cannot come from a controller.
const MOST_FORCES: f64 = 100.0;

/// The values that a module's signals can have.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Plausible {
    demand_n: f64,
    pressure_pa: [f64; 2],
    elongations_m: Vec<f64>,
}

impl Plausible {
    fn of(setup: &ModuleSetup) -> Self {
        let module = setup.structure.module(&setup.module);
        let gages = module.map_or(&[][..], |module| &module.gages);
        // A module without actuators has neither demands nor pressures.
        let hydraulics = setup.hydraulics.as_ref();
        let largest_pressure_pa = setup.signals.largest_pressure_pa;
        let elongation = |gage| setup.signals.largest_strain * setup.structure.gage_length_m(gage);
        Self {
            demand_n: hydraulics
                .map_or(0.0, |h| MOST_FORCES * h.supply_pa * h.area_a_m2.max(h.area_b_m2)),
            pressure_pa: hydraulics.map_or([0.0; 2], |h| {
                [
                    h.tank_pa - BELOW_TANK * h.supply_pa,
                    largest_pressure_pa.unwrap_or(MOST_SUPPLIES * h.supply_pa),
                ]
            }),
            elongations_m: gages.iter().map(elongation).collect(),
        }
    }

    fn has(&self, sample: &Measurements, signal: Signal) -> bool {
        // What is not a number is in no range.
        let within = |value: f64, most: f64| value.abs() <= most;
        match signal {
            Signal::Demand(i) => within(sample.demands_n[i], self.demand_n),
            Signal::Pressure(i) => {
                let [low, high] = self.pressure_pa;
                sample.pressures_pa[i].iter().all(|pressure| (low..=high).contains(pressure))
            }
            Signal::Elongation(i) | Signal::Reading(i) => {
                within(sample.elongations_m[i], self.elongations_m[i])
            }
        }
    }
}

/// How long a signal may be missing, and has to be back, in steps.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Limits {
    lost: u64,
    back: u64,
}

impl Limits {
    fn new(sampling: Sampling) -> Self {
        Self { lost: sampling.steps(LOST_S), back: sampling.steps(BACK_S) }
    }
}

/// One signal.
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Feed {
    /// Steps in a row whose value is not used.
    missing: u64,
    /// Steps in a row with a good value.
    good: u64,
    /// [`GOOD_FOR_ONE`] for each missing value, less one for each good one.
    owed: u64,
    /// The first step of the present or latest loss.
    since: Step,
    /// It is lost, and that has been reported.
    lost: bool,
}

impl Feed {
    /// Takes whether there is a value; is the signal lost with this step?
    fn take(&mut self, good: bool, step: Step, limits: Limits) -> bool {
        self.good = if good { self.good + 1 } else { 0 };
        if good && (!self.lost || self.good >= limits.back) {
            self.missing = 0;
        } else {
            self.missing += 1;
        }
        if good {
            self.owed = self.owed.saturating_sub(1);
            return false;
        }
        if self.owed == 0 {
            self.since = step;
        }
        let most = limits.lost * GOOD_FOR_ONE;
        self.owed = (self.owed + GOOD_FOR_ONE).min(most);
        let lost = !self.lost && self.owed == most;
        self.lost |= lost;
        lost
    }

    /// Is the present value used?
    fn is_used(&self) -> bool {
        self.missing == 0
    }
}

/// What a channel has at a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Supply {
    /// A residual of its own.
    Good,
    /// The one before.
    Held,
    /// None.
    None,
}

/// The signals of a module.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Validity {
    plausible: Plausible,
    layout: ChannelLayout,
    /// Demands, pressures, elongations.
    feeds: Vec<Feed>,
    /// Most steps in a row that are held.
    longest_held: u64,
    limits: Limits,
    /// The present sample with every value that it lacks replaced.
    completed: Option<Measurements>,
    /// A pressure is back that the models had gone on without.
    pressure_is_back: bool,
}

impl Validity {
    pub(crate) fn new(setup: &ModuleSetup, longest_held: u64) -> Self {
        let layout = ChannelLayout::of(setup);
        Self {
            plausible: Plausible::of(setup),
            layout,
            feeds: vec![Feed::default(); 2 * layout.actuators + layout.gages],
            longest_held,
            limits: Limits::new(setup.sampling()),
            completed: None,
            pressure_is_back: false,
        }
    }

    /// A run begins: nothing is missing yet.
    pub(crate) fn forget(&mut self) {
        self.feeds.fill(Feed::default());
        self.completed = None;
        self.pressure_is_back = false;
    }

    /// A channel's losses are forgotten: they count from now.
    pub(crate) fn forgive(&mut self, channel: usize) {
        for place in self.feeds_of(channel) {
            self.feeds[place].owed = 0;
            self.feeds[place].lost = false;
        }
    }

    /// Takes a sample of the right lengths; `expected` are the pressures of an actuator that the nominal loop
    /// has reached. `lost` is called with the channel, the signal and its first missing step when a signal is lost.
    pub(crate) fn take(
        &mut self,
        sample: &Measurements,
        expected: impl Fn(usize) -> [f64; 2],
        mut lost: impl FnMut(usize, Signal, Step),
    ) {
        self.pressure_is_back = false;
        let mut completed = self.completed.take().unwrap_or_else(|| at_rest(sample));
        (completed.run, completed.step) = (sample.run, sample.step);
        for place in 0..self.feeds.len() {
            let signal = self.signal(place);
            let good = self.plausible.has(sample, signal);
            let channel = self.channel_of(signal);
            let feed = &mut self.feeds[place];
            let was_away = feed.missing > self.longest_held;
            if feed.take(good, sample.step, self.limits) {
                lost(channel, signal, feed.since);
            }
            let (used, is_away) = (feed.is_used(), feed.missing > self.longest_held);
            match signal {
                Signal::Demand(i) if used => completed.demands_n[i] = sample.demands_n[i],
                Signal::Pressure(i) if used => {
                    self.pressure_is_back |= was_away;
                    completed.pressures_pa[i] = sample.pressures_pa[i];
                }
                Signal::Pressure(i) if is_away => completed.pressures_pa[i] = expected(i),
                Signal::Elongation(i) if used => {
                    completed.elongations_m[i] = sample.elongations_m[i];
                }
                // It keeps the last good value.
                Signal::Demand(_)
                | Signal::Pressure(_)
                | Signal::Elongation(_)
                | Signal::Reading(_) => {}
            }
        }
        self.completed = Some(completed);
    }

    /// The present sample with every value that it lacks replaced.
    pub(crate) fn completed(&self) -> Option<&Measurements> {
        self.completed.as_ref()
    }

    /// Lacks the present sample any value?
    pub(crate) fn is_incomplete(&self) -> bool {
        self.feeds.iter().any(|feed| feed.missing > 0)
    }

    /// Is a pressure back that the models had gone on without?
    pub(crate) fn pressure_is_back(&self) -> bool {
        self.pressure_is_back
    }

    /// What a channel has at the present step.
    pub(crate) fn supply(&self, channel: usize) -> Supply {
        let missing = self.feeds_of(channel).map(|place| self.feeds[place].missing).max();
        match missing.unwrap_or(0) {
            0 => Supply::Good,
            missing if missing <= self.longest_held => Supply::Held,
            _ => Supply::None,
        }
    }

    /// Has a channel's signal been reported as lost?
    pub(crate) fn is_lost(&self, channel: usize) -> bool {
        self.feeds_of(channel).any(|place| self.feeds[place].lost)
    }

    /// The channel whose pressures the gages' model has to do without, if there is one.
    pub(crate) fn force_is_assumed(&self) -> Option<usize> {
        (0..self.layout.actuators)
            .find(|i| self.feeds[self.layout.actuators + i].missing > self.longest_held)
    }

    fn signal(&self, place: usize) -> Signal {
        match place.checked_sub(self.layout.actuators) {
            None => Signal::Demand(place),
            Some(i) if i < self.layout.actuators => Signal::Pressure(i),
            Some(i) => Signal::Elongation(i - self.layout.actuators),
        }
    }

    fn channel_of(&self, signal: Signal) -> usize {
        match signal {
            Signal::Demand(i) | Signal::Pressure(i) => i,
            Signal::Elongation(gage) | Signal::Reading(gage) => self.layout.channel_of_gage(gage),
        }
    }

    fn feeds_of(&self, channel: usize) -> impl Iterator<Item = usize> + use<> {
        // Its demand, and its pressures; a gage has but an elongation, which comes after these.
        let demand = self.layout.gage(channel).is_none().then_some(channel);
        demand.into_iter().chain([channel + self.layout.actuators])
    }
}

/// Stands in for values that never came.
fn at_rest(sample: &Measurements) -> Measurements {
    Measurements {
        run: sample.run,
        step: sample.step,
        demands_n: vec![0.0; sample.demands_n.len()],
        pressures_pa: vec![[0.0; 2]; sample.pressures_pa.len()],
        elongations_m: vec![0.0; sample.elongations_m.len()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { lost: 50, back: 1000 };

    fn lost_after(good: impl Fn(u64) -> bool) -> Option<u64> {
        let mut feed = Feed::default();
        (0..100_000_u64).find(|&step| feed.take(good(step), Step(step), LIMITS))
    }

    #[test]
    fn a_signal_is_lost_after_fifty_steps_without_a_value() {
        assert_eq!(lost_after(|_| false), Some(49));
        assert_eq!(lost_after(|step| step < 1000), Some(1049));
    }

    #[test]
    fn a_lost_one_is_used_again_after_a_second_of_good_values() {
        let mut feed = Feed::default();
        for step in 0..60 {
            feed.take(false, Step(step), LIMITS);
        }
        let used = (60..5000).find(|&step| {
            feed.take(step != 900, Step(step), LIMITS);
            feed.is_used()
        });
        assert_eq!(used, Some(900 + LIMITS.back));
    }

    #[test]
    fn an_intermittent_one_is_lost_if_more_than_one_in_fifty_values_is_missing() {
        assert!(lost_after(|step| step % 20 != 0).is_some());
        assert_eq!(lost_after(|step| step % 60 != 0), None);
    }
}
