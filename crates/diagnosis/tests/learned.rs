//! A module learnt from recordings of a loaded structure, and faults in recordings that it was not learnt from.

use std::sync::Arc;

use crate::fixture;
use diagnosis::identification::{IdentificationResult, identify};
use diagnosis::messages::{Speaker, from_diagnoser, setup_fingerprint, to_diagnoser, to_setup};
use diagnosis::state::learned::{
    ChannelState, ChannelSummary, ChannelVerdict, HealthyRecording, LearnedJudge, LearnedModule,
    LearningError, LearningSettings, Learnt, learn,
};
use diagnosis::state::{Condition, Obstacle};
use diagnosis::{Action, Diagnoser, Event, Measurements, ModuleSetup, OrderToken, Transition};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use vocabulary::fault::FaultKind;
use vocabulary::{
    GivenOrder, GivenOrderKind, ModulePhase, RunId, StatePart, Step, Symptom, Verdict,
};

const SENSORS: usize = 7;
const CHANNELS: usize = SENSORS + 2;
const STEP_S: f64 = 0.2;
const MINUTE: usize = 300;

/// What a fault makes of a reading, so many samples after its onset.
type Fault<'a> = &'a dyn Fn(usize, f64) -> f64;

fn names() -> Vec<String> {
    (1..=SENSORS).map(|k| format!("s{k}")).chain(["u1".into(), "u2".into()]).collect()
}

/// Two jacks that load by steps with plateaus, up to `most`; sensors follow them, a little more than in proportion,
/// with a zero of each recording, a slow wander and quantised noise.
fn recording(seed: u64, minutes: usize, most: f64) -> HealthyRecording {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut generator) };
    let zeros: Vec<f64> = (0..SENSORS).map(|_| 0.3 * normal()).collect();
    let mut wander = [0.0; SENSORS];
    let mut channels = vec![Vec::new(); CHANNELS];
    let (mut force, mut target) = ([0.0_f64; 2], [0.0_f64; 2]);
    for sample in 0..minutes * MINUTE {
        if sample % (MINUTE + MINUTE / 2) == 0 {
            let phase = sample as f64 / (minutes * MINUTE) as f64;
            let level = most * (std::f64::consts::PI * phase).sin();
            target = [
                level * (0.8 + 0.2 * normal().abs().min(1.0)),
                level * 0.7 * normal().abs().min(1.4),
            ];
        }
        for k in 0..2 {
            force[k] += (target[k] - force[k]).clamp(-0.02 * most, 0.02 * most);
            channels[SENSORS + k].push(force[k] + 0.05 * normal());
        }
        for (k, wander) in wander.iter_mut().enumerate() {
            *wander += 0.002 * normal();
            let angle = k as f64;
            let load = force[0] * (1.0 + angle.cos()) + force[1] * (0.7 + angle.sin());
            let reading = load + 2e-4 * load * load + zeros[k] + *wander + 0.1 * normal();
            channels[k].push((reading / 0.05).round() * 0.05);
        }
    }
    HealthyRecording { name: format!("run{seed}"), step_s: STEP_S, channels }
}

fn healthy() -> Vec<HealthyRecording> {
    (1..=4).map(|seed| recording(seed, 24, 100.0)).collect()
}

fn learnt(recordings: &[HealthyRecording]) -> Learnt {
    learn(recordings, &names(), SENSORS, LearningSettings::default()).unwrap()
}

fn judged(
    module: &LearnedModule,
    of: &HealthyRecording,
) -> (Vec<ChannelVerdict>, Vec<ChannelSummary>) {
    let mut judge = LearnedJudge::new(module.clone(), of.step_s);
    let mut verdicts = Vec::new();
    for sample in 0..of.channels[0].len() {
        let values: Vec<f64> = of.channels.iter().map(|channel| channel[sample]).collect();
        verdicts.extend(judge.take(&values));
    }
    let (rest, summary) = judge.finish();
    verdicts.extend(rest);
    (verdicts, summary)
}

