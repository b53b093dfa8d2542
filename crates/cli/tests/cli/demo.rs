//! `trusswatch demo` with real processes on this machine. Needs the processes beside the binary under
//! test: `cargo build --release -p daemon`, or test the whole workspace.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use crate::binary::{run, trusswatch};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

/// A demo that was started.
struct Demo {
    child: Child,
    events: Option<BufReader<ChildStdout>>,
    pids: Vec<i32>,
}

impl Demo {
    fn start(arguments: &[&str]) -> Demo {
        for name in ["trusswatch-plant", "trusswatch-diagnoser"] {
            let beside = Path::new(env!("CARGO_BIN_EXE_trusswatch")).with_file_name(name);
            assert!(beside.is_file(), "build {name} first: cargo build --release -p daemon");
        }
        let mut child = trusswatch()
            .args(["demo", "--json"])
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let events = child.stdout.take().map(BufReader::new);
        let mut demo = Demo { child, events, pids: Vec::new() };
        let started = demo.next().unwrap();
        assert_eq!((&started["event"], &started["v"]), (&"started".into(), &1.into()));
        let processes = started["processes"].as_array().unwrap();
        demo.pids = processes.iter().map(|p| p["pid"].as_i64().unwrap() as i32).collect();
        demo
    }

    fn next(&mut self) -> Option<Value> {
        let mut line = String::new();
        let read = self.events.as_mut().unwrap().read_line(&mut line).unwrap();
        (read > 0).then(|| serde_json::from_str(&line).unwrap())
    }

    fn wait_for(&mut self, event: &str) -> Value {
        loop {
            let next = self.next().unwrap_or_else(|| panic!("no `{event}` came"));
            if next["event"] == event {
                return next;
            }
        }
    }

    fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(self.child.id() as i32), signal).unwrap();
    }

    /// Waits for the end; none of the processes may be left.
    fn end(mut self) -> (ExitStatus, String) {
        let mut said = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        let status = self.child.wait().unwrap();
        let left: Vec<&i32> = self.pids.iter().filter(|pid| is_running(**pid)).collect();
        assert!(left.is_empty(), "processes left: {left:?}");
        (status, said)
    }
}

/// A test that fails leaves nothing behind either.
impl Drop for Demo {
    fn drop(&mut self) {
        self.events = None;
        if let Ok(None) = self.child.try_wait() {
            self.signal(Signal::SIGTERM);
            drop(self.child.wait());
        }
    }
}

/// A process that has ended but was not waited for runs no more.
fn is_running(pid: i32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status"));
    status.is_ok_and(|status| !status.contains("State:\tZ"))
}

/// Nothing of a test takes longer than this, on a busy machine either.
const LIMIT: Duration = Duration::from_secs(180);

