//! An operator's commands concerning a fault, and why one may be refused.
//!
//! The life of a fault: latched → acknowledged (an operator has seen it) → reset (it is repaired). A
//! reset is refused while the evidence persists, unless forced.

use vocabulary::Component;
use vocabulary::words::residual;

/// The shell's token of a command it passed in, returned with the outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct OrderToken(pub u64);

/// Why a command was refused; nothing changed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OrderRefusal {
    /// The module has no such component.
    #[error("this module has no `{0}`; name one of its actuators or sensors")]
    Unknown(Component),
    /// No fault to acknowledge.
    #[error("`{component}` {}; only a latched fault can be acknowledged", standing(.state))]
    NothingToAcknowledge {
        /// The component.
        component: Component,
        /// Its state.
        state: &'static str,
    },
    /// There is nothing to reset.
    #[error(
        "`{component}` {}; only an acknowledged fault or an unconfirmed one can be reset",
        standing(.state)
    )]
    NothingToReset {
        /// The component.
        component: Component,
        /// Its state.
        state: &'static str,
    },
    /// It is declared faulty already.
    #[error("`{component}` is {state} already")]
    AlreadyFaulty {
        /// The component.
        component: Component,
        /// Its state.
        state: &'static str,
    },
    /// A gage cannot be shut off.
    #[error("`{0}` is not a cylinder; only a cylinder can be shut off")]
    NotACylinder(Component),
    /// A cylinder without a fault stays in service.
    #[error("`{component}` {}; only a cylinder with a latched fault can be shut off", standing(.state))]
    NothingToShutOff {
        /// The component.
        component: Component,
        /// Its state.
        state: &'static str,
    },
    /// There is nothing to put back.
    #[error("`{0}` is not shut off")]
    NotShutOff(Component),
    /// It would not be monitored after a reset.
    #[error("`{0}` is shut off; put it back first, or force the reset")]
    ShutOff(Component),
    /// There is nothing to unshelve.
    #[error("`{0}` is not shelved")]
    NotShelved(Component),
    /// There is nothing to unsuppress.
    #[error("`{0}` is not suppressed")]
    NotSuppressed(Component),
    /// No shelving or suppression has expired.
    #[error("no expired shelving or suppression for `{0}`")]
    NothingIsOver(Component),
    /// The fault is not acknowledged yet.
    #[error("`{0}` is not acknowledged; acknowledge it first, or force the reset")]
    NotAcknowledged(Component),
    /// The present state of the component is not known.
    #[error(
        "`{0}` is not watched at present; wait until the module is in service, or force the reset"
    )]
    NotWatched(Component),
    /// The divergence is still above its threshold, or was a moment ago.
    #[error(
        "`{component}` is still changing, divergence at {ratio:.1} times its threshold; repair it, or force the reset"
    )]
    StillChanging {
        /// The component.
        component: Component,
        /// D/γ now.
        ratio: f64,
    },
    /// The interval of the Gaussian still holds the latest change, so that its leaving would look like
    /// a fault.
    #[error(
        "`{component}` changed a moment ago; wait {steps} more steps for the interval to pass, or force the reset"
    )]
    StillInInterval {
        /// The component.
        component: Component,
        /// Steps to go.
        steps: u64,
    },
    /// It, or one of several that it belongs to, still departs from its reference.
    #[error(
        "`{component}` still departs from its reference{}; repair it, re-tare what was replaced, or force the reset",
        aside(.how)
    )]
    StillDeparted {
        /// The component.
        component: Component,
        /// By how much, or which others may depart instead; `None` if that is not known.
        how: Option<String>,
    },
    /// It cannot be compared with its reference.
    #[error(
        "`{0}` has not been compared with its reference since; wait for a window, or force the reset"
    )]
    NotCompared(Component),
    /// Nothing is there to shift.
    #[error("`{0}` cannot be re-tared: its module has no reference, or has not compared it yet")]
    NothingToReTare(Component),
    /// The residual is still where the fault took it.
    #[error(
        "residual of `{component}` is still displaced by {}, it was {} when the fault was found; repair it, or force the reset",
        residual(.component.kind(), *.now),
        residual(.component.kind(), *.found)
    )]
    StillDisplaced {
        /// The component.
        component: Component,
        /// Slow mean of the residual less what it was before the fault \[N\] or \[m\].
        now: f64,
        /// The residual at the detection less what it was before the fault \[N\] or \[m\].
        found: f64,
    },
}

/// A component without a fault may still be one of which nothing is known: it is not called normal.
fn standing(state: &str) -> String {
    if state == "normal" { "has no known fault".to_owned() } else { format!("is {state}") }
}

fn aside(how: &Option<String>) -> String {
    how.as_ref().map_or_else(String::new, |how| format!(", {how}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_hinders_a_reset_is_told_with_its_unit() {
        let component = || "sensor/g2".parse().unwrap();
        let departed = |how: Option<&str>| {
            let how = how.map(str::to_owned);
            OrderRefusal::StillDeparted { component: component(), how }.to_string()
        };
        let repair = "; repair it, re-tare what was replaced, or force the reset";
        let departs = "`sensor/g2` still departs from its reference";
        assert_eq!(departed(None), format!("{departs}{repair}"));
        let by = Some("its mean by +83.00 µm");
        assert_eq!(departed(by), format!("{departs}, its mean by +83.00 µm{repair}"));
        let displaced =
            OrderRefusal::StillDisplaced { component: component(), now: 8.2e-5, found: 8.3e-5 };
        let expected = "residual of `sensor/g2` is still displaced by +82.00 µm, it was +83.00 µm \
                        when the fault was found; repair it, or force the reset";
        assert_eq!(displaced.to_string(), expected);
    }

    #[test]
    fn what_has_no_fault_is_not_called_normal() {
        let refused = |state| {
            let component = "sensor/g7".parse().unwrap();
            OrderRefusal::NothingToAcknowledge { component, state }.to_string()
        };
        let only = "only a latched fault can be acknowledged";
        assert_eq!(refused("normal"), format!("`sensor/g7` has no known fault; {only}"));
        assert_eq!(refused("explained"), format!("`sensor/g7` is explained; {only}"));
    }
}