fn named(verdicts: &[ChannelVerdict], state: ChannelState) -> Vec<usize> {
    let mut named: Vec<usize> =
        verdicts.iter().filter(|v| v.state == state).filter_map(|v| v.channel).collect();
    named.sort_unstable();
    named.dedup();
    named
}

#[test]
fn healthy_recordings_that_were_left_out_raise_no_alarm() {
    let module = learnt(&healthy()).module;
    module.check().unwrap();
    for seed in 11..19 {
        let (verdicts, summary) = judged(&module, &recording(seed, 24, 95.0));
        assert_eq!(named(&verdicts, ChannelState::Faulty), [0; 0], "{seed}: {verdicts:?}");
        assert!(summary.iter().all(|s| s.normal > 0.95), "{seed}: {summary:?} {verdicts:?}");
    }
}

#[test]
fn faults_of_every_kind_are_named_with_their_sizes() {
    let module = learnt(&healthy()).module;
    let onset = 10 * MINUTE;
    for channel in 0..CHANNELS {
        let range = module.channels[channel].highest - module.channels[channel].lowest;
        let jump = |_: usize, x: f64| x + 0.1 * range;
        let drift = |k: usize, x: f64| x + 0.5 * range * k as f64 / (5 * MINUTE) as f64;
        let faults: [(&str, Fault<'_>); 4] = [
            ("jump", &jump),
            ("drift", &drift),
            ("missing", &|_, _| f64::NAN),
            ("stuck", &|_, _| 20.0),
        ];
        for (what, fault) in faults {
            let mut broken = recording(30 + channel as u64, 24, 95.0);
            for (k, value) in broken.channels[channel].iter_mut().skip(onset).enumerate() {
                *value = fault(k, *value);
            }
            let (verdicts, _) = judged(&module, &broken);
            let faulty = named(&verdicts, ChannelState::Faulty);
            let dead = named(&verdicts, ChannelState::NoSignal);
            let both: Vec<usize> = faulty.iter().chain(&dead).copied().collect();
            assert!(both.iter().all(|k| *k == channel), "{what} of {channel}: {verdicts:#?}");
            assert!(!both.is_empty(), "{what} of {channel}: {verdicts:#?}");
            let first =
                verdicts.iter().filter(|v| v.channel == Some(channel)).map(|v| v.first).min();
            let latest =
                onset as u64 + if what == "jump" || what == "missing" { 15 } else { 5 * 300 };
            let first = first.unwrap();
            assert!((onset as u64 - 10..latest).contains(&first), "{what} of {channel} at {first}");
            if what == "drift" && channel < SENSORS {
                let fault = verdicts.iter().find_map(|v| v.fault).unwrap();
                let per_s = 0.5 * range / (5.0 * 60.0);
                assert_eq!(fault.kind, FaultKind::Drift, "{channel}: {fault:?}");
                assert!((fault.size.value / per_s - 1.0).abs() < 0.1, "{channel}: {fault:?}");
            }
            if what == "jump" {
                let fault = verdicts.iter().find_map(|v| v.fault).unwrap();
                assert_eq!(fault.kind, FaultKind::Bias, "{channel}: {fault:?}");
                assert!(
                    (fault.size.value / (0.1 * range) - 1.0).abs() < 0.2,
                    "{channel}: {fault:?}"
                );
            }
        }
    }
}

#[test]
fn beyond_the_loads_seen_nothing_is_called_normal_and_nothing_healthy_faulty() {
    let module = learnt(&healthy()).module;
    let (verdicts, summary) = judged(&module, &recording(50, 24, 140.0));
    assert_eq!(named(&verdicts, ChannelState::Faulty), [0; 0], "{verdicts:#?}");
    assert!(summary.iter().all(|s| s.state == ChannelState::Unknown), "{summary:?}");
    assert!(verdicts.iter().any(|v| v.reason.starts_with("loads beyond")), "{verdicts:?}");
}

#[test]
fn a_change_of_the_structure_is_no_faulty_sensor() {
    let module = learnt(&healthy()).module;
    let mut changed = recording(60, 24, 95.0);
    for (k, channel) in changed.channels.iter_mut().take(SENSORS).enumerate() {
        let shift = [40.0, -55.0, 62.0, 35.0, -48.0, 51.0, -30.0][k];
        channel.iter_mut().for_each(|x| *x += shift);
    }
    let (verdicts, summary) = judged(&module, &changed);
    assert_eq!(named(&verdicts, ChannelState::Faulty), [0; 0], "{verdicts:#?}");
    assert!(summary.iter().all(|s| s.state == ChannelState::Unknown), "{summary:?}");
}

#[test]
fn faults_in_healthy_recordings_are_left_out_and_told() {
    let mut recordings = healthy();
    for value in &mut recordings[2].channels[3][3000..3100] {
        *value += 60.0;
    }
    let found = learnt(&recordings);
    let [interval] = &found.cleaned[..] else { panic!("{:?}", found.cleaned) };
    assert_eq!((interval.recording.as_str(), interval.channel.as_str()), ("run3", "s4"));
    assert!(interval.samples.0 <= 3000 && interval.samples.1 >= 3099, "{interval:?}");
    let mut broken = recording(70, 24, 95.0);
    broken.channels[3][3000..].iter_mut().for_each(|x| *x += 60.0);
    let (verdicts, _) = judged(&found.module, &broken);
    assert_eq!(named(&verdicts, ChannelState::Faulty), [3], "{verdicts:?}");
}

/// A tenth of the recording may be left out, and so long a fault makes the residual of its channel wide everywhere.
#[test]
fn a_fault_of_a_twelfth_of_a_healthy_recording_is_left_out() {
    let clean = learnt(&healthy()).module;
    for fault in [|x: f64| x + 60.0, |_| -900.0] {
        let mut recordings = healthy();
        let faulty = 3000..3600;
        recordings[2].channels[3][faulty.clone()].iter_mut().for_each(|x| *x = fault(*x));
        let found = learnt(&recordings);
        let [interval] = &found.cleaned[..] else { panic!("{:?}", found.cleaned) };
        assert_eq!((interval.recording.as_str(), interval.channel.as_str()), ("run3", "s4"));
        let (first, last) = interval.samples;
        assert!(first <= faulty.start && last + 1 >= faulty.end, "{interval:?}");
        let found_from = found.module.channels[3].smallest_found;
        assert!(found_from < 1.1 * clean.channels[3].smallest_found, "{found_from}");
    }
}

/// The structure is unloaded most of the time: loads that are rare are no faults.
#[test]
fn loads_that_are_rare_are_learnt() {
    let recordings: Vec<HealthyRecording> = (1..=3)
        .map(|seed| {
            let mut generator = ChaCha8Rng::seed_from_u64(seed);
            let mut channels = vec![Vec::new(); CHANNELS];
            for second in 0..3600 {
                // A vehicle of 12 s every 200 s, each of another weight.
                let weight = 20.0 + f64::from((second / 200 * 37 + seed as u32 * 11) % 80);
                let along = std::f64::consts::PI * f64::from(second % 200) / 12.0;
                let load = if second % 200 < 12 { weight * along.sin() } else { 0.0 };
                for (k, channel) in channels.iter_mut().enumerate() {
                    let noise: f64 = StandardNormal.sample(&mut generator);
                    let share = [1.0, -0.6, 0.4, 2.0, 1.5, -1.0, 0.8, 1.0, 0.5][k];
                    channel.push(share * (load + 1e-3 * load * load) + 0.1 * noise);
                }
            }
            HealthyRecording { name: format!("day{seed}"), step_s: 1.0, channels }
        })
        .collect();
    assert_eq!(learnt(&recordings).cleaned, []);
}

/// Readings of ten minutes, as a building's or a turbine's data acquisition keeps them.
#[test]
fn samples_farther_apart_than_a_window_are_windows() {
    let at = |step_s: f64, window_s: f64, alarms_per_hour: f64| {
        let slow = |one: HealthyRecording| HealthyRecording { step_s, ..one };
        let recordings: Vec<HealthyRecording> = healthy().into_iter().map(slow).collect();
        let settings = LearningSettings { window_s, alarms_per_hour };
        learn(&recordings, &names(), SENSORS, settings).unwrap().module
    };
    let slow = at(600.0, 1.0, 0.01);
    assert_eq!(slow.window_s, 600.0);
    let samples = 4 * 24 * MINUTE;
    assert!((slow.hours / (samples as f64 / 6.0) - 1.0).abs() < 0.01, "{}", slow.hours);
    // False alarms are counted in hours, however long a window: ten times shorter ones ten times as often.
    let (rare, as_rare) = (at(600.0, 600.0, 1e-8), at(60.0, 60.0, 1e-7));
    assert!(rare.reference_threshold > 5.0, "{}", rare.reference_threshold);
    assert!((rare.reference_threshold / as_rare.reference_threshold - 1.0).abs() < 1e-12);
    assert_eq!(slow.check_step(600.1), Ok(()));
    let error = slow.check_step(3600.0).unwrap_err();
    assert!(error.starts_with("samples are 3600 s apart, but the module compares"), "{error}");
}

#[test]
fn what_cannot_be_learnt_is_refused_with_its_name() {
    let refused = |change: &dyn Fn(&mut HealthyRecording)| {
        let mut recordings = healthy();
        recordings.iter_mut().for_each(change);
        learn(&recordings, &names(), SENSORS, LearningSettings::default()).unwrap_err()
    };
    let mut noise = ChaCha8Rng::seed_from_u64(1);
    let still: Vec<f64> = (0..24 * MINUTE).map(|_| 5.0 + noise.random::<f64>()).collect();
    let error = refused(&|r| r.channels[8] = still.clone());
    assert_eq!(error, LearningError::InputStill("u2".into()));
    assert_eq!(refused(&|r| r.channels[1].fill(3.0)), LearningError::SensorStill("s2".into()));
    let error = refused(&|r| r.channels[4] = r.channels[2].iter().map(|x| 2.0 * x + 1.0).collect());
    assert_eq!(error, LearningError::Repeats("s5".into(), "s3".into()));
    let error = refused(&|r| r.channels.iter_mut().for_each(|c| c.truncate(100)));
    assert!(matches!(error, LearningError::TooShort { .. }), "{error}");
}

/// So many channels that follow a few causes, with a zero of each recording; the first half are sensors.
fn of_many_channels(seed: u64, channels: usize, windows: usize) -> HealthyRecording {
    let mut generator = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut generator) };
    let level = [normal(), normal(), normal(), normal()];
    let mut causes = [0.0; 4];
    let mut wander: Vec<f64> = (0..channels).map(|_| 0.02 * normal()).collect();
    let mut readings = vec![Vec::new(); channels];
    for _ in 0..windows {
        causes.iter_mut().for_each(|cause| *cause = 0.9 * *cause + 0.2 * normal());
        for (k, channel) in readings.iter_mut().enumerate() {
            let of_causes =
                (0..4).map(|c| (level[c] + causes[c]) * ((3 * k + c * c + 1) as f64).sin());
            wander[k] += 0.005 * normal();
            channel.push(of_causes.sum::<f64>() + wander[k] + 0.02 * normal());
        }
    }
    HealthyRecording { name: format!("run{seed}"), step_s: 1.0, channels: readings }
}

