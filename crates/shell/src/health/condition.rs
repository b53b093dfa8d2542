//! Healthy or not, and the text of the report.

use std::time::Duration;

use crate::supervision::{OPENING, STOPPING, Sign};

/// A loop without progress for this long is considered hung: the watchdog timeout of the shipped units.
const TIMEOUT: Duration = Duration::from_secs(2);

/// Healthy or not, with the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HealthCondition {
    /// Whether it is healthy.
    pub well: bool,
    /// The reason, for people.
    pub words: String,
}

impl HealthCondition {
    /// A healthy condition.
    #[must_use]
    pub fn well(words: impl Into<String>) -> Self {
        Self { well: true, words: words.into() }
    }

    /// An unhealthy condition.
    #[must_use]
    pub fn unwell(words: impl Into<String>) -> Self {
        Self { well: false, words: words.into() }
    }
}

/// The liveness of a loop with this latest heartbeat.
#[must_use]
pub fn live(sign: Sign) -> HealthCondition {
    match sign {
        Sign::NotYet => HealthCondition::unwell(OPENING),
        Sign::Over => HealthCondition::unwell(STOPPING),
        Sign::Stuck(thread, age) => {
            let age_s = age.as_secs_f64();
            HealthCondition::unwell(format!(
                "the thread `{thread}` has made no progress for {age_s:.1} s"
            ))
        }
        Sign::Ago(age) if age < TIMEOUT => HealthCondition::well("the loop is live"),
        Sign::Ago(age) => {
            let age_s = age.as_secs_f64();
            HealthCondition::unwell(format!("the loop has made no progress for {age_s:.1} s"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_is_alive_while_it_makes_progress() {
        assert!(live(Sign::Ago(Duration::from_millis(50))).well);
        assert!(live(Sign::Ago(TIMEOUT - Duration::from_millis(1))).well);
        let hung = live(Sign::Ago(Duration::from_millis(2500)));
        assert_eq!(hung, HealthCondition::unwell("the loop has made no progress for 2.5 s"));
        let stuck = live(Sign::Stuck("events", Duration::from_secs(12)));
        let words = "the thread `events` has made no progress for 12.0 s";
        assert_eq!(stuck, HealthCondition::unwell(words));
        assert_eq!(live(Sign::NotYet), HealthCondition::unwell("opening a session"));
        assert_eq!(live(Sign::Over), HealthCondition::unwell("stopping"));
    }
}
