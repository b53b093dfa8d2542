//! The plant, its controller and its publisher.

use super::*;

impl World<'_> {
    pub(super) fn measure(&mut self) -> Result<(), SimulationError> {
        let step = self.plant.next_step();
        // Until then both are the same: the controller knows what has been published.
        let faulty = self.scenario.faults.iter().any(|fault| fault.at == step);
        if self.healthy.is_none() && (faulty || !self.watcher.states.is_empty()) {
            self.healthy = Some(self.plant.clone());
        }
        for fault in &self.scenario.faults {
            if fault.until == Some(step) {
                self.plant.clear(&fault.component)?;
                self.trace.note(self.now, format_args!("{} is healthy again", fault.component));
                let place = self.place_of(&fault.component.module);
                if self.computers[place].process.is_none() {
                    self.coverage.reach("a fault ended while its module was down");
                }
            }
            if fault.at == step {
                self.plant.inject(&fault.component, fault.fault)?;
                let kind = fault.fault.kind();
                self.trace.note(self.now, format_args!("{} is faulty: {kind}", fault.component));
                self.note_onset(&fault.component);
            }
        }
        self.control();
        let mut samples = std::mem::take(&mut self.samples);
        read(&mut self.plant, self.run, &mut samples);
        if let Some(healthy) = &mut self.healthy {
            healthy.advance();
            self.watcher.drift(self.now, drift_m(&self.plant, healthy));
        }
        for one in &self.active {
            if let DisturbanceKind::NoValue(module, gage) = *one
                && let Some(value) = samples[module].elongations_m.get_mut(gage)
            {
                *value = f64::NAN;
            }
        }
        if self.kept.len() == self.scenario.remembered_samples {
            self.kept.pop_front();
        }
        self.kept.push_back(samples.clone());
        if !self.is_active(|one| one == DisturbanceKind::SilentPublisher) {
            self.send(&samples, 1, self.run.0);
        }
        self.samples = samples;
        if let Some(other) = &mut self.other {
            let mut samples = Vec::new();
            read(other, (OTHER_RUN, Step(0)), &mut samples);
            self.send(&samples, 2, OTHER_RUN);
        }
        self.after(self.setup.step_ns(), Happening::Measure);
        Ok(())
    }

    /// The controller acts on what modules say of their components.
    pub(super) fn control(&mut self) {
        let now = self.instant(self.now);
        let heard = std::mem::take(&mut self.heard);
        if self.tolerance.follow(heard, &mut self.plant, now) {
            for component in self.tolerance.done_without() {
                self.coverage.reach(match component.component {
                    Component::Sensor(_) => "the controller used what a gage should read",
                    Component::Actuator(_) => "the controller did without a cylinder",
                });
            }
        }
        for cylinder in self.tolerance.shut_off_cylinders() {
            if self.watcher.shut_off.insert(cylinder.clone()) {
                self.coverage.reach("a cylinder was shut off");
                self.trace.note(self.now, format_args!("{cylinder} is shut off"));
            }
        }
    }

    pub(super) fn send(&mut self, samples: &[Measurements], publisher: u8, run: RunId) {
        let loss = self.active.iter().fold(0.0_f64, |most, one| match one {
            DisturbanceKind::Loss(share) => most.max(*share),
            _ => most,
        });
        let twice = self.active.iter().fold(0.0_f64, |most, one| match one {
            DisturbanceKind::Twice(share) => most.max(*share),
            _ => most,
        });
        let id = PublisherId { session: [publisher; 16], entity: 1 };
        let source = SampleSource { publisher: Some(id), run };
        let published_unix_ns = BEGIN_UNIX_NS + self.now;
        for (to, sample) in samples.iter().enumerate() {
            if loss > 0.0 && self.draw.random_bool(loss) {
                continue;
            }
            let times = if twice > 0.0 && self.draw.random_bool(twice) { 2 } else { 1 };
            for _ in 0..times {
                let Some(delay) = self.way(None, Some(to)) else { continue };
                let sample = sample.clone();
                self.after(delay, Happening::Sample { to, source, sample, published_unix_ns });
            }
        }
    }

    /// How much longer a message takes of which this share is lost and sent again.
    fn again(&mut self, share: f64) -> u64 {
        if self.draw.random_bool(share) { self.draw.random_range(AGAIN) } else { 0 }
    }

    /// How long a message takes, if it arrives. Outside of modules are the publisher, operators and views.
    pub(crate) fn way(&mut self, from: Option<usize>, to: Option<usize>) -> Option<u64> {
        let mut delay = self.draw.random_range(HOP);
        for one in self.active.clone() {
            match one {
                DisturbanceKind::NoRouter => return None,
                DisturbanceKind::CutOff(module) if from == Some(module) || to == Some(module) => {
                    return None;
                }
                DisturbanceKind::Deaf(module) if to == Some(module) => return None,
                DisturbanceKind::Mute(module) if from == Some(module) => return None,
                DisturbanceKind::Split(module) => {
                    if let (Some(from), Some(to)) = (from, to)
                        && (from < module) != (to < module)
                    {
                        return None;
                    }
                }
                DisturbanceKind::Loss(share) if from.is_some() => delay += self.again(share),
                DisturbanceKind::Late(ms) => delay += self.draw.random_range(0..=ms) * MS,
                _ => {}
            }
        }
        Some(delay)
    }
}

/// How far the tops of two plants are from each other \[m\].
fn drift_m(one: &Plant, other: &Plant) -> f64 {
    let pairs = one.tops_m().zip(other.tops_m());
    let distances = pairs.map(|(one, other)| {
        let squares = one.iter().zip(other).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt()
    });
    distances.fold(0.0, f64::max)
}

/// Advances a plant, and reads its modules. The run began at a step of the plant.
fn read(plant: &mut Plant, (run, begun): (RunId, Step), samples: &mut Vec<Measurements>) {
    let signals = plant.advance();
    samples.clear();
    samples.extend(signals.modules.iter().map(|module| Measurements {
        run,
        step: signals.step.minus(begun.0),
        demands_n: module.demands_n.clone(),
        pressures_pa: module.pressures_pa.clone(),
        elongations_m: module.elongations_m.clone(),
    }));
}
