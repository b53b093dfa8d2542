//! What is handed out and what is asked, by what arrives: no network.

use std::time::{Duration, Instant};

use vocabulary::{
    Candidate, FaultState, FaultTransition, GivenOrder, GivenOrderKind, HistoryPage,
    Identification, ModulePhase, PhaseChange, RunId, Step, fault::FaultKind,
};

use super::module_feed::LOOK_EVERY;
use super::{EventFeed, Incoming, ModuleAnswer, ModuleKey, ModuleQuery};
use crate::testing;
use crate::view::{EventLine, News};

const SECOND: Duration = Duration::from_secs(1);

fn key() -> ModuleKey {
    ("tower".parse().unwrap(), "m1".parse().unwrap())
}

/// A transition that was published at a time.
fn at(sequence: u64, time_unix_ns: u64) -> FaultTransition {
    let component = format!("m1/sensor/g{}", sequence % 3).parse().unwrap();
    let untouched = FaultTransition::untouched(key().0, component, time_unix_ns);
    FaultTransition { sequence, verdict: vocabulary::Verdict::Latched, ..untouched }
}

fn transition(sequence: u64) -> FaultTransition {
    at(sequence, 100 * sequence)
}

fn page(transitions: Vec<FaultTransition>, next_sequence: u64, more: bool) -> HistoryPage {
    let (structure, module) = key();
    HistoryPage {
        structure,
        module,
        first_sequence: transitions.first().map(|t| t.sequence),
        transitions,
        identifications: Vec::new(),
        phases: Vec::new(),
        next_sequence,
        more,
    }
}

/// A feed on one module, and the time.
struct Bench {
    feed: EventFeed,
    now: Instant,
    /// Numbers that were handed out, in this order, each with the time of its transition.
    handed: Vec<(u64, u64)>,
    /// Ranges that were reported as missed.
    missed: Vec<(u64, u64)>,
    /// How often it was reported that several processes run as the module.
    several: usize,
}

impl Bench {
    /// The module's present states were these.
    fn of(states: Vec<FaultTransition>) -> Self {
        let (feed, now) = (EventFeed::default(), Instant::now());
        let mut bench = Self { feed, now, handed: Vec::new(), missed: Vec::new(), several: 0 };
        let news = bench.feed.open(states, now);
        bench.note(news);
        bench
    }

    /// With transitions up to this one.
    fn at(latest: u64) -> Self {
        let mut bench = Self::of((1..=latest).map(transition).collect());
        bench.handed.clear();
        bench
    }

    fn note(&mut self, news: Vec<News>) {
        for event in news {
            match event {
                News::Fault(transition) | News::Present(transition) => {
                    self.handed.push((transition.sequence, transition.time_unix_ns));
                }
                News::Missed { from, to, .. } => self.missed.push((from, to)),
                News::SeveralProcesses { .. } => self.several += 1,
                other => unreachable!("{other:?}"),
            }
        }
    }

    fn published(&mut self, transition: FaultTransition) {
        let news = self.feed.transition(transition);
        self.note(news);
    }

    fn status(&mut self, next_sequence: u64, time_unix_ns: u64, another_process: bool) {
        let mut status = testing::status("m1", &[]);
        (status.next_sequence, status.time_unix_ns) = (next_sequence, time_unix_ns);
        status.another_process = another_process;
        let news = self.feed.published(Incoming::Status(Box::new(status)), self.now);
        self.note(news);
    }

    fn present(&mut self, states: Vec<FaultTransition>) {
        let news = self.feed.present(&key(), states, self.now);
        self.note(news);
    }

    fn page(&mut self, since: u64, page: Result<HistoryPage, String>) {
        let news = self.feed.answered(ModuleAnswer::Page(key(), since, page), self.now);
        self.note(news);
    }

    fn token(&mut self, there: bool) {
        self.feed.presence(&key(), there, self.now);
    }

    fn question(&mut self) -> Option<ModuleQuery> {
        let (_, wish) = self.feed.question(self.now)?;
        Some(wish)
    }

