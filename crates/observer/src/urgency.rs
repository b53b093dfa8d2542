//! Which component needs attention first.

use wire::{FaultState, FaultTransition};

/// From what needs attention most to what needs none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Urgency {
    /// A fault that no operator has acknowledged.
    Latched,
    /// Perhaps a fault.
    Unconfirmed,
    /// It is not known whether it is healthy.
    Unknown,
    /// A fault that an operator has acknowledged.
    Acknowledged,
    /// Any of these, but its alarm is set aside for a time.
    SetAside,
    /// It changed, and what explains that is known.
    Explained,
    /// It changed a moment ago.
    Tentative,
    /// Nothing.
    Normal,
}

impl Urgency {
    /// Of a component in its present state.
    #[must_use]
    pub fn of(component: &FaultTransition) -> Self {
        let urgency = match component.state() {
            FaultState::Latched => Urgency::Latched,
            FaultState::Unconfirmed => Urgency::Unconfirmed,
            FaultState::Unknown => Urgency::Unknown,
            FaultState::Acknowledged => Urgency::Acknowledged,
            FaultState::Explained => Urgency::Explained,
            FaultState::Tentative => Urgency::Tentative,
            FaultState::Normal => Urgency::Normal,
        };
        if urgency.needs_attention() && component.aside().is_some() {
            Urgency::SetAside
        } else {
            urgency
        }
    }

    /// Whether somebody has to do something about it now.
    #[must_use]
    pub fn needs_attention(self) -> bool {
        self < Urgency::SetAside
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::Shelving;

    #[test]
    fn what_is_set_aside_comes_after_what_needs_attention_and_before_the_rest() {
        let of = |state, is_shelved: bool| {
            let component = "m1/sensor/g1".parse().unwrap();
            let untouched = FaultTransition::untouched("t".parse().unwrap(), component, 5);
            let shelved = is_shelved.then(|| Shelving {
                since_unix_ns: 1,
                until_unix_ns: 2,
                by: "ada".to_owned(),
                on_behalf_of: None,
                reason: "painting".to_owned(),
            });
            Urgency::of(&FaultTransition {
                verdict: wire::Verdict::example(state),
                shelved,
                ..untouched
            })
        };
        assert_eq!(of(FaultState::Latched, false), Urgency::Latched);
        assert_eq!(of(FaultState::Latched, true), Urgency::SetAside);
        assert_eq!(of(FaultState::Normal, true), Urgency::Normal);
        assert!(Urgency::Acknowledged.needs_attention() && !Urgency::SetAside.needs_attention());
    }
}
