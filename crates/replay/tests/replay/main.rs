//! Exact replay, comparison, and replay with other settings.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

mod exact;
mod live;
mod other_settings;

use live::Live;
use replay::{Collection, ModuleRecord, Replayed, Shortfall, courses, replay};
use vocabulary::fault::Fault;

/// A run with a fault of a gage that shows in both modules.
fn with_fault() -> Live {
    fault_in(Live::new(|_| {}))
}

/// The same with diagnosers that have no reference: only changes are found.
fn without_reference() -> Live {
    fault_in(Live::new(|setup| setup.reference = None))
}

fn fault_in(mut live: Live) -> Live {
    live.run(5000);
    live.inject("module1/sensor/g5", Fault::Bias { offset_m: 2e-4 });
    live.run(3000);
    live
}

fn collect(live: &Live) -> Vec<ModuleRecord> {
    let mut collection = Collection::default();
    for message in &live.published {
        collection.take(&message.topic, &message.payload);
    }
    collection.finish()
}

/// All processes of all modules.
fn replay_all(records: &[ModuleRecord]) -> Vec<Result<Replayed, Shortfall>> {
    let of_module = |record: &ModuleRecord| -> Vec<Result<Replayed, Shortfall>> {
        let all = courses(record).into_iter();
        all.map(|(_, course)| replay(record, &course?)).collect()
    };
    records.iter().flat_map(of_module).collect()
}