    fn later(&mut self, time: Duration) {
        self.now += time;
    }

    fn numbers(&self) -> Vec<u64> {
        self.handed.iter().map(|(sequence, _)| *sequence).collect()
    }
}

#[test]
fn the_present_comes_first_and_what_was_published_meanwhile_after_it_once() {
    let mut bench = Bench::of(Vec::new());
    bench.feed = EventFeed::default();
    bench.published(transition(5));
    bench.published(transition(6));
    assert!(bench.handed.is_empty() && bench.question().is_none(), "all are being asked");
    let states = vec![transition(5), transition(3), transition(1), transition(0)];
    let news = bench.feed.open(states, bench.now);
    bench.note(news);
    assert_eq!(bench.numbers(), [1, 3, 5, 6]);
    assert_eq!(bench.question(), None);
}

#[test]
fn at_first_the_present_alarms_are_told_and_nothing_of_the_past() {
    let of = |sequence: u64, state: FaultState| FaultTransition {
        verdict: vocabulary::Verdict::example(state),
        ..transition(sequence)
    };
    let order = testing::acknowledged("m1", 1).order;
    let order = order.map(|order| GivenOrder { kind: GivenOrderKind::Unsuppress, ..order });
    let unsuppressed = FaultTransition { order, ..of(1, FaultState::Normal) };
    let suppressed = testing::suppressed(of(4, FaultState::Normal));
    let (mut feed, now) = (EventFeed::default(), Instant::now());
    // This one is published while it is asked for.
    let published = of(5, FaultState::Normal);
    assert_eq!(feed.transition(published.clone()), []);
    let mut alarm = of(2, FaultState::Latched);
    alarm.since_unix_ns = 7;
    let unmonitored = of(3, FaultState::Unknown);
    let before = [&unsuppressed, &alarm, &unmonitored, &suppressed];
    let states = before.into_iter().chain([&published]).cloned().collect();
    let news = feed.open(states, now);
    let present = |state: &FaultTransition| News::Present(Box::new(state.clone()));
    let event = News::Fault(Box::new(published));
    assert_eq!(news[..4], before.map(present));
    assert_eq!((news.len(), &news[4]), (5, &event));
    let shown: Vec<News> = news.into_iter().filter(News::is_shown).collect();
    assert_eq!(shown, [present(&alarm), present(&suppressed), event]);
    let lines = shown.into_iter().map(|news| {
        EventLine::of(&crate::view::ObservedEvent { number: 1, time_unix_ns: 9, news })
    });
    let lines: Vec<_> = lines.map(|line| (line.time_unix_ns, line.what, line.why)).collect();
    let found = "when this view connected or before".to_owned();
    assert_eq!(lines[0], (7, "latched".to_owned(), found.clone()));
    assert_eq!(lines[1].1, "normal, not verified, suppressed");
    assert!(lines[1].2.starts_with(&format!("{found}; suppressed until ")), "{lines:?}");
    // From now on everything is an event.
    let next = of(6, FaultState::Normal);
    assert_eq!(feed.transition(next.clone()), [News::Fault(Box::new(next))]);
}

#[test]
fn a_module_that_was_not_there_at_first_is_asked_when_it_appears() {
    let mut bench = Bench::of(Vec::new());
    bench.token(true);
    assert_eq!(bench.question(), Some(ModuleQuery::Present));
    assert_eq!(bench.question(), None, "one question at a time");
    bench.published(transition(4));
    assert!(bench.handed.is_empty());
    bench.present(vec![transition(2), transition(3)]);
    assert_eq!(bench.numbers(), [2, 3, 4]);
}

#[test]
fn a_module_that_does_not_answer_is_believed_what_it_publishes() {
    let mut bench = Bench::of(Vec::new());
    bench.published(transition(4));
    for pause in [0, 200, 400] {
        bench.later(Duration::from_millis(pause));
        assert_eq!(bench.question(), Some(ModuleQuery::Present));
        bench.present(Vec::new());
    }
    assert_eq!((bench.question(), bench.numbers()), (None, vec![4]));
    bench.published(transition(5));
    assert_eq!(bench.numbers(), [4, 5]);
}

