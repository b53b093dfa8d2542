//! What sequences of keys, scenes and answers lead to.

use ratatui::crossterm::event::KeyCode;
use vocabulary::{FaultState, Obeyed, OrderKind};

use observer::{ModuleHistory, OrderOutcome, QueryError};

use super::*;
use crate::OrderIssuer;
use crate::testing::{NOW, SECOND, heard, latched, scene, settings, state};

fn tower() -> Arc<Scene> {
    let first = vec![
        state("m1/sensor/g1", FaultState::Normal, 60),
        latched("m1/sensor/g2", 12),
        latched("m1/sensor/g3", 30),
    ];
    let second = vec![state("m2/sensor/g1", FaultState::Explained, 12)];
    Arc::new(scene(vec![heard("m1", first), heard("m2", second)]))
}

fn model() -> Model {
    let mut model = Model::new(settings(), NOW);
    assert_eq!(model.on_scene(tower(), NOW), []);
    model
}

fn keys(model: &mut Model, text: &str) -> Vec<ModelEffect> {
    text.chars().flat_map(|character| model.on_key(key(character))).collect()
}

fn key(character: char) -> KeyCode {
    match character {
        '\n' => KeyCode::Enter,
        '\t' => KeyCode::Tab,
        '\x1b' => KeyCode::Esc,
        other => KeyCode::Char(other),
    }
}

fn selected(model: &Model) -> String {
    let rows = model.rows();
    match &rows[model.fault_place(&rows)] {
        RowId::Module(whose) => whose.module.to_string(),
        RowId::Component(subject) => subject.component.to_string(),
    }
}

#[test]
fn enter_asks_for_what_there_is_of_a_fault_and_escape_ends_listening() {
    let mut model = model();
    let effects = keys(&mut model, "j\n");
    let seen = model.close_up.as_ref().unwrap();
    assert_eq!(seen.subject.component.to_string(), "m1/sensor/g3");
    let [ModelEffect::Listen(Some(module)), ModelEffect::Frame(of), ModelEffect::Identification(_)] =
        &effects[..]
    else {
        panic!("{effects:?}")
    };
    assert_eq!(
        (module.module.as_str(), of.component.to_string()),
        ("m1", "m1/sensor/g3".to_owned())
    );
    assert_eq!(keys(&mut model, "\x1b"), [ModelEffect::Listen(None)]);
    assert!(model.close_up.is_none());
}

#[test]
fn a_frame_that_is_not_there_yet_is_asked_for_again_and_one_that_is_there_is_not() {
    let mut model = model();
    keys(&mut model, "\n");
    let subject = model.close_up.as_ref().unwrap().subject.clone();
    assert_eq!(model.on_tick(NOW + 9 * SECOND), [], "the first question is still open");
    model.on_answer(TaskResult::Frame(subject.clone(), Err("none is kept".to_owned())));
    let again = model.on_tick(NOW + 10 * SECOND);
    assert!(
        matches!(again[..], [ModelEffect::Frame(_), ModelEffect::Identification(_)]),
        "{again:?}"
    );
    assert_eq!(model.on_tick(NOW + 11 * SECOND), []);
    let frame = Box::new(crate::screens_test::frame());
    model.on_answer(TaskResult::Frame(subject, Ok(frame)));
    assert_eq!(model.on_tick(NOW + 60 * SECOND), []);
}

#[test]
fn a_new_session_subscribes_again_to_the_shown_signals() {
    let mut model = model();
    keys(&mut model, "\n");
    let lost = Scene { network: NetworkState::Closed, ..(*tower()).clone() };
    assert_eq!(model.on_scene(Arc::new(lost), NOW), []);
    let effects = model.on_scene(tower(), NOW);
    let [ModelEffect::Listen(Some(module))] = &effects[..] else { panic!("{effects:?}") };
    assert_eq!(module.module.as_str(), "m1");
    assert_eq!(model.on_scene(tower(), NOW), []);
}

#[test]
fn an_answer_about_another_component_than_the_one_looked_at_is_passed_over() {
    let mut model = model();
    keys(&mut model, "\n");
    let other = ComponentId::of(&latched("m1/sensor/g3", 1));
    model.on_answer(TaskResult::Frame(other, Err("elsewhere".to_owned())));
    assert_eq!(model.close_up.unwrap().frame, Fetched::Awaited);
}

