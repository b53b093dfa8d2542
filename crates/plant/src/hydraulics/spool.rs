//! The spool of a valve that sticks.

/// The position of a sticking spool, expressed as the flow that it passes within the limits of the ports.
///
/// Friction holds the spool until the commanded flow differs from its own by more than a band; then it breaks loose and
/// moves to the command. The command is sampled once per step, as is the force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spool {
    /// The largest difference between command and flow at which friction holds the spool \[m³/s\].
    band: f64,
    /// The flow \[m³/s\]; `None` before the first step, in which the spool moves to the command.
    flow: Option<f64>,
}

impl Spool {
    /// A spool that starts to stick at the next command; band \[m³/s\].
    pub(crate) fn new(band: f64) -> Self {
        Self { band, flow: None }
    }

    /// Processes the command of a step \[m³/s\].
    pub(super) fn follow(&mut self, command: f64) {
        let held = self.flow.is_some_and(|flow| (command - flow).abs() <= self.band);
        if !held {
            self.flow = Some(command);
        }
    }

    /// The flow that the spool passes \[m³/s\].
    pub(super) fn flow(&self) -> f64 {
        self.flow.unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_begins_at_the_command_holds_within_the_band_and_jumps_to_the_command_beyond() {
        let mut spool = Spool::new(0.5);
        let positions = [2.0, 2.5, 1.5, 2.625, 2.25, 2.0, -4.0].map(|command| {
            spool.follow(command);
            spool.flow()
        });
        assert_eq!(positions, [2.0, 2.0, 2.0, 2.625, 2.625, 2.0, -4.0]);
    }
}
