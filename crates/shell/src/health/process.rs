//! Metrics common to all processes.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;
use std::time::Duration;

use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike;
use procfs_core::FromRead;
use procfs_core::process::{Stat, Status};

use super::sheet::Sheet;
use crate::supervision::Sign;

const STATUS: &str = "/proc/self/status";
const THREADS: &str = "/proc/self/task";
/// Ticks of Linux's accounts of processor time \[1/s\], the same on every machine.
const USER_HZ: f64 = 100.0;

/// The resource use of the process, and its liveness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProcessReport {
    /// The loop's latest heartbeat.
    pub sign: Sign,
    /// Processor time of all threads \[s\]; `None` if the system does not report it.
    pub processor_s: Option<f64>,
    /// Resident memory, including shared pages \[bytes\]; `None` if the system does not report it.
    pub resident_bytes: Option<u64>,
}

impl ProcessReport {
    /// Reads the present values from the system.
    pub fn read(sign: Sign) -> Self {
        Self { sign, processor_s: processor_s(), resident_bytes: resident_bytes() }
    }

    /// Writes the metrics.
    ///
    /// # Errors
    /// A metric cannot be written.
    pub fn write(&self, sheet: &mut Sheet<'_>) -> fmt::Result {
        let version = ("version", env!("CARGO_PKG_VERSION"));
        sheet.info("trusswatch_build", "The software.", version)?;
        let age_s = match self.sign {
            Sign::Ago(age) | Sign::Stuck(_, age) => Some(age.as_secs_f64()),
            Sign::NotYet | Sign::Over => None,
        };
        sheet.seconds("trusswatch_loop_age", "Since the loop's latest heartbeat.", age_s)?;
        if let Some(time_s) = self.processor_s {
            let help = "Processor time, user and system, of all threads.";
            sheet.counted_seconds("process_cpu", help, time_s)?;
        }
        if let Some(bytes) = self.resident_bytes {
            sheet.bytes("process_resident_memory", "Memory in use.", bytes)?;
        }
        Ok(())
    }
}

fn processor_s() -> Option<f64> {
    let usage = getrusage(UsageWho::RUSAGE_SELF).ok()?;
    let microseconds = (usage.user_time() + usage.system_time()).num_microseconds();
    let microseconds = u64::try_from(microseconds).ok()?;
    Some(Duration::from_micros(microseconds).as_secs_f64())
}

fn resident_bytes() -> Option<u64> {
    let kibibytes = Status::from_file(STATUS).ok()?.vmrss?;
    Some(kibibytes * 1024)
}

/// Processor time that each thread of this process has had so far \[s\], by its number, with its name. Empty if the system
/// does not report it.
#[must_use]
pub fn thread_times() -> BTreeMap<i32, (String, f64)> {
    let time = |thread: &Path| {
        let stat = Stat::from_file(thread.join("stat")).ok()?;
        #[expect(clippy::cast_precision_loss, reason = "ticks of years stay far below 2^53")]
        let time_s = (stat.utime + stat.stime) as f64 / USER_HZ;
        Some((stat.pid, (stat.comm, time_s)))
    };
    let threads = std::fs::read_dir(THREADS).into_iter().flatten().flatten();
    threads.filter_map(|thread| time(&thread.path())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_busy_thread_is_told_from_the_others_by_its_name() {
        let busy = std::thread::Builder::new().name("busy".to_owned());
        let (ending, ended) = std::sync::mpsc::channel::<()>();
        let spins =
            move || while ended.try_recv() != Err(std::sync::mpsc::TryRecvError::Disconnected) {};
        let busy = busy.spawn(spins).unwrap();
        let of = || thread_times().into_values().find(|(name, _)| name == "busy");
        while of().is_none_or(|(_, time_s)| time_s < 0.05) {
            std::thread::sleep(Duration::from_millis(5));
        }
        drop(ending);
        busy.join().unwrap();
        assert_eq!(of(), None);
    }

    #[test]
    fn this_process_has_used_time_and_memory() {
        let first = ProcessReport::read(Sign::NotYet);
        assert!(first.resident_bytes.unwrap() > 100_000, "{first:?}");
        let used = first.processor_s.unwrap();
        let mut spent = 0.0;
        for round in 0..u64::MAX {
            spent = ProcessReport::read(Sign::NotYet).processor_s.unwrap() - used;
            if std::hint::black_box(round) > 1000 && spent > 0.0 {
                break;
            }
        }
        assert!(spent > 0.0);
    }
}
