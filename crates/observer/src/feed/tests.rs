//! What is handed out and what is asked, by what arrives: no network.

use std::time::{Duration, Instant};

use vocabulary::{FaultTransition, HistoryPage};

use super::continuity::{Continuity, Whose, by_module};
use super::line::{LOOK_EVERY, Wish};
use crate::testing;
use crate::view::News;

const SECOND: Duration = Duration::from_secs(1);

fn whose() -> Whose {
    Whose { structure: "tower".parse().unwrap(), module: "m1".parse().unwrap() }
}

/// A transition that was published at a time.
fn at(sequence: u64, time_unix_ns: u64) -> FaultTransition {
    let component = format!("m1/sensor/g{}", sequence % 3).parse().unwrap();
    let untouched = FaultTransition::untouched(whose().structure, component, time_unix_ns);
    FaultTransition { sequence, ..untouched }
}

fn transition(sequence: u64) -> FaultTransition {
    at(sequence, 100 * sequence)
}

fn page(transitions: Vec<FaultTransition>, next_sequence: u64, more: bool) -> HistoryPage {
    let Whose { structure, module } = whose();
    HistoryPage {
        structure,
        module,
        first_sequence: transitions.first().map(|t| t.sequence),
        transitions,
        identifications: Vec::new(),
        next_sequence,
        more,
    }
}

/// A feed on one module, and the time.
struct Scene {
    continuity: Continuity,
    now: Instant,
    /// Numbers that were handed out, in this order, each with the time of its transition.
    handed: Vec<(u64, u64)>,
    /// Ranges that were reported as missed.
    missed: Vec<(u64, u64)>,
}

impl Scene {
    /// The module's present states were these.
    fn of(states: Vec<FaultTransition>) -> Self {
        let (continuity, now) = (Continuity::default(), Instant::now());
        let mut scene = Self { continuity, now, handed: Vec::new(), missed: Vec::new() };
        let news = scene.continuity.open(by_module(states), now);
        scene.note(news);
        scene
    }

    /// With transitions up to this one.
    fn at(latest: u64) -> Self {
        let mut scene = Self::of((1..=latest).map(transition).collect());
        scene.handed.clear();
        scene
    }

    fn note(&mut self, news: Vec<News>) {
        for event in news {
            match event {
                News::Fault(transition) => {
                    self.handed.push((transition.sequence, transition.time_unix_ns));
                }
                News::Missed { from, to, .. } => self.missed.push((from, to)),
                other => unreachable!("{other:?}"),
            }
        }
    }

    fn published(&mut self, transition: FaultTransition) {
        let news = self.continuity.published(transition);
        self.note(news);
    }

    fn status(&mut self, next_sequence: u64, time_unix_ns: u64, another_process: bool) {
        let mut status = testing::status("m1", &[]);
        (status.next_sequence, status.time_unix_ns) = (next_sequence, time_unix_ns);
        status.another_process = another_process;
        let news = self.continuity.status(&status, self.now);
        self.note(news);
    }

    fn present(&mut self, states: Vec<FaultTransition>) {
        let news = self.continuity.present(&whose(), states, self.now);
        self.note(news);
    }

    fn page(&mut self, since: u64, page: Result<HistoryPage, String>) {
        let news = self.continuity.page(&whose(), since, page, self.now);
        self.note(news);
    }

