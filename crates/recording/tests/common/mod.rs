//! Messages and files for the tests.
#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "each test uses its own part, and fails by what it cannot do"
)]

use std::path::Path;

use recording::{Recorded, Recording, Writer};

/// A sample of this step with some forty values.
pub fn sample(step: u64) -> Recorded {
    let values: Vec<f64> = (0..40).map(|i| ((step * 31 + i * 17) as f64).sin() * 1e-4).collect();
    let payload = format!(
        r#"{{"v":1,"module":"module1","run":1,"step":{step},"time_unix_ns":{},"demands_n":[],"pressures_pa":[],"elongations_m":{values:?}}}"#,
        1_000_000_000 + step * 1_000_000,
    );
    let topic = "trusswatch/tower/module1/sample".to_owned();
    Recorded::received(topic, payload.into_bytes(), 0)
}

/// Writes samples, synced after each so many. Returns what was on the disk after each sync, and how many it had.
pub fn write(file: &Path, samples: u64, sync_every: u64) -> Vec<(u64, u64)> {
    let mut writer = Writer::create(file).unwrap();
    let mut synced = vec![(writer.written().unwrap(), 0)];
    for step in 0..samples {
        writer.write(&sample(step)).unwrap();
        if (step + 1).is_multiple_of(sync_every) {
            writer.sync().unwrap();
            synced.push((writer.written().unwrap(), step + 1));
        }
    }
    writer.finish().unwrap();
    synced
}

/// All messages of a file without damage.
pub fn read(file: &Path) -> Vec<Recorded> {
    Recording::open(file).unwrap().messages().unwrap().map(Result::unwrap).collect()
}
