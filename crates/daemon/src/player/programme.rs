//! The samples that are to be published, step by step.

use std::collections::BTreeMap;

use vocabulary::{ModuleName, Sample, Step, StructureName};

/// Samples of one run of a structure.
#[derive(Debug)]
pub struct Programme {
    /// The structure.
    pub(super) structure: StructureName,
    /// Length of a step \[s\].
    pub(super) step_s: f64,
    /// Of each module, by step.
    samples: BTreeMap<ModuleName, BTreeMap<Step, Sample>>,
}

impl Programme {
    /// The samples of a run, in any order; of several of a module and step, the first counts.
    #[must_use]
    pub fn new(
        structure: StructureName,
        step_s: f64,
        samples: impl IntoIterator<Item = Sample>,
    ) -> Self {
        let mut of_modules: BTreeMap<ModuleName, BTreeMap<Step, Sample>> = BTreeMap::new();
        for sample in samples {
            let of_module = of_modules.entry(sample.module.clone()).or_default();
            of_module.entry(sample.step).or_insert(sample);
        }
        Self { structure, step_s, samples: of_modules }
    }

    /// The modules that it has samples of.
    pub(super) fn modules(&self) -> Vec<ModuleName> {
        self.samples.keys().cloned().collect()
    }

    /// First and last step, if there is one.
    #[must_use]
    pub fn steps(&self) -> Option<(Step, Step)> {
        let first = self.samples.values().filter_map(|of| of.keys().next()).min();
        let last = self.samples.values().filter_map(|of| of.keys().next_back()).max();
        first.copied().zip(last.copied())
    }

    /// What there is of a step: the place of the module, and its sample.
    pub(super) fn at(&self, step: Step) -> impl Iterator<Item = (usize, &Sample)> {
        let of_modules = self.samples.values().enumerate();
        of_modules.filter_map(move |(place, samples)| Some((place, samples.get(&step)?)))
    }

    /// The first step after this one that there is a sample of.
    pub(super) fn after(&self, step: Step) -> Option<Step> {
        let next = |samples: &BTreeMap<Step, Sample>| {
            samples.range(step.plus(1)..).next().map(|(step, _)| *step)
        };
        self.samples.values().filter_map(next).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::RunId;

    fn sample(module: &str, step: u64, value: f64) -> Sample {
        Sample {
            module: module.parse().unwrap(),
            run: RunId(1),
            step: Step(step),
            time_unix_ns: 0,
            demands_n: Vec::new(),
            pressures_pa: Vec::new(),
            elongations_m: vec![value],
            readings: Vec::new(),
            block: Vec::new(),
        }
    }

    #[test]
    fn steps_follow_one_another_whatever_is_missing_and_in_whatever_order_they_came() {
        let samples = [("b", 9), ("a", 3), ("b", 4), ("a", 9), ("a", 4), ("a", 3)];
        let samples =
            samples.iter().enumerate().map(|(k, (module, step))| sample(module, *step, k as f64));
        let programme = Programme::new("t".parse().unwrap(), 1e-3, samples);
        assert_eq!(programme.steps(), Some((Step(3), Step(9))));
        let found = |step| programme.at(Step(step)).map(|(place, s)| (place, s.elongations_m[0]));
        assert_eq!(found(3).collect::<Vec<_>>(), [(0, 1.0)]);
        assert_eq!(programme.after(Step(3)), Some(Step(4)));
        assert_eq!(found(4).collect::<Vec<_>>(), [(0, 4.0), (1, 2.0)]);
        assert_eq!(programme.after(Step(4)), Some(Step(9)));
        assert_eq!(programme.after(Step(9)), None);
    }
}
