//! Authority: the structure itself. What the drawing must show is in it; how it looks is for eyes.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a failing test may panic")]

#[path = "../../truss/tests/shared/mod.rs"]
mod shared;

use figure::structure::{SignLook, StructurePlan, drawing};
use svg::parser::Event;

fn texts(drawing: &str) -> Vec<String> {
    let mut texts = Vec::new();
    for event in svg::read(drawing).unwrap() {
        match event {
            Event::Text(text) => texts.push(text.trim().to_owned()),
            Event::Error(error) => panic!("{error}"),
            _ => {}
        }
    }
    texts
}

#[test]
fn the_drawing_names_the_structure_its_modules_and_all_equipment() {
    for structure in shared::all() {
        let texts = texts(&drawing(&structure));
        let count = |name: &str| texts.iter().filter(|text| *text == name).count();
        assert_eq!(count(structure.name.as_str()), 1);
        for module in &structure.modules {
            assert_eq!(count(module.name.as_str()), 1);
            for actuator in &module.actuators {
                let name = actuator.name.as_str();
                let all = structure.modules.iter().flat_map(|module| &module.actuators);
                assert_eq!(count(name), all.filter(|other| other.name.as_str() == name).count());
            }
            for gage in &module.gages {
                let name = gage.name.as_str();
                let all = structure.modules.iter().flat_map(|module| &module.gages);
                assert_eq!(count(name), all.filter(|other| other.name.as_str() == name).count());
            }
        }
    }
}

#[test]
fn the_legend_explains_what_occurs_and_nothing_else() {
    let tower = texts(&drawing(&shared::tower()));
    let has = |texts: &[String], words: &str| texts.iter().any(|text| text == words);
    for words in ["beam", "rod", "actuator", "strain gage", "boundary of modules"] {
        assert!(has(&tower, words), "{words}");
    }
    assert!(has(&tower, "support, free to tilt") && !has(&tower, "clamped support"));
    let local = texts(&drawing(&shared::local(&shared::tower(), "module2")));
    assert!(has(&local, "clamped support") && !has(&local, "boundary of modules"));
    let lower = texts(&drawing(&shared::local(&shared::small(), "lower")));
    assert!(!has(&lower, "beam"));
}

#[test]
fn every_coordinate_is_finite_and_the_drawing_is_always_the_same() {
    for structure in shared::all() {
        let first = drawing(&structure);
        assert!(!first.contains("NaN") && !first.contains("inf"));
        assert_eq!(first, drawing(&structure));
    }
}

#[test]
fn a_plan_has_a_link_with_title_and_badge_for_every_component() {
    for structure in shared::all() {
        let plan = StructurePlan::of(&structure);
        let look = |component: &vocabulary::ComponentPath| SignLook {
            class: "latched".to_owned(),
            badge: "sign-latched".to_owned(),
            title: format!("{component}: <script>"),
            href: format!("/component/{component}"),
        };
        let signs = plan.signs(look);
        let components = structure.modules.iter().flat_map(|module| {
            module.components().map(|component| format!("{}/{component}", module.name))
        });
        let mut count = 0;
        for component in components {
            assert!(signs.contains(&format!("href=\"/component/{component}\"")), "{component}");
            count += 1;
        }
        assert_eq!(signs.matches("href=\"#sign-latched\"").count(), count);
        assert_eq!(plan.components().count(), count);
        assert!(!signs.contains("<script>") && !signs.contains("NaN"), "{signs}");
        let page = format!("<svg viewBox=\"{}\">{}{signs}</svg>", plan.view_box(), plan.ground());
        assert!(texts(&page).len() > count);
    }
}