#[test]
fn an_acknowledgement_goes_to_what_was_selected_when_it_was_begun() {
    let mut model = model();
    assert_eq!(keys(&mut model, "aseen"), []);
    let newer = scene(vec![heard("m0", vec![latched("m0/sensor/g9", 0)])]);
    model.on_scene(Arc::new(newer), NOW);
    let effects = keys(&mut model, "\n\n");
    let [ModelEffect::Order(given)] = &effects[..] else { panic!("{effects:?}") };
    assert_eq!(given.subject(), "m1/sensor/g2");
    assert_eq!((given.kind, given.order.note.as_deref()), (OrderKind::Acknowledge, Some("seen")));
    assert!(model.notice.as_ref().unwrap().text.contains("no answer yet"));
    let obeyed =
        Obeyed { component: None, state: FaultState::Acknowledged, sequence: 8, durable: true };
    model.on_answer(TaskResult::Order(given.clone(), OrderOutcome::from(Ok(obeyed))));
    let text = &model.notice.as_ref().unwrap().text;
    assert_eq!(text, "m1/sensor/g2: acknowledged: now acknowledged, transition 8");
}

#[test]
fn letters_typed_into_a_note_are_no_commands() {
    let mut model = model();
    assert_eq!(keys(&mut model, "rq?f/ah"), []);
    assert_eq!(model.dialog.as_ref().unwrap().note, "q?f/ah");
    assert!(!model.helps && model.frozen.is_none());
}

#[test]
fn commands_are_refused_with_the_reason_without_permission() {
    let refused =
        ViewSettings { issuer: Err("the certificate is an observer's".to_owned()), ..settings() };
    let mut model = Model::new(refused, NOW);
    model.on_scene(tower(), NOW);
    for kind in ["a", "r", "s", "u"] {
        assert_eq!(keys(&mut model, kind), []);
        assert!(model.dialog.is_none());
        let notice = model.notice.take().unwrap();
        assert_eq!(notice.text, "commands disabled: the certificate is an observer's");
    }
    model.settings.issuer = Ok(OrderIssuer { by: "ada".to_owned(), operator: None });
    keys(&mut model, "a");
    assert!(model.dialog.is_some());
}

#[test]
fn frozen_nothing_moves_until_it_is_thawed() {
    let mut model = model();
    keys(&mut model, "f");
    model.on_scene(Arc::new(scene(Vec::new())), NOW + 5 * SECOND);
    assert_eq!((model.shown().modules.len(), model.shown_unix_ns()), (2, NOW));
    assert_eq!(model.frozen_for_ns(), Some(5 * SECOND));
    keys(&mut model, " ");
    assert_eq!((model.shown().modules.len(), model.frozen_for_ns()), (0, None));
}

#[test]
fn the_filter_narrows_while_it_is_typed_and_escape_widens_step_by_step() {
    let mut model = model();
    keys(&mut model, "/g3");
    assert_eq!((model.rows().len(), selected(&model)), (1, "m1/sensor/g3".to_owned()));
    keys(&mut model, "\n");
    assert!(!model.types_filter && !model.filter.is_empty());
    keys(&mut model, "\x1b");
    assert_eq!((model.rows().len(), model.filter.is_empty()), (3, true));
}

#[test]
fn enter_on_a_module_lists_all_its_components() {
    let mut model = model();
    keys(&mut model, "\t\t\n");
    assert_eq!((model.pane, model.rows().len()), (Pane::Faults, 3));
    keys(&mut model, "G");
    assert_eq!(selected(&model), "m1/sensor/g1");
    keys(&mut model, "\x1b");
    assert_eq!(model.scope, None);
}

#[test]
fn without_anything_selected_no_order_begins() {
    let mut model = Model::new(settings(), NOW);
    assert_eq!(keys(&mut model, "a\n\n"), []);
    assert_eq!(model.notice.as_ref().unwrap().text, "no component is selected");
}

#[test]
fn history_is_asked_for_and_without_a_network_says_so() {
    let mut model = model();
    let effects = keys(&mut model, "h");
    let [ModelEffect::History(of)] = &effects[..] else { panic!("{effects:?}") };
    let ComponentId { structure, component } = of;
    let mut history = ModuleHistory::new(structure, &component.module, 1);
    history.broken_off = Some(QueryError::NotAsked("the network is not connected".to_owned()));
    model.on_answer(TaskResult::History(of.clone(), Box::new(history)));
    let journal = model.journal.as_ref().unwrap();
    assert_eq!(
        journal.entries,
        Fetched::Missing("m1: the network is not connected; its history is unavailable".to_owned())
    );
    keys(&mut model, "\x1b");
    assert!(model.journal.is_none());
}

#[test]
fn q_and_control_c_end_it_and_control_z_suspends_it() {
    let mut model = model();
    assert_eq!(keys(&mut model, "q"), [ModelEffect::Quit]);
    keys(&mut model, "a");
    assert_eq!(model.on_control('c'), [ModelEffect::Quit]);
    assert_eq!(model.on_control('z'), [ModelEffect::Suspend]);
}