    fn question(&mut self) -> Option<Wish> {
        let (_, wish) = self.continuity.question(self.now)?;
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
    let mut scene = Scene::of(Vec::new());
    scene.continuity = Continuity::default();
    scene.published(transition(5));
    scene.published(transition(6));
    assert!(scene.handed.is_empty() && scene.question().is_none(), "all are being asked");
    let states = vec![transition(5), transition(3), transition(1), transition(0)];
    let news = scene.continuity.open(by_module(states), scene.now);
    scene.note(news);
    assert_eq!(scene.numbers(), [1, 3, 5, 6]);
    assert_eq!(scene.question(), None);
}

#[test]
fn a_module_that_was_not_there_at_first_is_asked_when_it_appears() {
    let mut scene = Scene::of(Vec::new());
    scene.continuity.presence(&whose(), true);
    assert_eq!(scene.question(), Some(Wish::Present));
    assert_eq!(scene.question(), None, "one question at a time");
    scene.published(transition(4));
    assert!(scene.handed.is_empty());
    scene.present(vec![transition(2), transition(3)]);
    assert_eq!(scene.numbers(), [2, 3, 4]);
}

#[test]
fn a_module_that_does_not_answer_is_believed_what_it_publishes() {
    let mut scene = Scene::of(Vec::new());
    scene.published(transition(4));
    for pause in [0, 200, 400] {
        scene.later(Duration::from_millis(pause));
        assert_eq!(scene.question(), Some(Wish::Present));
        scene.present(Vec::new());
    }
    assert_eq!((scene.question(), scene.numbers()), (None, vec![4]));
    scene.published(transition(5));
    assert_eq!(scene.numbers(), [4, 5]);
}

#[test]
fn a_gap_is_filled_from_the_journal_and_what_comes_after_it_waits() {
    let mut scene = Scene::at(3);
    scene.published(transition(6));
    scene.published(transition(7));
    assert_eq!(scene.question(), Some(Wish::History(4)));
    assert!(scene.handed.is_empty() && scene.question().is_none());
    scene.page(4, Ok(page((4..=7).map(transition).collect(), 8, false)));
    assert_eq!(scene.numbers(), [4, 5, 6, 7]);
    scene.published(transition(5));
    scene.published(transition(8));
    assert_eq!(scene.numbers(), [4, 5, 6, 7, 8]);
    assert_eq!((scene.question(), scene.missed), (None, vec![]));
}

#[test]
fn a_long_gap_is_filled_page_by_page() {
    let mut scene = Scene::at(3);
    scene.published(transition(8));
    for since in [4, 6] {
        assert_eq!(scene.question(), Some(Wish::History(since)));
        let transitions = (since..since + 2).map(transition).collect();
        scene.page(since, Ok(page(transitions, 9, true)));
    }
    assert_eq!(scene.numbers(), [4, 5, 6, 7, 8]);
    // There was more on the last page than this: it may have been published since.
    scene.status(9, 900, false);
    assert_eq!(scene.question(), None);
}

#[test]
fn a_gap_at_the_end_is_found_by_the_status_after_a_second() {
    let mut scene = Scene::at(3);
    scene.status(6, 600, false);
    assert_eq!(scene.question(), None, "a transition may come after the status that counts it");
    scene.later(SECOND);
    assert_eq!(scene.question(), Some(Wish::History(4)));
    scene.page(4, Ok(page((4..=5).map(transition).collect(), 6, false)));
    assert_eq!(scene.numbers(), [4, 5]);
    scene.later(SECOND);
    assert_eq!(scene.question(), None);
}

#[test]
fn what_comes_within_a_second_of_the_status_is_not_asked_for() {
    let mut scene = Scene::at(3);
    scene.status(5, 600, false);
    scene.published(transition(4));
    scene.later(SECOND);
    assert_eq!(scene.question(), None);
    assert_eq!(scene.numbers(), [4]);
}

#[test]
fn a_module_that_appears_again_is_asked_what_was_missed_and_its_journal_has_it() {
    let mut scene = Scene::at(3);
    scene.continuity.presence(&whose(), false);
    scene.continuity.presence(&whose(), true);
    assert_eq!(scene.question(), Some(Wish::Present));
    scene.present(vec![transition(3), transition(5), transition(2)]);
    assert_eq!(scene.question(), Some(Wish::History(4)));
    scene.page(4, Ok(page(vec![transition(4), transition(5)], 6, false)));
    assert_eq!(scene.numbers(), [4, 5]);
}

#[test]
fn what_a_restarted_module_publishes_again_is_not_handed_out_again() {
    let mut scene = Scene::at(5);
    for sequence in [3, 4, 5] {
        scene.published(transition(sequence));
    }
    scene.published(transition(6));
    assert_eq!((scene.numbers(), scene.question()), (vec![6], None));
}

#[test]
fn without_a_journal_the_present_is_handed_out_and_the_rest_reported() {
    let mut scene = Scene::at(3);
    scene.continuity.presence(&whose(), true);
    assert_eq!(scene.question(), Some(Wish::Present));
    scene.present(vec![transition(3), transition(5), transition(7)]);
    for pause in [0, 200, 400] {
        scene.later(Duration::from_millis(pause));
        assert_eq!(scene.question(), Some(Wish::History(4)));
        scene.page(4, Err("no journal".to_owned()));
    }
    assert_eq!(scene.numbers(), [5, 7]);
    assert_eq!(scene.missed, [(4, 4), (6, 6)]);
}

#[test]
fn a_failing_question_is_put_three_times_and_the_gap_reported_once() {
    let mut scene = Scene::at(3);
    scene.published(transition(6));
    for pause in [0, 200, 400] {
        scene.later(Duration::from_millis(pause));
        assert_eq!(scene.question(), Some(Wish::History(4)));
        assert_eq!(scene.question(), None);
        scene.page(4, Err("no answer".to_owned()));
        assert_eq!(scene.question(), None, "not at once");
    }
    assert_eq!((scene.numbers(), &scene.missed), (vec![6], &vec![(4, 5)]));
    scene.published(transition(7));
    assert_eq!((scene.numbers(), scene.question()), (vec![6, 7], None));
}

#[test]
fn a_gap_at_the_end_that_cannot_be_filled_is_reported_once_and_still_filled_later() {
    let mut scene = Scene::at(3);
    scene.status(6, 600, false);
    scene.later(SECOND);
    for _ in 0..2 {
        for pause in [0, 200, 400] {
            scene.later(Duration::from_millis(pause));
            assert_eq!(scene.question(), Some(Wish::History(4)));
            scene.page(4, Err("no answer".to_owned()));
        }
        assert_eq!(scene.question(), None);
        scene.later(10 * SECOND);
        scene.status(6, 700, false);
    }
    assert_eq!(scene.missed, [(4, 5)]);
    assert_eq!(scene.question(), Some(Wish::History(4)));
    scene.page(4, Ok(page(vec![transition(4), transition(5)], 6, false)));
    assert_eq!(scene.numbers(), [4, 5]);
}

#[test]
fn what_the_journal_does_not_hold_is_reported() {
    let mut scene = Scene::at(3);
    scene.published(transition(9));
    assert_eq!(scene.question(), Some(Wish::History(4)));
    let held = [6, 8, 9].map(transition).to_vec();
    scene.page(4, Ok(page(held, 10, false)));
    assert_eq!(scene.numbers(), [6, 8, 9]);
    assert_eq!(scene.missed, [(4, 5), (7, 7)]);
}

#[test]
fn a_wiped_module_begins_again_and_nothing_of_it_is_missed() {
    let mut scene = Scene::at(50);
    scene.published(at(3, 9000));
    assert_eq!(scene.question(), Some(Wish::History(1)));
    let new = [at(1, 7000), at(2, 8000), at(3, 9000)].to_vec();
    scene.page(1, Ok(page(new, 4, false)));
    assert_eq!(scene.handed, [(1, 7000), (2, 8000), (3, 9000)]);
    scene.published(at(4, 9500));
    assert_eq!((scene.numbers(), scene.question()), (vec![1, 2, 3, 4], None));
}

#[test]
fn a_wiped_module_is_known_by_its_status_if_nothing_was_heard_of_it() {
    let mut scene = Scene::at(50);
    for time in [8000, 9000] {
        scene.status(3, time, false);
        scene.later(SECOND);
    }
    assert_eq!(scene.question(), Some(Wish::History(1)));
    scene.page(1, Ok(page(vec![at(1, 7000), at(2, 7500)], 3, false)));
    assert_eq!(scene.handed, [(1, 7000), (2, 7500)]);
    assert_eq!(scene.missed, []);
}

#[test]
fn a_wiped_module_that_has_come_further_than_before_is_known_by_its_incarnation() {
    let of = |incarnation, sequence, time| FaultTransition { incarnation, ..at(sequence, time) };
    let mut scene = Scene::of(vec![of(7, 1, 100)]);
    scene.published(of(8, 3, 9000));
    assert_eq!(scene.question(), Some(Wish::History(1)));
    let new = [of(8, 1, 7000), of(8, 2, 8000), of(8, 3, 9000)].to_vec();
    scene.page(1, Ok(page(new, 4, false)));
    scene.published(of(7, 9, 9900));
    assert_eq!(scene.handed, [(1, 100), (1, 7000), (2, 8000), (3, 9000)]);
    assert_eq!(scene.missed, []);
}

#[test]
fn a_number_given_again_after_a_crash_is_handed_out_and_those_before_it_are_not() {
    let mut scene = Scene::at(8);
    scene.published(at(8, 5000));
    assert_eq!(scene.question(), Some(Wish::History(1)));
    let mut journal: Vec<FaultTransition> = (1..8).map(transition).collect();
    journal.push(at(8, 5000));
    scene.page(1, Ok(page(journal, 9, false)));
    assert_eq!(scene.handed, [(8, 5000)]);
    assert_eq!(scene.missed, []);
}

#[test]
fn of_two_processes_each_transition_is_handed_out_and_nothing_is_asked() {
    let mut scene = Scene::at(3);
    scene.status(4, 400, true);
    for transition in [at(51, 500), at(4, 600), at(52, 700), at(52, 700), at(5, 800)] {
        scene.published(transition);
        assert_eq!(scene.question(), None);
    }
    assert_eq!(scene.numbers(), [51, 4, 52, 5]);
    scene.status(6, 900, false);
    scene.later(2 * SECOND);
    assert_eq!(scene.question(), Some(Wish::History(1)));
    let journal = [transition(1), transition(2), transition(3), at(4, 600), at(5, 800)];
    scene.page(1, Ok(page(journal.to_vec(), 6, false)));
    assert_eq!((scene.numbers(), scene.missed), (vec![51, 4, 52, 5], vec![]));
}

#[test]
fn two_processes_that_no_status_tells_of_make_no_more_than_a_question_at_a_time() {
    let mut scene = Scene::at(3);
    let mut questions = 0;
    for round in 0..200 {
        scene.published(at(50 + round, 1000 + 20 * round));
        scene.published(at(4 + round, 1010 + 20 * round));
        questions += u32::from(scene.question().is_some());
    }
    assert!(questions <= 2, "{questions} questions without an answer");
}

#[test]
fn what_is_held_back_is_bounded() {
    let mut scene = Scene::at(3);
    for sequence in 5..5000 {
        scene.published(transition(sequence));
    }
    assert_eq!(scene.missed, [(4, 4)]);
    assert!(scene.handed.len() > 4990 - 256);
}

#[test]
fn a_module_without_a_status_is_looked_at_now_and_then_unless_it_is_gone() {
    let mut scene = Scene::at(3);
    scene.later(LOOK_EVERY);
    assert_eq!(scene.question(), Some(Wish::Present));
    scene.present((1..=3).map(transition).collect());
    assert_eq!(scene.question(), None);
    scene.later(LOOK_EVERY / 2);
    scene.status(4, 400, false);
    scene.later(LOOK_EVERY / 2);
    assert_eq!(scene.question(), None, "the status suffices");
    scene.continuity.presence(&whose(), false);
    scene.later(LOOK_EVERY);
    assert_eq!(scene.question(), None);
}

#[test]
fn an_answer_that_was_overtaken_changes_nothing() {
    let mut scene = Scene::at(3);
    scene.continuity.presence(&whose(), true);
    assert_eq!(scene.question(), Some(Wish::Present));
    scene.published(transition(4));
    scene.present((1..=3).map(transition).collect());
    scene.published(transition(5));
    assert_eq!((scene.numbers(), scene.question()), (vec![4, 5], None));
}

#[test]
fn a_page_that_nobody_waits_for_any_more_is_not_used() {
    let mut scene = Scene::at(3);
    scene.published(transition(5));
    assert_eq!(scene.question(), Some(Wish::History(4)));
    scene.published(transition(4));
    scene.page(4, Ok(page(vec![transition(4), transition(5)], 6, false)));
    assert_eq!((scene.numbers(), scene.missed), (vec![4, 5], vec![]));
}
