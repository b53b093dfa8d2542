//! One module's samples onto the network.

use shell::clock;
use vocabulary::{Key, ModuleName, RunId, Sample, Step, StructureName, Topic};
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::sample::SourceInfo;
use zenoh::{Session, Wait};

use super::recent_samples::RecentSamples;

/// Publishes a module's samples.
#[derive(Debug)]
pub(crate) struct SamplePublisher {
    publisher: Publisher<'static>,
    /// Counts what this publisher has sent, so that subscribers can distinguish it from others.
    sent: u32,
    recent: RecentSamples,
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
        is_lock_step: bool,
        recent: RecentSamples,
    ) -> zenoh::Result<Self> {
        let congestion_control =
            if is_lock_step { CongestionControl::Block } else { CongestionControl::Drop };
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
            readings: Vec::new(),
        };
        Ok(Self { publisher, sent: 0, recent, sample })
    }

    /// The latest samples.
    pub(crate) fn recent(&self) -> &RecentSamples {
        &self.recent
    }

    /// The module.
    pub(crate) fn module(&self) -> &ModuleName {
        &self.sample.module
    }

    /// Publishes a step: demanded forces \[N\], pressures of chambers A and B \[Pa\] and elongations \[m\] in the order of
    /// the module's description. Why it could not be sent, if so; the next one can be tried.
    pub(crate) fn publish(
        &mut self,
        step: Step,
        demands_n: &[f64],
        pressures_pa: &[[f64; 2]],
        elongations_m: &[f64],
    ) -> Result<(), String> {
        let sample = &mut self.sample;
        sample.step = step;
        demands_n.clone_into(&mut sample.demands_n);
        pressures_pa.clone_into(&mut sample.pressures_pa);
        elongations_m.clone_into(&mut sample.elongations_m);
        sample.time_unix_ns = clock::unix_ns();
        let bytes = vocabulary::encode(sample).map_err(|error| error.to_string())?;
        let bytes = ZBytes::from(bytes);
        self.recent.keep(step, bytes.clone());
        self.sent = self.sent.wrapping_add(1);
        let source = SourceInfo::new(self.publisher.id(), self.sent);
        self.publisher.put(bytes).source_info(source).wait().map_err(|error| error.to_string())
    }
}
