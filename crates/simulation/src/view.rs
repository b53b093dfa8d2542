//! A view that watches a world from outside, as the page and the terminal do: it hears what is published unless it is cut
//! off, and asks for the rest. The feed and the view are the observer's own.

use std::collections::BTreeSet;

use observer::feed::{EventFeed, Incoming, ModuleAnswer, ModuleKey, ModuleQuery};
use observer::{NetworkState, News, Structures};
use process::JournalRecord;
use vocabulary::{ComponentPath, FaultState, FaultTransition, HistoryPage};

use crate::coverage::ReachedHistories;
use crate::module::Computer;
use crate::scenario::DisturbanceKind;
use crate::world::{BEGIN_UNIX_NS, Happening, MS, SECOND, World};

/// How often the view looks at its connection and asks.
const LOOK_EVERY: u64 = 100 * MS;
/// When it asks all modules for the first time.
const FIRST_ASKED: u64 = 300 * MS;
/// How long it waits for an answer.
const ANSWER_WITHIN: u64 = SECOND;
/// How often it asks all modules how their components are.
const STATES_EVERY: u64 = 2 * SECOND;
/// Questions to modules at a time.
const QUESTIONS: usize = 8;

/// The view.
#[derive(Debug, Default)]
pub(crate) struct View {
    feed: EventFeed,
    shown: Structures,
    under_way: usize,
    /// When it connects \[ns\].
    opens: u64,
    /// What was handed out, by component and number.
    handed_out: BTreeSet<(ComponentPath, u64, u64)>,
    /// Components that raised an alarm with an operator: they were handed out or shown as faulty.
    called: BTreeSet<ComponentPath>,
}

impl View {
    fn news(&mut self, all: Vec<News>, now: u64, coverage: &mut ReachedHistories) -> Vec<String> {
        let mut violations = Vec::new();
        for news in all {
            match &news {
                News::Fault(transition) => {
                    let (incarnation, sequence) = transition.place();
                    let component = transition.component.clone();
                    if transition.state() == FaultState::Latched {
                        self.called.insert(component.clone());
                    }
                    // A number that no disk had is given again.
                    let number = (component, incarnation, sequence);
                    let is_new = !transition.durable || self.handed_out.insert(number);
                    if !is_new {
                        let component = &transition.component;
                        violations.push(format!("{component}, number {sequence} handed out twice"));
                    }
                }
                News::Present(transition) if transition.state().is_fault() => {
                    self.called.insert(transition.component.clone());
                    coverage.reach("a view found a fault when it connected");
                }
                News::Missed { .. } => coverage.reach("a view missed transitions for good"),
                News::Connection { connected: false } => coverage.reach("a view was cut off"),
                _ => {}
            }
            self.shown.news(news, BEGIN_UNIX_NS + now);
        }
        violations
    }
}

