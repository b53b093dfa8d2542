//! Commands of operators: when they are accepted, and what follows.

use vocabulary::words::departure;
use vocabulary::{Component, ComponentKind, Step};

use crate::diagnoser::Diagnoser;
use crate::event::Action;
use crate::order::OrderRefusal;
use crate::state::{Condition, Departed};
use crate::verdict::Transition;
use vocabulary::{GivenOrder, GivenOrderKind, Symptom, Verdict};

/// A residual displaced by less than this share of the displacement found has returned to normal.
const STILL_DISPLACED: f64 = 0.5;

impl Diagnoser {
    /// The orders that end the shelvings and suppressions that have had their time \[ns since 1970\].
    #[must_use]
    pub fn lapses(&self, now_unix_ns: u64) -> Vec<(Component, GivenOrder)> {
        let is_over = |latest: &&Transition| {
            let mut both = latest.shelved.iter().chain(&latest.suppressed);
            both.any(|shelving| shelving.span().is_over(now_unix_ns))
        };
        let order = |latest: &Transition| {
            let kind = GivenOrderKind::Lapse { now_unix_ns };
            (latest.component.clone(), GivenOrder::by_itself(kind, None))
        };
        self.last_transitions().filter(is_over).map(order).collect()
    }

    /// The components whose alarms are suppressed.
    pub fn suppressed(&self) -> impl Iterator<Item = &Component> {
        let suppressed = self.last_transitions().filter(|latest| latest.suppressed.is_some());
        suppressed.map(|latest| &latest.component)
    }

    /// Carries out a command: the sequence number of its transition.
    ///
    /// # Errors
    /// Why it is refused; nothing changed.
    pub(crate) fn carry_out(
        &mut self,
        component: Component,
        given: GivenOrder,
        actions: &mut Vec<Action>,
    ) -> Result<u64, OrderRefusal> {
        let channel = self.channels.position(&component);
        let channel = channel.ok_or_else(|| OrderRefusal::Unknown(component.clone()))?;
        let verdict = match given.kind {
            GivenOrderKind::Acknowledge => self.acknowledge(channel, component)?,
            GivenOrderKind::Reset { force } => self.reset(channel, component, force)?,
            GivenOrderKind::ReTare => self.re_tare(channel, component)?,
            GivenOrderKind::Declare => return self.declare(channel, component, given, actions),
            GivenOrderKind::ShutOff { .. } => {
                self.check_shut_off(channel, component)?;
                return self.set_aside(channel, given, actions);
            }
            GivenOrderKind::Shelve(_)
            | GivenOrderKind::Unshelve
            | GivenOrderKind::Suppress(_)
            | GivenOrderKind::Unsuppress
            | GivenOrderKind::PutBack
            | GivenOrderKind::Lapse { .. } => return self.set_aside(channel, given, actions),
        };
        let now = (self.run(), self.last_step().unwrap_or_default());
        actions.extend(self.judging.ledger.obey(channel, verdict, now, given).map(Action::Publish));
        Ok(self.next_sequence() - 1)
    }

    /// Whether the alarm counts, and whether a cylinder is shut off, which no verdict depends on.
    fn set_aside(
        &mut self,
        channel: usize,
        given: GivenOrder,
        actions: &mut Vec<Action>,
    ) -> Result<u64, OrderRefusal> {
        let now = self.intake.position().unwrap_or_default();
        let evidence = self.channels.evidence()[channel];
        let transition = self.judging.ledger.set_aside(channel, given, now, evidence)?;
        let sequence = transition.sequence;
        actions.push(Action::Publish(transition));
        Ok(sequence)
    }

    /// An operator knows more than the residuals show, as of now.
    fn declare(
        &mut self,
        channel: usize,
        component: Component,
        given: GivenOrder,
        actions: &mut Vec<Action>,
    ) -> Result<u64, OrderRefusal> {
        let verdict = self.judging.ledger.verdict(channel);
        if verdict.is_latched() {
            let state = verdict.as_str();
            return Err(OrderRefusal::AlreadyFaulty { component, state });
        }
        let now = self.intake.position().unwrap_or_default();
        let evidence = self.channels.evidence()[channel];
        self.judging.isolator.drop_cases(channel);
        let transition = self.judging.ledger.declare(channel, given, now, evidence);
        let sequence = transition.sequence;
        actions.push(Action::Publish(transition));
        Ok(sequence)
    }

    /// Only a cylinder can be shut off, and only after its fault was declared: an explained change is not enough.
    fn check_shut_off(&self, channel: usize, component: Component) -> Result<(), OrderRefusal> {
        if component.kind() != ComponentKind::Actuator {
            return Err(OrderRefusal::NotACylinder(component));
        }
        let verdict = self.judging.ledger.verdict(channel);
        let state = verdict.as_str();
        verdict
            .is_latched()
            .then_some(())
            .ok_or(OrderRefusal::NothingToShutOff { component, state })
    }

    fn acknowledge(&self, channel: usize, component: Component) -> Result<Verdict, OrderRefusal> {
        match self.judging.ledger.verdict(channel) {
            Verdict::Latched => Ok(Verdict::Acknowledged),
            other => Err(OrderRefusal::NothingToAcknowledge { component, state: other.as_str() }),
        }
    }

    fn reset(
        &mut self,
        channel: usize,
        component: Component,
        force: bool,
    ) -> Result<Verdict, OrderRefusal> {
        self.check_resettable(channel, &component, force)?;
        if !force {
            self.check_change_is_over(channel)?;
            self.check_evidence_is_gone(channel, component)?;
        }
        Ok(self.start_anew(channel))
    }

