//! Two versions side by side: one process after another is upgraded in place, on the state directory and the
//! configuration of the version before. At every stage each module still has its faults, finds new ones together with its
//! peer, and is read by the commands of both versions. The same on the way back.
//!
//! `.ci/upgrade` builds the former version and runs this.

use std::collections::BTreeMap;
use std::time::Duration;

use daemon::config::Schedule;
use names::RunId;
use names::fault::Fault;
use serde_json::Value;
use system_tests::binaries::Version;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::follower::{Follower, follow};
use system_tests::in_time;
use system_tests::observer::{Faults, Observer, states, unix_ns};
use system_tests::operate::{Ended, trusswatch_of};
use system_tests::plant_clock::PlantClock;
use system_tests::process::Process;
use system_tests::turn;
use wire::{FaultState, FaultTransition, Injection, ModulePhase, ModuleStatus};

const VERSIONS: [Version; 2] = [Version::Former, Version::Present];
const STEPS: u64 = 1_000_000;
/// In service for so long that no effect may be older than its cause \[steps\].
const WATCHED: u64 = 500;
/// After so long a fault explains nothing any more and has left the statistics \[steps\].
const APART: u64 = 5600;
/// A jump would need no peer.
const SMALL: Fault = Fault::Bias { offset_m: 1.6e-5 };
/// Its effects show in both modules.
const LARGE: Fault = Fault::ExternalLeakageA { area_m2: 1e-5 };
/// Of each module, the cylinder that leaks at a stage; at the first one none does.
const LEAKING: [Option<&str>; 4] = [None, Some("a2"), Some("a4"), Some("a3")];
/// Components of both modules.
const COMPONENTS: usize = 24;
/// Which process is replaced: the plant, or one of the modules.
const PLANT: usize = 0;

/// The tower at work, and what it must not forget.
struct Works {
    deployment: Deployment,
    observer: Observer,
    faults: Faults,
    clock: PlantClock,
    followers: [Follower; 2],
    diagnosers: Vec<Process>,
    plant: Process,
    run: RunId,
    /// State and sequence number of every fault that was found.
    found: BTreeMap<String, (FaultState, u64)>,
    /// The same when it was found.
    latched: BTreeMap<String, u64>,
}

impl Works {
    /// With configurations of the former version and programs of this one.
    async fn start(version: Version) -> Self {
        let deployment = Deployment::of_watched_tower_in(Version::Former, &Schedule::default());
        (0..=MODULES.len()).for_each(|place| deployment.install(place, version));
        let observer = Observer::of(&deployment).await;
        let faults = observer.faults().await;
        let clock = PlantClock::of(&observer).await;
        let diagnosers = deployment.start_diagnosers();
        observer.wait_for(&MODULES, false).await;
        let run = RunId(1);
        let plant = deployment.start_plant("real", STEPS, 11, run);
        Self {
            followers: VERSIONS.map(|version| follow(version, &deployment)),
            deployment,
            observer,
            faults,
            clock,
            diagnosers,
            plant,
            run,
            found: BTreeMap::new(),
            latched: BTreeMap::new(),
        }
    }

    /// Replaces the program at a place: what ran there ends in order.
    async fn replace(&mut self, place: usize, version: Version) {
        self.deployment.install(place, version);
        if place == PLANT {
            let run = RunId(self.run.0 + 1);
            let next = || self.deployment.start_plant("real", STEPS, 11, run);
            end(&mut self.plant).await;
            self.observer.wait_until_gone("plant").await;
            self.plant = next();
            self.run = run;
        } else {
            end(&mut self.diagnosers[place - 1]).await;
            self.observer.wait_until_gone(MODULES[place - 1]).await;
            self.diagnosers[place - 1] = self.deployment.start_diagnoser(place - 1);
            self.observer.wait_for(&MODULES, false).await;
        }
    }

    /// Everything that must hold of any two versions.
    async fn pass(&mut self, stage: usize) {
        let before = self.watching().await;
        self.nothing_is_forgotten().await;
        for module in MODULES {
            self.suffers(&format!("{module}/sensor/g{}", stage + 1), SMALL).await;
        }
        if let Some(cylinder) = LEAKING[stage] {
            self.explain_across(cylinder).await;
        }
        let after = self.watching().await;
        for (before, after) in before.iter().zip(&after) {
            let [before_answers, after_answers] = [before, after].map(|s| s.peers[0].answered);
            assert!(after_answers > before_answers, "no answer came: {after:#?}");
            understands_all(after);
        }
        self.commands_are_obeyed(stage).await;
        self.nothing_is_forgotten().await;
        self.commands_read().await;
    }

