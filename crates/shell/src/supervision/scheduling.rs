//! Logs how the kernel schedules the process, because only the process can show whether the settings of a unit or a
//! drop-in took effect.

use procfs_core::process::{Limit, LimitValue, Limits, Stat};
use procfs_core::{FromRead, ProcResult};

const STAT: &str = "/proc/self/stat";
const LIMITS: &str = "/proc/self/limits";

/// Logs the policy, priority and limits in effect.
pub(crate) fn log() {
    let read = || -> ProcResult<(Stat, Limits)> {
        Ok((Stat::from_file(STAT)?, Limits::from_file(LIMITS)?))
    };
    match read() {
        Ok((stat, limits)) => tracing::info!(
            policy = policy(stat.policy),
            real_time_priority = stat.rt_priority.unwrap_or(0),
            nice = stat.nice,
            open_files = soft(&limits.max_open_files),
            locked_memory_bytes = soft(&limits.max_locked_memory),
            most_real_time_priority = soft(&limits.max_realtime_priority),
            core_bytes = soft(&limits.max_core_file_size),
            "scheduling and limits"
        ),
        Err(error) => tracing::warn!("cannot read scheduling and limits: {error}"),
    }
}

/// The policy's name in `chrt` and systemd.
fn policy(number: Option<u32>) -> String {
    match number {
        Some(0) => "other".to_owned(),
        Some(1) => "fifo".to_owned(),
        Some(2) => "rr".to_owned(),
        Some(3) => "batch".to_owned(),
        Some(5) => "idle".to_owned(),
        Some(6) => "deadline".to_owned(),
        Some(number) => format!("policy {number}"),
        None => "unknown".to_owned(),
    }
}

/// The soft limit.
fn soft(limit: &Limit) -> String {
    match limit.soft_limit {
        LimitValue::Unlimited => "unlimited".to_owned(),
        LimitValue::Value(value) => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_process_has_a_policy_with_a_name_and_limits() {
        let stat = Stat::from_file(STAT).unwrap();
        assert!(["other", "batch", "idle"].contains(&policy(stat.policy).as_str()));
        let limits = Limits::from_file(LIMITS).unwrap();
        let (soft, _) =
            nix::sys::resource::getrlimit(nix::sys::resource::Resource::RLIMIT_NOFILE).unwrap();
        assert_eq!(super::soft(&limits.max_open_files), soft.to_string());
    }

    #[test]
    fn a_real_time_policy_is_reported_by_its_name() {
        assert_eq!(policy(Some(1)), "fifo");
        assert_eq!(policy(Some(99)), "policy 99");
    }
}
