//! Who issues a command.

use wire::Order;

use super::carry_out::Manner;
use super::subject::Subject;

/// A person, and the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Issuer {
    pub(super) by: String,
    pub(super) note: Option<String>,
}

impl Issuer {
    /// A command concerning a component or a module.
    pub(super) fn order(&self, subject: &Subject, manner: Manner) -> Order {
        let Issuer { by, note } = self.clone();
        let Manner { force, re_tare, for_s, .. } = manner;
        let component = subject.mention();
        Order { component, by, on_behalf_of: None, note, for_s, force, re_tare }
    }
}

/// `USER@HOST` from the environment; `None` if it names no user.
pub(super) fn from_environment() -> Option<String> {
    let variable = |name| std::env::var(name).ok().filter(|user: &String| !user.trim().is_empty());
    let user = variable("USER").or_else(|| variable("LOGNAME"))?;
    let host = nix::unistd::gethostname().ok()?;
    Some(format!("{user}@{}", host.to_string_lossy()))
}
