//! What is rendered of a scene.

use maud::{Markup, html};
use observer::{NetworkState, Scene};
use truss::Structure;
use wire::{FaultState, FaultTransition};

use crate::access::{Person, Viewer};
use crate::drawing::Drawing;
use crate::layout::{Page, network};
use crate::testing::*;
use crate::view::View;
use crate::{assets, forms, overview};

/// The most that may be sent before the overview is seen.
const FIRST_PAINT_BYTES: usize = 150_000;

fn tower() -> Drawing {
    let text = include_str!("../../../../configs/tower.toml");
    Drawing::of(&Structure::from_toml(text).unwrap())
}

fn overview_of(scene: &Scene, drawing: Option<&Drawing>) -> String {
    overview::main(&View::new(scene, drawing)).into_string()
}

fn whole(scene: &Scene, main: &Markup) -> String {
    let (live, viewer) = ("page=overview".to_owned(), &Viewer::default());
    Page { title: "tower", place: "/", live, viewer, scene }.markup(main).into_string()
}

fn counts(scene: &Scene) -> String {
    let page = overview_of(scene, None);
    let begin = page.split(r#"id="counts" role="status">"#).nth(1).unwrap();
    begin.split('<').next().unwrap().to_owned()
}

#[test]
fn the_whole_is_in_a_sentence_that_says_what_is_not_known_and_because_of_whom() {
    let normal = |path: &str| component(path, FaultState::Normal);
    let well = module("m1", vec![normal("m1/sensor/g1"), normal("m1/sensor/g2")]);
    let second = module("m2", vec![normal("m2/sensor/g1"), latched("m2/sensor/g2")]);
    assert_eq!(counts(&scene(vec![well.clone()])), "No fault known, 2 of 2 components verified");
    assert_eq!(
        counts(&scene(vec![well.clone(), silent(second)])),
        "1 fault, 2 of 4 components verified, 1 unknown: m2 is not heard"
    );
    let unverified = FaultTransition { condition: None, ..normal("m1/sensor/g1") };
    assert_eq!(
        counts(&scene(vec![module("m1", vec![unverified])])),
        "No fault known, 0 of 1 component verified, 1 normal, not verified"
    );
    let mute = module("m3", Vec::new());
    assert_eq!(
        counts(&scene(vec![well.clone(), mute])),
        "No fault known, 2 of 2 components verified: m3: does not answer: nothing is known of its components"
    );
    let cut = Scene { network: NetworkState::Closed, ..scene(vec![well]) };
    assert!(counts(&cut).ends_with("; as it was when there was a network"), "{}", counts(&cut));
    assert_eq!(counts(&Scene::default()), "No network: nothing is known");
    assert_eq!(counts(&scene(Vec::new())), "No module answers");
}

#[test]
fn a_silent_module_stands_among_the_alarms_before_the_faults_of_others() {
    let faulty = module("m1", vec![latched("m1/sensor/g1")]);
    let gone = silent(module(
        "m2",
        vec![
            component("m2/sensor/g1", FaultState::Normal),
            component("m2/sensor/g2", FaultState::Normal),
        ],
    ));
    let page = overview_of(&scene(vec![faulty, gone]), None);
    let alarms = page.split(r#"id="alarms""#).nth(1).unwrap();
    let alarms = alarms.split("</section>").next().unwrap();
    let place = |words: &str| alarms.find(words).unwrap_or_else(|| panic!("{words}: {alarms}"));
    assert!(place("NOT HEARD since") < place("m1/sensor/g1"));
    assert!(place("m1/sensor/g1") < place("2 components of m2"));
    assert!(!page.contains(">normal<"), "what is not heard is not called normal: {page}");
}

#[test]
fn what_is_unknown_never_looks_normal_in_the_drawing() {
    let drawing = tower();
    let first = drawing_component(&drawing);
    let gone = silent(module("module1", vec![component(&first, FaultState::Normal)]));
    let heard_of = scene(vec![gone]);
    let view = View::new(&heard_of, Some(&drawing));
    let signs = drawing.signs(|structure, path| view.shown(structure, path)).into_string();
    assert_eq!(signs.matches(r#"class="mark unknown""#).count(), 1);
    assert_eq!(signs.matches("mark normal").count() + signs.matches("mark unverified").count(), 0);
    assert!(signs.matches("mark absent").count() > 10, "nobody has reported the others");
    assert!(signs.contains(&format!("{first}: unknown")), "{signs}");
}

fn drawing_component(drawing: &Drawing) -> String {
    let empty = Scene::default();
    let view = View::new(&empty, None);
    let signs = drawing.signs(|structure, path| view.shown(structure, path)).into_string();
    let begin = signs.split("/component/").nth(1).unwrap();
    begin.split('"').next().unwrap().to_owned()
}

#[test]
fn notes_and_reasons_of_others_are_text_and_never_markup() {
    let hostile = "<script>alert(1)</script>\u{1b}[2J";
    let noted = acknowledged("m1/sensor/g1", hostile);
    let shelved = FaultTransition { shelved: Some(shelving(hostile)), ..latched("m1/sensor/g2") };
    let unreachable = Scene {
        network: NetworkState::Failed(hostile.to_owned()),
        ..scene(vec![module("m1", vec![noted, shelved])])
    };
    let drawing = tower();
    for page in [
        whole(&unreachable, &overview::main(&View::new(&unreachable, Some(&drawing)))),
        network(&unreachable).into_string(),
    ] {
        assert!(page.contains("&lt;script&gt;alert(1)"), "{page}");
        assert!(!page.contains("<script>") && !page.contains('\u{1b}'), "{page}");
    }
}

#[test]
fn who_set_an_alarm_aside_until_when_and_why_stands_in_the_list() {
    let shelved =
        FaultTransition { shelved: Some(shelving("painting")), ..latched("m1/sensor/g2") };
    let page = overview_of(&scene(vec![module("m1", vec![shelved])]), None);
    let others = page.split(r#"id="others""#).nth(1).unwrap();
    assert!(others.contains("shelved until 20") && others.contains("by ada: painting"), "{others}");
    assert!(others.contains("m1/sensor/g2"));
}

#[test]
fn every_part_that_is_sent_stands_in_the_page_with_the_same_content() {
    let seen = scene(vec![module("m1", vec![latched("m1/sensor/g1")])]);
    let drawing = tower();
    let view = View::new(&seen, Some(&drawing));
    let page = whole(&seen, &overview::main(&view));
    let parts = overview::parts(&view);
    assert!(parts.len() > 5);
    for part in parts {
        assert_eq!(page.matches(&format!("id=\"{}\"", part.id)).count(), 1, "{}", part.id);
        assert!(page.contains(&part.html), "{}: {}", part.id, part.html);
    }
}

#[test]
fn the_overview_of_the_shipped_tower_is_small() {
    let drawing = tower();
    let components = |module: &str| {
        let (sensors, actuators) = (1..=8, 1..=4);
        let sensors = sensors.map(|n| latched(&format!("{module}/sensor/g{n}")));
        sensors.chain(actuators.map(|n| latched(&format!("{module}/actuator/A{n}")))).collect()
    };
    let seen = scene(vec![
        module("module1", components("module1")),
        module("module2", components("module2")),
    ]);
    let page = whole(&seen, &overview::main(&View::new(&seen, Some(&drawing))));
    let bytes = page.len() + assets::STYLE.len() + assets::SCRIPT.len() + assets::ICON.len();
    assert!(bytes < FIRST_PAINT_BYTES, "{bytes} bytes, {} of them the page", page.len());
    assert!(assets::SCRIPT.lines().count() < 100);
}

#[test]
fn nothing_is_asked_of_another_host_and_no_script_or_style_stands_in_a_page() {
    let seen = scene(vec![module("m1", vec![latched("m1/sensor/g1")])]);
    let drawing = tower();
    let page = whole(&seen, &overview::main(&View::new(&seen, Some(&drawing))));
    for text in [page.as_str(), assets::STYLE, assets::SCRIPT] {
        let foreign = text.replace("http://www.w3.org/2000/svg", "");
        assert!(!foreign.contains("http://") && !foreign.contains("https://"));
        assert!(!foreign.contains("src=\"//") && !foreign.contains("url("));
    }
    assert!(
        !page.contains("style=") && !page.contains("onclick"),
        "a content security policy refuses it"
    );
}

#[test]
fn forms_are_for_those_who_may_order() {
    let fault = latched("m1/sensor/g1");
    let person =
        |may_order| Person { name: "ada".to_owned(), may_order, form_token: "t0k".to_owned() };
    let form = |person| {
        let mut viewer = Viewer::default();
        viewer.person = person;
        html! { (forms::of_component(&viewer, &fault, "/component/m1/sensor/g1")) }.into_string()
    };
    let allowed = form(Some(person(true)));
    for part in [
        r#"action="/order/acknowledge""#,
        r#"action="/order/reset""#,
        r#"action="/order/shelve""#,
        r#"action="/order/unshelve""#,
        r#"name="token" value="t0k""#,
        r#"name="component" value="m1/sensor/g1""#,
        r#"name="back" value="/component/m1/sensor/g1""#,
    ] {
        assert!(allowed.contains(part), "{part}: {allowed}");
    }
    assert!(!form(Some(person(false))).contains("<form") && !form(None).contains("<form"));
}
