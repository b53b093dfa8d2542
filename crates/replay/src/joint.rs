//! All modules in one process on the recorded samples, with other settings.
//!
//! The recorded answers of peers no longer apply, so the diagnosers query each other. The modules advance together step
//! by step, each with its recorded samples and gaps; operators' commands apply at the recorded step. Restarts are left
//! out: each module processes every sample once.

use std::collections::VecDeque;

use diagnosis::{
    Action, Diagnoser, Event, Measurements, PeerFailure, QuestionToken, StateQuestion,
};
use vocabulary::ModuleName;

use crate::part::{PartError, ReplayPart};
use crate::player::{ReplayedTransition, feed};
use crate::samples::empty_sample;

/// Timeout of an answer \[s\], the default of `queries.timeout_ms`.
const TIMEOUT_S: f64 = 0.3;

/// The transitions of each part.
///
/// # Errors
/// A setup is invalid.
pub fn together(parts: &[ReplayPart<'_>]) -> Result<Vec<Vec<ReplayedTransition>>, PartError> {
    let mut replay = JointReplay::new(parts)?;
    while let Some(place) = replay.next() {
        replay.advance(place);
    }
    Ok(replay.verdicts)
}

/// A pending question.
#[derive(Debug)]
struct AskedQuestion {
    asker: usize,
    peer: usize,
    question: StateQuestion,
    /// The number of items that the asker had processed.
    at: usize,
    is_open: bool,
}

struct JointReplay<'a> {
    parts: &'a [ReplayPart<'a>],
    diagnosers: Vec<Diagnoser>,
    /// The number of items that each diagnoser has processed.
    taken: Vec<usize>,
    times: Vec<u64>,
    timeouts: Vec<usize>,
    sample: Measurements,
    asked: Vec<AskedQuestion>,
    /// All questions before this one are closed.
    open_from: usize,
    /// Asker, the peer that did not answer, and the end of the pause before the next question, in items of the asker.
    silent: Vec<(usize, ModuleName, usize)>,
    verdicts: Vec<Vec<ReplayedTransition>>,
}

