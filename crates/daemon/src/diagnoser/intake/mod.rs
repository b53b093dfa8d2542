//! Samples, from the network to the diagnosis.
//!
//! | file | job |
//! |---|---|
//! | `receiver` | the network's callback: reads, counts what is no sample, never waits |
//! | `incumbent` | whose samples are diagnosed, when there are several publishers |
//! | `tally` | what was counted |
//! | `refusals` | why samples are not used, and how many |
//! | `sequencer` | puts recovered samples before those that came meanwhile |
//! | `store` | asks the publisher for samples that were missed |
//! | `gathering` | what it replied, and nobody else |
//! | `retry_policy` | when it is asked again |

mod gathering;
mod incumbent;
mod receiver;
mod refusals;
mod retry_policy;
mod sequencer;
mod store;
mod tally;

use std::time::Instant;

use diagnosis::Sample;

pub(crate) use receiver::Receiver;
pub(crate) use refusals::Refusals;
pub(crate) use sequencer::{Flow, Sequencer};
pub(crate) use store::{Fetched, Store};
pub(crate) use tally::IntakeTally;

/// A sample, when it was published and when it came.
#[derive(Debug, Clone)]
pub(crate) struct Arrival {
    pub(crate) sample: Sample,
    pub(crate) time_unix_ns: u64,
    pub(crate) received: Instant,
}

/// How many values a sample of the module has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Size {
    pub(crate) actuators: usize,
    pub(crate) gages: usize,
}

impl Arrival {
    /// A sample that is too long is cut off one value past its length: too long it stays, but it takes no
    /// more room than a true one, however many wait.
    pub(crate) fn new(sample: vocabulary::Sample, received: Instant, size: Size) -> Self {
        let vocabulary::Sample {
            module: _,
            run,
            step,
            time_unix_ns,
            mut demands_n,
            mut pressures_pa,
            mut elongations_m,
        } = sample;
        cut(&mut demands_n, size.actuators);
        cut(&mut pressures_pa, size.actuators);
        cut(&mut elongations_m, size.gages);
        let sample = Sample { run, step, demands_n, pressures_pa, elongations_m };
        Self { sample, time_unix_ns, received }
    }
}

fn cut<T>(values: &mut Vec<T>, length: usize) {
    if values.len() > length {
        values.truncate(length + 1);
        values.shrink_to_fit();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{RunId, Step};

    #[test]
    fn a_sample_that_is_too_long_stays_so_but_takes_no_room() {
        let sample = vocabulary::Sample {
            module: "m".parse().unwrap(),
            run: RunId(1),
            step: Step(1),
            time_unix_ns: 0,
            demands_n: vec![1.0],
            pressures_pa: vec![[1.0; 2]; 2],
            elongations_m: vec![1.0; 100_000],
        };
        let size = Size { actuators: 2, gages: 3 };
        let Arrival { sample, .. } = Arrival::new(sample, Instant::now(), size);
        let lengths =
            (sample.demands_n.len(), sample.pressures_pa.len(), sample.elongations_m.len());
        assert_eq!(lengths, (1, 2, 4));
        assert!(sample.elongations_m.capacity() < 10);
    }
}
