//! Samples at full rate.

use std::collections::BTreeMap;

use serde_json::Value;
use zenoh::bytes::ZBytes;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use super::samples::{Fate, HostileSample, hostile_samples, long_samples, oversized_sample};

/// One in this many is long.
const LONG_EVERY: u64 = 499;
/// One in this many is longer than a message may be.
const OVERSIZED_EVERY: u64 = 4_999;

/// Publishes `count` hostile samples one after the other, waiting where the network is full, so that
/// none is lost; how many of each kind.
pub async fn pour(
    session: &Session,
    key: &'static str,
    sample: &Value,
    count: u64,
) -> BTreeMap<Fate, u64> {
    let (short, long) = (shared(short_ones(sample)), shared(long_samples(sample)));
    let oversized = shared(vec![oversized_sample()]);
    let choose = move |number: u64| {
        let kind = match number {
            n if n % OVERSIZED_EVERY == OVERSIZED_EVERY / 2 => &oversized,
            n if n % LONG_EVERY == LONG_EVERY / 2 => &long,
            _ => &short,
        };
        kind[number as usize % kind.len()].clone()
    };
    publish(session, key, count, choose).await
}

/// The same with one kind of sample only: well-formed, and with very many values.
pub async fn pour_long(
    session: &Session,
    key: &'static str,
    sample: &Value,
    count: u64,
) -> BTreeMap<Fate, u64> {
    let mut long = long_samples(sample);
    long.retain(|sample| sample.fate == Fate::OtherSource);
    let long = shared(long);
    publish(session, key, count, move |_| long[0].clone()).await
}

async fn publish(
    session: &Session,
    key: &'static str,
    count: u64,
    choose: impl Fn(u64) -> (Fate, ZBytes) + Send + 'static,
) -> BTreeMap<Fate, u64> {
    let publisher = session.declare_publisher(key).congestion_control(CongestionControl::Block);
    let publisher = publisher.await.unwrap();
    let pouring = tokio::task::spawn_blocking(move || {
        let mut sent = BTreeMap::new();
        for (fate, bytes) in (0..count).map(choose) {
            publisher.put(bytes).wait().unwrap();
            *sent.entry(fate).or_default() += 1;
        }
        publisher.undeclare().wait().unwrap();
        sent
    });
    pouring.await.unwrap()
}

/// The true sample, repeated by an unknown publisher, is hostile too.
fn short_ones(sample: &Value) -> Vec<HostileSample> {
    let repeated = serde_json::to_vec(sample).unwrap();
    let repeated = HostileSample { bytes: repeated, fate: Fate::OtherSource };
    hostile_samples(sample).into_iter().chain([repeated]).collect()
}

fn shared(samples: Vec<HostileSample>) -> Vec<(Fate, ZBytes)> {
    samples.into_iter().map(|sample| (sample.fate, sample.bytes.into())).collect()
}
