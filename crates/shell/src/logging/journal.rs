//! Logging to the systemd journal.

use std::fs::File;
use std::io;
use std::os::fd::AsFd;
use std::os::unix::fs::MetadataExt;

use tracing_journald::{Priority, PriorityMappings};

use super::rewriting::{Rewriting, with_fields_in_text};

/// Device and inode of the stream connected to the journal, set by the service manager.
const VARIABLE: &str = "JOURNAL_STREAM";
/// `journalctl TRUSSWATCH_COMPONENT=module1/sensor/g2`: the prefix marks fields of trusswatch.
const PREFIX: &str = "TRUSSWATCH";

/// Whether standard error is a stream to the journal. The variable alone does not prove it: a process that inherits it
/// may have redirected the stream.
pub(super) fn is_connected() -> bool {
    let Ok(named) = std::env::var(VARIABLE) else { return false };
    standard_error_stream().is_ok_and(|stream| stream == named)
}

fn standard_error_stream() -> io::Result<String> {
    let duplicate = io::stderr().as_fd().try_clone_to_owned()?;
    let stream = File::from(duplicate).metadata()?;
    Ok(format!("{}:{}", stream.dev(), stream.ino()))
}

/// The layer that writes to the journal.
///
/// # Errors
/// The journal is not available.
pub(super) fn layer() -> io::Result<Rewriting<tracing_journald::Layer>> {
    let layer = tracing_journald::layer()?
        .with_field_prefix(Some(PREFIX.to_owned()))
        .with_priority_mappings(priorities());
    Ok(Rewriting(layer, with_fields_in_text))
}

/// Maps each level to the priority of the same name.
fn priorities() -> PriorityMappings {
    PriorityMappings {
        error: Priority::Error,
        warn: Priority::Warning,
        info: Priority::Informational,
        debug: Priority::Debug,
        trace: Priority::Debug,
    }
}
