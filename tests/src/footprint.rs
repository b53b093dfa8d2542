//! What a process takes of the machine: time of its processors, and memory.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

/// Length of the ticks in which the kernel accounts a process's CPU time: USER_HZ is 100.
const TICK: Duration = Duration::from_millis(10);
/// Place of the time in user mode among the words behind the command's name; that in the kernel follows.
const USER_TIME: usize = 11;

/// Time of the processors that a process has had since it was started, all its threads together.
///
/// # Panics
/// If there is no such process.
#[must_use]
pub fn processor_time(pid: u32) -> Duration {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap();
    // The command's name may have blanks in it, and stands in brackets.
    let words = stat.rsplit_once(')').unwrap().1.split_whitespace();
    let ticks = words.skip(USER_TIME).take(2).map(|word| word.parse::<u32>().unwrap()).sum();
    TICK * ticks
}

/// What the least takes that a process at 1 kHz can do on this machine: share of a core \[%\] for sending itself a
/// message of a sample's size over TCP, every millisecond for some seconds. On a virtual machine whose processors
/// others use as well it is several times what it is on a quiet one. To be called while the process does nothing
/// else.
///
/// # Panics
/// Without a network.
#[must_use]
pub fn bare_messages_percent() -> f64 {
    const MESSAGES: u32 = 3000;
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut sender = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    sender.set_nodelay(true).unwrap();
    let mut receiver = listener.accept().unwrap().0;
    let received = std::thread::spawn(move || while receiver.read_exact(&mut [0; 512]).is_ok() {});
    let (start, before) = (Instant::now(), processor_time(std::process::id()));
    for count in 1..=MESSAGES {
        let due = start + count * Duration::from_millis(1);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        sender.write_all(&[0; 512]).unwrap();
    }
    let spent = processor_time(std::process::id()) - before;
    drop(sender);
    received.join().unwrap();
    100.0 * spent.as_secs_f64() / start.elapsed().as_secs_f64()
}

/// Resident memory of a process \[KiB\]; `None` if there is no such process, or it has ended.
#[must_use]
pub fn resident_kib(pid: u32) -> Option<u64> {
    of_status(pid, "VmRSS:")
}

/// The most resident memory that a process has had since it was started \[KiB\]; `None` if there is no such
/// process, or it has ended.
#[must_use]
pub fn most_resident_kib(pid: u32) -> Option<u64> {
    of_status(pid, "VmHWM:")
}

fn of_status(pid: u32, name: &str) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Memory of a process \[MiB\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Memory {
    /// Its proportional share: pages that several processes share, such as the program itself, count
    /// to each of them in part.
    pub proportional_mib: f64,
    /// Memory that is not shared.
    pub private_mib: f64,
}

impl Memory {
    /// What a process holds at present.
    ///
    /// # Panics
    /// If there is no such process.
    #[must_use]
    pub fn of(pid: u32) -> Self {
        let rollup = std::fs::read_to_string(format!("/proc/{pid}/smaps_rollup")).unwrap();
        let mib = |name: &str| -> f64 {
            let line = rollup.lines().find_map(|line| line.strip_prefix(name)).unwrap();
            line.trim().trim_end_matches(" kB").parse::<f64>().unwrap() / 1024.0
        };
        let private_mib = mib("Private_Clean:") + mib("Private_Dirty:");
        Self { proportional_mib: mib("Pss:"), private_mib }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_very_process_holds_something_and_is_at_work() {
        let pid = std::process::id();
        let memory = Memory::of(pid);
        assert!(memory.proportional_mib >= memory.private_mib && memory.private_mib > 0.1);
        let before = processor_time(pid);
        let mut spent = Duration::ZERO;
        while spent < 5 * TICK {
            spent = processor_time(pid) - before;
        }
    }
}
