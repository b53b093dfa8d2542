//! A module that is compared with its reference: what was wrong before anybody looked is found, nothing is called healthy
//! that has not been compared, and orders go by the reference.

use std::sync::{Arc, LazyLock};

use crate::fixture::{self, Bench, quiet, setup, unchanged_since};
use diagnosis::state::{
    Condition, CylinderMeans, GageMeans, Gaussian, Reference, ReferenceProblem, Snippet,
    WindowLength, WindowMeans, commission,
};
use diagnosis::{
    Action, Diagnoser, Doubt, Event, GivenOrder, GivenOrderKind, ModuleSetup, OrderRefusal,
    OrderToken, PeerFailure, Rule, SetupError, StateAnswer, StateQuestion, Symptom, Verdict,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vocabulary::Step;

/// The models have settled and the channels are watched.
const SETTLED: u64 = 4000;
const BIAS_M: f64 = 30e-6;

fn alone() -> ModuleSetup {
    ModuleSetup { peers: Vec::new(), ..setup("lower", Rule::FirstChange) }
}

/// The module under forces that differ from snippet to snippet.
fn snippets(setup: &ModuleSetup, count: u64) -> Vec<Snippet> {
    let setup = ModuleSetup { thresholds: vec![f64::MAX; setup.thresholds.len()], ..setup.clone() };
    let mut generator = ChaCha8Rng::seed_from_u64(5);
    let mut snippet = |seed: u64| {
        let mut bench = Bench::of(setup.clone());
        bench.signals.random_from(seed);
        for offset in &mut bench.signals.pressure_offsets {
            *offset = 2e5 * (generator.random::<f64>() - 0.5);
        }
        let mut windows = Vec::new();
        for step in 0..SETTLED + 3000 {
            bench.run(1);
            if step >= SETTLED {
                let lengths = WindowLength::ALL.into_iter();
                windows.extend(lengths.filter_map(|l| bench.diagnoser.window(l)).cloned());
            }
        }
        Snippet { label: format!("seed {seed}"), modules: vec![windows] }
    };
    (100..100 + count).map(&mut snippet).collect()
}

fn reference() -> Arc<Reference> {
    static REFERENCE: LazyLock<Arc<Reference>> = LazyLock::new(|| {
        let setup = alone();
        Arc::new(commission(std::slice::from_ref(&setup), 0, &snippets(&setup, 40), 0.001).unwrap())
    });
    Arc::clone(&REFERENCE)
}

fn commissioned() -> Bench {
    Bench::of(ModuleSetup { reference: Some(reference()), ..alone() })
}

fn condition(bench: &Bench, component: &str) -> Condition {
    let place = bench.diagnoser.components().iter().position(|own| own.to_string() == component);
    bench.diagnoser.conditions().nth(place.unwrap()).unwrap().clone()
}

fn order(bench: &mut Bench, kind: GivenOrderKind) -> Result<u64, OrderRefusal> {
    let order = GivenOrder { kind, by: "ada".into(), on_behalf_of: None, note: None };
    let component = "sensor/g1".parse().unwrap();
    bench.give(Event::Ordered { token: OrderToken(7), component, order });
    match bench.actions.last().unwrap() {
        Action::Obeyed { sequence, .. } => Ok(*sequence),
        Action::OrderRefused { refusal, .. } => Err(refusal.clone()),
        other => panic!("{other:?}"),
    }
}

#[test]
fn without_a_reference_nothing_is_verified() {
    let mut bench = Bench::of(alone());
    bench.run(SETTLED);
    assert!(bench.diagnoser.conditions().all(|known| *known == Condition::NotVerified));
}

#[test]
fn what_is_healthy_agrees_once_it_has_been_compared_and_as_of_when() {
    let mut bench = commissioned();
    bench.run(400);
    assert!(bench.diagnoser.conditions().all(|known| *known == Condition::NotCompared));
    bench.run(SETTLED - 400);
    let agrees = Condition::Agrees { from: Step(SETTLED - 1000), as_of: Step(SETTLED - 1) };
    assert!(bench.diagnoser.conditions().all(|known| *known == agrees));
    bench.run(20_000);
    assert!(bench.transitions().is_empty(), "{:?}", bench.transitions());
}

#[test]
fn what_is_not_compared_any_more_does_not_agree() {
    let mut bench = commissioned();
    bench.run(SETTLED);
    for step in 0..4000 {
        let sample = bench.signals.sample();
        if step % 5 != 0 || (step + 1) % 1000 == 0 {
            bench.give(Event::Sample(sample));
        }
    }
    assert_eq!(condition(&bench, "sensor/g1"), Condition::NotCompared);
    assert_eq!(bench.latched(), [""; 0]);
    bench.run(SETTLED);
    assert!(matches!(condition(&bench, "sensor/g1"), Condition::Agrees { .. }));
}

#[test]
fn what_was_wrong_before_service_is_found() {
    let mut bench = commissioned();
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(SETTLED + 2000);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    let found = bench.transitions()[0].clone();
    assert_eq!((found.symptom, found.before_service), (Symptom::Departure, true));
    let size = found.evidence.residual - found.evidence.level;
    assert!((size - BIAS_M).abs() < 0.1 * BIAS_M, "{size}");
    assert!(matches!(condition(&bench, "sensor/g1"), Condition::Departed { .. }));
}

#[test]
fn what_happens_unseen_is_found_with_the_time_since_when() {
    let mut bench = commissioned();
    bench.run(SETTLED);
    for _ in 0..600 {
        bench.signals.sample();
    }
    bench.signals.gage_offsets[1] = -BIAS_M;
    bench.run(SETTLED + 3000);
    assert_eq!(bench.latched(), ["sensor/g2"]);
    let found = bench.transitions().into_iter().find(|t| t.verdict == Verdict::Latched).unwrap();
    assert_eq!((found.symptom, found.before_service), (Symptom::Departure, false));
    assert_eq!(found.onset, Step(SETTLED), "it agreed until then");
}

#[test]
fn a_creeping_gage_is_found() {
    let mut bench = commissioned();
    bench.run(SETTLED);
    for _ in 0..40_000 {
        bench.signals.gage_offsets[0] += 1e-9;
        bench.run(1);
    }
    assert_eq!(bench.latched(), ["sensor/g1"]);
    assert_eq!(bench.transitions().len(), 1, "{:?}", bench.transitions());
}

#[test]
fn a_component_is_found_when_its_share_of_the_limit_reaches_one() {
    let mut bench = commissioned();
    bench.run(SETTLED);
    let share = |bench: &Bench| {
        let components = bench.diagnoser.components().iter();
        let place = components.map(ToString::to_string).position(|own| own == "sensor/g1");
        bench.diagnoser.margins(place.unwrap()).departure
    };
    let (mut largest, mut before) = (0.0_f64, Vec::new());
    while bench.latched().is_empty() {
        for _ in 0..1000 {
            bench.signals.gage_offsets[0] -= 2e-11;
            bench.run(1);
        }
        if bench.latched().is_empty() {
            let share = share(&bench).unwrap();
            largest = largest.min(share);
            before.push(share);
        }
        assert!(before.len() < 100);
    }
    // It is negative, as the gage reads too little, and grows. Two windows have to depart.
    assert!((-1.3..-0.8).contains(&largest), "{before:?}");
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let (first, second) = before.split_at(before.len() / 2);
    assert!(mean(second) < mean(first) - 0.2, "{before:?}");
    // What is known to be faulty is at no distance from a limit.
    bench.run(2000);
    assert_eq!(share(&bench), None);
    for channel in 0..bench.diagnoser.components().len() {
        let margins = bench.diagnoser.margins(channel);
        for (test, share) in margins.shares() {
            assert!(share.is_none_or(|share| share.abs() < 1.0), "{} {test}", margins.component);
        }
    }
}

#[test]
fn a_cylinder_that_loses_oil_is_found_though_its_force_is_right() {
    let mut bench = commissioned();
    for _ in 0..SETTLED + 2000 {
        let mut sample = bench.signals.sample();
        // 30 bar less in A, and as much less in B as leaves the force what it was.
        sample.pressures_pa[0][0] -= 30e5;
        sample.pressures_pa[0][1] -= 30e5 * 1.3273 / 0.9425;
        bench.give(Event::Sample(sample));
    }
    assert_eq!(bench.latched(), ["actuator/a1"]);
    assert_eq!(bench.transitions()[0].symptom, Symptom::OilContent);
}

#[test]
fn a_frozen_gage_is_found_by_its_noise() {
    let mut bench = commissioned();
    bench.run(SETTLED);
    for _ in 0..3000 {
        let mut sample = bench.signals.sample();
        sample.elongations_m[0] = 0.0;
        bench.give(Event::Sample(sample));
    }
    assert_eq!(bench.latched(), ["sensor/g1"]);
}

#[test]
fn a_reset_goes_by_the_reference_and_a_new_gage_is_re_tared() {
    let mut bench = commissioned();
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(SETTLED + 2000);
    order(&mut bench, GivenOrderKind::Acknowledge).unwrap();
    let refused = order(&mut bench, GivenOrderKind::Reset { force: false });
    let Err(OrderRefusal::StillDeparted { how: Some(how), .. }) = refused else {
        panic!("{refused:?}")
    };
    let by = how.strip_prefix("its mean by +").and_then(|by| by.strip_suffix(" µm"));
    let by_m = 1e-6 * by.unwrap().parse::<f64>().unwrap();
    assert!((by_m - BIAS_M).abs() < 0.1 * BIAS_M, "{how}");
    order(&mut bench, GivenOrderKind::ReTare).unwrap();
    let tare = bench.transitions().last().unwrap().tare.unwrap();
    assert!((tare - BIAS_M).abs() < 0.1 * BIAS_M, "{tare}");
    bench.run(SETTLED);
    assert!(matches!(condition(&bench, "sensor/g1"), Condition::Agrees { .. }));
    assert_eq!(bench.latched(), [""; 0]);
    let mut restarted = bench.restarted();
    restarted.signals.gage_offsets[0] = BIAS_M;
    restarted.run(SETTLED + 2000);
    assert_eq!(restarted.latched(), [""; 0], "the tare outlives the process");
    bench.signals.gage_offsets[0] = 0.0;
    bench.run(SETTLED + 3000);
    assert_eq!(bench.latched(), ["sensor/g1"], "the old place is wrong now");
}

#[test]
fn a_repaired_fault_stays_latched_and_is_seen_to_have_returned() {
    let mut bench = commissioned();
    bench.run(SETTLED);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(3000);
    assert!(matches!(condition(&bench, "sensor/g1"), Condition::Departed { .. }));
    bench.signals.gage_offsets[0] = 0.0;
    bench.run(3000);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    assert!(matches!(condition(&bench, "sensor/g1"), Condition::Agrees { .. }));
}

#[test]
fn as_soon_as_a_repaired_fault_is_said_to_agree_it_can_be_reset() {
    for broken in [1500, 1900, 2300] {
        let mut bench = commissioned();
        bench.run(SETTLED);
        bench.signals.gage_offsets[0] = BIAS_M;
        bench.run(broken);
        order(&mut bench, GivenOrderKind::Acknowledge).unwrap();
        bench.signals.gage_offsets[0] = 0.0;
        let agrees = |bench: &mut Bench| {
            bench.run(1);
            matches!(condition(bench, "sensor/g1"), Condition::Agrees { .. })
        };
        assert!((0..4000).any(|_| agrees(&mut bench)));
        order(&mut bench, GivenOrderKind::Reset { force: false }).unwrap();
    }
}

#[test]
fn a_force_beyond_what_was_seen_makes_the_gages_unknown_and_none_faulty() {
    let mut bench = commissioned();
    for offset in &mut bench.signals.pressure_offsets {
        *offset = 5e6;
    }
    bench.run(SETTLED + 2000);
    assert!(matches!(condition(&bench, "sensor/g1"), Condition::CannotTell { .. }));
    let gages = bench.latched().into_iter().filter(|name| name.starts_with("sensor"));
    assert_eq!(gages.count(), 0);
}

/// As if the peer measured the same, without any correlation with this module, which has so many gages.
fn with_uncorrelated_peer(own: &Gaussian, gages: usize) -> Gaussian {
    let (own_gages, own_forces) = ((0..gages).map(Some), (gages..own.mean.len()).map(Some));
    let of_peer = |count| std::iter::repeat_n(None, count);
    let order: Vec<Option<usize>> = own_gages
        .chain(of_peer(gages))
        .chain(own_forces)
        .chain(of_peer(own.mean.len() - gages))
        .collect();
    let all = |values: &[f64]| -> Vec<f64> {
        let value = |(k, of): (usize, &Option<usize>)| values[of.unwrap_or(k % values.len())];
        order.iter().enumerate().map(value).collect()
    };
    let correlation = |a: usize, b: usize| match (order[a], order[b]) {
        (Some(a), Some(b)) => own.correlations[a.max(b)][a.min(b)],
        _ => 0.0,
    };
    Gaussian {
        snippets: own.snippets,
        mean: all(&own.mean),
        deviation: all(&own.deviation),
        correlations: (0..order.len())
            .map(|a| (0..a).map(|b| correlation(a, b)).collect())
            .collect(),
    }
}

/// A module with a peer that moves by itself.
fn reference_with_peer() -> Reference {
    let mut reference = Reference::clone(&reference());
    let (own, peer) = (alone().module, fixture::name("upper"));
    let add = |path: &vocabulary::ComponentPath| vocabulary::ComponentPath {
        module: peer.clone(),
        component: path.component.clone(),
    };
    let gages: Vec<_> = reference.gages.iter().map(add).collect();
    let forces: Vec<_> = reference.forces.clone();
    assert!(reference.gages.iter().all(|path| path.module == own));
    let Reference { short, long, moving, .. } = &mut reference;
    for means in [&mut short.means, &mut long.means, moving] {
        *means = with_uncorrelated_peer(means, gages.len());
    }
    reference.gages.extend(gages);
    reference.forces.extend(
        forces
            .into_iter()
            .map(|force| diagnosis::state::ForceRange { actuator: add(&force.actuator), ..force }),
    );
    reference
}

fn with_peer() -> Bench {
    with_reference(reference_with_peer())
}

fn with_reference(reference: Reference) -> Bench {
    let reference = Some(Arc::new(reference));
    Bench::of(ModuleSetup { reference, ..setup("lower", Rule::FirstChange) })
}

/// An answer with such a window of the peer.
fn answer(question: StateQuestion, window: WindowMeans) -> Event {
    Event::Answered(StateAnswer { window: Some(window), ..unchanged_since(Step(0), question) })
}

#[test]
fn peers_are_asked_only_when_something_may_be_wrong_and_a_silent_one_stops_nothing() {
    let mut bench = with_peer();
    bench.run(SETTLED);
    // What the models made of their start does not count.
    bench.actions.clear();
    bench.run(7000);
    let asked: Vec<u64> = bench.questions().iter().map(|(_, question)| question.as_of.0).collect();
    assert_eq!(asked, [4999, 9999], "every fifth window");
    let mut bench = with_peer();
    bench.signals.gage_offsets[0] = BIAS_M;
    while bench.signals.step.0 < SETTLED + 3000 {
        bench.run(1);
        for (peer, question) in bench.questions() {
            assert!(question.window.is_some());
            let failure = PeerFailure::TimedOut;
            bench.actions.retain(|action| !matches!(action, Action::Ask { .. }));
            bench.give(Event::Unanswered { peer, question, failure });
        }
    }
    assert_eq!(bench.latched(), ["sensor/g1"]);
}

#[test]
fn a_window_that_does_not_fit_counts_as_none_and_is_counted() {
    let mut bench = with_peer();
    bench.signals.gage_offsets[0] = BIAS_M;
    let reference = reference_with_peer();
    let (gages, cylinders) = (reference.gages.len() / 2, reference.forces.len() / 2);
    let gage = GageMeans { residual_m: f64::MAX, scatter_m2: 0.0, swing_m2: 0.0 };
    let (mut asked, mut rejected) = (0, 0);
    while bench.signals.step.0 < SETTLED + 3000 {
        bench.run(1);
        for (_, question) in bench.questions() {
            bench.actions.clear();
            let length = question.window.unwrap();
            let window = WindowMeans {
                length,
                until: question.as_of,
                gages: vec![Some(gage); gages],
                cylinders: vec![None; cylinders],
            };
            let other = WindowLength::ALL.into_iter().find(|other| *other != length).unwrap();
            let lies = [
                WindowMeans { gages: vec![Some(gage); 99], ..window.clone() },
                WindowMeans { until: question.as_of.minus(1), ..window.clone() },
                WindowMeans { length: other, ..window },
            ];
            bench.give(answer(question, lies[asked % lies.len()].clone()));
            asked += 1;
            let is_rejection = |action: &&Action| matches!(action, Action::AnswerRejected { .. });
            rejected += bench.actions.iter().filter(is_rejection).count();
        }
    }
    assert!(asked > 2);
    assert_eq!(rejected, asked);
    assert_eq!(bench.diagnoser.counters().answers_malformed, asked as u64);
    assert_eq!(bench.latched(), ["sensor/g1"], "what it measures itself is enough");
}

/// By itself the module knows its first gage to 0.1 mm; the peer's first gage tells where it is to half a micrometre.
#[test]
fn what_only_a_peer_can_tell_is_found_and_does_not_pass_for_healthy() {
    let mut reference = reference_with_peer();
    let peer_gage = reference.gages.len() / 2;
    let Gaussian { correlations, deviation, mean, .. } = &mut reference.long.means;
    correlations.iter_mut().for_each(|row| row.fill(0.0));
    correlations[peer_gage][0] = 0.999_99;
    deviation[0] = 100e-6;
    let (gages, mean) = (mean[peer_gage..2 * peer_gage].to_vec(), mean.clone());
    let bench_with = |bias_m: f64| {
        let mut bench = with_reference(reference.clone());
        bench.signals.gage_offsets[0] = bias_m;
        while bench.signals.step.0 < SETTLED + 8000 {
            bench.run(1);
            for (_, question) in bench.questions() {
                bench.actions.retain(|action| !matches!(action, Action::Ask { .. }));
                let gage = |residual_m: &f64| {
                    Some(GageMeans { residual_m: *residual_m, scatter_m2: 0.0, swing_m2: 0.0 })
                };
                let force = |force_n: &f64| {
                    let (rate_n_per_s, tracking_n, content_pa) = (0.0, 0.0, 0.0);
                    let force_n = *force_n;
                    Some(CylinderMeans { force_n, rate_n_per_s, tracking_n, content_pa })
                };
                let forces = &mean[mean.len() - reference.forces.len() / 2..];
                let window = WindowMeans {
                    length: question.window.unwrap(),
                    until: question.as_of,
                    gages: gages.iter().map(gage).collect(),
                    cylinders: forces.iter().map(force).collect(),
                };
                bench.give(answer(question, window));
            }
        }
        bench
    };
    assert_eq!(bench_with(0.0).latched(), [""; 0]);
    assert_eq!(bench_with(BIAS_M).latched(), ["sensor/g1"]);
}

#[test]
fn a_reference_of_other_settings_is_refused_and_named() {
    let refused = |change: fn(&mut ModuleSetup)| {
        let mut setup = ModuleSetup { reference: Some(reference()), ..alone() };
        change(&mut setup);
        let problems = Diagnoser::new(setup).unwrap_err();
        assert!(
            problems.iter().all(|problem| matches!(problem, SetupError::Reference(_))),
            "{problems:?}"
        );
        problems.len()
    };
    assert_eq!(refused(|setup| setup.hydraulics.as_mut().unwrap().volume_a_m3 *= 1.01), 1);
    assert_eq!(refused(|setup| setup.step_s = 2e-3), 1);
    let mut other = Reference::clone(&reference());
    other.version = 99;
    assert_eq!(other.problems(&alone()), [ReferenceProblem::Version(99)]);
    let mut broken = Reference::clone(&reference());
    broken.long.means.deviation[0] = f64::NAN;
    let wanted = "long: `means.deviation` is NaN; use a finite number above 0: commission again";
    let said: Vec<String> = broken.problems(&alone()).iter().map(ToString::to_string).collect();
    assert_eq!(said, [wanted]);
}

#[test]
fn too_few_snippets_are_refused_with_the_number_needed() {
    let setup = alone();
    let error =
        commission(std::slice::from_ref(&setup), 0, &snippets(&setup, 5), 0.001).unwrap_err();
    assert!(error.to_string().contains("give at least"), "{error}");
}

/// As if gages 1 and 2 always moved alike, five times as far as the bias, and nothing else knew of them.
fn two_alike() -> Arc<Reference> {
    let mut reference = Reference::clone(&reference());
    for means in [&mut reference.short.means, &mut reference.long.means] {
        for (a, row) in means.correlations.iter_mut().enumerate() {
            row.fill(0.0);
            if a == 1 {
                row[0] = 0.999_999;
            }
        }
        means.deviation[..2].fill(5.0 * BIAS_M);
    }
    Arc::new(reference)
}

/// Both of two suspects are named, and neither is called faulty.
#[test]
fn what_cannot_be_told_apart_is_one_of_several() {
    let mut bench = Bench::of(ModuleSetup { reference: Some(two_alike()), ..alone() });
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(SETTLED + 3000);
    for gage in ["sensor/g1", "sensor/g2"] {
        let verdict = bench.verdict(gage);
        let Verdict::Unconfirmed { doubt: Doubt::OneOf(suspects) } = verdict else {
            panic!("{gage}: {verdict:?}")
        };
        assert_eq!(suspects.len(), 2);
    }
}

/// What departs is known now, though no window follows that says so: samples may have stopped.
#[test]
fn once_one_of_several_suspects_is_known_to_be_faulty_the_others_are_none() {
    let setup = setup("lower", Rule::FirstChange);
    let mut bench = Bench::of(ModuleSetup { reference: Some(two_alike()), ..setup });
    bench.run(SETTLED);
    bench.actions.clear();
    bench.signals.gage_offsets[0] = BIAS_M;
    let mut asked_of_change = None;
    while !matches!(bench.verdict("sensor/g2"), Verdict::Unconfirmed { .. }) {
        bench.run(1);
        assert!(bench.now() < Step(SETTLED + 3000), "the other gage has never been a suspect");
        for (peer, question) in bench.questions() {
            bench.actions.retain(|action| !matches!(action, Action::Ask { .. }));
            if question.window.is_none() {
                asked_of_change = Some(question);
                continue;
            }
            let failure = PeerFailure::TimedOut;
            bench.give(Event::Unanswered { peer, question, failure });
        }
    }
    assert_eq!(bench.verdict("sensor/g1"), Verdict::Tentative);
    bench.give(quiet(asked_of_change.unwrap()));
    assert_eq!(bench.latched(), ["sensor/g1"]);
    assert_eq!(bench.verdict("sensor/g2"), Verdict::Normal);
}

/// Long before the first two seconds are over: short windows tell it.
#[test]
fn what_is_far_off_is_found_within_tenths_of_a_second() {
    let mut bench = commissioned();
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(400);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    let latched = bench.transitions().pop().unwrap();
    assert!(latched.before_service);
    assert_eq!(latched.symptom, Symptom::Departure);
}

/// It agreed once, and a reset does not change that.
#[test]
fn what_departs_again_after_a_forced_reset_was_not_so_before_service() {
    let mut bench = commissioned();
    bench.run(SETTLED);
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(4000);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    order(&mut bench, GivenOrderKind::Reset { force: true }).unwrap();
    bench.run(4000);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    let again = bench.transitions().pop().unwrap();
    assert_eq!((again.symptom, again.before_service), (Symptom::Departure, false));
}

/// What agreed over a second was healthy then, though no short window has been compared since.
#[test]
fn what_short_windows_find_began_after_the_last_agreement() {
    let mut bench = commissioned();
    bench.run(SETTLED);
    // Too slow for the change detector: 10 µm a second.
    let began = bench.signals.step;
    for _ in 0..8000 {
        bench.signals.gage_offsets[0] += 1e-8;
        bench.run(1);
    }
    let latched =
        bench.transitions().into_iter().find(|t| t.symptom == Symptom::Departure).unwrap();
    assert!(!latched.before_service);
    assert!(latched.onset >= began && latched.decided > latched.onset, "{latched:?}");
}

/// The mast's lower module without its cylinders, and without figures of any.
fn gages_only() -> ModuleSetup {
    let mut setup = ModuleSetup { hydraulics: None, ..alone() };
    let mut structure = setup.structure.clone();
    structure.modules[0].actuators.clear();
    setup.structure = structure;
    setup.thresholds.truncate(setup.components().len());
    setup
}

#[test]
fn a_module_without_actuators_needs_no_hydraulics() {
    let setup = gages_only();
    assert_eq!(setup.problems(), []);
    let with_figures = ModuleSetup { hydraulics: alone().hydraulics, ..gages_only() };
    assert_eq!(with_figures.problems(), [], "they are unused");
    let mut wrong = with_figures;
    wrong.hydraulics.as_mut().unwrap().supply_pa = f64::NAN;
    assert!(matches!(wrong.problems()[..], [SetupError::Hydraulics(_)]));
    let missing = ModuleSetup { hydraulics: None, ..alone() };
    let problems = Diagnoser::new(missing).unwrap_err();
    let [problem] = &problems[..] else { panic!("{problems:?}") };
    for figure in ["`lower`", "[hydraulics]", "area_a_m2", "pressure_noise_pa"] {
        assert!(problem.to_string().contains(figure), "{problem}");
    }
}

#[test]
fn a_module_without_actuators_is_diagnosed_and_commissioned() {
    let setup = gages_only();
    let sent = serde_json::to_string(&setup).unwrap();
    let setup: ModuleSetup = serde_json::from_str(&sent).unwrap();
    let reference =
        commission(std::slice::from_ref(&setup), 0, &snippets(&setup, 40), 0.001).unwrap();
    assert_eq!(reference.problems(&setup), []);
    let mut bench = Bench::of(ModuleSetup { reference: Some(Arc::new(reference)), ..setup });
    bench.run(SETTLED);
    assert_eq!(bench.latched(), Vec::<String>::new());
    bench.signals.gage_offsets[1] = BIAS_M;
    bench.run(200);
    assert_eq!(bench.latched(), ["sensor/g2"]);
}
