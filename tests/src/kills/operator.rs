//! Acknowledges and resets over the network as an operator would, so that components can become faulty
//! again.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use ::observer::{OrderRequest, QueryError};
use daemon::config::Schedule;
use parking_lot::Mutex;
use session::client::order;
use tokio::task::JoinSet;
use vocabulary::{
    FaultState, FaultTransition, ModuleName, Obeyed, Order, OrderKind, RunId, Step, StructureName,
};
use zenoh::Session;

use crate::observer::{Observer, states};
use crate::plant_clock::PlantClock;

/// Polling interval.
const EVERY: Duration = Duration::from_millis(100);
/// Timeout for the reply to a command.
const TIMEOUT: Duration = Duration::from_millis(800);
/// From the latest change of a component to its reset \[steps\]: its interval has passed by then.
const SETTLED: u64 = 2200;

/// A command confirmed as obeyed by its reply.
#[derive(Debug, Clone, PartialEq)]
pub struct Done {
    /// The module that obeyed.
    pub module: ModuleName,
    /// The command.
    pub kind: OrderKind,
    /// Its message.
    pub order: Order,
    /// The reply.
    pub obeyed: Obeyed,
}

/// Outcomes of the commands.
#[derive(Debug, Clone, Default)]
pub struct Books {
    /// Those that were obeyed.
    pub done: Vec<Done>,
    /// Number refused.
    pub refused: usize,
    /// Number without a reply.
    pub unanswered: usize,
    /// Malformed replies.
    pub senseless: Vec<String>,
}

/// Acknowledges and resets faults until dropped.
pub struct Operator {
    books: Arc<Mutex<Books>>,
    _work: JoinSet<()>,
}

struct Worker {
    session: Session,
    structure: StructureName,
    clock: PlantClock,
    run: RunId,
    schedule: Schedule,
    books: Arc<Mutex<Books>>,
}

impl Operator {
    /// Starts polling.
    pub async fn of(observer: &Observer, run: RunId, schedule: Schedule) -> Self {
        let books = Arc::new(Mutex::new(Books::default()));
        let worker = Worker {
            session: observer.session.clone(),
            structure: observer.structure.clone(),
            clock: PlantClock::of(observer).await,
            run,
            schedule,
            books: Arc::clone(&books),
        };
        let mut work = JoinSet::new();
        work.spawn(worker.work());
        Self { books, _work: work }
    }

    /// Outcomes of the commands so far.
    #[must_use]
    pub fn books(&self) -> Books {
        self.books.lock().clone()
    }
}

impl Worker {
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
                    component: Some(state.component.component.into()),
                    by: "operator".into(),
                    // Makes this command unique.
                    note: Some(format!("order {number}")),
                    force: kind == OrderKind::Reset,
                    ..Order::default()
                };
                wanted.entry(state.module).or_default().push((kind, order));
            }
            // A silent module delays only its own commands.
            let (mut modules, worker) = (JoinSet::new(), &self);
            for (module, orders) in wanted {
                let give = worker.give(module, orders);
                modules.spawn(give);
            }
            while modules.join_next().await.is_some() {}
        }
    }

    /// The command due for a component.
    fn wants(&self, state: &FaultTransition, now: Step) -> Option<OrderKind> {
        let never = state.verdict.is_undecidable();
        match state.state() {
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

    /// Sends a module its commands, one after the other.
    fn give(
        &self,
        module: ModuleName,
        orders: Vec<(OrderKind, Order)>,
    ) -> impl Future<Output = ()> + Send + 'static {
        let (session, structure) = (self.session.clone(), self.structure.clone());
        let books = Arc::clone(&self.books);
        async move {
            for (kind, given) in orders {
                let request = OrderRequest {
                    structure: structure.clone(),
                    module: module.clone(),
                    kind,
                    operator: None,
                    order: given,
                };
                let reply = order(&session, &request, TIMEOUT).await;
                books.lock().note(&module, kind, request.order, reply);
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
        reply: Result<Obeyed, QueryError>,
    ) {
        match reply {
            Ok(obeyed) => self.done.push(Done { module: module.clone(), kind, order, obeyed }),
            Err(QueryError::Refused(_)) => self.refused += 1,
            Err(QueryError::Unanswered(_) | QueryError::Untaken | QueryError::NotAsked(_)) => {
                self.unanswered += 1;
            }
            Err(QueryError::Senseless(what)) => self.senseless.push(format!("{module}: {what}")),
        }
    }
}