impl World<'_> {
    pub(crate) fn open_view(&mut self) {
        let opens = self.scenario.view_opens_ms * MS;
        self.view.opens = opens;
        self.view.shown.network(NetworkState::Open, BEGIN_UNIX_NS + opens);
        self.at(opens + FIRST_ASKED, Happening::ViewOpens);
        self.at(opens + LOOK_EVERY, Happening::ViewLooks);
        self.at(opens + STATES_EVERY, Happening::ViewAsksStates);
    }

    /// Something was published: the view hears it, if the way is open.
    pub(crate) fn tell_view(&mut self, of: usize, incoming: Incoming) {
        if let Some(delay) = self.way(Some(of), None) {
            self.after(delay, Happening::ViewHears(Box::new(incoming)));
        }
    }

    pub(crate) fn tell_presence(&mut self, of: usize, there: bool) {
        let key = self.key_of(of);
        self.tell_view(of, Incoming::Token(key, there));
    }

    fn key_of(&self, of: usize) -> ModuleKey {
        (self.setup.name.clone(), self.name(of).clone())
    }

    pub(crate) fn view_hears(&mut self, incoming: Incoming) {
        if self.now < self.view.opens {
            return;
        }
        if let Incoming::Status(status) = &incoming {
            self.view.shown.status((**status).clone(), BEGIN_UNIX_NS + self.now);
        }
        let now = self.instant(self.now);
        let news = self.view.feed.published(incoming, now);
        self.view_news(news);
    }

    pub(crate) fn view_looks(&mut self) {
        let now = self.instant(self.now);
        let is_connected = !self.is_active(|one| one == DisturbanceKind::NoRouter);
        let news = self.view.feed.connection(is_connected, now);
        for one in &news {
            if let News::Connection { connected } = *one {
                let state = if connected { NetworkState::Open } else { NetworkState::Opening };
                self.view.shown.network(state, BEGIN_UNIX_NS + self.now);
            }
        }
        self.view_news(news);
        while self.view.under_way < QUESTIONS
            && let Some((key, query)) = self.view.feed.question(now)
        {
            self.view.under_way += 1;
            let of = self.place_of(&key.1);
            let happening = Happening::ViewAsked { of, key, query };
            match self.way(None, Some(of)) {
                Some(delay) => self.after(delay, happening),
                None => self.view_waits(happening),
            }
        }
        self.after(LOOK_EVERY, Happening::ViewLooks);
    }

    /// A question that cannot be delivered times out.
    fn view_waits(&mut self, asked: Happening) {
        if let Happening::ViewAsked { key, query, .. } = asked {
            let answer = unanswered(key, query);
            self.after(ANSWER_WITHIN, Happening::ViewAnswered(Box::new(answer), true));
        }
    }

    pub(crate) fn view_opens(&mut self) {
        let mut all = Vec::new();
        for of in 0..self.computers.len() {
            let is_open = self.way(None, Some(of)).is_some() && self.way(Some(of), None).is_some();
            if is_open {
                all.extend(self.present(of));
            }
        }
        let answer = ModuleAnswer::Present(None, all);
        self.after(2 * MS, Happening::ViewAnswered(Box::new(answer), false));
    }

    /// The states of all components, with how they compare with their references.
    pub(crate) fn view_asks_states(&mut self) {
        self.view.shown.asked();
        for of in 0..self.computers.len() {
            let is_open = self.way(None, Some(of)).is_some() && self.way(Some(of), None).is_some();
            if !is_open || self.computers[of].frozen_until > self.now {
                continue;
            }
            for incoming in self.present(of) {
                if let Incoming::Transition(state) = incoming {
                    self.check_synced(of, &state);
                    let process = Some(format!("{of}"));
                    self.view.shown.state(*state, process, BEGIN_UNIX_NS + self.now);
                }
            }
        }
        self.view.shown.answered();
        let scene = self.view.shown.scene(0, BEGIN_UNIX_NS + self.now);
        let faulty = scene.components().filter(|shown| shown.state().is_fault());
        self.view.called.extend(faulty.map(|shown| shown.component.clone()));
        self.after(STATES_EVERY, Happening::ViewAsksStates);
    }

    /// What a module answers to a question for its present state. Like publication, it waits for the disk.
    fn present(&self, of: usize) -> Vec<Incoming> {
        let clocks = self.clocks(of);
        let Some(running) = self.computers[of].process.as_ref() else { return Vec::new() };
        let components = &running.store.components;
        let speaker = running.module.speaker();
        let mut states = components.states(speaker, |_| true, None, clocks.unix_ns);
        let ticket = states.iter().map(|published| published.ticket).max().unwrap_or(0);
        if running.store.writes.answer(ticket, clocks.at).is_none() {
            return Vec::new();
        }
        for published in &mut states {
            published.state.durable = running.store.writes.has(published.ticket);
        }
        let states = states.into_iter().map(|one| Incoming::Transition(Box::new(one.state)));
        let found = components.identifications(|_| true).cloned();
        let phase = components.phase().cloned().map(Incoming::Phase);
        states
            .chain(found.map(|one| Incoming::Identification(Box::new(one))))
            .chain(phase)
            .collect()
    }

    pub(crate) fn view_asked(&mut self, of: usize, key: ModuleKey, query: ModuleQuery) {
        let answer = match (&self.computers[of].process, query) {
            (None, _) => None,
            (Some(_), ModuleQuery::Present) => {
                Some(ModuleAnswer::Present(Some(key.clone()), self.present(of)))
            }
            (Some(running), ModuleQuery::History(since)) => {
                self.coverage.reach("a view asked for what it missed");
                let next = running.module.diagnoser().next_sequence();
                let page = history(&self.computers[of], &key, since, next);
                Some(ModuleAnswer::Page(key.clone(), since, Ok(page)))
            }
        };
        let way = self.way(Some(of), None);
        match answer.zip(way) {
            Some((answer, delay)) => {
                self.after(delay, Happening::ViewAnswered(Box::new(answer), true));
            }
            None => self.view_waits(Happening::ViewAsked { of, key, query }),
        }
    }

    pub(crate) fn view_answered(&mut self, answer: ModuleAnswer, is_one: bool) {
        self.view.under_way -= usize::from(is_one);
        let now = self.instant(self.now);
        let news = self.view.feed.answered(answer, now);
        self.view_news(news);
    }

    fn view_news(&mut self, news: Vec<News>) {
        for violation in self.view.news(news, self.now, &mut self.coverage) {
            self.watcher.violated(self.now, violation);
        }
    }

    /// Checks that the view shows what the modules know, and that every fault raised an alarm.
    pub(crate) fn check_view(&mut self) {
        let scene = self.view.shown.scene(0, BEGIN_UNIX_NS + self.now);
        let mut problems = Vec::new();
        for computer in &self.computers {
            let Some(running) = &computer.process else { continue };
            for present in running.store.components.present() {
                let Some(latest) = present.latest else { continue };
                let component = &latest.component;
                let shown = scene.components().find(|shown| shown.component == *component);
                let shown = shown.map_or(FaultState::Normal, FaultTransition::state);
                let known = latest.verdict.state();
                // What cannot be verified is shown as unknown.
                let is_hidden = shown == FaultState::Unknown && known == FaultState::Normal;
                if shown != known && !is_hidden {
                    problems.push(format!("{component} is {known}, and shown as {shown}"));
                }
                if known.is_fault() && !self.view.called.contains(component) {
                    problems.push(format!("{component} is faulty and raised no alarm"));
                }
            }
        }
        for problem in problems {
            self.watcher.violated(self.now, problem);
        }
    }
}

