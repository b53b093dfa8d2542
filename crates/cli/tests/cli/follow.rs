//! `trusswatch follow` against a stand-in for the diagnosers.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStdout, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;
use vocabulary::{FaultState, FaultTransition, GivenOrder, GivenOrderKind};

use crate::binary::trusswatch;
use crate::stand_in::StandIn;

/// Far longer than any of this takes on a loaded machine.
const TIMEOUT: Duration = Duration::from_secs(60);

struct Follower {
    child: Child,
    lines: std::io::Lines<BufReader<ChildStdout>>,
}

impl Follower {
    fn of(tower: &StandIn, arguments: &[&str]) -> Follower {
        let mut child = trusswatch()
            .args(["follow", "--connect", &tower.endpoint])
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        Follower { child, lines }
    }

    /// The next line that contains all of these.
    fn line(&mut self, said: &[&str]) -> String {
        let is_it = |line: &String| said.iter().all(|text| line.contains(text));
        self.lines.by_ref().map(Result::unwrap).find(is_it).unwrap()
    }

    fn stop(self) -> Option<i32> {
        self.end_by(Signal::SIGTERM)
    }

    fn end_by(mut self, signal: Signal) -> Option<i32> {
        let pid = Pid::from_raw(i32::try_from(self.child.id()).unwrap());
        kill(pid, signal).unwrap();
        self.child.wait().unwrap().code()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn verdicts_and_presence_are_printed_as_they_come_until_it_is_ended() {
    let mut tower = StandIn::open("tower").await;
    let mut people = Follower::of(&tower, &[]);
    let mut machines = Follower::of(&tower, &["--json"]);
    // Its token shows that a follower listens.
    tower.token("module1").await;
    let latched = tower.transition("module1/sensor/g2", FaultState::Latched, 7);
    let (shown, document, codes) = tokio::time::timeout(
        TIMEOUT,
        tokio::task::spawn_blocking(move || {
            people.line(&["module1", "there"]);
            machines.line(&["presence", "module1"]);
            tokio::runtime::Handle::current().block_on(async {
                tower.publish(&latched).await;
                tower.publish(&latched).await;
                let later = tower.transition("module1/sensor/g2", FaultState::Acknowledged, 8);
                tower.publish(&later).await;
            });
            let shown = [people.line(&["module1/sensor/g2"]), people.line(&["module1/sensor/g2"])];
            let document = machines.line(&["fault", "module1/sensor/g2"]);
            (shown, document, [people.stop(), machines.stop()])
        }),
    )
    .await
    .unwrap()
    .unwrap();
    assert!(shown[0].contains("latched") && shown[0].contains("step 3112"), "{shown:?}");
    assert!(shown[1].contains("acknowledged"), "the same is printed once: {shown:?}");
    let document: Value = serde_json::from_str(&document).unwrap();
    assert_eq!((&document["news"], &document["state"]), (&"fault".into(), &"latched".into()));
    assert_eq!((&document["sequence"], &document["v"]), (&7.into(), &1.into()));
    assert_eq!(codes, [Some(0), Some(0)]);
}

#[tokio::test(flavor = "multi_thread")]
async fn it_begins_with_the_present_alarms_and_with_nothing_of_the_past() {
    let tower = StandIn::open("tower").await;
    let alarm = tower.transition("module1/sensor/g2", FaultState::Latched, 7);
    let (kind, by) = (GivenOrderKind::Unsuppress, "ada".to_owned());
    let order = Some(GivenOrder { kind, by, on_behalf_of: None, note: None });
    let past = tower.transition("module1/sensor/g3", FaultState::Normal, 8);
    tower.states("module1", vec![alarm, FaultTransition { order, ..past }]).await;
    let mut people = Follower::of(&tower, &[]);
    let lines = tokio::time::timeout(
        TIMEOUT,
        tokio::task::spawn_blocking(move || {
            let first = people.line(&["sensor/"]);
            let next = tower.transition("module1/sensor/g4", FaultState::Latched, 9);
            tokio::runtime::Handle::current().block_on(tower.publish(&next));
            let lines = [first, people.line(&["sensor/"])];
            people.stop();
            lines
        }),
    );
    let [first, next] = lines.await.unwrap().unwrap();
    assert!(first.contains("sensor/g2") && first.contains("latched"), "{first}");
    assert!(first.contains("when this view connected or before"), "{first}");
    assert!(next.contains("sensor/g4") && next.contains("changed at step"), "{next}");
}

/// Far more than a pipe holds.
const MANY: u64 = 400;

#[tokio::test(flavor = "multi_thread")]
async fn a_signal_ends_it_while_standard_output_is_blocked() {
    let mut tower = StandIn::open("tower").await;
    let mut stalled = [Follower::of(&tower, &["--json"]), Follower::of(&tower, &["--json"])];
    tower.token("module1").await;
    for follower in &mut stalled {
        follower.line(&["presence", "module1"]);
    }
    for sequence in 0..MANY {
        tower
            .publish(&tower.transition("module1/sensor/g2", FaultState::Latched, 7 + sequence))
            .await;
    }
    // Until the pipes are full.
    tokio::time::sleep(Duration::from_secs(1)).await;
    let ended = tokio::task::spawn_blocking(move || {
        let begun = Instant::now();
        let [first, second] = stalled;
        let codes = [first.end_by(Signal::SIGTERM), second.end_by(Signal::SIGINT)];
        (codes, begun.elapsed())
    });
    let (codes, took) = tokio::time::timeout(TIMEOUT, ended).await.unwrap().unwrap();
    assert_eq!(codes, [Some(0), Some(0)]);
    assert!(took < Duration::from_secs(20), "{took:?}");
}
