//! The laboratory impairs a network exactly as requested.

use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use system_tests::lab::{Impairment, Lab, Node};
use system_tests::quantiles::quantile;
use system_tests::turn;

const MS: Duration = Duration::from_millis(1);
/// Nothing that is still to come takes longer.
const SILENCE: Duration = Duration::from_millis(300);

/// A socket of a node, on any port: one that was closed a moment ago may still be held by a child process of
/// another test that is just being started.
fn socket(lab: &Lab, node: Node) -> UdpSocket {
    let address = SocketAddr::from((lab.address(node), 0));
    let socket = lab.inside(node, || UdpSocket::bind(address)).unwrap();
    socket.set_read_timeout(Some(SILENCE)).unwrap();
    socket
}

/// A datagram that was received.
struct Received {
    number: u32,
    /// From just before it was sent.
    after: Duration,
}

/// Sends numbered datagrams and receives until nothing more comes.
fn stream(lab: &Lab, from: Node, to: Node, count: u32, every: Duration) -> Vec<Received> {
    let (sender, receiver) = (socket(lab, from), socket(lab, to));
    let target = receiver.local_addr().unwrap();
    let start = Instant::now();
    let sending = std::thread::spawn(move || {
        for number in 0..count {
            let due = start + every * number;
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            let sent = u64::try_from(start.elapsed().as_nanos()).unwrap();
            let mut datagram = number.to_be_bytes().to_vec();
            datagram.extend(sent.to_be_bytes());
            // Refused while there is no way: the receiver's address cannot be found.
            let _ = sender.send_to(&datagram, target);
        }
    });
    let mut all = Vec::new();
    let mut buffer = [0; 64];
    loop {
        match receiver.recv(&mut buffer) {
            Ok(_) => all.push(read(&buffer, start.elapsed())),
            Err(_) if sending.is_finished() => break,
            Err(_) => {}
        }
    }
    sending.join().unwrap();
    all
}

fn read(buffer: &[u8], now: Duration) -> Received {
    let number = u32::from_be_bytes(buffer[..4].try_into().unwrap());
    let sent = Duration::from_nanos(u64::from_be_bytes(buffer[4..12].try_into().unwrap()));
    Received { number, after: now.saturating_sub(sent) }
}

/// Both know where the other is, so that a stream is nothing but its datagrams.
fn introduce(lab: &Lab, one: Node, other: Node) {
    assert_eq!(stream(lab, one, other, 1, MS).len(), 1);
    assert_eq!(stream(lab, other, one, 1, MS).len(), 1);
}

fn delays(received: &[Received]) -> Vec<Duration> {
    let mut delays: Vec<Duration> = received.iter().map(|datagram| datagram.after).collect();
    delays.sort();
    delays
}

fn overtakings(received: &[Received]) -> usize {
    received.windows(2).filter(|pair| pair[1].number < pair[0].number).count()
}

#[test]
#[ignore = "needs a laboratory: network namespaces, as root"]
fn an_unimpaired_network_loses_nothing_keeps_the_order_and_takes_no_time() {
    let _turn = turn::blocking_alone();
    let lab = Lab::required(1);
    introduce(&lab, Node::Plant, Node::Module1);
    let before = lab.tally(Node::Plant, Node::Module1);
    let received = stream(&lab, Node::Plant, Node::Module1, 5000, MS / 5);
    let after = lab.tally(Node::Plant, Node::Module1);
    assert_eq!(received.len(), 5000);
    assert_eq!(overtakings(&received), 0);
    assert!(after.forwarded - before.forwarded >= 5000);
    assert_eq!((after.lost, after.cut), (0, 0));
    let delays = delays(&received);
    let (p50, p99) = (quantile(&delays, 0.5), quantile(&delays, 0.99));
    println!("one way at 5000 frames/s: p50 {p50:?}, p99 {p99:?}");
    assert!(p50 < Duration::from_micros(300), "{p50:?}");
}

/// Round trips of a datagram between two nodes, one after the other.
fn round_trips(lab: &Lab, near: Node, far: Node, count: usize) -> Vec<Duration> {
    let (near, far) = (socket(lab, near), socket(lab, far));
    let target = far.local_addr().unwrap();
    let mut trips = std::thread::scope(|scope| {
        scope.spawn(|| {
            let mut buffer = [0; 64];
            for _ in 0..count {
                let (length, from) = far.recv_from(&mut buffer).unwrap();
                far.send_to(&buffer[..length], from).unwrap();
            }
        });
        let mut buffer = [0; 64];
        let mut trip = || {
            let start = Instant::now();
            near.send_to(&[7; 56], target).unwrap();
            near.recv(&mut buffer).unwrap();
            start.elapsed()
        };
        (0..count).map(|_| trip()).collect::<Vec<_>>()
    });
    trips.sort();
    trips
}

#[test]
#[ignore = "needs a laboratory: network namespaces, as root"]
fn the_switch_itself_takes_less_than_a_third_of_a_millisecond() {
    let _turn = turn::blocking_alone();
    let lab = Lab::required(2);
    for (near, far) in [(Node::Module1, Node::Module2), (Node::Observer, Node::Plant)] {
        introduce(&lab, near, far);
        let trips = round_trips(&lab, near, far, 2000);
        let (p50, p99) = (quantile(&trips, 0.5), quantile(&trips, 0.99));
        println!("round trip {near:?} to {far:?}: p50 {p50:?}, p99 {p99:?}");
        assert!(p50 < Duration::from_micros(600), "{p50:?} for both ways");
    }
}