    /// What the component measures now is what it should measure.
    fn re_tare(&mut self, channel: usize, component: Component) -> Result<Verdict, OrderRefusal> {
        self.check_resettable(channel, &component, false)?;
        self.check_change_is_over(channel)?;
        let off = self.comparing.departure(channel);
        let off = off.ok_or(OrderRefusal::NothingToReTare(component))?;
        let tare = self.channels.shift_tare(channel, off);
        self.judging.ledger.set_tare(channel, tare);
        Ok(self.start_anew(channel))
    }

    fn check_resettable(
        &self,
        channel: usize,
        component: &Component,
        force: bool,
    ) -> Result<(), OrderRefusal> {
        let component = component.clone();
        let latest = self.judging.ledger.latest(&component);
        if !force && latest.is_some_and(|latest| latest.shut_off.is_some()) {
            return Err(OrderRefusal::ShutOff(component));
        }
        match self.judging.ledger.verdict(channel) {
            Verdict::Latched if !force => Err(OrderRefusal::NotAcknowledged(component)),
            Verdict::Latched | Verdict::Acknowledged | Verdict::Unconfirmed { .. } => Ok(()),
            other => {
                let state = other.as_str();
                Err(OrderRefusal::NothingToReset { component, state })
            }
        }
    }

    fn start_anew(&mut self, channel: usize) -> Verdict {
        self.judging.isolator.drop_cases(channel);
        self.channels.forgive(channel);
        let agrees = match self.compared(channel) {
            Condition::Agrees { from, .. } => {
                self.is_after_detection(*from, &self.channels.components()[channel])
            }
            _ => false,
        };
        if !agrees {
            self.comparing.forgive(channel);
        }
        if self.interval_to_pass(channel) != Some(0) {
            // The Gaussian still holds what the fault did to it.
            self.channels.restart(channel);
        }
        Verdict::Normal
    }

    pub(crate) fn check_change_is_over(&self, channel: usize) -> Result<(), OrderRefusal> {
        if self.channels.learned().is_some() {
            // It has no divergence that could go on.
            return Ok(());
        }
        let component = self.channels.components()[channel].clone();
        let monitor = self.channels.monitor(channel);
        if !monitor.is_watched() {
            return Err(OrderRefusal::NotWatched(component));
        }
        if monitor.is_active() {
            let ratio = monitor.evidence().ratio();
            return Err(OrderRefusal::StillChanging { component, ratio });
        }
        match self.interval_to_pass(channel) {
            // A growing interval never passes; the Gaussian restarts with the reset.
            None | Some(0) => Ok(()),
            Some(steps) => Err(OrderRefusal::StillInInterval { component, steps }),
        }
    }

    /// Whether a window from this step on is one that a component's fault would have shown in.
    fn is_after_detection(&self, from: Step, component: &Component) -> bool {
        let latest = self.judging.ledger.latest(component);
        let of_run = latest.filter(|latest| self.run().is_some_and(|run| latest.is_of(run)));
        of_run.is_none_or(|latest| from > latest.detection)
    }

    /// The reference decides; without one, where the residual was before the fault.
    fn check_evidence_is_gone(
        &self,
        channel: usize,
        component: Component,
    ) -> Result<(), OrderRefusal> {
        match self.condition(channel) {
            Condition::Agrees { from, .. } if self.is_after_detection(*from, &component) => Ok(()),
            // What it agreed in may have been before the fault.
            Condition::Agrees { .. } => Err(OrderRefusal::NotCompared(component)),
            Condition::Doubtful { .. } | Condition::Departed { .. } | Condition::OneOf { .. } => {
                let how = self.departure_in_words(channel, &component);
                Err(OrderRefusal::StillDeparted { component, how })
            }
            Condition::NotCompared | Condition::CannotTell { .. } => {
                Err(OrderRefusal::NotCompared(component))
            }
            Condition::NotVerified => match self.displacement(channel) {
                Some((now, found)) => Err(OrderRefusal::StillDisplaced { component, now, found }),
                None => Ok(()),
            },
        }
    }

    /// By how much a component departs from its reference, or which others may instead.
    fn departure_in_words(&self, channel: usize, component: &Component) -> Option<String> {
        if let Condition::OneOf { components, .. } = self.condition(channel) {
            let names: Vec<String> = components.iter().map(ToString::to_string).collect();
            return Some(format!("or another of these does: {}", names.join(", ")));
        }
        let kind = component.kind();
        if let Some(learned) = self.channels.learned() {
            let off = learned.departure(channel)?;
            return departure(kind, Symptom::Reading, off, 0.0);
        }
        let Departed { symptom, measured, expected, .. } = *self.comparing.departed(channel)?;
        departure(kind, symptom, measured, expected)
    }

    fn interval_to_pass(&self, channel: usize) -> Option<u64> {
        self.channels.interval_to_pass(channel, self.last_step().unwrap_or_default())
    }

    /// How far the residual is from where it was before the fault, and how far it was when the fault was
    /// found, if it is still on that side and not closer to where it was.
    fn displacement(&self, channel: usize) -> Option<(f64, f64)> {
        let component = &self.channels.components()[channel];
        let latest = self.judging.ledger.latest(component)?;
        let found = latest.evidence;
        if latest.symptom == Symptom::NoSignal {
            return None;
        }
        let now = self.channels.monitor(channel).level() - found.level;
        let then = found.residual - found.level;
        let displaced = now * then > 0.0 && now.abs() >= STILL_DISPLACED * then.abs();
        displaced.then_some((now, then))
    }
}