/// With few windows for the channels a fit follows each window, and what it has not seen it misses by far.
#[test]
fn healthy_recordings_of_few_windows_and_many_channels_are_no_faulty_ones() {
    const MANY: usize = 32;
    let names: Vec<String> = (0..MANY).map(|k| format!("c{k}")).collect();
    let learn = |recordings: &[HealthyRecording]| {
        learn(recordings, &names, MANY / 2, LearningSettings::default())
    };
    let (mut alarms, mut judged_s) = (0, 0.0);
    for set in 0..5 {
        let recordings: Vec<_> =
            (0..20).map(|k| of_many_channels(100 * set + k, MANY, 40)).collect();
        let found = learn(&recordings).unwrap();
        assert_eq!(found.cleaned, [], "set {set}");
        for other in 20..60 {
            let (verdicts, _) =
                judged(&found.module, &of_many_channels(100 * set + other, MANY, 40));
            alarms += named(&verdicts, ChannelState::Faulty).len();
            judged_s += 40.0;
        }
        // A fault in as short a recording is told.
        let mut broken = recordings;
        broken[3].channels[20][17] += 1.0;
        let Err(error) = learn(&broken) else { panic!("set {set}") };
        let LearningError::Unclean { recording, channel, .. } = &error else { panic!("{error}") };
        assert_eq!((recording, channel), (&broken[3].name, &names[20]));
    }
    assert_eq!(alarms, 0, "in {judged_s} s");
    let few: Vec<_> = (0..2).map(|k| of_many_channels(k, MANY, 40)).collect();
    let error = learn(&few).unwrap_err().to_string();
    let said = "2 recordings have together 80 complete windows of 1 s; 32 channels need at least 96: use longer \
                recordings or more of them, or at most 26 channels";
    assert_eq!(error, said);
}

