//! Copies side by side, and taking them apart again.

#![allow(clippy::unwrap_used, reason = "test code")]

use truss::{Mechanics, Modes, Structure};

const TOWER: &str = include_str!("../../../configs/tower.toml");

fn tower() -> Structure {
    Structure::from_toml(TOWER).unwrap()
}

#[test]
fn a_structure_in_one_piece_is_its_only_part() {
    assert_eq!(tower().parts(), [tower()]);
    let module = tower().local(&"module2".parse().unwrap()).unwrap();
    assert_eq!(module.parts(), std::slice::from_ref(&module));
}

#[test]
fn a_row_has_every_module_of_every_copy_under_a_name_of_its_own() {
    let row = tower().row(3).unwrap();
    assert_eq!(row.name.as_str(), "tower-x3");
    assert_eq!((row.nodes.len(), row.members.len(), row.modules.len()), (3 * 52, 3 * 152, 12));
    let equipped: Vec<&str> = row.equipped().map(|module| module.name.as_str()).collect();
    let expected = ["t01-module1", "t01-module2", "t02-module1", "t02-module2"];
    assert_eq!(equipped[..4], expected);
    assert_eq!(tower().row(100).unwrap().modules[0].name.as_str(), "t001-module1");
}

/// The parts of a row are the structure again, but for names and place.
#[test]
fn every_part_of_a_row_moves_like_the_structure_that_was_copied() {
    let row = tower().row(3).unwrap();
    let parts = row.parts();
    assert_eq!(parts.len(), 3);
    let mechanics = |structure: &Structure| Mechanics::assemble(structure).unwrap();
    let frequencies = |structure: &Structure| {
        Modes::of(&mechanics(structure), structure.damping, Some(12)).unwrap().frequencies_hz()
    };
    let expected = frequencies(&tower());
    for (part, prefix) in parts.iter().zip(["t01-", "t02-", "t03-"]) {
        assert!((frequencies(part) - &expected).amax() < 1e-6);
        assert!((mechanics(part).gage_map - mechanics(&tower()).gage_map).amax() < 1e-9);
        assert!(part.modules.iter().all(|module| module.name.as_str().starts_with(prefix)));
        assert_eq!(part.modules.len(), 4);
    }
    // The whole, whose matrix has zeros between the parts, has each mode as often as there are copies.
    let two = frequencies(&tower().row(2).unwrap());
    assert!((two[0] - expected[0]).abs() < 1e-6 && (two[3] - expected[1]).abs() < 1e-6);
}

#[test]
fn a_row_is_written_and_read_back_and_summed_up() {
    let row = tower().row(2).unwrap();
    assert_eq!(Structure::from_toml(&row.to_toml()).unwrap(), row);
    let (one, two) = (tower().summary().unwrap(), row.summary().unwrap());
    assert_eq!((one.parts, two.parts), (1, 2));
    assert_eq!(two.degrees_of_freedom, 2 * one.degrees_of_freedom);
    assert!((two.modes[0].frequency_hz - one.modes[0].frequency_hz).abs() < 1e-6);
    assert!(two.to_string().contains("2, each standing by itself"));
    assert!(!one.to_string().contains("standing by itself"));
}

#[test]
fn a_part_keeps_the_order_of_its_modules_however_they_are_mixed() {
    let mut row = tower().row(2).unwrap();
    row.modules.swap(1, 4);
    let names: Vec<Vec<String>> = row
        .parts()
        .iter()
        .map(|part| part.modules.iter().map(|module| module.name.to_string()).collect())
        .collect();
    assert_eq!(names[0], ["t01-module1", "t01-module3", "t01-module4", "t01-module2"]);
    assert_eq!(names[1][0], "t02-module1");
}

#[test]
fn a_name_that_gets_too_long_is_reported() {
    let mut long = tower();
    long.modules[0].name = "m".repeat(62).parse().unwrap();
    let error = long.row(2).unwrap_err().to_string();
    assert!(error.contains("mmmm") && error.contains("64"), "{error}");
}
