//! Compares whole screens with those in `tests/screens`. `BLESS=1` rewrites them, so that a change is deliberate and
//! visible.

use std::path::Path;
use std::sync::Arc;

use observer::{ModuleView, NetworkState, News, ObservedEvent, Scene};
use ratatui::buffer::Buffer;
use ratatui::crossterm::event::KeyCode;
use ratatui::layout::Rect;
use ratatui::style::Color;
use vocabulary::{
    Candidate, Channel, Condition, Divergences, FaultSize, FaultState, FaultTransition,
    FreezeFrame, FrozenSignals, GivenOrder, GivenOrderKind, Identification, RunId, Shelving, Step,
    Trace, Unknown,
};

use crate::model::{Model, TaskResult};
use crate::testing::{NOW, SECOND, heard, latched, scene, settings, state};
use crate::view::draw;
use observer::ComponentId;

const SIZES: [(u16, u16); 2] = [(80, 24), (120, 40)];

fn buffer(model: &Model, (width, height): (u16, u16)) -> Buffer {
    let area = Rect::new(0, 0, width, height);
    let mut buffer = Buffer::empty(area);
    draw(model, area, &mut buffer);
    buffer
}

fn text(buffer: &Buffer) -> String {
    let line = |y: u16| {
        let cells = (0..buffer.area.width).map(|x| buffer[(x, y)].symbol());
        cells.collect::<String>().trim_end().to_owned() + "\n"
    };
    (0..buffer.area.height).map(line).collect()
}

/// Compares the drawn model with the agreed screen, in both sizes.
#[track_caller]
fn assert_screens(name: &str, model: &Model) {
    for (width, height) in SIZES {
        let file =
            format!("{}/tests/screens/{name}-{width}x{height}.txt", env!("CARGO_MANIFEST_DIR"));
        let present = text(&buffer(model, (width, height)));
        if std::env::var_os("BLESS").is_some() {
            std::fs::create_dir_all(Path::new(&file).parent().unwrap()).unwrap();
            std::fs::write(&file, &present).unwrap();
        }
        let agreed = std::fs::read_to_string(&file).unwrap();
        assert_eq!(present, agreed, "{name} at {width}×{height} is now\n{present}");
    }
}

fn agreeing(component: &str) -> FaultTransition {
    let condition = Condition::Agrees { from: Step(3701), as_of: Step(4700) };
    FaultTransition { condition: Some(condition), ..state(component, FaultState::Normal, 600) }
}

fn bias() -> Identification {
    let size = FaultSize { value: 4.51e-5, low: 4.48e-5, high: 4.54e-5, own_unit: false };
    let bias = Candidate {
        kind: vocabulary::fault::FaultKind::Bias.into(),
        probability: 0.987,
        size: Some(size),
    };
    let drift = Candidate {
        kind: vocabulary::fault::FaultKind::Drift.into(),
        probability: 0.013,
        size: None,
    };
    Identification {
        structure: "tower".parse().unwrap(),
        module: "module1".parse().unwrap(),
        component: "module1/sensor/g2".parse().unwrap(),
        run: RunId(3),
        sequence: 7,
        as_of_step: Step(3210),
        decided: true,
        candidates: vec![bias, drift],
        signature: None,
        since_unix_ns: None,
        time_unix_ns: NOW - 11 * SECOND,
    }
}

fn fault() -> FaultTransition {
    let identification = Some(Box::new(bias()));
    FaultTransition { identification, ..latched("module1/sensor/g2", 12) }
}

fn shelving() -> Shelving {
    Shelving {
        since_unix_ns: NOW - 60 * SECOND,
        until_unix_ns: NOW + 7200 * SECOND,
        by: "ada".to_owned(),
        on_behalf_of: None,
        reason: "painting".to_owned(),
    }
}

fn acknowledged() -> FaultTransition {
    let order = GivenOrder {
        kind: GivenOrderKind::Acknowledge,
        by: "ada".to_owned(),
        on_behalf_of: None,
        note: Some("seen on site".to_owned()),
    };
    FaultTransition {
        verdict: vocabulary::Verdict::example(FaultState::Acknowledged),
        order: Some(order),
        ..latched("module1/actuator/a3", 400)
    }
}

fn first() -> ModuleView {
    let shelved = Some(shelving());
    let mut components = vec![
        acknowledged(),
        agreeing("module1/sensor/g1"),
        fault(),
        FaultTransition { shelved, ..latched("module1/sensor/g3", 7300) },
        state("module1/sensor/g4", FaultState::Normal, 600),
    ];
    components.sort_by(|a, b| a.component.cmp(&b.component));
    heard("module1", components)
}

fn second() -> ModuleView {
    let explained = FaultTransition {
        verdict: vocabulary::Verdict::Explained {
            by: "module1/sensor/g2".parse().unwrap(),
            since: Step(3108),
        },
        ..state("module2/sensor/g5", FaultState::Explained, 12)
    };
    heard("module2", vec![agreeing("module2/actuator/a1"), explained])
}

