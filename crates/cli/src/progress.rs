//! Progress of long work on standard error: a bar with the remaining time on a terminal, occasional lines elsewhere.

use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};

use indicatif::{ProgressBar, ProgressStyle};

/// Number of progress lines printed without a terminal.
const LINES: u64 = 10;

/// The progress of work done by several threads.
pub(crate) struct WorkProgress {
    what: &'static str,
    unit: &'static str,
    bar: ProgressBar,
    is_terminal: bool,
    done: AtomicU64,
    all: u64,
}

impl WorkProgress {
    /// Of so many items; in what unit they are counted.
    pub(crate) fn new(what: &'static str, unit: &'static str, all: u64) -> WorkProgress {
        let template = format!("{{msg}} {{wide_bar}} {{pos}} of {{len}} {unit}, {{eta}} left");
        let style = ProgressStyle::with_template(&template)
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::new(all).with_style(style).with_message(what);
        WorkProgress {
            what,
            unit,
            bar,
            is_terminal: io::stderr().is_terminal(),
            done: AtomicU64::new(0),
            all,
        }
    }

    /// Records that one more item is done.
    pub(crate) fn advance(&self) {
        self.bar.inc(1);
        let before = self.done.fetch_add(1, Ordering::Relaxed);
        let tenth = |done: u64| done * LINES / self.all.max(1);
        if tenth(before + 1) > tenth(before) && !self.is_terminal {
            let (what, done, all, unit) = (self.what, before + 1, self.all, self.unit);
            // Standard error may be closed.
            let _ = writeln!(io::stderr(), "{what}: {done} of {all} {unit}");
        }
    }
}

impl Drop for WorkProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