#[test]
fn a_gap_is_filled_from_the_journal_and_what_comes_after_it_waits() {
    let mut bench = Bench::at(3);
    bench.published(transition(6));
    bench.published(transition(7));
    assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
    assert!(bench.handed.is_empty() && bench.question().is_none());
    bench.page(4, Ok(page((4..=7).map(transition).collect(), 8, false)));
    assert_eq!(bench.numbers(), [4, 5, 6, 7]);
    bench.published(transition(5));
    bench.published(transition(8));
    assert_eq!(bench.numbers(), [4, 5, 6, 7, 8]);
    assert_eq!((bench.question(), bench.missed), (None, vec![]));
}

#[test]
fn a_long_gap_is_filled_page_by_page() {
    let mut bench = Bench::at(3);
    bench.published(transition(8));
    for since in [4, 6] {
        assert_eq!(bench.question(), Some(ModuleQuery::History(since)));
        let transitions = (since..since + 2).map(transition).collect();
        bench.page(since, Ok(page(transitions, 9, true)));
    }
    assert_eq!(bench.numbers(), [4, 5, 6, 7, 8]);
    // There was more on the last page than this: it may have been published since.
    bench.status(9, 900, false);
    assert_eq!(bench.question(), None);
}

#[test]
fn a_gap_at_the_end_is_found_by_the_status_after_a_second() {
    let mut bench = Bench::at(3);
    bench.status(6, 600, false);
    assert_eq!(bench.question(), None, "a transition may come after the status that counts it");
    bench.later(SECOND);
    assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
    bench.page(4, Ok(page((4..=5).map(transition).collect(), 6, false)));
    assert_eq!(bench.numbers(), [4, 5]);
    bench.later(SECOND);
    assert_eq!(bench.question(), None);
}

#[test]
fn what_comes_within_a_second_of_the_status_is_not_asked_for() {
    let mut bench = Bench::at(3);
    bench.status(5, 600, false);
    bench.published(transition(4));
    bench.later(SECOND);
    assert_eq!(bench.question(), None);
    assert_eq!(bench.numbers(), [4]);
}

#[test]
fn a_module_that_appears_again_is_asked_what_was_missed_and_its_journal_has_it() {
    let mut bench = Bench::at(3);
    bench.token(false);
    bench.token(true);
    assert_eq!(bench.question(), Some(ModuleQuery::Present));
    bench.present(vec![transition(3), transition(5), transition(2)]);
    assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
    bench.page(4, Ok(page(vec![transition(4), transition(5)], 6, false)));
    assert_eq!(bench.numbers(), [4, 5]);
}

#[test]
fn what_a_restarted_module_publishes_again_is_not_handed_out_again() {
    let mut bench = Bench::at(5);
    for sequence in [3, 4, 5] {
        bench.published(transition(sequence));
    }
    bench.published(transition(6));
    assert_eq!((bench.numbers(), bench.question()), (vec![6], None));
}

#[test]
fn without_a_journal_the_present_is_handed_out_and_the_rest_reported() {
    let mut bench = Bench::at(3);
    bench.token(true);
    assert_eq!(bench.question(), Some(ModuleQuery::Present));
    bench.present(vec![transition(3), transition(5), transition(7)]);
    for pause in [0, 200, 400] {
        bench.later(Duration::from_millis(pause));
        assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
        bench.page(4, Err("no journal".to_owned()));
    }
    assert_eq!(bench.numbers(), [5, 7]);
    assert_eq!(bench.missed, [(4, 4), (6, 6)]);
}

#[test]
fn a_failing_question_is_put_three_times_and_the_gap_reported_once() {
    let mut bench = Bench::at(3);
    bench.published(transition(6));
    for pause in [0, 200, 400] {
        bench.later(Duration::from_millis(pause));
        assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
        assert_eq!(bench.question(), None);
        bench.page(4, Err("no answer".to_owned()));
        assert_eq!(bench.question(), None, "not at once");
    }
    assert_eq!((bench.numbers(), &bench.missed), (vec![6], &vec![(4, 5)]));
    bench.published(transition(7));
    assert_eq!((bench.numbers(), bench.question()), (vec![6, 7], None));
}