#[test]
#[ignore = "needs a laboratory: network namespaces, as root"]
fn the_share_lost_is_the_share_asked_for() {
    let _turn = turn::blocking_alone();
    let lab = Lab::required(3);
    introduce(&lab, Node::Module1, Node::Module2);
    const COUNT: u32 = 4000;
    for share in [0.05, 0.2] {
        lab.impair(Node::Module1, Node::Module2, Impairment::loss(share));
        let received = stream(&lab, Node::Module1, Node::Module2, COUNT, MS / 4).len();
        let (mean, n) = (f64::from(COUNT) * (1.0 - share), f64::from(COUNT));
        let deviation = (n * share * (1.0 - share)).sqrt();
        // Four standard deviations: one run in 16000 fails by chance, and the seed is fixed.
        let off = (received as f64 - mean).abs() / deviation;
        assert!(off < 4.0, "{received} of {COUNT} at {share}: {off} standard deviations off");
    }
}

#[test]
#[ignore = "needs a laboratory: network namespaces, as root"]
fn frames_are_late_by_the_delay_give_or_take_the_jitter_and_overtake_each_other() {
    let _turn = turn::blocking_alone();
    let lab = Lab::required(4);
    introduce(&lab, Node::Module1, Node::Module2);
    lab.impair(Node::Module1, Node::Module2, Impairment::delay(20 * MS, 10 * MS));
    let received = stream(&lab, Node::Module1, Node::Module2, 2000, MS);
    assert_eq!(received.len(), 2000);
    let delays = delays(&received);
    let (first, p50) = (delays[0], quantile(&delays, 0.5));
    let (p95, p99) = (quantile(&delays, 0.95), quantile(&delays, 0.99));
    println!("20 ± 10 ms: least {first:?}, p50 {p50:?}, p95 {p95:?}, p99 {p99:?}");
    assert!(first >= 10 * MS && first < 11 * MS, "{first:?}");
    assert!(p50 >= 19 * MS && p50 < 22 * MS, "{p50:?}");
    // A machine that stalls for 20 ms delays one frame in a hundred by more than the jitter.
    assert!(p95 >= 28 * MS && p95 < 32 * MS, "{p95:?}");
    assert!(p99 >= 29 * MS, "{p99:?}");
    assert!(overtakings(&received) > 200, "{}", overtakings(&received));
    // The other way is as it was.
    let back = round_trip_back(&lab);
    assert!(back < 5 * MS, "{back:?}");
}

fn round_trip_back(lab: &Lab) -> Duration {
    quantile(&delays(&stream(lab, Node::Module2, Node::Module1, 100, MS)), 0.5)
}

#[test]
#[ignore = "needs a laboratory: network namespaces, as root"]
fn a_cut_one_way_leaves_the_other_way_open_and_heals() {
    let _turn = turn::blocking_alone();
    let lab = Lab::required(5);
    introduce(&lab, Node::Module1, Node::Module2);
    lab.impair(Node::Module1, Node::Module2, Impairment::cut());
    assert_eq!(stream(&lab, Node::Module1, Node::Module2, 100, MS).len(), 0);
    assert_eq!(stream(&lab, Node::Module2, Node::Module1, 100, MS).len(), 100);
    assert_eq!(stream(&lab, Node::Module1, Node::Plant, 100, MS).len(), 100);
    assert!(lab.tally(Node::Module1, Node::Module2).cut >= 100);
    lab.heal();
    assert_eq!(stream(&lab, Node::Module1, Node::Module2, 100, MS).len(), 100);
}

#[test]
#[ignore = "needs a laboratory: network namespaces, as root"]
fn two_laboratories_at_a_time_do_not_meet_and_leave_nothing_behind() {
    let _turn = turn::blocking_alone();
    let (one, other) = (Lab::required(6), Lab::required(6));
    assert_ne!(one.address(Node::Plant), other.address(Node::Plant));
    introduce(&one, Node::Plant, Node::Observer);
    introduce(&other, Node::Plant, Node::Observer);
    let broken = std::thread::spawn(move || {
        let _lab = one;
        panic!("a test that fails while it has a laboratory");
    });
    assert!(broken.join().is_err());
    introduce(&other, Node::Module1, Node::Observer);
    let addresses = format!("{}/24", other.address(Node::Observer));
    drop(other);
    let cards = std::process::Command::new("ip").args(["-o", "address"]).output().unwrap();
    assert!(!String::from_utf8_lossy(&cards.stdout).contains(&addresses));
}

#[test]
#[ignore = "needs a laboratory: network namespaces, as root"]
fn a_command_runs_where_its_node_is_under_its_own_number() {
    let _turn = turn::blocking_alone();
    let lab = Lab::required(8);
    let mut program = std::process::Command::new("sh");
    program.args(["-c", "echo $$; ip -o address show dev lab"]);
    let mut command = lab.command(Node::Module2, program);
    let child = command.stdout(std::process::Stdio::piped()).spawn().unwrap();
    let pid = child.id().to_string();
    let words = String::from_utf8(child.wait_with_output().unwrap().stdout).unwrap();
    assert_eq!(words.lines().next(), Some(pid.as_str()));
    assert!(words.contains(&lab.address(Node::Module2).to_string()), "{words}");
}
