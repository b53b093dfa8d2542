//! One module's samples onto the network.

use shell::clock;
use vocabulary::{Key, ModuleName, RunId, Sample, Step, StructureName, Topic};
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::sample::SourceInfo;
use zenoh::{Session, Wait};

use super::pacing::Pacing;
use super::recording::Recording;

/// What a module measures at a step, in the order of its description.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Signals<'a> {
    /// Demanded forces \[N\].
    pub(crate) demands_n: &'a [f64],
    /// Pressures of chambers A and B \[Pa\].
    pub(crate) pressures_pa: &'a [[f64; 2]],
    /// Elongations \[m\].
    pub(crate) elongations_m: &'a [f64],
}

/// Publishes a module's samples.
#[derive(Debug)]
pub(crate) struct SamplePublisher {
    publisher: Publisher<'static>,
    /// Counts what this publisher has sent, so that subscribers can distinguish it from others.
    sent: u32,
    recording: Recording,
    /// Used again for each step.
    sample: Sample,
}

impl SamplePublisher {
    /// By the clock, a sample that finds no room is dropped: it would only come late. In lock-step
    /// nothing may be dropped, and there is time to wait.
    pub(crate) async fn declare(
        session: &Session,
        structure: &StructureName,
        module: &ModuleName,
        run: RunId,
        pacing: &Pacing,
        recording: Recording,
    ) -> zenoh::Result<Self> {
        let congestion_control =
            if pacing.is_lock_step() { CongestionControl::Block } else { CongestionControl::Drop };
        let publisher = session
            .declare_publisher(Key::of_module(structure, module, Topic::Sample).to_string())
            .encoding(Encoding::APPLICATION_JSON)
            .congestion_control(congestion_control)
            .await?;
        let sample = Sample {
            module: module.clone(),
            run,
            step: Step(0),
            time_unix_ns: 0,
            demands_n: Vec::new(),
            pressures_pa: Vec::new(),
            elongations_m: Vec::new(),
        };
        Ok(Self { publisher, sent: 0, recording, sample })
    }

    /// The latest samples.
    pub(crate) fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Publishes a step. Why it could not be sent, if so; the next one can be tried.
    pub(crate) fn publish(&mut self, step: Step, signals: Signals<'_>) -> Result<(), String> {
        let sample = &mut self.sample;
        sample.step = step;
        copy(signals.demands_n, &mut sample.demands_n);
        copy(signals.pressures_pa, &mut sample.pressures_pa);
        copy(signals.elongations_m, &mut sample.elongations_m);
        sample.time_unix_ns = clock::unix_ns();
        let bytes = vocabulary::encode(sample).map_err(|error| error.to_string())?;
        let bytes = ZBytes::from(bytes);
        self.recording.keep(step, bytes.clone());
        self.sent = self.sent.wrapping_add(1);
        let source = SourceInfo::new(self.publisher.id(), self.sent);
        self.publisher.put(bytes).source_info(source).wait().map_err(|error| error.to_string())
    }
}

/// Allocates nothing once there is room.
fn copy<T: Copy>(from: &[T], to: &mut Vec<T>) {
    to.clear();
    to.extend_from_slice(from);
}
