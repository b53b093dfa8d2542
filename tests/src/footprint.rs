//! What a process takes of the machine: time of its processors, and memory.

use std::time::{Duration, Instant};

use session::{Network, loopback};

use crate::in_time;

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

/// Share of a core \[%\] that this process takes for nothing but publishing a message of a sample's size over Zenoh,
/// and receiving it in another session, every millisecond for some seconds. It is built as the diagnosers are, so
/// that it measures the machine, the network's library and the profile with all their mixture of kernel and user
/// mode, and none of what a diagnoser does with a sample. To be called while the process does nothing else.
///
/// # Panics
/// Without a network.
pub async fn bare_messages_percent() -> f64 {
    const MESSAGES: u32 = 3000;
    const KEY: &str = "bare/messages";
    let [endpoint] = loopback::endpoints().unwrap();
    let listening = Network { listen: vec![endpoint.clone()], ..Network::default() };
    let receiver = in_time("a session", session::open(&listening)).await.unwrap();
    let received = receiver.declare_subscriber(KEY).await.unwrap();
    let sender = in_time("a session", session::open(&Network::peer_of(&[endpoint]))).await.unwrap();
    let publisher = sender.declare_publisher(KEY).await.unwrap();
    while !publisher.matching_status().await.unwrap().matching() {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    let (start, before) = (Instant::now(), processor_time(std::process::id()));
    let receiving = tokio::spawn(async move {
        for _ in 0..MESSAGES {
            in_time("a message", received.recv_async()).await.unwrap();
        }
    });
    for count in 1..=MESSAGES {
        let due = start + count * Duration::from_millis(1);
        tokio::time::sleep(due.saturating_duration_since(Instant::now())).await;
        publisher.put([0; 512]).await.unwrap();
    }
    receiving.await.unwrap();
    let spent = processor_time(std::process::id()) - before;
    let percent = 100.0 * spent.as_secs_f64() / start.elapsed().as_secs_f64();
    session::close(&sender).await;
    session::close(&receiver).await;
    percent
}

/// Resident memory that a process has allocated \[KiB\]; `None` if there is no such process, or it has ended. The pages of
/// its program's file are not counted: the kernel takes them away and brings them back as it likes.
#[must_use]
pub fn allocated_kib(pid: u32) -> Option<u64> {
    of_status(pid, "RssAnon:")
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
