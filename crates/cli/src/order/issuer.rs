//! Who issues a command.

use names::ComponentPath;
use wire::Order;

/// A person, and the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Issuer {
    pub(super) by: String,
    pub(super) note: Option<String>,
}

impl Issuer {
    /// A command concerning a component.
    pub(super) fn order(&self, component: &ComponentPath, force: bool, re_tare: bool) -> Order {
        let Issuer { by, note } = self.clone();
        let component = Some(component.component.clone().into());
        Order { component, by, note, force, re_tare, ..Order::default() }
    }
}

/// `USER@HOST` from the environment; `None` if it names no user.
pub(super) fn from_environment() -> Option<String> {
    let variable = |name| std::env::var(name).ok().filter(|user: &String| !user.trim().is_empty());
    let user = variable("USER").or_else(|| variable("LOGNAME"))?;
    let host = nix::unistd::gethostname().ok()?;
    Some(format!("{user}@{}", host.to_string_lossy()))
}