impl<'a> JointReplay<'a> {
    fn new(parts: &'a [ReplayPart<'a>]) -> Result<Self, PartError> {
        let diagnoser = |part: &ReplayPart<'_>| {
            Diagnoser::new(part.setup.clone()).map_err(|problems| PartError {
                module: part.setup.module.clone(),
                problems: problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "),
            })
        };
        let timeout = |part: &ReplayPart<'_>| (TIMEOUT_S / part.setup.step_s).ceil() as usize;
        Ok(Self {
            parts,
            diagnosers: parts.iter().map(diagnoser).collect::<Result<_, _>>()?,
            taken: vec![0; parts.len()],
            times: vec![0; parts.len()],
            timeouts: parts.iter().map(timeout).collect(),
            sample: empty_sample(),
            asked: Vec::new(),
            open_from: 0,
            silent: Vec::new(),
            verdicts: parts.iter().map(|_| Vec::new()).collect(),
        })
    }

    /// The diagnoser with the earliest next item.
    fn next(&self) -> Option<usize> {
        let moment = |place: usize| Some(self.parts[place].items.get(self.taken[place])?.0);
        (0..self.parts.len())
            .filter_map(|place| Some((moment(place)?, place)))
            .min()
            .map(|(_, place)| place)
    }

    fn advance(&mut self, place: usize) {
        let part = &self.parts[place];
        let item = &part.items[self.taken[place]].1;
        self.taken[place] += 1;
        let mut actions = Vec::new();
        let diagnoser = (&mut self.diagnosers[place], part.setup.step_s);
        let published = feed(diagnoser, item, part.samples, &mut self.sample, &mut actions);
        self.times[place] = published.unwrap_or(self.times[place]);
        self.carry_out(place, actions);
        self.close_expired();
        self.resume_peers(place);
    }

    /// Carries out the actions of one diagnoser and whatever follows from them.
    fn carry_out(&mut self, place: usize, actions: Vec<Action>) {
        let mut pending: VecDeque<(usize, Action)> =
            actions.into_iter().map(|action| (place, action)).collect();
        while let Some((actor, action)) = pending.pop_front() {
            let Some((target, event)) = self.event_for(actor, action) else { continue };
            let mut actions = Vec::new();
            self.diagnosers[target].handle(event, &mut actions);
            pending.extend(actions.into_iter().map(|action| (target, action)));
        }
    }

    fn event_for(&mut self, actor: usize, action: Action) -> Option<(usize, Event)> {
        match action {
            Action::Publish(transition) => {
                let time_unix_ns = self.times[actor];
                self.verdicts[actor].push(ReplayedTransition { transition, time_unix_ns });
                None
            }
            Action::Ask { peer, question } => Some(self.ask(actor, peer, question)),
            Action::Answer { token, answer } => {
                let (asker, ..) = self.close(token)?;
                Some((asker, Event::Answered(answer)))
            }
            Action::Refuse { token, refusal } => {
                let (asker, peer, question) = self.close(token)?;
                let failure = PeerFailure::Refused(refusal.to_string());
                Some(self.unanswered(asker, peer, question, failure))
            }
            _ => None,
        }
    }

    fn ask(&mut self, asker: usize, peer: ModuleName, question: StateQuestion) -> (usize, Event) {
        let target = self.diagnosers.iter().position(|diagnoser| *diagnoser.module() == peer);
        let is_there = |place: &usize| self.taken[*place] < self.parts[*place].items.len();
        let Some(target) = target.filter(|place| *place == asker || is_there(place)) else {
            let failure = PeerFailure::Absent;
            return (asker, Event::Unanswered { peer, question, failure });
        };
        let token = QuestionToken(self.asked.len() as u64);
        let at = self.taken[asker];
        self.asked.push(AskedQuestion { asker, peer: target, question, at, is_open: true });
        (target, Event::Asked { token, question })
    }

    fn close(&mut self, token: QuestionToken) -> Option<(usize, usize, StateQuestion)> {
        let asked = self.asked.get_mut(usize::try_from(token.0).ok()?)?;
        let was_open = std::mem::replace(&mut asked.is_open, false);
        was_open.then_some((asked.asker, asked.peer, asked.question))
    }

    fn unanswered(
        &mut self,
        asker: usize,
        peer: usize,
        question: StateQuestion,
        failure: PeerFailure,
    ) -> (usize, Event) {
        let peer = self.diagnosers[peer].module().clone();
        let until = self.taken[asker] + self.timeouts[asker];
        if !self.silent.iter().any(|(a, p, _)| (*a, p) == (asker, &peer)) {
            self.silent.push((asker, peer.clone(), until));
        }
        (asker, Event::Unanswered { peer, question, failure })
    }

    /// Closes questions that have timed out or whose peer has ended.
    fn close_expired(&mut self) {
        while self.asked.get(self.open_from).is_some_and(|asked| !asked.is_open) {
            self.open_from += 1;
        }
        for index in self.open_from..self.asked.len() {
            let AskedQuestion { asker, peer, question, at, is_open } = self.asked[index];
            let is_over = self.taken[asker] > at + self.timeouts[asker]
                || self.taken[peer] >= self.parts[peer].items.len();
            if !is_open || !is_over {
                continue;
            }
            self.asked[index].is_open = false;
            let token = QuestionToken(index as u64);
            let mut actions = Vec::new();
            self.diagnosers[peer].handle(Event::Withdrawn { token }, &mut actions);
            self.carry_out(peer, actions);
            let (asker, event) = self.unanswered(asker, peer, question, PeerFailure::TimedOut);
            let mut actions = Vec::new();
            self.diagnosers[asker].handle(event, &mut actions);
            self.carry_out(asker, actions);
        }
    }

    /// Permits queries to peers again whose pause has ended.
    fn resume_peers(&mut self, place: usize) {
        let now = self.taken[place];
        let is_over =
            |(asker, _, until): &(usize, ModuleName, usize)| *asker == place && now >= *until;
        let Some(index) = self.silent.iter().position(is_over) else { return };
        let (_, peer, _) = self.silent.swap_remove(index);
        let mut actions = Vec::new();
        self.diagnosers[place].handle(Event::Returned { peer }, &mut actions);
        self.carry_out(place, actions);
    }
}