#[test]
fn few_recordings_teach_a_blunter_module() {
    for count in [1, 2] {
        let module = learnt(&healthy()[..count]).module;
        assert!(module.reference_threshold >= 6.0);
        let (verdicts, _) = judged(&module, &recording(80, 24, 90.0));
        assert_eq!(named(&verdicts, ChannelState::Faulty), [0; 0], "{count}: {verdicts:#?}");
    }
}

/// A learned module's diagnoser, and what it publishes.
#[derive(Clone)]
struct Live {
    diagnoser: Diagnoser,
    actions: Vec<Action>,
}

impl Live {
    fn setup(module: LearnedModule) -> ModuleSetup {
        let (structure, span) = ("bridge".parse().unwrap(), fixture::name("span"));
        let (learned, thresholds) = (Some(Arc::new(module)), vec![1.0; CHANNELS]);
        let setup = ModuleSetup::of_readings(structure, span, STEP_S);
        ModuleSetup { learned, thresholds, ..setup }
    }

    fn new(module: LearnedModule) -> Self {
        let diagnoser = Diagnoser::new(Self::setup(module)).unwrap();
        Self { diagnoser, actions: Vec::new() }
    }

    /// Takes samples of a recording.
    fn take(&mut self, recording: &HealthyRecording, samples: std::ops::Range<usize>) {
        for sample in samples {
            let measurements = Measurements {
                run: RunId(1),
                step: Step(1000 + sample as u64),
                demands_n: vec![],
                pressures_pa: vec![],
                elongations_m: recording.channels.iter().map(|channel| channel[sample]).collect(),
            };
            self.diagnoser.handle(Event::Sample(measurements), &mut self.actions);
        }
    }

