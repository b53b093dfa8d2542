//! The transitions of all modules, each once and in the order of its module.

use std::collections::BTreeMap;
use std::time::Instant;

use vocabulary::{FaultTransition, HistoryPage, ModuleName, ModuleStatus, StructureName};

use super::line::{Line, Outcome, Wish};
use crate::view::News;

/// Modules of which the numbers are followed; of others the transitions are handed out as they come.
const MODULES: usize = 1024;

/// A module of a structure.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Whose {
    pub(super) structure: StructureName,
    pub(super) module: ModuleName,
}

impl Whose {
    fn of(transition: &FaultTransition) -> Self {
        let FaultTransition { structure, module, .. } = transition;
        Self { structure: structure.clone(), module: module.clone() }
    }
}

/// Present states by module.
pub(super) type States = BTreeMap<Whose, Vec<FaultTransition>>;

/// Present states by module.
pub(super) fn by_module(states: Vec<FaultTransition>) -> States {
    let mut sorted = States::new();
    for state in states {
        sorted.entry(Whose::of(&state)).or_default().push(state);
    }
    sorted
}

/// Where each module stands.
#[derive(Debug, Default)]
pub(super) struct Continuity {
    lines: BTreeMap<Whose, Line>,
    /// The present states of all modules have been asked for together.
    is_open: bool,
}

impl Continuity {
    /// A transition that was published.
    pub(super) fn published(&mut self, transition: FaultTransition) -> Vec<News> {
        let whose = Whose::of(&transition);
        match self.line(&whose) {
            Some(line) => news(&whose, line.published(transition)),
            None => vec![News::Fault(Box::new(transition))],
        }
    }

    /// What a status says of the module's numbers.
    pub(super) fn status(&mut self, status: &ModuleStatus, now: Instant) -> Vec<News> {
        let ModuleStatus { structure, module, .. } = status;
        let whose = Whose { structure: structure.clone(), module: module.clone() };
        self.line(&whose).map_or_else(Vec::new, |line| news(&whose, line.status(status, now)))
    }

    /// A module has come or gone.
    pub(super) fn presence(&mut self, whose: &Whose, there: bool) {
        match self.line(whose) {
            Some(line) if there => line.appear(),
            Some(line) => line.disappear(),
            None => {}
        }
    }

    /// The present states of all modules that answer: the first question of all. Who is not among them is asked again.
    pub(super) fn open(&mut self, states: States, now: Instant) -> Vec<News> {
        self.is_open = true;
        let each = states.into_iter().flat_map(|(whose, states)| self.present(&whose, states, now));
        each.collect()
    }

    /// The present states of a module; none if it did not answer.
    pub(super) fn present(
        &mut self,
        whose: &Whose,
        states: Vec<FaultTransition>,
        now: Instant,
    ) -> Vec<News> {
        self.line(whose).map_or_else(Vec::new, |line| news(whose, line.present(states, now)))
    }

    /// A page of a module's journal from `since` on, or why there is none.
    pub(super) fn page(
        &mut self,
        whose: &Whose,
        since: u64,
        page: Result<HistoryPage, String>,
        now: Instant,
    ) -> Vec<News> {
        self.line(whose).map_or_else(Vec::new, |line| news(whose, line.page(since, page, now)))
    }

    /// A question that is due now, if any is; it counts as put.
    pub(super) fn question(&mut self, now: Instant) -> Option<(Whose, Wish)> {
        if !self.is_open {
            return None;
        }
        let due = |(whose, line): (&Whose, &mut Line)| Some((whose.clone(), line.question(now)?));
        self.lines.iter_mut().find_map(due)
    }

    fn line(&mut self, whose: &Whose) -> Option<&mut Line> {
        if !self.lines.contains_key(whose) {
            if self.lines.len() >= MODULES {
                return None;
            }
            let mut line = Line::default();
            line.appear();
            self.lines.insert(whose.clone(), line);
        }
        self.lines.get_mut(whose)
    }
}

fn news(whose: &Whose, outcomes: Vec<Outcome>) -> Vec<News> {
    let Whose { structure, module } = whose;
    let one = |outcome| match outcome {
        Outcome::Handed(transition) => News::Fault(transition),
        Outcome::Missed { numbers, reason } => News::Missed {
            structure: structure.clone(),
            module: module.clone(),
            from: numbers.start,
            to: numbers.end - 1,
            reason,
        },
    };
    outcomes.into_iter().map(one).collect()
}
