//! The process that sends notifications: the overview says when it does not get them through.

use std::sync::Arc;
use std::time::Duration;

use maud::{Markup, html};
use parking_lot::Mutex;
use shell::health::{ProbeKind, probe};
use tokio::task::JoinSet;
use tokio::time::sleep;

use crate::look;

/// Interval of asking for its health, and the longest wait for the answer.
const EVERY: Duration = Duration::from_secs(5);
const WITHIN: Duration = Duration::from_secs(2);

/// What is known of its health.
#[derive(Debug, Default)]
pub(crate) struct Notifier {
    problem: Arc<Mutex<Option<String>>>,
    _task: JoinSet<()>,
}

impl Notifier {
    /// Asks the process at this health address, if one is given, until it is dropped.
    pub(crate) fn watching(address: Option<String>) -> Self {
        let mut notifier = Self::default();
        let Some(address) = address else { return notifier };
        let problem = Arc::clone(&notifier.problem);
        notifier._task.spawn(async move {
            loop {
                let found = match probe(&address, ProbeKind::Ready, WITHIN).await {
                    Ok(condition) if condition.well => None,
                    Ok(condition) => Some(condition.words),
                    Err(error) => Some(error.to_string()),
                };
                *problem.lock() = found;
                sleep(EVERY).await;
            }
        });
        notifier
    }

    /// That notifications do not get through; empty without a problem.
    pub(crate) fn banner(&self) -> Markup {
        let problem = self.problem.lock().clone();
        html! {
            @if let Some(problem) = problem {
                p.banner { (look::sign("unconfirmed")) "Notifications are not delivered: " (problem) }
            }
        }
    }
}
