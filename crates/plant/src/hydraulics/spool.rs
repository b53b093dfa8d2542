//! The spool of a valve that sticks.

/// Where a sticking spool is, as the flow that it lets pass within the limits of the ports.
///
/// Friction holds it until the flow that is commanded differs from its own by more than a band; then it breaks
/// loose and moves to the command. The command is sampled once per step, as the force is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spool {
    /// \[m³/s\]
    band: f64,
    /// \[m³/s\]; none before the first step, in which it is where the command is.
    flow: Option<f64>,
}

impl Spool {
    /// One that begins to stick where the next command puts it; band \[m³/s\].
    pub(crate) fn new(band: f64) -> Self {
        Self { band, flow: None }
    }

    /// Takes the command of a step \[m³/s\].
    pub(super) fn follow(&mut self, command: f64) {
        let held = self.flow.is_some_and(|flow| (command - flow).abs() <= self.band);
        if !held {
            self.flow = Some(command);
        }
    }

    /// The flow that it lets pass \[m³/s\].
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
