//! Takes what arrives, asks for what is missing, and puts out what is news.

use std::time::{Duration, Instant};

use tokio::sync::mpsc::Receiver;
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;
use vocabulary::{ModuleStatus, StructureName, keys::Watched};
use zenoh::Session;

use super::Outbox;
use super::continuity::{Continuity, Whose, by_module};
use super::newest::{Came, Newest};
use super::queries::{Answer, ask, present};
use super::reading::Arrival;
use super::several::Several;
use crate::view::News;

/// Questions that wait for their answers.
const QUESTIONS: usize = 8;
/// How often it is looked whether a question is due.
const TICK: Duration = Duration::from_millis(100);

/// Runs until the session is closed.
pub(super) async fn run(
    session: Session,
    structure: Option<StructureName>,
    mut arrivals: Receiver<Arrival>,
    outbox: Outbox<News>,
) {
    let mut desk = Desk::new(outbox);
    let mut asked = JoinSet::new();
    asked.spawn(ask_all(session.clone(), structure));
    let mut ticks = tokio::time::interval(TICK);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            arrival = arrivals.recv() => match arrival {
                Some(arrival) => desk.published(arrival),
                None => return,
            },
            Some(Ok(answer)) = asked.join_next() => desk.answer(answer),
            _ = ticks.tick() => {}
        }
        while asked.len() < QUESTIONS
            && let Some(question) = desk.continuity.question(Instant::now())
        {
            asked.spawn(ask(session.clone(), question));
        }
    }
}

async fn ask_all(session: Session, structure: Option<StructureName>) -> Answer {
    let watched = Watched { structure: structure.as_ref(), module: None };
    Answer::Present(None, present(&session, watched).await)
}

/// What is known, and where news go.
struct Desk {
    outbox: Outbox<News>,
    continuity: Continuity,
    newest: Newest,
    several: Several,
}

impl Desk {
    fn new(outbox: Outbox<News>) -> Self {
        let (continuity, newest, several) = Default::default();
        Self { outbox, continuity, newest, several }
    }

    fn put(&self, news: Vec<News>) {
        news.into_iter().for_each(|event| self.outbox.put(event));
    }

    fn published(&mut self, arrival: Arrival) {
        let news = match arrival {
            Arrival::Transition(transition) => self.continuity.published(*transition),
            Arrival::Status(status) => self.status(&status),
            Arrival::Token(whose, there) => {
                self.continuity.presence(&whose, there);
                let Whose { structure, module } = whose;
                vec![News::Presence { structure, who: module.to_string(), there }]
            }
            other => self.other(other, Came::Published),
        };
        self.put(news);
    }

    fn status(&mut self, status: &ModuleStatus) -> Vec<News> {
        let now = Instant::now();
        let mut news = self.continuity.status(status, now);
        let ModuleStatus { structure, module, .. } = status;
        let (structure, module) = (structure.clone(), module.clone());
        let whose = Whose { structure: structure.clone(), module: module.clone() };
        if status.another_process && self.several.is_first(whose, now) {
            news.push(News::SeveralProcesses { structure, module });
        }
        news
    }

    fn other(&mut self, arrival: Arrival, came: Came) -> Vec<News> {
        match arrival {
            Arrival::Identification(found) if self.newest.identification(&found, came) => {
                vec![News::Identification(found)]
            }
            Arrival::Phase(change) if self.newest.phase(&change, came) => {
                vec![News::Phase(change)]
            }
            Arrival::Other(news) => vec![news],
            _ => Vec::new(),
        }
    }

    fn answer(&mut self, answer: Answer) {
        let now = Instant::now();
        let news = match answer {
            Answer::Present(whose, arrivals) => self.present(whose, arrivals, now),
            Answer::Page(whose, since, page) => self.continuity.page(&whose, since, page, now),
        };
        self.put(news);
    }

    /// States first: an identification belongs to a fault.
    fn present(&mut self, whose: Option<Whose>, arrivals: Vec<Arrival>, now: Instant) -> Vec<News> {
        let (mut states, mut others) = (Vec::new(), Vec::new());
        for arrival in arrivals {
            match arrival {
                Arrival::Transition(state) => states.push(*state),
                other => others.push(other),
            }
        }
        let mut states = by_module(states);
        let mut news = match whose {
            None => self.continuity.open(states, now),
            Some(whose) => {
                let states = states.remove(&whose).unwrap_or_default();
                self.continuity.present(&whose, states, now)
            }
        };
        let others = others.into_iter().flat_map(|other| self.other(other, Came::Answered));
        news.extend(others);
        news
    }
}
