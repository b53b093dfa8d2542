//! A link of TLS that carries as much as it can in both directions at once: nothing is lost, changed or
//! torn down. And one that carries nothing any more ends, whatever is still unsent.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use pki::{Authority, Holder, Lifetime};
use session::Network;
use system_tests::deployment::free_endpoint;
use system_tests::in_time;
use system_tests::turn;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::oneshot;
use zenoh::Session;
use zenoh::qos::CongestionControl;
use zenoh::sample::SampleKind;

/// Messages in each direction.
const MESSAGES: u64 = 20_000;
/// For a long time.
const MANY_MESSAGES: u64 = 200_000;
/// Messages under way at most, far fewer than fit into queues.
const WINDOW: u64 = 500;
/// The size of a sample \[bytes\].
const SIZE: usize = 600;
const GLANCE: Duration = Duration::from_millis(1);
/// A message of which a second's worth fits into no socket \[bytes\].
const LARGE: usize = 60_000;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn both_directions_of_a_link_carry_everything_in_order() {
    let _turn = turn::side_by_side().await;
    carry(MESSAGES).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "the same ten times as long takes most of a minute"]
async fn both_directions_of_a_link_carry_everything_in_order_for_a_long_time() {
    let _turn = turn::alone().await;
    carry(MANY_MESSAGES).await;
}

async fn carry(messages: u64) {
    let folder = tempfile::tempdir().unwrap();
    issue(folder.path(), &["module1", "module2"]);
    let endpoint = free_endpoint().replace("tcp/", "tls/");
    let of = |holder: &str| Network { tls: Some(folder.path().join(holder)), ..Network::default() };
    let first = Network { listen: vec![endpoint.clone()], ..of("module1") };
    let second = Network { connect: vec![endpoint], ..of("module2") };
    let first = session::open(&first).await.unwrap();
    let second = session::open(&second).await.unwrap();
    let there = in_order(&second, "there").await;
    let back = in_order(&first, "back").await;
    tokio::join!(send(&first, "there", &there, messages), send(&second, "back", &back, messages));
    session::close(&first).await;
    session::close(&second).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_process_that_is_cut_off_is_missed_though_much_is_unsent() {
    let _turn = turn::side_by_side().await;
    let folder = tempfile::tempdir().unwrap();
    issue(folder.path(), &["module1", "module2"]);
    let of = |holder: &str| Network { tls: Some(folder.path().join(holder)), ..Network::default() };
    let near = free_endpoint();
    let (cable, cut) = cable(near.trim_start_matches("tcp/").to_owned()).await;
    let first = Network { listen: vec![near.replace("tcp/", "tls/")], ..of("module1") };
    let second = Network { connect: vec![cable], ..of("module2") };
    let first = session::open(&first).await.unwrap();
    let second = session::open(&second).await.unwrap();
    let _taken = second.declare_subscriber("large").callback(|_| {}).await.unwrap();
    let _token = second.liveliness().declare_token("second").await.unwrap();
    let tokens = first.liveliness().declare_subscriber("second").history(true).await.unwrap();
    let come = in_time("the token", tokens.recv_async()).await.unwrap();
    assert_eq!(come.kind(), SampleKind::Put);
    let large = first.declare_publisher("large").congestion_control(CongestionControl::Drop);
    let large = large.await.unwrap();
    cut.send(()).unwrap();
    // Without the end of its lease the token would stay: neither side learns that nothing passes.
    let gone = in_time("the end of the token", async {
        loop {
            tokio::select! {
                token = tokens.recv_async() => return token.unwrap().kind(),
                () = tokio::time::sleep(GLANCE) => large.put(vec![0; LARGE]).await.unwrap(),
            }
        }
    });
    assert_eq!(gone.await, SampleKind::Delete);
    session::close(&first).await;
    session::close(&second).await;
}

/// A cable to this address for one connection, its far end, and what cuts it: nothing passes then, and
/// neither side learns of it.
async fn cable(to: String) -> (String, oneshot::Sender<()>) {
    let far = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let endpoint = format!("tls/{}", far.local_addr().unwrap());
    let (cut, is_cut) = oneshot::channel::<()>();
    tokio::spawn(async move {
        let (mut far, _) = far.accept().await.unwrap();
        let mut near = TcpStream::connect(to).await.unwrap();
        tokio::select! {
            _ = tokio::io::copy_bidirectional(&mut far, &mut near) => {}
            _ = is_cut => std::future::pending().await,
        }
    });
    (endpoint, cut)
}

fn issue(library: &Path, holders: &[&str]) {
    let days = Lifetime::of_days(1);
    let authority = Authority::create(library, "tower".parse().unwrap(), days).unwrap();
    let here = ["127.0.0.1".parse().unwrap()];
    for holder in holders {
        let directory = library.join(holder);
        authority.issue(&directory, holder.parse::<Holder>().unwrap(), &here, days).unwrap();
    }
}

/// The message with this number: the number, and as often as fits.
fn message(number: u64) -> Vec<u8> {
    number.to_le_bytes().repeat(SIZE / 8)
}

/// Counts the messages that come whole and in order; any other one ends the count.
async fn in_order(session: &Session, key: &str) -> Arc<AtomicU64> {
    let count = Arc::new(AtomicU64::new(0));
    let counted = count.clone();
    let take = move |sample: zenoh::sample::Sample| {
        let expected = counted.load(Ordering::Acquire);
        if *sample.payload().to_bytes() == message(expected) {
            counted.store(expected + 1, Ordering::Release);
        }
    };
    session.declare_subscriber(key.to_owned()).callback(take).background().await.unwrap();
    count
}

/// Fails if nothing arrives any more, however long everything takes.
async fn send(session: &Session, key: &str, arrived: &AtomicU64, messages: u64) {
    let publisher = session.declare_publisher(key.to_owned());
    let publisher = publisher.congestion_control(CongestionControl::Block).await.unwrap();
    while !publisher.matching_status().await.unwrap().matching() {
        tokio::time::sleep(GLANCE).await;
    }
    let reach = async |count: u64| {
        while arrived.load(Ordering::Acquire) < count {
            tokio::time::sleep(GLANCE).await;
        }
    };
    for number in 0..messages {
        in_time("the next messages", reach((number + 1).saturating_sub(WINDOW))).await;
        in_time("room for a message", publisher.put(message(number)).into_future()).await.unwrap();
    }
    for left in (0..WINDOW).rev() {
        in_time("the last messages", reach(messages - left)).await;
    }
}
