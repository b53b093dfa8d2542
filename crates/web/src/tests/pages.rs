//! What is rendered of a scene.

use maud::{Markup, html};
use observer::{NetworkState, Scene};
use truss::Structure;
use vocabulary::{FaultState, FaultTransition, GivenOrder, GivenOrderKind};

use crate::access::{Person, Viewer};
use crate::drawing::LinkedDrawing;
use crate::layout::{Page, network};
use crate::testing::*;
use crate::view::LinkedScene;
use crate::{assets, forms, overview};

/// The most that may be sent before the overview is seen.
const FIRST_PAINT_BYTES: usize = 150_000;

fn tower() -> LinkedDrawing {
    let text = include_str!("../../../../configs/tower.toml");
    LinkedDrawing::of(&Structure::from_toml(text).unwrap())
}

fn overview_of(scene: &Scene, drawing: Option<&LinkedDrawing>) -> String {
    overview::main(&LinkedScene::new(scene), drawing, None).into_string()
}

fn whole(scene: &Scene, main: &Markup) -> String {
    let (live, viewer) = ("page=overview".to_owned(), &Viewer::default());
    Page { title: "tower", place: "/", live, viewer, scene }.markup(main).into_string()
}

#[test]
fn the_whole_is_in_a_sentence() {
    let seen = scene(vec![module("m1", vec![component("m1/sensor/g1", FaultState::Normal)])]);
    let counts = r#"id="counts" role="status">1 of 1 components are normal<"#;
    assert!(overview_of(&seen, None).contains(counts));
}

#[test]
fn between_clocks_that_differ_no_lag_is_shown_but_what_is_wrong() {
    let mut seen = module("m1", vec![component("m1/sensor/g1", FaultState::Normal)]);
    let status = seen.status.as_mut().unwrap();
    (status.lag_ms, status.sample_age_ms) = (Some(-3_600_000.0), Some(-3_599_000.0));
    let page = overview_of(&scene(vec![seen]), None);
    assert!(
        page.contains("its clock is 3600 s behind the publisher&#39;s")
            || page.contains("its clock is 3600 s behind the publisher's"),
        "{page}"
    );
    assert!(!page.contains("-3600") && !page.contains("-1.0 h"), "{page}");
}

#[test]
fn a_journal_that_lost_records_or_is_damaged_is_not_called_ok() {
    let mut seen = module("m1", vec![component("m1/sensor/g1", FaultState::Normal)]);
    let journal = &mut seen.status.as_mut().unwrap().journal;
    (journal.directory, journal.lost, journal.damaged) = (Some("/var".to_owned()), 1, 2);
    let page = overview_of(&scene(vec![seen]), None);
    assert!(page.contains("<dt>journal</dt><dd>1 lost, 2 damaged"), "{page}");
}

#[test]
fn a_silent_module_stands_among_the_alarms_after_the_faults_of_others() {
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
    assert!(place("m1/sensor/g1") < place("NOT ANSWERING"));
    assert!(place("NOT ANSWERING") < place("2 components unknown"));
    assert!(place("nothing heard since") < place(">g2<"));
    assert!(!page.contains(">normal<"), "what is not heard is not called normal: {page}");
}

#[test]
fn the_page_of_a_silent_module_claims_nothing_of_the_present() {
    let mut seen = module("m1", vec![component("m1/sensor/g1", FaultState::Normal)]);
    let status = seen.status.as_mut().unwrap();
    status.journal.directory = Some("/var".to_owned());
    status.peers = vec![vocabulary::PeerStatus::unasked("m2".parse().unwrap())];
    status.peers[0].present = true;
    let page_of = |module: &observer::ModuleView| {
        let scene = scene(vec![module.clone()]);
        crate::module::parts(&LinkedScene::new(&scene), &module.id()).remove(0).html
    };
    let page = page_of(&seen);
    for part in ["<dt>journal</dt><dd>ok", "<dd>1 of 1 components are normal</dd>", ">there<"] {
        assert!(page.contains(part), "{part}: {page}");
    }
    let page = page_of(&silent(seen));
    for part in ["<dt>journal</dt><dd>-", "<dd>0 of 1 components are normal, 1 unknown</dd>"] {
        assert!(page.contains(part), "{part}: {page}");
    }
    for heading in ["Peers as seen by this module, last reported at ", "Set up with, last reported"]
    {
        assert!(page.contains(heading), "{page}");
    }
}