#[test]
fn a_gap_at_the_end_that_cannot_be_filled_is_reported_once_and_still_filled_later() {
    let mut bench = Bench::at(3);
    bench.status(6, 600, false);
    bench.later(SECOND);
    for _ in 0..2 {
        for pause in [0, 200, 400] {
            bench.later(Duration::from_millis(pause));
            assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
            bench.page(4, Err("no answer".to_owned()));
        }
        assert_eq!(bench.question(), None);
        bench.later(10 * SECOND);
        bench.status(6, 700, false);
    }
    assert_eq!(bench.missed, [(4, 5)]);
    assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
    bench.page(4, Ok(page(vec![transition(4), transition(5)], 6, false)));
    assert_eq!(bench.numbers(), [4, 5]);
}

#[test]
fn what_a_module_published_before_it_restarted_is_not_given_up_while_it_is_away() {
    let mut bench = Bench::at(3);
    bench.published(transition(6));
    assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
    bench.token(false);
    bench.page(4, Err("no answer within 1s".into()));
    for _ in 0..5 {
        bench.later(SECOND);
        assert_eq!(bench.question(), None, "it is away");
    }
    bench.token(true);
    bench.question();
    bench.present(vec![transition(6)]);
    assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
    bench.page(4, Ok(page(vec![transition(4), transition(5), transition(6)], 7, false)));
    assert_eq!((bench.numbers(), bench.missed), (vec![4, 5, 6], vec![]));
}

#[test]
fn what_a_module_published_that_does_not_come_back_is_given_up() {
    let mut bench = Bench::at(3);
    bench.published(transition(6));
    bench.token(false);
    bench.later(11 * SECOND);
    while bench.missed.is_empty() {
        bench.later(SECOND);
        if bench.question().is_some() {
            bench.page(4, Err("no answer within 1s".into()));
        }
    }
    assert_eq!((bench.numbers(), bench.missed), (vec![6], vec![(4, 5)]));
}

#[test]
fn what_the_journal_does_not_hold_is_reported() {
    let mut bench = Bench::at(3);
    bench.published(transition(9));
    assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
    let held = [6, 8, 9].map(transition).to_vec();
    bench.page(4, Ok(page(held, 10, false)));
    assert_eq!(bench.numbers(), [6, 8, 9]);
    assert_eq!(bench.missed, [(4, 5), (7, 7)]);
}

#[test]
fn a_wiped_module_begins_again_and_nothing_of_it_is_missed() {
    let mut bench = Bench::at(50);
    bench.published(at(3, 9000));
    assert_eq!(bench.question(), Some(ModuleQuery::History(1)));
    let new = [at(1, 7000), at(2, 8000), at(3, 9000)].to_vec();
    bench.page(1, Ok(page(new, 4, false)));
    assert_eq!(bench.handed, [(1, 7000), (2, 8000), (3, 9000)]);
    bench.published(at(4, 9500));
    assert_eq!((bench.numbers(), bench.question()), (vec![1, 2, 3, 4], None));
}

#[test]
fn a_wiped_module_is_known_by_its_status_if_nothing_was_heard_of_it() {
    let mut bench = Bench::at(50);
    for time in [8000, 9000] {
        bench.status(3, time, false);
        bench.later(SECOND);
    }
    assert_eq!(bench.question(), Some(ModuleQuery::History(1)));
    bench.page(1, Ok(page(vec![at(1, 7000), at(2, 7500)], 3, false)));
    assert_eq!(bench.handed, [(1, 7000), (2, 7500)]);
    assert_eq!(bench.missed, []);
}

