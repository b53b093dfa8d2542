//! Orders of operators: when they are obeyed, and what follows.

use truss::ids::{Component, Step};

use crate::diagnoser::Diagnoser;
use crate::event::Action;
use crate::monitor::Monitor;
use crate::order::{GivenOrder, Order, OrderKind, OrderRefusal, OrderToken};
use crate::verdict::Verdict;

/// A residual displaced by less than this share of what was found is back.
const STILL_DISPLACED: f64 = 0.5;

impl Diagnoser {
    pub(crate) fn take_order(
        &mut self,
        token: OrderToken,
        order: Order,
        actions: &mut Vec<Action>,
    ) {
        match self.obey(order, actions) {
            Ok(sequence) => actions.push(Action::Obeyed { token, sequence }),
            Err(refusal) => actions.push(Action::OrderRefused { token, refusal }),
        }
    }

    fn obey(&mut self, order: Order, actions: &mut Vec<Action>) -> Result<u64, OrderRefusal> {
        let Order { component, given } = order;
        let channel = self.components.iter().position(|own| *own == component);
        let channel = channel.ok_or_else(|| OrderRefusal::Unknown(component.clone()))?;
        let verdict = match given.kind {
            OrderKind::Acknowledge => self.acknowledge(channel, component)?,
            OrderKind::Reset { force } => self.reset(channel, component, force)?,
        };
        Ok(self.enter_order(channel, verdict, given, actions))
    }

    fn acknowledge(&self, channel: usize, component: Component) -> Result<Verdict, OrderRefusal> {
        match self.ledger.verdict(channel) {
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
        match self.ledger.verdict(channel) {
            Verdict::Latched if !force => return Err(OrderRefusal::NotAcknowledged(component)),
            Verdict::Latched | Verdict::Acknowledged | Verdict::Unconfirmed { .. } => {}
            other => {
                let state = other.as_str();
                return Err(OrderRefusal::NothingToReset { component, state });
            }
        }
        if !force {
            self.check_evidence_is_gone(channel, component)?;
        }
        self.isolator.drop_cases(channel);
        if self.interval_to_pass(channel) != Some(0) {
            // The Gaussian still holds what the fault did to it.
            self.bank.restart_channel(channel);
            self.monitors[channel].restart();
        }
        Ok(Verdict::Normal)
    }

    fn check_evidence_is_gone(
        &self,
        channel: usize,
        component: Component,
    ) -> Result<(), OrderRefusal> {
        let monitor = &self.monitors[channel];
        if !monitor.is_watched() {
            return Err(OrderRefusal::NotWatched(component));
        }
        if monitor.is_active() {
            let ratio = monitor.evidence().ratio();
            return Err(OrderRefusal::StillChanging { component, ratio });
        }
        match self.interval_to_pass(channel) {
            // A growing interval never passes; the Gaussian begins anew with the reset.
            None | Some(0) => {}
            Some(steps) => return Err(OrderRefusal::StillInInterval { component, steps }),
        }
        match self.displacement(channel, monitor) {
            Some((now, found)) => Err(OrderRefusal::StillDisplaced { component, now, found }),
            None => Ok(()),
        }
    }

    /// Steps until the Gaussian holds nothing of the latest change; `None` if it never forgets.
    fn interval_to_pass(&self, channel: usize) -> Option<u64> {
        let settings = &self.detection;
        let vectors = settings.interval.vectors()?;
        let memory = (vectors + settings.window + settings.lag) as u64;
        let changed = self.monitors[channel].changed_until();
        let since = changed.map(|until| self.last_step.unwrap_or(Step(0)).since(until));
        Some(since.map_or(0, |since| memory.saturating_sub(since)))
    }

    /// How far the residual is from where it was before the fault, and how far it was when the fault was
    /// found, if it is still on that side and not closer to where it was.
    fn displacement(&self, channel: usize, monitor: &Monitor) -> Option<(f64, f64)> {
        let found = self.ledger.latest(&self.components[channel])?.evidence;
        let now = monitor.level() - found.level;
        let then = found.residual - found.level;
        let displaced = now * then > 0.0 && now.abs() >= STILL_DISPLACED * then.abs();
        displaced.then_some((now, then))
    }

    fn enter_order(
        &mut self,
        channel: usize,
        verdict: Verdict,
        given: GivenOrder,
        actions: &mut Vec<Action>,
    ) -> u64 {
        let now = self.last_step.unwrap_or_default();
        let transition = self.ledger.obey(channel, verdict, now, given);
        actions.extend(transition.map(Action::Publish));
        self.ledger.next_sequence() - 1
    }
}
