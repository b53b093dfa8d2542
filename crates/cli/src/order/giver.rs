//! Who gives an order.

use truss::ids::ComponentPath;
use wire::Order;

/// A person, and the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Giver {
    pub(super) by: String,
    pub(super) note: Option<String>,
}

impl Giver {
    /// An order concerning a component.
    pub(super) fn order(&self, component: &ComponentPath, force: bool) -> Order {
        let Giver { by, note } = self.clone();
        Order { component: component.component.clone(), by, note, force }
    }
}

/// `USER@HOST`, as the surroundings tell; `None` if they tell no user.
pub(super) fn from_surroundings() -> Option<String> {
    let told = |name| std::env::var(name).ok().filter(|user: &String| !user.trim().is_empty());
    let user = told("USER").or_else(|| told("LOGNAME"))?;
    let host = nix::unistd::gethostname().ok()?;
    Some(format!("{user}@{}", host.to_string_lossy()))
}