#[test]
fn a_wiped_module_that_has_come_further_than_before_is_known_by_its_incarnation() {
    let of = |incarnation, sequence, time| FaultTransition { incarnation, ..at(sequence, time) };
    let mut bench = Bench::of(vec![of(7, 1, 100)]);
    bench.published(of(8, 3, 9000));
    assert_eq!(bench.question(), Some(ModuleQuery::History(1)));
    let new = [of(8, 1, 7000), of(8, 2, 8000), of(8, 3, 9000)].to_vec();
    bench.page(1, Ok(page(new, 4, false)));
    bench.published(of(7, 9, 9900));
    assert_eq!(bench.handed, [(1, 100), (1, 7000), (2, 8000), (3, 9000)]);
    assert_eq!(bench.missed, []);
}

#[test]
fn a_number_given_again_after_a_crash_is_handed_out_and_those_before_it_are_not() {
    let mut bench = Bench::at(8);
    bench.published(at(8, 5000));
    assert_eq!(bench.question(), Some(ModuleQuery::History(1)));
    let mut journal: Vec<FaultTransition> = (1..8).map(transition).collect();
    journal.push(at(8, 5000));
    bench.page(1, Ok(page(journal, 9, false)));
    assert_eq!(bench.handed, [(8, 5000)]);
    assert_eq!(bench.missed, []);
}

/// The clock was set back before the second transition, so that the time of the first one is later.
#[test]
fn a_number_given_again_with_a_clock_that_was_set_back_brings_nothing_twice() {
    let mut bench = Bench::at(1);
    bench.published(at(2, 50));
    bench.published(at(2, 60));
    assert_eq!(bench.question(), Some(ModuleQuery::History(1)));
    bench.page(1, Ok(page(vec![transition(1), at(2, 60)], 3, false)));
    assert_eq!((bench.handed, bench.missed), (vec![(2, 50), (2, 60)], vec![]));
}

/// Its clock was set back before the third transition; then it restarts, and publishes again what it knows.
#[test]
fn a_module_whose_clock_was_set_back_does_not_count_again() {
    let mut bench = Bench::at(2);
    bench.published(at(3, 50));
    for restarted in [transition(1), transition(2), at(3, 50)] {
        bench.published(restarted);
    }
    bench.token(false);
    bench.token(true);
    bench.present(vec![transition(1), transition(2), at(3, 50)]);
    bench.published(at(4, 60));
    assert_eq!(bench.handed, [(3, 50), (4, 60)]);
    assert_eq!(bench.missed, []);
}

#[test]
fn of_two_processes_each_transition_is_handed_out_and_nothing_is_asked() {
    let mut bench = Bench::at(3);
    bench.status(4, 400, true);
    for transition in [at(51, 500), at(4, 600), at(52, 700), at(52, 700), at(5, 800)] {
        bench.published(transition);
        assert_eq!(bench.question(), None);
    }
    assert_eq!(bench.numbers(), [51, 4, 52, 5]);
    bench.status(6, 900, false);
    bench.later(2 * SECOND);
    assert_eq!(bench.question(), Some(ModuleQuery::History(1)));
    let journal = [transition(1), transition(2), transition(3), at(4, 600), at(5, 800)];
    bench.page(1, Ok(page(journal.to_vec(), 6, false)));
    assert_eq!((bench.numbers(), bench.missed), (vec![51, 4, 52, 5], vec![]));
}

#[test]
fn two_processes_without_statuses_cause_one_query_at_a_time() {
    let mut bench = Bench::at(3);
    let mut questions = 0;
    for round in 0..200 {
        bench.published(at(50 + round, 1000 + 20 * round));
        bench.published(at(4 + round, 1010 + 20 * round));
        questions += u32::from(bench.question().is_some());
    }
    assert!(questions <= 2, "{questions} questions without an answer");
}

#[test]
fn what_is_held_back_is_bounded() {
    let mut bench = Bench::at(3);
    for sequence in 5..5000 {
        bench.published(transition(sequence));
    }
    assert_eq!(bench.missed, [(4, 4)]);
    assert!(bench.handed.len() > 4990 - 256);
}