    fn transitions(&self) -> Vec<&Transition> {
        let published = self.actions.iter().filter_map(|action| match action {
            Action::Publish(transition) => Some(transition),
            _ => None,
        });
        published.collect()
    }

    fn identifications(&self) -> Vec<IdentificationResult> {
        let requested = self.actions.iter().filter_map(|action| match action {
            Action::Identify(excerpt) => Some(identify(excerpt, None)),
            _ => None,
        });
        requested.collect()
    }

    fn condition(&self, channel: usize) -> &Condition {
        self.diagnoser.conditions().nth(channel).unwrap()
    }

    /// Commands something of a component: is it carried out?
    fn order(&mut self, component: &str, kind: GivenOrderKind) -> bool {
        let order = GivenOrder { kind, by: "ada".into(), on_behalf_of: None, note: None };
        let (token, component) = (OrderToken(1), component.parse().unwrap());
        self.diagnoser.handle(Event::Ordered { token, component, order }, &mut self.actions);
        matches!(self.actions.last(), Some(Action::Obeyed { .. }))
    }
}

/// Readings in which one channel has a bias for five minutes, then no value for two.
fn troubled() -> HealthyRecording {
    let mut troubled = recording(31, 24, 95.0);
    for value in &mut troubled.channels[2][8 * MINUTE..13 * MINUTE] {
        *value += 30.0;
    }
    troubled.channels[4][18 * MINUTE..20 * MINUTE].fill(f64::NAN);
    troubled
}