    /// A cylinder leaks in each module, one after the other; what follows in the other module is explained by that. Not
    /// each time: a gage that is latched already and moves as well may be taken for the cause.
    async fn explain_across(&mut self, cylinder: &str) {
        let mut effects = Vec::new();
        for module in MODULES {
            effects.extend(self.suffers(&format!("{module}/actuator/{cylinder}"), LARGE).await);
        }
        let across = |effect: &FaultTransition| {
            effect.explained_by.as_ref().is_some_and(|cause| cause.module != effect.module)
        };
        assert!(effects.iter().any(across), "{cylinder}: {effects:#?}");
    }

    /// Waits until both modules have watched for long enough; their statuses.
    async fn watching(&self) -> Vec<ModuleStatus> {
        let mut statuses = Vec::new();
        let start = unix_ns();
        for module in MODULES {
            let present = |status: &ModuleStatus| {
                status.run == Some(self.run) && status.time_unix_ns > start && has_watched(status)
            };
            statuses.push(self.observer.status_of(module, present).await);
        }
        statuses
    }

    /// Gives a component a fault, which is found, and nothing else; what else became of it.
    async fn suffers(&mut self, component: &str, fault: Fault) -> Vec<FaultTransition> {
        let start = unix_ns();
        let order =
            Injection { component: component.parse().unwrap(), fault: Some(fault), at_step: None };
        let (session, structure) = (&self.observer.session, "tower".parse().unwrap());
        let injected = ::observer::inject(session, &structure, &order, Duration::from_secs(5));
        let from = injected.await.unwrap().effective_step;
        // What follows in the other module may be there before.
        let mut effects = Vec::new();
        // A process that was started again publishes what was found before it.
        let wanted = |_: u64, found: FaultTransition| {
            if found.time_unix_ns <= start {
                return None;
            }
            if found.component.to_string() == component && found.state == FaultState::Latched {
                return Some(found);
            }
            effects.push(found);
            None
        };
        let latched = self.faults.find(&format!("{component} latched"), wanted).await;
        assert!(latched.onset_step.unwrap() >= from, "{latched:#?}");
        self.found.insert(component.to_owned(), (FaultState::Latched, latched.sequence));
        self.latched.insert(component.to_owned(), latched.sequence);
        self.clock.reach(self.run, from.0 + APART).await;
        let later = self.faults.arrived().into_iter().map(|(_, effect)| effect);
        effects.extend(later.filter(|effect| effect.time_unix_ns > start));
        let wrong = |effect: &&FaultTransition| effect.state == FaultState::Latched;
        assert_eq!(effects.iter().find(wrong), None, "{component}");
        let causes = effects.iter().filter_map(|effect| effect.explained_by.as_ref());
        for cause in causes {
            assert!(self.found.contains_key(&cause.to_string()), "{cause} has no fault");
        }
        effects
    }

    /// Both modules have every fault, with the number that it had.
    async fn nothing_is_forgotten(&self) {
        let answered = async {
            loop {
                let states = states(&self.observer.session).await;
                if states.len() == COMPONENTS {
                    return states;
                }
            }
        };
        let states = in_time("the states of all components", answered).await;
        let faulty = states.into_iter().filter(|state| state.state.is_fault());
        let faulty =
            faulty.map(|found| (found.component.to_string(), (found.state, found.sequence)));
        assert_eq!(faulty.collect::<BTreeMap<_, _>>(), self.found);
    }

    /// The commands of each version read both modules.
    async fn commands_read(&self) {
        for version in VERSIONS {
            let picture = self.command(version, &["faults", "--json"]).await;
            assert_eq!(picture.code, Some(0), "{version:?} {picture:?}");
            let picture = picture.json();
            assert_eq!(picture["problems"], Value::Array(vec![]), "{version:?} {picture:#}");
            let components = picture["components"].as_array().unwrap();
            for (component, (state, sequence)) in &self.found {
                let shown = |shown: &&Value| shown["component"] == component.as_str();
                let shown = components.iter().find(shown).unwrap();
                assert_eq!(shown["state"], state.as_str(), "{version:?} {shown:#}");
                assert_eq!(shown["sequence"], *sequence, "{version:?} {shown:#}");
            }
            let check = self.command(version, &["faults", "--exit-code"]).await;
            assert_eq!(check.code, Some(1), "{version:?} {check:?}");
            self.histories_are_read(version).await;
        }
    }

