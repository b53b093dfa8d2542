//! The real binaries: exit codes, `check`, busy ports, signals.

use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};

use crate::support::{LIMIT, configs, free_endpoint, in_time};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use session::Network;
use tempfile::TempDir;

const PLANT: &str = env!("CARGO_BIN_EXE_trusswatch-plant");
const DIAGNOSER: &str = env!("CARGO_BIN_EXE_trusswatch-diagnoser");

fn output(program: &str, arguments: &[&str]) -> (i32, String, String) {
    let Output { status, stdout, stderr } =
        Command::new(program).args(arguments).env("TRUSSWATCH_LOG", "off").output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (status.code().unwrap(), text(stdout), text(stderr))
}

/// The shipped configuration without its `[network]`.
fn without_network(folder: &TempDir, name: &str) -> PathBuf {
    let text = std::fs::read_to_string(configs().join(name)).unwrap();
    let text = text.split("[network]").next().unwrap();
    let root = configs();
    let text = text
        .replace("structure = \"", &format!("structure = \"{}/", root.display()))
        .replace("thresholds = \"", &format!("thresholds = \"{}/", root.display()))
        .replace("reference = \"", &format!("reference = \"{}/", root.display()));
    let file = folder.path().join(name);
    std::fs::write(&file, text).unwrap();
    file
}

