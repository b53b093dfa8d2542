//! The table of verdicts.

use std::collections::BTreeSet;
use std::io;
use std::path::Path;
use std::sync::Arc;

use ::replay::{ModuleRecord, latest_setup};
use vocabulary::Step;

use vocabulary::words::reason;

const HEADING: [&str; 13] = [
    "structure",
    "module",
    "sequence",
    "run",
    "component",
    "state",
    "onset_step",
    "detection_step",
    "decided_step",
    "decided_s",
    "published_s",
    "explained_by",
    "why",
];

/// Writes the table; returns the number of verdicts.
pub(super) fn write(file: &Path, records: &[Arc<ModuleRecord>]) -> io::Result<usize> {
    let mut out = csv::Writer::from_path(file)?;
    out.write_record(HEADING)?;
    let mut seen = BTreeSet::new();
    for record in records {
        let step_s = latest_setup(record).ok().map(|setup| setup.step_s);
        for message in &record.transitions {
            let time = message.time_unix_ns;
            if !seen.insert((message.component.to_string(), message.sequence, time)) {
                continue;
            }
            let step = |step: Option<Step>| step.map_or_else(String::new, |step| step.to_string());
            let seconds = message.decided_step.zip(step_s);
            out.write_record([
                record.structure.to_string(),
                record.module.to_string(),
                message.sequence.to_string(),
                message.run.map_or_else(String::new, |run| run.to_string()),
                message.component.component.to_string(),
                message.state().to_string(),
                step(message.onset_step),
                step(message.detection_step),
                step(message.decided_step),
                seconds.map_or_else(String::new, |(step, s)| format!("{:?}", step.0 as f64 * s)),
                format!("{}.{:09}", time / 1_000_000_000, time % 1_000_000_000),
                message.verdict.explained_by().map_or_else(String::new, ToString::to_string),
                reason(message),
            ])?;
        }
    }
    out.flush()?;
    Ok(seen.len())
}