fn silent() -> ModuleView {
    let mut module = second();
    let heard_unix_ns = NOW - 9 * SECOND;
    let unknown =
        Unknown { since_unix_ns: heard_unix_ns, reason: "its diagnoser is not heard".to_owned() };
    for component in &mut module.components {
        *component = component.clone().while_unknown(unknown.clone());
    }
    ModuleView { is_silent: true, heard_unix_ns, ..module }
}

fn with_events(mut scene: Scene) -> Arc<Scene> {
    let there = News::Presence {
        structure: "tower".parse().unwrap(),
        who: "module1".to_owned(),
        there: true,
        at_start: false,
    };
    let news = [there, News::Fault(Box::new(fault())), News::Identification(Box::new(bias()))];
    for (number, news) in (1..).zip(news) {
        let time_unix_ns = NOW - (20 - 4 * number) * SECOND;
        scene.events.push_back(Arc::new(ObservedEvent { number, time_unix_ns, news }));
    }
    Arc::new(scene)
}

fn model() -> Model {
    let mut model = Model::new(settings(), NOW);
    model.on_scene(with_events(scene(vec![first(), second()])), NOW);
    model
}

fn press(model: &mut Model, text: &str) {
    for character in text.chars() {
        let key = match character {
            '\n' => KeyCode::Enter,
            '\x1b' => KeyCode::Esc,
            other => KeyCode::Char(other),
        };
        model.on_key(key);
    }
}

/// A gage's frame: a jump in the middle of four seconds.
pub(crate) fn frame() -> FreezeFrame {
    let steps: Vec<u64> = (1108..5108).step_by(10).collect();
    let trace = |name: &str, unit: &str, of: &dyn Fn(f64) -> f64| Trace {
        name: name.to_owned(),
        unit: unit.to_owned(),
        values: steps
            .iter()
            .map(|step| Some(of(f64::from(u32::try_from(*step).unwrap()))))
            .collect(),
    };
    let jump = |step: f64| if step < 3108.0 { 0.0 } else { 45e-6 };
    let wave = |step: f64| 3e-6 * (step / 40.0).sin();
    let grows = |step: f64| {
        if step < 3108.0 { 0.02 } else { 5e3 * (1.0 - (-(step - 3108.0) / 90.0).exp()) }
    };
    FreezeFrame {
        structure: "tower".parse().unwrap(),
        module: "module1".parse().unwrap(),
        component: "module1/sensor/g2".parse().unwrap(),
        incarnation: 0,
        time_unix_ns: NOW - 10 * SECOND,
        signals: FrozenSignals {
            sequence: 7,
            run: RunId(3),
            step_s: 1e-3,
            onset_step: Step(3108),
            detection_step: Step(3110),
            decided_step: Step(3118),
            threshold: 10.0,
            traces: vec![
                trace("residual", "m", &|step| jump(step) + wave(step)),
                trace("divergence", "1", &grows),
            ],
            steps: steps.iter().map(|step| Step(*step)).collect(),
        },
    }
}

fn divergences(step: u32) -> Divergences {
    let component = "sensor/g2".parse().unwrap();
    let residual = 45e-6 + 3e-6 * (f64::from(step) / 40.0).sin();
    let divergence = Some(5e3 + 500.0 * (f64::from(step) / 200.0).cos());
    Divergences {
        structure: "tower".parse().unwrap(),
        module: "module1".parse().unwrap(),
        run: RunId(3),
        step: Step(u64::from(step)),
        time_unix_ns: NOW,
        channels: vec![Channel {
            component,
            residual,
            divergence,
            threshold: 10.0,
            own_unit: false,
        }],
    }
}

#[test]
fn the_main_screen_has_modules_faults_by_urgency_and_events() {
    assert_screens("main", &model());
}

#[test]
fn a_silent_module_stands_among_the_alarms() {
    let mut model = Model::new(settings(), NOW);
    model.on_scene(with_events(scene(vec![first(), silent()])), NOW);
    assert_screens("silent", &model);
}

#[test]
fn before_anybody_answers_it_says_where_it_looks() {
    let mut model = Model::new(settings(), NOW);
    let network = NetworkState::Failed("no connection to tcp/192.0.2.10:7447 within 3s".to_owned());
    let nobody = Scene { number: 1, time_unix_ns: NOW, network, ..Scene::default() };
    model.on_scene(Arc::new(nobody), NOW + SECOND);
    assert_screens("nobody", &model);
}

#[test]
fn a_component_is_shown_with_its_plots() {
    let mut model = model();
    press(&mut model, "\n");
    let subject = ComponentId::of(&fault());
    model.on_answer(TaskResult::Frame(subject.clone(), Ok(Box::new(frame()))));
    model.on_answer(TaskResult::Identification(subject, Ok(Some(Box::new(bias())))));
    for step in (5200..9200).step_by(40) {
        model.on_answer(TaskResult::Divergences(Box::new(divergences(step))));
    }
    assert_screens("component", &model);
}

#[test]
fn the_help_names_keys_and_symbols() {
    let mut model = model();
    press(&mut model, "?");
    assert_screens("help", &model);
}