#[test]
fn valid_configurations_pass_the_check_with_a_summary() {
    let module = configs().join("module1.toml");
    let (code, stdout, stderr) = output(DIAGNOSER, &["check", module.to_str().unwrap()]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(
        stdout.contains("valid: module `module1` of `tower`, 4 actuators, 8 gages"),
        "{stdout}"
    );
    let plant = configs().join("plant.toml");
    let (code, stdout, stderr) = output(PLANT, &["check", plant.to_str().unwrap()]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert!(stdout.contains("valid: structure `tower`, modules module1, module2"), "{stdout}");
}

#[test]
fn an_invalid_configuration_is_exit_code_3_whether_checked_or_run() {
    let folder = TempDir::new().unwrap();
    let file = without_network(&folder, "module1.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("tie_ms", "tie_m")).unwrap();
    for command in ["check", "run"] {
        let (code, _, stderr) = output(DIAGNOSER, &[command, file.to_str().unwrap()]);
        assert_eq!(code, 3, "{stderr}");
        assert!(stderr.contains("unknown field `tie_m`"), "{stderr}");
    }
    let (code, _, stderr) = output(PLANT, &["run", "/nowhere/plant.toml"]);
    assert_eq!(code, 3);
    assert!(stderr.contains("/nowhere/plant.toml: cannot be read"), "{stderr}");
}

#[test]
fn wrong_use_of_the_command_line_is_exit_code_2() {
    for arguments in [&["fly"] as &[&str], &[], &["run"], &["run", "x", "--speeed", "max"]] {
        assert_eq!(output(PLANT, arguments).0, 2, "{arguments:?}");
        assert_eq!(output(DIAGNOSER, arguments).0, 2, "{arguments:?}");
    }
    let (code, _, stderr) = output(PLANT, &["run", "x.toml", "--speed", "fast"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("expected `max`, `real` or a factor"), "{stderr}");
}

#[test]
fn exit_codes_are_documented_in_the_help() {
    for program in [PLANT, DIAGNOSER] {
        let (code, stdout, _) = output(program, &["--help"]);
        assert_eq!(code, 0);
        assert!(stdout.contains("Exit codes:") && stdout.contains("busy port"), "{stdout}");
    }
}

#[test]
fn a_busy_port_is_exit_code_4_and_the_endpoint_is_named() {
    let folder = TempDir::new().unwrap();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let endpoint = format!("tcp/{}", taken.local_addr().unwrap());
    for (program, file) in [(PLANT, "plant.toml"), (DIAGNOSER, "module1.toml")] {
        let file = without_network(&folder, file);
        let (code, _, stderr) =
            output(program, &["run", file.to_str().unwrap(), "--listen", &endpoint]);
        assert_eq!(code, 4, "{stderr}");
        assert!(stderr.contains(&endpoint) && stderr.contains("free the port"), "{stderr}");
    }
}

#[test]
fn an_address_for_health_must_be_one_and_be_free() {
    let folder = TempDir::new().unwrap();
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = taken.local_addr().map(|address| (taken, address.to_string())).unwrap();
    for (program, file) in [(PLANT, "plant.toml"), (DIAGNOSER, "module1.toml")] {
        let file = without_network(&folder, file);
        let run = |address| output(program, &["run", file.to_str().unwrap(), "--health", address]);
        let (code, _, stderr) = run(&taken.1);
        assert_eq!(code, 4, "{stderr}");
        let expected = format!("health cannot be served on {}", taken.1);
        assert!(stderr.contains(&expected) && stderr.contains("free the port"), "{stderr}");
        let (code, _, stderr) = run("9464");
        assert_eq!(code, 3, "{stderr}");
        assert!(stderr.contains("--health: `9464` is not an address with a port"), "{stderr}");
    }
}

/// A child that does not outlive the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start(program: &str, arguments: &[&str]) -> Running {
    let child =
        Command::new(program).args(arguments).stdin(Stdio::null()).stderr(Stdio::null()).spawn();
    Running(child.unwrap())
}

async fn ends(mut running: Running, signal: Option<Signal>) -> i32 {
    if let Some(signal) = signal {
        kill(Pid::from_raw(i32::try_from(running.0.id()).unwrap()), signal).unwrap();
    }
    let waiting = tokio::task::spawn_blocking(move || running.0.wait().unwrap());
    in_time("the end of a process", waiting).await.unwrap().code().unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn sigterm_and_sigint_end_processes_that_would_never_end() {
    let folder = TempDir::new().unwrap();
    let [plant_at, module_at] = [free_endpoint(), free_endpoint()];
    let plant_file = without_network(&folder, "plant.toml");
    let module_file = without_network(&folder, "module1.toml");
    // Module 2 never comes and the plant waits for it: without the signals neither process would end.
    let plant = start(PLANT, &["run", plant_file.to_str().unwrap(), "--listen", &plant_at]);
    let module =
        ["run", module_file.to_str().unwrap(), "--listen", &module_at, "--connect", &plant_at];
    let diagnoser = start(DIAGNOSER, &module);
    let session = session::open(&Network::peer_of(&[plant_at, module_at])).await.unwrap();
    let (structure, modules) = ("tower".parse().unwrap(), ["module1".parse().unwrap()]);
    session::client::wait_for(&session, &structure, &modules, true, LIMIT).await.unwrap();
    let gone = session
        .liveliness()
        .declare_subscriber(vocabulary::keys::Watched::default().tokens())
        .await
        .unwrap();
    assert_eq!(ends(diagnoser, Some(Signal::SIGTERM)).await, 0);
    let token = in_time("the token's end", gone.recv_async()).await.unwrap();
    assert_eq!(token.kind(), zenoh::sample::SampleKind::Delete);
    assert_eq!(ends(plant, Some(Signal::SIGINT)).await, 0);
    session::close(&session).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_plant_without_waiting_ends_after_its_steps() {
    let folder = TempDir::new().unwrap();
    let file = without_network(&folder, "plant.toml");
    let arguments =
        ["run", file.to_str().unwrap(), "--no-wait", "--speed", "max", "--steps", "500"];
    assert_eq!(ends(start(PLANT, &arguments), None).await, 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_waits_for_its_router_can_still_be_stopped() {
    let folder = TempDir::new().unwrap();
    let file = without_network(&folder, "module1.toml");
    let unused = free_endpoint();
    let text = std::fs::read_to_string(&file).unwrap();
    let network = format!("[network]\nmode = \"client\"\nconnect = [\"{unused}\"]\n");
    std::fs::write(&file, text + &network).unwrap();
    let mut child = Command::new(DIAGNOSER)
        .args(["run", file.to_str().unwrap()])
        .env("TRUSSWATCH_LOG", "info")
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut log = BufReader::new(child.stderr.take().unwrap()).lines();
    let running = Running(child);
    assert!(log.by_ref().map_while(Result::ok).any(|line| line.contains("opening a session")));
    assert_eq!(ends(running, Some(Signal::SIGTERM)).await, 0);
}
