//! Acknowledges and resets over the network as an operator would, so that components can be faulty once
//! more.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use daemon::config::Schedule;
use daemon::observer::{OrderError, order};
use tokio::task::JoinHandle;
use truss::ids::{ModuleName, RunId, Step, StructureName};
use wire::{Doubt, FaultState, FaultTransition, Obeyed, Order, OrderKind};
use zenoh::Session;

use crate::observer::{Observer, states};
use crate::plant_clock::PlantClock;

/// From one look to the next.
const EVERY: Duration = Duration::from_millis(100);
/// How long an order's reply is waited for.
const PATIENCE: Duration = Duration::from_millis(800);
/// From the latest change of a component to its reset \[steps\]: its interval has passed by then.
const SETTLED: u64 = 2200;

/// An order that was obeyed, by its own word.
#[derive(Debug, Clone, PartialEq)]
pub struct Done {
    /// Who obeyed.
    pub module: ModuleName,
    /// What was ordered.
    pub kind: OrderKind,
    /// In which words.
    pub order: Order,
    /// The reply.
    pub obeyed: Obeyed,
}

/// What became of the orders.
#[derive(Debug, Clone, Default)]
pub struct Books {
    /// Those that were obeyed.
    pub done: Vec<Done>,
    /// How many were refused.
    pub refused: usize,
    /// How many were not answered.
    pub unanswered: usize,
    /// Replies that make no sense.
    pub senseless: Vec<String>,
}

/// Deals with faults as long as it lives.
pub struct Operator {
    books: Arc<Mutex<Books>>,
    task: JoinHandle<()>,
}

struct Desk {
    session: Session,
    structure: StructureName,
    clock: PlantClock,
    run: RunId,
    schedule: Schedule,
    books: Arc<Mutex<Books>>,
}

impl Operator {
    /// Begins to look.
    pub async fn of(observer: &Observer, run: RunId, schedule: Schedule) -> Self {
        let books = Arc::new(Mutex::new(Books::default()));
        let desk = Desk {
            session: observer.session.clone(),
            structure: observer.structure.clone(),
            clock: PlantClock::of(observer).await,
            run,
            schedule,
            books: Arc::clone(&books),
        };
        Self { books, task: tokio::spawn(desk.work()) }
    }

    /// What has become of the orders so far.
    #[must_use]
    pub fn books(&self) -> Books {
        lock(&self.books).clone()
    }
}

impl Drop for Operator {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Desk {
    async fn work(self) {
        let mut ticks = tokio::time::interval(EVERY);
        ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let mut number = 0;
        loop {
            ticks.tick().await;
            let now = self.clock.step(self.run).unwrap_or_default();
            let mut wanted: BTreeMap<ModuleName, Vec<(OrderKind, Order)>> = BTreeMap::new();
            for state in states(&self.session).await {
                let Some(kind) = self.wants(&state, now) else { continue };
                number += 1;
                let order = Order {
                    component: state.component.component,
                    by: "operator".into(),
                    // Tells this order from every other one.
                    note: Some(format!("order {number}")),
                    force: kind == OrderKind::Reset,
                };
                wanted.entry(state.module).or_default().push((kind, order));
            }
            // A module that is silent holds up nobody but itself.
            let (mut modules, desk) = (tokio::task::JoinSet::new(), &self);
            for (module, orders) in wanted {
                let give = desk.give(module, orders);
                modules.spawn(give);
            }
            while modules.join_next().await.is_some() {}
        }
    }

    /// What is to be done about a component.
    fn wants(&self, state: &FaultTransition, now: Step) -> Option<OrderKind> {
        let never = matches!(state.doubt, Some(Doubt::Unknowing | Doubt::RunEnded));
        match state.state {
            FaultState::Latched => Some(OrderKind::Acknowledge),
            FaultState::Acknowledged => self.is_settled(state, now).then_some(OrderKind::Reset),
            FaultState::Unconfirmed if never => {
                self.is_settled(state, now).then_some(OrderKind::Reset)
            }
            _ => None,
        }
    }

    /// Is the component repaired, and has it been quiet long enough?
    fn is_settled(&self, state: &FaultTransition, now: Step) -> bool {
        let begun = self.schedule.faults.iter().filter(|fault| fault.at_step <= now);
        let own = begun.filter(|fault| fault.component == state.component);
        let repaired = own.filter_map(|fault| fault.until_step).max();
        let latest = repaired.max(state.detection_step).unwrap_or_default();
        latest.plus(SETTLED) <= now
    }

    /// Gives a module its orders, one after the other.
    fn give(
        &self,
        module: ModuleName,
        orders: Vec<(OrderKind, Order)>,
    ) -> impl Future<Output = ()> + Send + 'static {
        let (session, structure) = (self.session.clone(), self.structure.clone());
        let books = Arc::clone(&self.books);
        async move {
            for (kind, given) in orders {
                let reply = order(&session, &structure, &module, kind, &given, PATIENCE).await;
                lock(&books).note(&module, kind, given, reply);
            }
        }
    }
}

impl Books {
    fn note(
        &mut self,
        module: &ModuleName,
        kind: OrderKind,
        order: Order,
        reply: Result<Obeyed, OrderError>,
    ) {
        match reply {
            Ok(obeyed) => self.done.push(Done { module: module.clone(), kind, order, obeyed }),
            Err(OrderError::Refused(_)) => self.refused += 1,
            Err(OrderError::Unanswered(_)) => self.unanswered += 1,
            Err(OrderError::Senseless(what)) => self.senseless.push(format!("{module}: {what}")),
        }
    }
}

fn lock(books: &Mutex<Books>) -> MutexGuard<'_, Books> {
    books.lock().unwrap_or_else(PoisonError::into_inner)
}