#[test]
fn what_is_unknown_never_looks_normal_in_the_drawing() {
    let drawing = tower();
    let first = drawing_component(&drawing);
    let gone = silent(module("module1", vec![component(&first, FaultState::Normal)]));
    let heard_of = scene(vec![gone]);
    let signs = drawing.signs(&LinkedScene::new(&heard_of)).into_string();
    assert_eq!(signs.matches(r#"class="mark unknown""#).count(), 1);
    assert_eq!(signs.matches("mark normal").count() + signs.matches("mark unverified").count(), 0);
    assert!(signs.matches("mark absent").count() > 10, "the other signals were never reported");
    assert!(signs.contains(&format!("{first}: unknown")), "{signs}");
}

fn drawing_component(drawing: &LinkedDrawing) -> String {
    let empty = Scene::default();
    let signs = drawing.signs(&LinkedScene::new(&empty)).into_string();
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
        whole(&unreachable, &overview::main(&LinkedScene::new(&unreachable), Some(&drawing), None)),
        network(&unreachable).into_string(),
    ] {
        assert!(page.contains("&lt;script&gt;alert(1)"), "{page}");
        assert!(!page.contains("<script>") && !page.contains('\u{1b}'), "{page}");
    }
}

#[test]
fn the_list_shows_operator_reason_and_end_of_shelving() {
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
    let view = LinkedScene::new(&seen);
    let page = whole(&seen, &overview::main(&view, Some(&drawing), None));
    let parts = overview::parts(&view, Some(&drawing));
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
    let page = whole(&seen, &overview::main(&LinkedScene::new(&seen), Some(&drawing), None));
    let bytes = page.len() + assets::STYLE.len() + assets::SCRIPT.len() + assets::ICON.len();
    assert!(bytes < FIRST_PAINT_BYTES, "{bytes} bytes, {} of them the page", page.len());
    assert!(assets::SCRIPT.lines().count() < 210);
}

#[test]
fn nothing_is_asked_of_another_host_and_no_script_or_style_stands_in_a_page() {
    let seen = scene(vec![module("m1", vec![latched("m1/sensor/g1")])]);
    let drawing = tower();
    let page = whole(&seen, &overview::main(&LinkedScene::new(&seen), Some(&drawing), None));
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
fn forms_are_those_that_a_diagnoser_may_obey() {
    let forms = |fault: &FaultTransition| {
        let mut viewer = Viewer::default();
        let (name, form_token) = ("ada".to_owned(), "t0k".to_owned());
        viewer.person = Some(Person { name, may_order: true, form_token });
        let page = html! { (forms::of_component(&viewer, fault, "/")) }.into_string();
        ["acknowledge", "declare", "shut-off", "put-back"].map(|kind| {
            let form = page.split("<form").find(|form| form.contains(&format!("/order/{kind}\"")));
            form.is_some_and(|form| {
                !form.split('>').next().is_some_and(|tag| tag.contains("hidden"))
            })
        })
    };
    let cylinder = latched("m1/actuator/a1");
    assert_eq!(forms(&latched("m1/sensor/g1")), [true, false, false, false]);
    assert_eq!(forms(&cylinder), [true, false, true, false]);
    let (kind, by) = (GivenOrderKind::ShutOff { since_unix_ns: 1 }, "ada".to_owned());
    let shut_off = Some(GivenOrder { kind, by, on_behalf_of: None, note: None });
    assert_eq!(
        forms(&FaultTransition { shut_off, ..cylinder.clone() }),
        [true, false, false, true]
    );
    let untouched = FaultTransition::untouched(cylinder.structure, cylinder.component, 5);
    assert_eq!(forms(&untouched), [false, true, false, false]);
}

#[test]
fn forms_require_permission_to_issue_commands() {
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