#[test]
fn a_module_without_a_status_is_looked_at_now_and_then_unless_it_is_gone() {
    let mut bench = Bench::at(3);
    bench.later(LOOK_EVERY);
    assert_eq!(bench.question(), Some(ModuleQuery::Present));
    bench.present((1..=3).map(transition).collect());
    assert_eq!(bench.question(), None);
    bench.later(LOOK_EVERY / 2);
    bench.status(4, 400, false);
    bench.later(LOOK_EVERY / 2);
    assert_eq!(bench.question(), None, "the status suffices");
    bench.token(false);
    bench.later(LOOK_EVERY);
    assert_eq!(bench.question(), None);
}

#[test]
fn an_answer_that_was_overtaken_changes_nothing() {
    let mut bench = Bench::at(3);
    bench.token(true);
    assert_eq!(bench.question(), Some(ModuleQuery::Present));
    bench.published(transition(4));
    bench.present((1..=3).map(transition).collect());
    bench.published(transition(5));
    assert_eq!((bench.numbers(), bench.question()), (vec![4, 5], None));
}

#[test]
fn a_page_of_a_cancelled_query_is_not_used() {
    let mut bench = Bench::at(3);
    bench.published(transition(5));
    assert_eq!(bench.question(), Some(ModuleQuery::History(4)));
    bench.published(transition(4));
    bench.page(4, Ok(page(vec![transition(4), transition(5)], 6, false)));
    assert_eq!((bench.numbers(), bench.missed), (vec![4, 5], vec![]));
}

#[test]
fn several_processes_are_reported_once_for_as_long_as_there_are_several() {
    let mut bench = Bench::at(3);
    for _ in 0..100 {
        bench.status(4, 400, true);
        bench.later(SECOND);
    }
    assert_eq!(bench.several, 1);
    bench.later(58 * SECOND);
    bench.status(4, 400, true);
    assert_eq!(bench.several, 1);
    bench.later(60 * SECOND);
    bench.status(4, 400, true);
    assert_eq!(bench.several, 2, "it was over meanwhile");
}

fn phase(time_unix_ns: u64) -> PhaseChange {
    testing::phase_change(ModulePhase::InService, time_unix_ns)
}

fn identification(kind: FaultKind, time_unix_ns: u64) -> Identification {
    let (structure, module) = key();
    Identification {
        structure,
        module,
        component: "m1/sensor/g1".parse().unwrap(),
        run: RunId(1),
        sequence: 2,
        as_of_step: Step(time_unix_ns),
        decided: true,
        candidates: vec![Candidate { kind: kind.into(), probability: 1.0, size: None }],
        signature: None,
        since_unix_ns: None,
        time_unix_ns,
    }
}

#[test]
fn what_was_published_is_news_unless_it_is_the_same_again_and_an_answer_only_if_it_is_later() {
    let mut feed = EventFeed::default();
    let mut at = |time, is_answer| feed.other(Incoming::Phase(phase(time)), is_answer).is_some();
    assert!(at(5, true) && !at(5, false));
    assert!(at(7, false) && !at(6, true));
    assert!(at(4, false), "a clock was set back");
}

#[test]
fn an_answer_about_the_same_kind_of_the_same_fault_is_no_news() {
    let mut feed = EventFeed::default();
    let mut is_news = |kind, time, is_answer| {
        let found = Incoming::Identification(Box::new(identification(kind, time)));
        feed.other(found, is_answer).is_some()
    };
    assert!(is_news(FaultKind::Bias, 5, true));
    assert!(!is_news(FaultKind::Bias, 15, true) && is_news(FaultKind::Bias, 25, false));
    assert!(is_news(FaultKind::Drift, 35, true));
}

/// What is said of the connection and of who is there, by what happens at which millisecond.
struct Presences {
    feed: EventFeed,
    start: Instant,
}

impl Presences {
    /// A feed whose first query was answered.
    fn new() -> Self {
        Self { feed: EventFeed { is_open: true, ..EventFeed::default() }, start: Instant::now() }
    }