/// Waits until something is so.
fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let end = Instant::now() + LIMIT;
    while !is_so() {
        assert!(Instant::now() < end, "{what} did not happen within {LIMIT:?}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn every_injected_fault_is_named_and_nothing_else() {
    let mut demo = Demo::start(&["--speed", "max"]);
    let mut events = Vec::new();
    while let Some(event) = demo.next() {
        events.push(event);
    }
    let pids = demo.pids.clone();
    let (status, said) = demo.end();
    assert_eq!((status.code(), said.as_str()), (Some(0), ""));
    let summary = events.last().unwrap();
    assert_eq!(summary["event"], "summary");
    assert_eq!(summary["exact"], true);
    let listed: Vec<_> =
        summary["pids"].as_array().unwrap().iter().map(|p| p.as_i64().unwrap() as i32).collect();
    assert_eq!(listed, pids);
    let components = |list: &str| -> Vec<String> {
        let faults = summary[list].as_array().unwrap().iter();
        faults.map(|fault| fault["component"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(components("injected").len(), 7);
    assert_eq!(components("injected"), components("diagnosed"));
    for event in ["ready", "in_service", "injected", "repaired", "verdict", "identified"] {
        assert!(events.iter().any(|entry| entry["event"] == event), "no {event}");
    }
    let explained_elsewhere = events.iter().any(|entry| {
        entry["state"] == "explained"
            && entry["explained_by"] == "module1/actuator/a1"
            && entry["component"].as_str().unwrap().starts_with("module2/")
    });
    assert!(explained_elsewhere, "no gage of module2 was explained by the actuator of module1");
    let departs = |entry: &&Value| entry["state"] == "latched" && entry["symptom"] == "departure";
    let departing: Vec<&Value> = events.iter().filter(departs).collect();
    let [creeping] = departing[..] else { panic!("one gage creeps: {departing:?}") };
    assert_eq!(creeping["component"], components("injected")[6].as_str());
    let figure = |name: &str| creeping["evidence"][name].as_f64().unwrap();
    assert!(figure("residual") - figure("level") > 20e-6, "{creeping}");
    let has_changed = |entry: &Value| {
        entry["state"] == "tentative"
            && entry["component"] == creeping["component"]
            && entry["step"].as_u64() > summary["injected"][6]["step"].as_u64()
    };
    assert!(!events.iter().any(has_changed), "no change showed");
}

#[test]
fn configurations_of_a_directory_are_run_in_place_of_the_shipped_ones() {
    let configs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs");
    let mut demo = Demo::start(&[configs.to_str().unwrap(), "--speed", "max"]);
    let summary = demo.wait_for("summary");
    assert_eq!(summary["injected"].as_array().unwrap().len(), 7);
    assert_eq!(demo.end().0.code(), Some(0));
    let incomplete = tempfile::tempdir().unwrap();
    std::fs::copy(configs.join("plant.toml"), incomplete.path().join("plant.toml")).unwrap();
    std::fs::copy(configs.join("tower.toml"), incomplete.path().join("tower.toml")).unwrap();
    let named = incomplete.path().to_str().unwrap();
    run(&["demo", named]).fails(3, &["module1.toml", "cannot be read"]);
}

#[test]
fn an_interrupt_leaves_no_process_behind() {
    for signal in [Signal::SIGINT, Signal::SIGTERM] {
        let mut demo = Demo::start(&[]);
        demo.wait_for("warming_up");
        demo.signal(signal);
        let events = demo.events.take().unwrap();
        let (status, said) = demo.end();
        assert_eq!(
            (status.code(), said.as_str()),
            (Some(130), "error: interrupted before the end\n")
        );
        let mut later = events.lines().map(Result::unwrap);
        assert!(!later.any(|line| line.contains("\"summary\"")), "it was not seen through");
    }
}

#[test]
fn a_killed_demo_leaves_no_process_behind() {
    let mut demo = Demo::start(&[]);
    demo.wait_for("warming_up");
    demo.signal(Signal::SIGKILL);
    let pids = demo.pids.clone();
    wait_until("the end of all processes", || !pids.iter().any(|pid| is_running(*pid)));
}

/// How long the demo itself waits for its processes to stop.
const STOP_TIMEOUT: Duration = Duration::from_secs(4);

#[test]
fn a_second_interrupt_kills_what_does_not_stop() {
    loop {
        let mut demo = Demo::start(&[]);
        demo.wait_for("warming_up");
        let (frozen, others) = (demo.pids[1], [demo.pids[0], demo.pids[2]]);
        kill(Pid::from_raw(frozen), Signal::SIGSTOP).unwrap();
        let asked = Instant::now();
        demo.signal(Signal::SIGINT);
        wait_until("the end of the others", || !others.iter().any(|pid| is_running(*pid)));
        let is_frozen = is_running(frozen);
        demo.signal(Signal::SIGINT);
        let (status, said) = demo.end();
        assert_eq!(status.code(), Some(130));
        if said.contains("interrupted again: killing what has not stopped") {
            assert!(is_frozen, "a frozen process does not stop when asked");
            return;
        }
        // On a busy machine the others may need so long that the demo no longer waits: then again.
        assert!(asked.elapsed() >= STOP_TIMEOUT, "{said}");
    }
}

#[test]
fn a_process_that_dies_is_reported_with_its_log() {
    let mut demo = Demo::start(&[]);
    demo.wait_for("warming_up");
    kill(Pid::from_raw(demo.pids[1]), Signal::SIGKILL).unwrap();
    let (status, said) = demo.end();
    assert_eq!(status.code(), Some(1));
    assert!(said.starts_with("error: module2 ended unexpectedly (signal: 9"), "{said}");
    assert!(said.contains("module=module2"), "{said}");
}

#[test]
fn a_closed_pipe_ends_the_demo_quietly() {
    let mut demo = Demo::start(&["--speed", "max"]);
    demo.events = None;
    let (status, said) = demo.end();
    assert_eq!((status.code(), said.as_str()), (Some(0), ""));
}

#[test]
fn logs_are_kept_where_it_reports() {
    let mut demo = Demo::start(&["--keep-logs"]);
    demo.wait_for("ready");
    demo.signal(Signal::SIGINT);
    let (_, said) = demo.end();
    let kept = said.lines().find_map(|line| line.strip_prefix("logs and configurations are in "));
    let kept = PathBuf::from(kept.unwrap());
    for file in ["plant.log", "module1.log", "module2.log", "plant.toml", "schedule.toml"] {
        assert!(kept.join(file).is_file(), "{file}");
    }
    std::fs::remove_dir_all(kept).unwrap();
}

#[test]
fn without_the_processes_beside_it_the_demo_says_how_to_build_them() {
    // A link, not a copy: a file that was just written may still be open in a child of another test,
    // and could then not be started.
    let built = PathBuf::from(env!("CARGO_BIN_EXE_trusswatch"));
    let alone = tempfile::tempdir_in(built.parent().unwrap()).unwrap();
    let program = alone.path().join("trusswatch");
    std::fs::hard_link(&built, &program).unwrap();
    let output = Command::new(&program).arg("demo").output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(said.contains("`trusswatch-plant`"), "{said}");
    assert!(said.contains("cargo build --release -p daemon"), "{said}");
}

#[test]
fn a_speed_that_is_none_is_refused_with_those_that_are() {
    for speed in ["fast", "0", "-1", "nan"] {
        run(&["demo", &format!("--speed={speed}")])
            .fails(2, &["--speed", "`max`, `real` or a factor"]);
    }
}