    async fn histories_are_read(&self, version: Version) {
        let history = self.command(version, &["history", "--json"]).await;
        assert_eq!(history.code, Some(0), "{version:?} {history:?}");
        let history = history.json();
        assert_eq!(history["gaps"], Value::Array(vec![]), "{version:?} {:#}", history["gaps"]);
        let transitions = history["transitions"].as_array().unwrap();
        for (component, sequence) in &self.latched {
            let kept = |kept: &&Value| {
                kept["component"] == component.as_str() && kept["sequence"] == *sequence
            };
            let kept = transitions.iter().find(kept);
            let kept = kept.unwrap_or_else(|| panic!("{version:?}: {component} {sequence}"));
            assert_eq!(kept["state"], "latched", "{version:?} {kept:#}");
        }
    }

    /// Both modules obey the command lines of both versions.
    async fn commands_are_obeyed(&mut self, stage: usize) {
        let cylinders = LEAKING[stage].map(|cylinder| format!("actuator/{cylinder}"));
        let components = [Some(format!("sensor/g{}", stage + 1)), cylinders];
        for (version, component) in VERSIONS.into_iter().zip(components) {
            let Some(component) = component else { continue };
            for module in MODULES {
                let component = format!("{module}/{component}");
                let words = ["ack", &component, "--by", "ada", "--note", "seen", "--json"];
                let ended = self.command(version, &words).await;
                assert_eq!(ended.code, Some(0), "{version:?} {ended:?}");
                let order = &ended.json()["orders"][0];
                assert_eq!(order["outcome"], "obeyed", "{version:?} {order:#}");
                let sequence = order["sequence"].as_u64().unwrap();
                self.found.insert(component, (FaultState::Acknowledged, sequence));
            }
        }
    }

    async fn command(&self, version: Version, words: &[&str]) -> Ended {
        trusswatch_of(version, &self.deployment, words).await
    }

    /// Whoever followed has seen every fault, and could read everything.
    async fn followers_have_seen_all(&self) {
        for (version, follower) in VERSIONS.into_iter().zip(&self.followers) {
            for (component, sequence) in &self.latched {
                let seen = |lines: &Vec<Value>| {
                    lines
                        .iter()
                        .find(|line| {
                            line["news"] == "fault"
                                && line["component"] == component.as_str()
                                && line["sequence"] == *sequence
                        })
                        .cloned()
                };
                let line =
                    in_time(&format!("{version:?}: {component}"), follower.first(seen)).await;
                assert_eq!(line["state"], "latched", "{version:?} {line:#}");
            }
            let lines = follower.so_far();
            let known = ["fault", "identification", "phase", "presence"];
            let strange = |line: &&Value| !known.iter().any(|known| line["news"] == *known);
            assert_eq!(lines.iter().find(strange), None, "{version:?}");
        }
    }

    async fn stop(self) {
        self.followers_have_seen_all().await;
        self.plant.stop().await;
        for diagnoser in self.diagnosers {
            diagnoser.stop().await;
        }
    }
}

async fn end(process: &mut Process) {
    process.signal(nix::sys::signal::Signal::SIGTERM);
    assert_eq!(process.exit_code().await, Some(0), "{}", process.log());
}

fn has_watched(status: &ModuleStatus) -> bool {
    let since = status.in_service_since_step.filter(|_| status.phase == ModulePhase::InService);
    since.zip(status.step).is_some_and(|(since, now)| now.since(since) > WATCHED)
}

/// Nothing that came to this module was rejected, and its journal was read in whole.
fn understands_all(status: &ModuleStatus) {
    let intake = &status.intake;
    let rejected = [
        intake.malformed,
        intake.unknown_version,
        intake.wrong_message,
        intake.other_module,
        status.inquiries.malformed,
        status.diagnosis.answers_malformed,
        status.peers[0].malformed,
        status.journal.damaged,
        status.journal.lost,
    ];
    assert!(rejected.iter().all(|count| *count == 0), "{status:#?}");
    assert_eq!(status.unconfirmed, 0, "{status:#?}");
}

/// Starts with programs of one version and replaces them one after the other by those of another.
async fn roll(from: Version, to: Version, places: [usize; 3]) {
    let _turn = turn::side_by_side().await;
    let mut works = Works::start(from).await;
    works.pass(0).await;
    for (stage, place) in (1..).zip(places) {
        works.replace(place, to).await;
        works.pass(stage).await;
    }
    works.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs programs of a former version: see .ci/upgrade"]
async fn one_module_after_the_other_is_upgraded_and_the_plant_last() {
    roll(Version::Former, Version::Present, [1, 2, PLANT]).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs programs of a former version: see .ci/upgrade"]
async fn the_plant_is_upgraded_first() {
    roll(Version::Former, Version::Present, [PLANT, 2, 1]).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs programs of a former version: see .ci/upgrade"]
async fn an_upgrade_is_taken_back() {
    roll(Version::Present, Version::Former, [2, 1, PLANT]).await;
}