#[test]
fn a_learned_module_latches_what_it_finds_at_once_and_follows_commands() {
    let mut live = Live::new(learnt(&healthy()).module);
    let troubled = troubled();
    let onset = 8 * MINUTE;
    live.take(&troubled, 0..onset);
    assert_eq!(live.diagnoser.phase(), ModulePhase::InService);
    assert_eq!(live.transitions(), Vec::<&Transition>::new());
    assert!(matches!(live.condition(2), Condition::Agrees { .. }), "{:?}", live.condition(2));
    live.take(&troubled, onset..onset + 5 * 5);
    let [latched] = live.transitions()[..] else { panic!("{:?}", live.transitions()) };
    assert_eq!(latched.component.to_string(), "sensor/s3");
    assert_eq!((&latched.verdict, latched.symptom), (&Verdict::Latched, Symptom::Reading));
    let (began, found) = (latched.onset.0, latched.detection.0);
    assert!(began.abs_diff(1000 + onset as u64) <= 5 && found > began, "{latched:?}");
    assert!((latched.evidence.residual - 30.0).abs() < 6.0, "{latched:?}");
    assert!(!latched.before_service && latched.evidence.ratio() > 1.0, "{latched:?}");
    assert!(matches!(live.condition(2), Condition::Departed { .. }));
    assert!(live.order("sensor/s3", GivenOrderKind::Acknowledge));
    assert!(!live.order("sensor/s3", GivenOrderKind::Reset { force: false }), "it still departs");
    live.take(&troubled, onset + 5 * 5..17 * MINUTE);
    assert!(matches!(live.condition(2), Condition::Agrees { .. }));
    assert!(live.order("sensor/s3", GivenOrderKind::Reset { force: false }));
    live.take(&troubled, 17 * MINUTE..19 * MINUTE);
    let lost = live.transitions().last().copied().unwrap().clone();
    assert_eq!(
        (lost.component.to_string().as_str(), lost.symptom),
        ("sensor/s5", Symptom::NoSignal)
    );
    assert_eq!(live.condition(4), &Condition::CannotTell { obstacle: Obstacle::NoSignal });
    live.take(&troubled, 19 * MINUTE..24 * MINUTE);
    let story: Vec<_> = live.transitions().iter().map(|t| t.verdict.as_str()).collect();
    assert_eq!(story, ["latched", "acknowledged", "normal", "latched"]);
    assert!(matches!(live.condition(4), Condition::Agrees { .. }), "{:?}", live.condition(4));
}

