//! One module's samples onto the network.

use shell::clock;
use vocabulary::{
    Encoding, Key, ModuleName, RunId, Sample, Step, StepValues, StructureName, Topic,
};
use zenoh::bytes::ZBytes;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::sample::SourceInfo;
use zenoh::{Session, Wait};

use super::recent_samples::RecentSamples;
use crate::messages;

/// How samples are put into messages.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SampleForm {
    pub(crate) encoding: Encoding,
    /// Steps of a message; with one it has no block.
    pub(crate) block_steps: u64,
    /// By the clock, a message that finds no room is dropped: it would only come late. In lock-step
    /// nothing may be dropped, and there is time to wait.
    pub(crate) is_lock_step: bool,
}

/// Publishes a module's samples.
#[derive(Debug)]
pub(crate) struct SamplePublisher {
    publisher: Publisher<'static>,
    form: SampleForm,
    /// Counts what this publisher has sent, so that subscribers can distinguish it from others.
    sent: u32,
    recent: RecentSamples,
    /// Used again for each message; with the steps of a block so far.
    sample: Sample,
}

impl SamplePublisher {
    pub(crate) async fn declare(
        session: &Session,
        structure: &StructureName,
        module: &ModuleName,
        run: RunId,
        form: SampleForm,
    ) -> zenoh::Result<Self> {
        let congestion_control =
            if form.is_lock_step { CongestionControl::Block } else { CongestionControl::Drop };
        let publisher = session
            .declare_publisher(Key::of_module(structure, module, Topic::Sample).to_string())
            .encoding(messages::encoding(form.encoding))
            .congestion_control(congestion_control)
            .await?;
        let recent = RecentSamples::new(run, form.encoding);
        let StepValues { demands_n, pressures_pa, elongations_m, readings } = StepValues::default();
        let sample = Sample {
            module: module.clone(),
            run,
            step: Step(0),
            time_unix_ns: 0,
            demands_n,
            pressures_pa,
            elongations_m,
            readings,
            block: Vec::new(),
        };
        Ok(Self { publisher, form, sent: 0, recent, sample })
    }

    /// The latest samples.
    pub(crate) fn recent(&self) -> &RecentSamples {
        &self.recent
    }

    /// The module.
    pub(crate) fn module(&self) -> &ModuleName {
        &self.sample.module
    }

    /// Publishes a step, or keeps it for its block: demanded forces \[N\], pressures of chambers A and B \[Pa\] and
    /// elongations \[m\] in the order of the module's description. Returns the last step that is out, if any was sent; or
    /// why not, and the next one can be tried.
    pub(crate) fn publish(
        &mut self,
        step: Step,
        demands_n: &[f64],
        pressures_pa: &[[f64; 2]],
        elongations_m: &[f64],
    ) -> Result<Option<Step>, String> {
        if self.form.block_steps <= 1 {
            let sample = &mut self.sample;
            sample.step = step;
            demands_n.clone_into(&mut sample.demands_n);
            pressures_pa.clone_into(&mut sample.pressures_pa);
            elongations_m.clone_into(&mut sample.elongations_m);
            return self.send(step).map(|()| Some(step));
        }
        // A recording may lack steps; those of a block follow one another.
        let is_next = self.sample.step.plus(self.sample.block.len() as u64) == step;
        let broken = if is_next { Ok(None) } else { self.flush() };
        if self.sample.block.is_empty() {
            self.sample.step = step;
        }
        self.sample.block.push(StepValues {
            demands_n: demands_n.to_vec(),
            pressures_pa: pressures_pa.to_vec(),
            elongations_m: elongations_m.to_vec(),
            readings: Vec::new(),
        });
        let is_last = step.0.is_multiple_of(self.form.block_steps);
        broken.and_then(|broken| if is_last { self.flush() } else { Ok(broken) })
    }

    /// Publishes the steps of a block that is not full. Returns the last of them, if there are any.
    pub(crate) fn flush(&mut self) -> Result<Option<Step>, String> {
        let steps = self.sample.block.len() as u64;
        if steps == 0 {
            return Ok(None);
        }
        let last = self.sample.step.plus(steps - 1);
        let sent = self.send(last);
        self.sample.block.clear();
        sent.map(|()| Some(last))
    }

    fn send(&mut self, last: Step) -> Result<(), String> {
        self.sample.time_unix_ns = clock::unix_ns();
        let bytes = vocabulary::encode_as(&self.sample, self.form.encoding)
            .map_err(|error| error.to_string())?;
        let bytes = ZBytes::from(bytes);
        self.recent.keep((self.sample.step, last), bytes.clone());
        self.sent = self.sent.wrapping_add(1);
        let source = SourceInfo::new(self.publisher.id(), self.sent);
        self.publisher.put(bytes).source_info(source).wait().map_err(|error| error.to_string())
    }
}
