//! Questions of modules to each other and to the publisher, and orders of operators.

use super::*;

impl World<'_> {
    pub(super) fn open_query(&mut self, query: OpenQuery) -> QueryId {
        self.asked += 1;
        self.queries.insert(self.asked, query);
        self.asked
    }

    pub(super) fn ask(&mut self, of: usize, peer: &ModuleName, question: StateQuestion) {
        let to = self.place_of(peer);
        let life = self.computers[of].life;
        let Some(running) = self.computers[of].process.as_ref() else { return };
        let timeout = running.timeouts.of_next(peer);
        let query = self.open_query(OpenQuery {
            from: Some((of, life)),
            peer: to,
            question: Some(question),
            timeout,
            order: None,
        });
        let line = format_args!("{} asks {peer} about {}", self.name(of), question.as_of);
        self.trace.note(self.now, line);
        self.after(
            timeout.as_nanos() as u64,
            Happening::Replied { query, reply: QueryReply::TimedOut },
        );
        if let Some(delay) = self.way(Some(of), Some(to)) {
            self.after(delay, Happening::Asked { to, query, question });
        }
        self.comes_to(of, KillMoment::Asking, 5 * MS);
    }

    pub(super) fn asked(&mut self, to: usize, query: QueryId, question: StateQuestion) {
        if self.computers[to].process.is_none() {
            self.coverage.reach("a question to a peer that is down");
            let Some(delay) = self.way(Some(to), None) else { return };
            return self.after(delay, Happening::Replied { query, reply: QueryReply::Absent });
        }
        let until = self.now + self.setup.modules[to].settings.hold.as_nanos() as u64;
        if let Some(running) = self.computers[to].process.as_mut() {
            running.held.insert(query, until);
        }
        self.take(to, |module, context| module.question(question, query, context));
        self.pump(to);
    }

    pub(super) fn answer(&mut self, of: usize, query: QueryId, mut answer: StateAnswer) {
        if self.active.contains(&DisturbanceKind::Liar(of)) {
            self.coverage.reach("a liar asked");
            answer.changes.clear();
            answer.actuator_faults.clear();
            answer.alarms.clear();
        }
        self.reply(of, query, QueryReply::Answer(Box::new(answer)));
    }

    pub(super) fn reply(&mut self, of: usize, query: QueryId, reply: QueryReply) {
        let asker = self.queries.get(&query).and_then(|open| open.from);
        if let Some(delay) = self.way(Some(of), asker.map(|(place, _)| place)) {
            self.after(delay, Happening::Replied { query, reply });
        }
    }

    pub(super) fn replied(&mut self, query: QueryId, reply: QueryReply) {
        // It may have ended before.
        let Some(open) = self.queries.remove(&query) else { return };
        match (open.from, open.question) {
            (Some((of, life)), Some(question)) => {
                if self.computers[of].life != life {
                    return;
                }
                let frozen = self.computers[of].frozen_until;
                if frozen > self.now {
                    self.queries.insert(query, open);
                    return self.at(frozen, Happening::Replied { query, reply });
                }
                let outcome = match reply {
                    QueryReply::Answer(answer) => Ok(*answer),
                    QueryReply::Absent => Err(PeerFailure::Absent),
                    QueryReply::TimedOut => Err(PeerFailure::TimedOut),
                    QueryReply::Refused(reason) => Err(PeerFailure::Refused(reason)),
                    QueryReply::Obeyed(_) => {
                        Err(PeerFailure::Malformed("an order obeyed".to_owned()))
                    }
                };
                self.coverage.reach(match &outcome {
                    Ok(_) => "a question answered",
                    Err(PeerFailure::TimedOut) => "a question timed out",
                    Err(_) => "a question refused",
                });
                self.ended(of, open.peer, question, open.timeout, outcome);
            }
            _ => self.order_replied(&open, reply),
        }
    }

    pub(super) fn ended(
        &mut self,
        of: usize,
        peer: usize,
        question: StateQuestion,
        timeout: Duration,
        outcome: Result<StateAnswer, PeerFailure>,
    ) {
        let peer = self.name(peer).clone();
        let Some(running) = self.computers[of].process.as_mut() else { return };
        running.timeouts.note(&peer, timeout, outcome.as_ref().err());
        let event = match outcome {
            Ok(answer) => Event::Answered(answer),
            Err(failure) => Event::Unanswered { peer, question, failure },
        };
        self.take(of, |module, context| module.answer(event, context));
        self.pump(of);
    }

    /// Asks the publisher for samples, until it is reached or they are given up.
    pub(super) fn fetch(&mut self, of: usize, life: u64, question: SampleQuestion, until: u64) {
        let publisher = SampleSource {
            publisher: Some(PublisherId { session: [1; 16], entity: 2 }),
            run: question.run,
        };
        let is_reached = self.way(Some(of), None).is_some() && self.way(None, Some(of)).is_some();
        let received = self.instant(self.now);
        let Some(running) = self.computers[of].process.as_mut() else { return };
        let uses = running.uses(publisher);
        if !is_reached && self.now < until {
            // By then the queue may be full, and nothing is waited for any more.
            running.may_miss_samples |= until - self.now < FETCHED_FOR - QUEUE_FULL_AFTER;
            return self.after(FETCH_AGAIN, Happening::Fetch { of, life, question, until });
        }
        let mut samples = Vec::new();
        if is_reached && uses && question.run == self.run.0 {
            let wanted = question.from..=question.to;
            let kept = self.kept.iter().map(|all| &all[of]);
            let fitting = kept.filter(|sample| wanted.contains(&sample.step));
            samples.extend(fitting.map(|sample| ReceivedSample {
                sample: sample.clone(),
                time_unix_ns: BEGIN_UNIX_NS + self.now,
                received,
            }));
        }
        running.may_miss_samples |= samples.is_empty();
        let is_first_kept = |sample: &ReceivedSample| sample.sample.step > question.from;
        if samples.first().is_some_and(is_first_kept) {
            self.coverage.reach("samples that the publisher has no more");
        }
        let what = if samples.is_empty() {
            "a fetch in vain"
        } else {
            "samples fetched from the publisher"
        };
        self.coverage.reach(what);
        running.module.recovered(question, samples, received);
        self.pump(of);
    }

    pub(super) fn order(&mut self, place: usize) {
        let order = &self.scenario.orders[place];
        let to = self.place_of(&order.component.module);
        let query = self.open_query(OpenQuery {
            from: None,
            peer: to,
            question: None,
            timeout: Duration::from_nanos(ORDER_TIMEOUT),
            order: Some(place),
        });
        let line = format_args!("an operator orders {:?}: {}", order.kind, order.component);
        self.trace.note(self.now, line);
        self.after(ORDER_TIMEOUT, Happening::Replied { query, reply: QueryReply::TimedOut });
        if let Some(delay) = self.way(None, Some(to)) {
            self.after(delay, Happening::Ordered { to, query, order: place });
        }
    }

    pub(super) fn ordered(&mut self, to: usize, query: QueryId, place: usize) {
        let (kind, order) = self.given(place);
        if self.computers[to].process.is_none() {
            return;
        }
        self.take(to, |module, context| module.order(kind, &order, query, context));
        self.pump(to);
    }

    pub(super) fn given(&self, place: usize) -> (OrderKind, Order) {
        let timed = &self.scenario.orders[place];
        let component = Some(timed.component.clone().into());
        let is_shelving = timed.kind == OrderKind::Shelve;
        let order = Order {
            component,
            by: "ada".to_owned(),
            on_behalf_of: None,
            note: is_shelving.then(|| "painting".to_owned()),
            for_s: is_shelving.then_some(4),
            force: false,
            re_tare: false,
        };
        (timed.kind, order)
    }

    pub(super) fn order_replied(&mut self, open: &OpenQuery, reply: QueryReply) {
        let Some(place) = open.order else { return };
        let order = &self.scenario.orders[place];
        let (component, kind) = (&order.component, order.kind);
        match reply {
            QueryReply::Obeyed(state) => {
                self.trace.note(self.now, format_args!("obeyed: {kind:?} {component}: {state}"));
            }
            QueryReply::Refused(reason) => {
                self.coverage.reach("an order refused");
                self.trace.note(self.now, format_args!("refused: {kind:?} {component}: {reason}"));
            }
            _ => {
                self.coverage.reach("an order without a reply");
                self.trace.note(self.now, format_args!("no reply: {kind:?} {component}"));
                let asked_ms = self.now.saturating_sub(ORDER_TIMEOUT) / MS;
                if !self.scenario.is_disturbed(asked_ms, self.now / MS) {
                    let what = format!("no reply to {kind:?} of {component}");
                    self.watcher.violated(self.now, what);
                }
            }
        }
    }
}
