//! The recorded samples of a module.

use std::ops::Range;

use vocabulary::{RunId, Step};

/// Identifies a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleHead {
    /// Its run.
    pub run: RunId,
    /// Its step.
    pub step: Step,
    /// The time of publishing, by the publisher's clock \[ns since 1970\].
    pub time_unix_ns: u64,
}

#[derive(Debug, Clone, Copy)]
struct SampleEntry {
    head: SampleHead,
    /// The index of its first value.
    at: usize,
    /// The numbers of demands, pairs of pressures, and elongations or readings.
    lengths: [usize; 3],
}

/// Samples by run and step, without duplicates. There are several of one run and step if the publisher restarted with
/// the same run.
#[derive(Debug, Default)]
pub struct Samples {
    entries: Vec<SampleEntry>,
    /// The values of all samples in one vector: an hour has millions.
    values: Vec<f64>,
}

impl Samples {
    /// Adds a sample.
    pub(crate) fn push(&mut self, sample: &vocabulary::Sample) {
        let head =
            SampleHead { run: sample.run, step: sample.step, time_unix_ns: sample.time_unix_ns };
        let at = self.values.len();
        let gages = sample.elongations_m.len() + sample.readings.len();
        let lengths = [sample.demands_n.len(), sample.pressures_pa.len(), gages];
        self.entries.push(SampleEntry { head, at, lengths });
        self.values.extend_from_slice(&sample.demands_n);
        self.values.extend(sample.pressures_pa.iter().flatten());
        self.values.extend_from_slice(&sample.elongations_m);
        self.values.extend_from_slice(&sample.readings);
    }

    /// Keeps of each the readings at these places, in this order; nothing else.
    pub fn select(&mut self, places: &[usize]) {
        let mut values = Vec::with_capacity(self.entries.len() * places.len());
        for entry in &mut self.entries {
            let [demands, pairs, gages] = entry.lengths;
            let readings = entry.at + demands + 2 * pairs;
            let reading = |place: usize| (place < gages).then(|| self.values[readings + place]);
            entry.at = values.len();
            entry.lengths = [0, 0, places.len()];
            values.extend(places.iter().map(|place| reading(*place).unwrap_or(f64::NAN)));
        }
        self.values = values;
    }

    /// Sorts the samples and removes duplicates.
    pub(crate) fn sort(&mut self) {
        let Self { entries, values } = self;
        let key = |entry: &SampleEntry| (entry.head.run, entry.head.step);
        entries.sort_by_key(key);
        let mut group = 0;
        let mut kept = 0;
        for index in 0..entries.len() {
            let entry = entries[index];
            if kept > 0 && key(&entries[kept - 1]) != key(&entry) {
                group = kept;
            }
            let is_known = entries[group..kept].iter().any(|other| same(other, &entry, values));
            if !is_known {
                entries[kept] = entry;
                kept += 1;
            }
        }
        entries.truncate(kept);
    }

    /// The number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The identity of a sample.
    #[must_use]
    pub fn head(&self, index: usize) -> Option<SampleHead> {
        self.entries.get(index).map(|entry| entry.head)
    }

    /// A copy of a sample.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<diagnosis::Measurements> {
        self.entries.get(index)?;
        let mut sample = empty_sample();
        self.read(index, &mut sample);
        Some(sample)
    }

    /// Copies a sample into an existing one.
    pub fn read(&self, index: usize, into: &mut diagnosis::Measurements) {
        let Some(SampleEntry { head, at, lengths: [demands, pairs, gages] }) =
            self.entries.get(index)
        else {
            return;
        };
        let pressures = at + demands;
        let elongations = pressures + 2 * pairs;
        into.run = head.run;
        into.step = head.step;
        into.demands_n.clear();
        into.demands_n.extend_from_slice(&self.values[*at..pressures]);
        into.pressures_pa.clear();
        let (pairs, _) = self.values[pressures..elongations].as_chunks::<2>();
        into.pressures_pa.extend_from_slice(pairs);
        into.elongations_m.clear();
        into.elongations_m.extend_from_slice(&self.values[elongations..elongations + gages]);
    }

    /// The samples of this run and step; `near` is their likely index.
    pub(crate) fn of(&self, run: RunId, step: Step, near: usize) -> Range<usize> {
        let is = |index: usize| {
            self.entries.get(index).is_some_and(|e| (e.head.run, e.head.step) == (run, step))
        };
        let begins = is(near) && !near.checked_sub(1).is_some_and(is);
        let from = if begins { near } else { self.first_from(run, step) };
        let mut to = from;
        while is(to) {
            to += 1;
        }
        from..to
    }

    /// The index of the first sample not before this run and step.
    pub(crate) fn first_from(&self, run: RunId, step: Step) -> usize {
        self.entries.partition_point(|e| (e.head.run, e.head.step) < (run, step))
    }
}

/// An empty sample to read others into.
pub(crate) fn empty_sample() -> diagnosis::Measurements {
    diagnosis::Measurements {
        run: RunId(0),
        step: Step(0),
        demands_n: Vec::new(),
        pressures_pa: Vec::new(),
        elongations_m: Vec::new(),
    }
}

fn same(one: &SampleEntry, other: &SampleEntry, values: &[f64]) -> bool {
    let bits = |entry: &SampleEntry| {
        let [demands, pairs, gages] = entry.lengths;
        values[entry.at..entry.at + demands + 2 * pairs + gages].iter().map(|v| v.to_bits())
    };
    one.head == other.head && one.lengths == other.lengths && bits(one).eq(bits(other))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(step: u64, time_unix_ns: u64, value: f64) -> vocabulary::Sample {
        vocabulary::Sample {
            module: "module1".parse().unwrap(),
            run: RunId(1),
            step: Step(step),
            time_unix_ns,
            demands_n: vec![value],
            pressures_pa: vec![[2.0, 3.0]],
            elongations_m: vec![4.0],
            readings: vec![f64::NAN],
            block: Vec::new(),
        }
    }

    #[test]
    fn what_was_recorded_twice_is_there_once_and_what_came_again_twice() {
        let mut samples = Samples::default();
        for (step, time, value) in
            [(3, 30, 1.0), (2, 20, 1.0), (3, 30, 1.0), (3, 90, 1.0), (3, 30, 7.0)]
        {
            samples.push(&sample(step, time, value));
        }
        samples.sort();
        assert_eq!(samples.len(), 4);
        assert_eq!(samples.of(RunId(1), Step(3), 0), 1..4);
        assert_eq!(samples.of(RunId(1), Step(3), 2), 1..4);
        assert_eq!(samples.of(RunId(1), Step(4), 4), 4..4);
        let mut one = empty_sample();
        samples.read(3, &mut one);
        assert_eq!((one.step, one.demands_n[0]), (Step(3), 7.0));
        assert_eq!(one.pressures_pa, [[2.0, 3.0]]);
        assert_eq!(one.elongations_m[0], 4.0);
        samples.select(&[2, 0]);
        samples.read(3, &mut one);
        assert!(one.demands_n.is_empty() && one.elongations_m[0].is_nan());
        assert_eq!(one.elongations_m[1], 4.0);
    }
}
