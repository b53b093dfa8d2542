//! Independent random streams from one seed.
//!
//! Each source of randomness has a separate stream (ChaCha with 8 rounds, the seed as key, the stream as nonce), so
//! draws of one source never affect another: a faulty and a fault-free run with the same seed differ only by the fault.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A source of randomness. Channels are numbered within a part of the plant, in the order of its modules.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stream {
    /// Mean wind speed and direction.
    WindConditions,
    /// Frequencies and phases of the turbulence.
    Turbulence,
    /// Live loads of the levels.
    LiveLoads,
    /// Deviation of the true structure's and hardware's parameters.
    Mismatch,
    /// Measurement noise of one gage.
    GageNoise(usize),
    /// Random walk of one gage.
    GageWalk(usize),
    /// Measurement noise of one actuator's two pressures.
    PressureNoise(usize),
    /// Times and values of changes of live loads.
    LiveLoadChanges,
    /// Course of one pattern of temperature.
    Temperature(usize),
    /// Gain of one gage.
    GageGain(usize),
    /// Slow drift of one pressure sensor, two to an actuator.
    PressureDrift(usize),
    /// Times, speeds and loads of a vehicle's crossings.
    MovingLoad(usize),
}

impl Stream {
    fn number(self) -> u64 {
        // The kind is in the upper half, the channel in the lower one.
        let numbered = |kind: u64, channel: usize| (kind << 32) | (channel as u64 & 0xffff_ffff);
        match self {
            Stream::WindConditions => numbered(1, 0),
            Stream::Turbulence => numbered(2, 0),
            Stream::LiveLoads => numbered(3, 0),
            Stream::Mismatch => numbered(4, 0),
            Stream::GageNoise(channel) => numbered(5, channel),
            Stream::GageWalk(channel) => numbered(6, channel),
            Stream::PressureNoise(channel) => numbered(7, channel),
            Stream::LiveLoadChanges => numbered(8, 0),
            Stream::Temperature(channel) => numbered(9, channel),
            Stream::GageGain(channel) => numbered(10, channel),
            Stream::PressureDrift(channel) => numbered(11, channel),
            Stream::MovingLoad(channel) => numbered(12, channel),
        }
    }

    /// The stream's generator, at its start.
    pub(crate) fn generator(self, seed: u64) -> ChaCha8Rng {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(self.number());
        generator
    }
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;

    #[test]
    fn streams_of_one_seed_differ_and_repeat() {
        let all = [
            Stream::WindConditions,
            Stream::Turbulence,
            Stream::LiveLoads,
            Stream::Mismatch,
            Stream::GageNoise(0),
            Stream::GageNoise(1),
            Stream::GageWalk(0),
            Stream::PressureNoise(0),
            Stream::LiveLoadChanges,
            Stream::Temperature(0),
            Stream::GageGain(0),
            Stream::PressureDrift(0),
            Stream::MovingLoad(0),
        ];
        let first = |stream: Stream| stream.generator(5).next_u64();
        let drawn: Vec<u64> = all.into_iter().map(first).collect();
        let mut distinct = drawn.clone();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), all.len());
        assert_eq!(drawn, all.into_iter().map(first).collect::<Vec<_>>());
    }
}