fn unanswered(key: ModuleKey, query: ModuleQuery) -> ModuleAnswer {
    match query {
        ModuleQuery::Present => ModuleAnswer::Present(Some(key), Vec::new()),
        ModuleQuery::History(since) => {
            ModuleAnswer::Page(key, since, Err("no answer in time".to_owned()))
        }
    }
}

/// The page of the journal from a number on.
fn history(computer: &Computer, key: &ModuleKey, since: u64, next_sequence: u64) -> HistoryPage {
    let records = computer.disk.records();
    let records = records.iter().filter_map(|text| JournalRecord::from_text(text));
    let mut transitions: Vec<FaultTransition> = Vec::new();
    for record in records {
        if let JournalRecord::Transition(one) = record
            && transitions.iter().all(|known| known.sequence != one.sequence)
        {
            transitions.push(FaultTransition { durable: true, ..*one });
        }
    }
    transitions.sort_by_key(|one| one.sequence);
    let first_sequence = transitions.first().map(|first| first.sequence);
    transitions.retain(|one| one.sequence >= since);
    HistoryPage {
        structure: key.0.clone(),
        module: key.1.clone(),
        transitions,
        identifications: Vec::new(),
        phases: Vec::new(),
        first_sequence,
        next_sequence,
        more: false,
    }
}