#[test]
fn the_filter_is_shown_while_it_is_typed() {
    let mut model = model();
    press(&mut model, "/sensor lat");
    assert_screens("filter", &model);
}

#[test]
fn an_order_is_shown_once_more_before_it_is_sent() {
    let mut model = model();
    press(&mut model, "s\npainting until noon\n");
    assert_screens("shelve", &model);
}

#[test]
fn a_frozen_screen_says_so_with_its_age() {
    let mut model = model();
    press(&mut model, "f");
    let later = NOW + 65 * SECOND;
    model.on_scene(Arc::new(scene(Vec::new())), later);
    assert_screens("frozen", &model);
}

#[test]
fn the_picture_for_operators_is_this_screen() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let file = format!("{root}/crates/terminal/tests/screens/silent-80x24.txt");
    let screen = std::fs::read_to_string(file).unwrap();
    for page in ["README.md", "deploy/README.md"] {
        let page = std::fs::read_to_string(format!("{root}/{page}")).unwrap();
        let mark = "<!-- silent-80x24 screen -->\n```text\n";
        let picture = page.split_once(mark).unwrap().1.split_once("```").unwrap().0;
        assert_eq!(picture, screen);
    }
}

#[test]
fn a_picture_that_is_old_is_not_taken_for_the_present() {
    let mut model = model();
    model.on_tick(NOW + 7 * SECOND);
    let shown = text(&buffer(&model, (80, 24)));
    assert!(shown.contains("PICTURE IS 7 s OLD"), "{shown}");
}

#[test]
fn a_structure_of_which_nothing_is_known_is_not_called_normal() {
    let mut model = Model::new(settings(), NOW);
    model.on_scene(Arc::new(scene(vec![heard("m1", Vec::new())])), NOW);
    let shown = text(&buffer(&model, (80, 24)));
    assert!(shown.contains("all components unknown"), "{shown}");
    assert!(shown.contains("NOT ANSWERING") && !shown.contains("normal"), "{shown}");
}

#[test]
fn foreign_texts_reach_the_screen_harmless() {
    let hostile = "x\x1b[2J\u{202e}y\r\n";
    let mut component = acknowledged();
    component.order.as_mut().unwrap().note = Some(hostile.to_owned());
    let mut module = heard("module1", vec![component]);
    module.status.as_mut().unwrap().journal.problem = Some(hostile.to_owned());
    let mut scene = scene(vec![module]);
    scene.network = NetworkState::Failed(hostile.to_owned());
    let structure = "tower".parse().unwrap();
    let news = News::Presence { structure, who: hostile.to_owned(), there: false, at_start: false };
    scene.events.push_back(Arc::new(ObservedEvent { number: 1, time_unix_ns: NOW, news }));
    let mut model = Model::new(settings(), NOW);
    model.on_scene(Arc::new(scene), NOW);
    for keys in ["", "\n", "h", "\x1b\x1ba"] {
        press(&mut model, keys);
        let shown = text(&buffer(&model, (200, 40)));
        let raw = |c: char| c != '\n' && !vocabulary::is_printable(c);
        assert!(!shown.chars().any(raw), "{shown:?}");
    }
    let shown = text(&buffer(&Model::new(settings(), NOW), (200, 40)));
    assert!(shown.contains("no module answers yet"), "{shown}");
}

#[test]
fn without_colours_the_same_is_there_and_no_colour() {
    let (mut model, mut coloured) = (model(), 0);
    let with = text(&buffer(&model, (80, 24)));
    for colours in [true, false] {
        model.settings.colours = colours;
        let drawn = buffer(&model, (80, 24));
        assert_eq!(text(&drawn), with);
        let count = drawn.content.iter().filter(|cell| cell.fg != Color::Reset).count();
        coloured = if colours {
            count
        } else {
            assert!(coloured > 0 && count == 0);
            count
        };
    }
}

#[test]
fn a_terminal_without_utf_8_gets_ascii_in_the_same_places() {
    let mut model = model();
    for keys in ["", "\n", "\x1b?"] {
        press(&mut model, keys);
        model.settings.ascii = false;
        let drawn = text(&buffer(&model, (80, 24)));
        model.settings.ascii = true;
        let ascii = text(&buffer(&model, (80, 24)));
        assert!(!drawn.is_ascii() && ascii.is_ascii(), "{ascii}");
        let widths = |text: &str| text.lines().map(|line| line.chars().count()).collect::<Vec<_>>();
        let (drawn, ascii) = (widths(&drawn), widths(&ascii));
        // Lines of a plot may end in dots that are not set.
        assert!(
            drawn.iter().zip(&ascii).all(|(drawn, ascii)| ascii <= drawn),
            "{drawn:?} {ascii:?}"
        );
    }
}

#[test]
fn every_size_can_be_drawn() {
    let mut model = model();
    press(&mut model, "s");
    for width in [1, 20, 39, 40, 41, 79, 200] {
        for height in [1, 5, 9, 10, 11, 60] {
            for keys in ["", "\x1b\n", "h", "\x1b\x1b?", " "] {
                press(&mut model, keys);
                buffer(&model, (width, height));
            }
        }
    }
}