/// As `detect` says of a recording that ends there.
#[test]
fn a_learned_module_identifies_what_it_latches() {
    let module = learnt(&healthy()).module;
    let (onset, rate) = (8 * MINUTE, 0.02);
    let drifting = |mut one: HealthyRecording| {
        for (k, value) in one.channels[2].iter_mut().skip(onset).enumerate() {
            *value += rate * k as f64;
        }
        one
    };
    let stuck = |mut one: HealthyRecording| {
        one.channels[2][onset..].fill(20.0);
        one
    };
    let healthy = recording(31, 24, 95.0);
    let per_s = rate / STEP_S;
    for (broken, kind, size) in [
        (troubled(), FaultKind::Bias, Some(30.0)),
        (drifting(healthy.clone()), FaultKind::Drift, Some(per_s)),
        (stuck(healthy), FaultKind::Stuck, None),
    ] {
        let mut live = Live::new(module.clone());
        live.take(&broken, 0..12 * MINUTE);
        let found = live.identifications();
        let latched = live.transitions()[0].clone();
        let own: Vec<_> = found.iter().filter(|f| f.component == latched.component).collect();
        assert!(own.len() > 5, "{kind}: {own:?}");
        assert!(own.iter().all(|found| found.sequence == latched.sequence));
        assert!(own[0].as_of.0 <= latched.decided.0 + 10, "{:?} {latched:?}", own[0]);
        let last = own.last().unwrap();
        let [candidate] = last.candidates[..] else { panic!("{last:?}") };
        assert_eq!(
            (candidate.kind, candidate.size.is_some()),
            (kind.into(), size.is_some()),
            "{last:?}"
        );
        if let (Some(found), Some(size)) = (candidate.size, size) {
            assert!(found.own_unit && found.low < size && size < found.high, "{kind}: {found:?}");
        }
        let detected = |until: usize| {
            let mut of = broken.clone();
            of.channels.iter_mut().for_each(|channel| channel.truncate(until));
            judged(&module, &of)
                .0
                .into_iter()
                .find_map(|v| v.fault.filter(|_| v.channel == Some(2)))
        };
        let fault = detected((last.as_of.0 - 1000) as usize + 1).unwrap();
        assert_eq!((fault.kind, fault.decided), (kind, last.decided().is_some()), "{fault:?}");
        assert!(candidate.size.is_none_or(|size| size == fault.size), "{fault:?} {last:?}");
    }
    let mut live = Live::new(module);
    live.take(&troubled(), 0..19 * MINUTE);
    let lost = live.identifications().into_iter().next_back().unwrap();
    assert_eq!(lost.component.to_string(), "sensor/s5");
    assert_eq!(lost.candidates[0].kind, FaultKind::NoSignal.into());
}

#[test]
fn a_gap_in_the_samples_of_a_learned_module_is_no_loss_of_a_signal() {
    let mut live = Live::new(learnt(&healthy()).module);
    let quiet = recording(12, 24, 95.0);
    live.take(&quiet, 0..4 * MINUTE);
    for (from, missing) in [(4, 1), (5, 7), (6, 40)] {
        live.take(&quiet, from * MINUTE + missing..(from + 1) * MINUTE);
    }
    // So long a gap is a jump of the steps; the second sample behind it is taken.
    live.take(&quiet, 10 * MINUTE..24 * MINUTE);
    assert_eq!(live.transitions(), Vec::<&Transition>::new());
    assert!(live.diagnoser.counters().samples_missing > 200);
    let beyond = recording(12, 24, 260.0);
    let mut live = Live::new(learnt(&healthy()).module);
    live.take(&beyond, 0..12 * MINUTE);
    let unseen = Condition::CannotTell { obstacle: Obstacle::UnseenLoads };
    assert!(live.diagnoser.conditions().any(|one| *one == unseen), "{:?}", live.condition(0));
}

#[test]
fn a_learned_module_s_setup_and_state_come_back_as_the_same_bits() {
    let module = learnt(&healthy()).module;
    let setup = Live::setup(module.clone());
    let speaker = Speaker::of("bridge".parse().unwrap(), setup.module.clone());
    let message = speaker.configuration(&setup, "0", "t", 1).unwrap();
    let text = serde_json::to_string(&message).unwrap();
    let back = to_setup(&serde_json::from_str(&text).unwrap()).unwrap();
    assert_eq!(setup_fingerprint(&back).unwrap(), message.fingerprint);
    assert_eq!(back.learned.as_deref(), Some(&module));
    let (mut live, troubled) = (Live::new(module), troubled());
    live.take(&troubled, 0..8 * MINUTE + 9);
    let software = env!("CARGO_PKG_VERSION").to_owned();
    let about = StatePart { software, ..StatePart::default() };
    let parts = from_diagnoser(&live.diagnoser, &about);
    let diagnoser = to_diagnoser(&parts.iter().collect::<Vec<_>>()).unwrap();
    let mut restored = Live { diagnoser, actions: live.actions.clone() };
    for one in [&mut live, &mut restored] {
        one.take(&troubled, 8 * MINUTE + 9..24 * MINUTE);
    }
    assert!(live.transitions().len() >= 2);
    assert_eq!(live.actions, restored.actions);
    assert_eq!(live.diagnoser.evidence(), restored.diagnoser.evidence());
}