    fn token(&mut self, module: &str, there: bool, ms: u64) -> Vec<String> {
        let key = (key().0, module.parse().unwrap());
        let now = self.start + Duration::from_millis(ms);
        in_words(self.feed.published(Incoming::Token(key, there), now))
    }

    fn connected(&mut self, is_there: bool, ms: u64) -> Vec<String> {
        in_words(self.feed.connection(is_there, self.start + Duration::from_millis(ms)))
    }
}

fn in_words(news: Vec<News>) -> Vec<String> {
    let words = |news| match news {
        News::Connection { connected } => format!("connected {connected}"),
        News::Presence { who, there, at_start, .. } => {
            format!("{who} {there}{}", if at_start { " before" } else { "" })
        }
        other => unreachable!("{other:?}"),
    };
    news.into_iter().map(words).collect()
}

#[test]
fn an_observer_that_is_cut_off_says_so_and_not_that_modules_have_left() {
    let mut seen = Presences::new();
    assert_eq!(seen.token("m1", true, 0), ["m1 true before"]);
    assert!(seen.connected(true, 10).is_empty());
    assert_eq!(seen.token("m2", true, 500), ["m2 true before"]);
    // The entry point dies: every token disappears.
    for module in ["m1", "m2"] {
        assert!(seen.token(module, false, 1000).is_empty());
    }
    assert!(seen.connected(false, 1050).is_empty());
    assert_eq!(seen.connected(false, 1400), ["connected false"]);
    assert!(seen.connected(false, 9000).is_empty());
    // Another one answers, over which one of them is still there.
    assert_eq!(seen.connected(true, 9100), ["connected true"]);
    assert!(seen.token("m2", true, 9150).is_empty());
    assert!(seen.connected(true, 9500).is_empty());
    assert_eq!(seen.connected(true, 9600), ["m1 false"]);
    assert!(seen.connected(true, 20_000).is_empty());
    assert_eq!(seen.token("m1", true, 20_000), ["m1 true"]);
}

#[test]
fn an_entry_point_that_another_one_replaces_at_once_is_no_news_but_who_left_is() {
    let mut seen = Presences::new();
    assert!(seen.connected(false, 0).is_empty());
    assert!(seen.connected(true, 2500).is_empty());
    for module in ["m1", "m2"] {
        seen.token(module, true, 2500);
        seen.token(module, false, 3000);
    }
    assert!(seen.connected(false, 3010).is_empty());
    assert!(seen.connected(true, 3200).is_empty());
    seen.token("m1", true, 3250);
    assert_eq!(seen.connected(true, 3700), ["m2 false"]);
}

#[test]
fn a_module_that_leaves_is_reported_within_half_a_second_and_a_first_connection_has_three() {
    let mut seen = Presences::new();
    assert!(seen.connected(false, 0).is_empty());
    assert!(seen.connected(false, 2900).is_empty());
    assert_eq!(seen.connected(false, 3000), ["connected false"]);
    assert_eq!(seen.connected(true, 4000), ["connected true"]);
    seen.token("m1", true, 4000);
    seen.token("m1", false, 6000);
    assert!(seen.connected(true, 6400).is_empty());
    assert_eq!(seen.connected(true, 6500), ["m1 false"]);
}

#[test]
fn a_module_that_answers_has_a_place_among_made_up_tokens() {
    let (mut feed, now) = (EventFeed::default(), Instant::now());
    for number in 0..3000 {
        let ghost = format!("ghost{number}").parse().unwrap();
        feed.published(Incoming::Token((key().0, ghost), true), now);
    }
    let news = feed.open(vec![transition(1)], now);
    assert!(!news.is_empty(), "what it answered is handed out");
    let news = feed.published(Incoming::Transition(Box::new(transition(3))), now);
    assert!(news.is_empty(), "it waits for the one between");
    let mut due = std::iter::from_fn(|| feed.question(now + SECOND));
    assert!(due.any(|(of, question)| of == key() && question == ModuleQuery::History(2)));
}
