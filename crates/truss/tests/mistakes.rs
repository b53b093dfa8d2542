//! Authority: the text of each message. Every mistake in a description is named, with its line and
//! with what would be right.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a failing test may panic")]

mod shared;

use truss::{Mechanics, ModalStepper, ModelError, Perturbation, Structure};

const TRIPOD: &str = r#"name = "tripod"
nodes = [
  { name = "A", position_m = [0.0, 0.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "B", position_m = [2.0, 0.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "C", position_m = [1.0, 2.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "T", position_m = [1.0, 1.0, 3.0], mass_kg = 100.0 },
]
members = [
  { name = "one", ends = ["A", "T"], section = "bar" },
  { name = "two", ends = ["B", "T"], section = "bar" },
  { name = "three", ends = ["C", "T"], section = "bar" },
]
[damping]
alpha_per_s = 0.1
beta_s = 0.001
[materials.steel]
young_pa = 210e9
poisson = 0.3
density_kg_per_m3 = 7850.0
[sections.bar]
kind = "rod"
material = "steel"
area_m2 = 1e-4
[[modules]]
name = "only"
actuators = [
  { name = "a1", member = "one" },
]
gages = [
  { name = "g1", member = "two" },
]
"#;

#[test]
fn surroundings_that_cannot_be_are_named() {
    let with = |text: &str| format!("[[surroundings]]\n{text}\n[damping]");
    let found = |text: &str| only("[damping]", &with(text));
    for (text, expected) in [
        ("freedoms = [[\"Q\", \"x\"]]\nstiffness = [[1.0]]", "`Q`"),
        (
            "freedoms = [[\"T\", \"rx\"]]\nstiffness = [[1.0]]",
            "rx of node `T`, which no beam turns",
        ),
        (
            "freedoms = [[\"T\", \"x\"], [\"T\", \"x\"]]\nstiffness = [[1.0], [0.0, 1.0]]",
            "x of node `T` twice",
        ),
        ("freedoms = [[\"T\", \"x\"]]\nstiffness = [[1.0, 2.0]]", "no lower triangle of 1 rows"),
        ("freedoms = [[\"T\", \"x\"]]\nstiffness = [[nan]]", "NaN"),
    ] {
        let message = found(text);
        assert!(message.contains(expected), "{message}");
    }
}

/// The messages after replacing one piece of the tripod.
fn messages(from: &str, to: &str) -> Vec<String> {
    assert!(TRIPOD.contains(from), "{from}");
    let errors = Structure::from_toml(&TRIPOD.replace(from, to)).unwrap_err();
    let messages: Vec<String> = errors.iter().map(ToString::to_string).collect();
    assert_eq!(errors.to_string(), messages.join("\n"));
    for message in &messages {
        assert!(!message.ends_with('.') && !message.contains('\n'), "{message}");
        assert!(message.starts_with(|c: char| !c.is_uppercase()), "{message}");
    }
    messages
}

fn only(from: &str, to: &str) -> String {
    let mut messages = messages(from, to);
    assert_eq!(messages.len(), 1, "{messages:#?}");
    messages.remove(0)
}

#[test]
fn the_tripod_itself_is_sound() {
    let tripod = Structure::from_toml(TRIPOD).unwrap();
    assert_eq!(Mechanics::assemble(&tripod).unwrap().dofs.len(), 3);
}

#[test]
fn an_unknown_node_is_named_with_the_nearest_one() {
    assert_eq!(
        only(r#"["A", "T"]"#, r#"["AA", "T"]"#),
        "line 9: member `one` refers to node `AA`, which is not described; did you mean `A`?"
    );
    assert_eq!(
        only(r#"["A", "T"]"#, r#"["nowhere", "T"]"#),
        "line 9: member `one` refers to node `nowhere`, which is not described; there are `A`, `B`, `C`, `T`"
    );
}

#[test]
fn unknown_sections_materials_members_and_modules_are_named() {
    assert!(
        only(r#"["A", "T"], section = "bar""#, r#"["A", "T"], section = "tube""#)
            .contains("section `tube`")
    );
    assert!(
        only(r#"material = "steel""#, r#"material = "stele""#).contains("did you mean `steel`?")
    );
    assert!(
        only(r#"member = "two""#, r#"member = "twoo""#)
            .contains("gage `g1` of module `only` refers to member `twoo`")
    );
    assert!(only(r#"["A", "T"],"#, r#"["A", "T"], module = "other","#).contains("module `other`"));
}

#[test]
fn a_member_without_length_is_named_with_its_ends() {
    assert_eq!(
        only(r#"["A", "T"]"#, r#"["T", "T"]"#),
        "line 9: member `one` has no length: `T` and `T` are at the same place; give it two nodes that are apart"
    );
}

#[test]
fn an_actuator_without_length_is_named() {
    let message =
        only(r#"{ name = "a1", member = "one" }"#, r#"{ name = "a1", between = ["T", "T"] }"#);
    assert!(message.starts_with("line 27: actuator `a1` has no length"), "{message}");
}

#[test]
fn an_actuator_says_where_it_is_exactly_once() {
    let neither = only(r#"{ name = "a1", member = "one" }"#, r#"{ name = "a1" }"#);
    assert!(neither.contains("either `between"), "{neither}");
    let both = only(r#"member = "one" }"#, r#"member = "one", between = ["A", "T"] }"#);
    assert!(both.contains("either `between"), "{both}");
}

#[test]
fn numbers_out_of_range_are_named_with_their_range() {
    assert_eq!(
        only("area_m2 = 1e-4", "area_m2 = -1e-4"),
        "line 20: `area_m2` of section `bar` is -0.0001; use 1e-10 to 1e4 m²"
    );
    for (from, to, quantity) in [
        ("young_pa = 210e9", "young_pa = 0.0", "young_pa"),
        ("poisson = 0.3", "poisson = 0.7", "poisson"),
        ("density_kg_per_m3 = 7850.0", "density_kg_per_m3 = -1.0", "density_kg_per_m3"),
        ("mass_kg = 100.0", "mass_kg = -1.0", "mass_kg"),
        ("mass_kg = 100.0", "mass_kg = nan", "mass_kg"),
        ("[1.0, 1.0, 3.0]", "[1.0, inf, 3.0]", "position_m"),
        ("alpha_per_s = 0.1", "alpha_per_s = -0.1", "alpha_per_s"),
        ("beta_s = 0.001", "beta_s = inf", "beta_s"),
        (r#"["A", "T"],"#, r#"["A", "T"], stiffness_factor = 0.0,"#, "stiffness_factor"),
        ("mass_kg = 100.0", "mass_factor = 0.0", "mass_factor"),
    ] {
        let messages = messages(from, to);
        assert!(
            messages.iter().any(|m| m.contains(quantity) && m.contains("use ")),
            "{messages:?}"
        );
    }
}

#[test]
fn duplicate_names_are_reported_with_both_lines() {
    assert_eq!(
        only(r#"{ name = "three""#, r#"{ name = "one""#),
        "line 11: member `one` is described twice, first in line 9; give each its own name"
    );
}

#[test]
fn duplicate_nodes_actuators_gages_and_modules_are_reported() {
    assert!(
        messages(r#"name = "B""#, r#"name = "A""#)
            .iter()
            .any(|m| m.contains("node `A` is described twice, first in line 3"))
    );
    assert!(
        only(
            r#"  { name = "a1", member = "one" },"#,
            "  { name = \"a1\", member = \"one\" },\n  { name = \"a1\", member = \"two\" },"
        )
        .contains("actuator `a1` is described twice, first in line 27")
    );
    assert!(
        only(
            r#"  { name = "g1", member = "two" },"#,
            "  { name = \"g1\", member = \"two\" },\n  { name = \"g1\", member = \"one\" },"
        )
        .contains("gage `g1` is described twice")
    );
    assert!(
        messages("[[modules]]", "[[modules]]\nname = \"only\"\n[[modules]]")
            .iter()
            .any(|m| m.contains("module `only` is described twice"))
    );
}

#[test]
fn unknown_missing_and_mistyped_keys_are_named() {
    assert!(
        only("mass_kg = 100.0", "mas_kg = 100.0")
            .contains("line 6: node `T`: unknown field `mas_kg`")
    );
    assert!(
        only(r#"{ name = "one", ends"#, r#"{ name = "one", end"#)
            .contains("member `one`: unknown field `end`")
    );
    assert!(only("area_m2 = 1e-4", "").contains("section `bar`: missing field `area_m2`"));
    assert!(only("mass_kg = 100.0", r#"mass_kg = "heavy""#).contains("node `T`: invalid type"));
    assert!(only("[damping]", "[dampening]").contains("unknown field `dampening`"));
    assert!(
        only(
            r#"fixed = ["x", "y", "z"] },
  { name = "B""#,
            r#"fixed = ["up"] },
  { name = "B""#
        )
        .contains("unknown variant `up`")
    );
}

#[test]
fn text_that_is_no_toml_is_reported_with_its_line() {
    assert!(only("nodes = [", "nodes = ").starts_with("line "));
    assert!(Structure::from_toml("").is_err());
}

#[test]
fn names_outside_the_alphabet_are_refused() {
    assert!(only(r#"name = "only""#, r#"name = "on/ly""#).contains("module name"));
    assert!(only(r#"name = "tripod""#, r#"name = "tri pod""#).contains("structure name"));
    assert!(only(r#"name = "g1""#, r#"name = """#).contains("gage name"));
}

#[test]
fn a_beam_needs_its_moments_and_a_proper_local_axis() {
    let messages = messages(r#"kind = "rod""#, r#"kind = "beam""#);
    assert_eq!(messages.len(), 3, "{messages:?}");
    assert!(messages[0].contains("lacks `second_moment_y_m4`"));
    let beam = "kind = \"beam\"\nsecond_moment_y_m4 = 1e-6\nsecond_moment_z_m4 = 1e-6\ntorsion_constant_m4 = 1e-6";
    let text = TRIPOD
        .replace(r#"kind = "rod""#, beam)
        .replace(r#"["A", "T"],"#, r#"["A", "T"], local_y = [2.0, 2.0, 6.0],"#);
    let error = Structure::from_toml(&text).unwrap_err().to_string();
    assert_eq!(
        error,
        "line 9: `local_y` of member `one` runs along the member; give a vector across it"
    );
}

#[test]
fn all_mistakes_are_reported_at_once_in_the_order_of_lines() {
    let text = TRIPOD
        .replace("mass_kg = 100.0", "mass = 100.0")
        .replace(r#"["A", "T"]"#, r#"["X", "T"]"#)
        .replace("area_m2 = 1e-4", "area_m2 = 0.0")
        .replace(r#"member = "two""#, r#"member = "four""#);
    let errors = Structure::from_toml(&text).unwrap_err();
    let lines: Vec<_> = errors.iter().map(|error| error.line).collect();
    assert_eq!(lines, [Some(6), Some(9), Some(20), Some(30)]);
}

#[test]
fn an_idle_node_and_a_module_without_members_are_reported() {
    let idle = only("nodes = [", "nodes = [\n  { name = \"idle\", position_m = [9.0, 9.0, 9.0] },");
    assert_eq!(idle, "line 3: node `idle` belongs to no member; connect it or leave it out");
    let text = TRIPOD.replace(r#"section = "bar" }"#, r#"section = "bar", module = "only" }"#)
        + "[[modules]]\nname = \"empty\"\n";
    let error = Structure::from_toml(&text).unwrap_err().to_string();
    assert!(error.contains("module `empty` has no members"), "{error}");
    let text = TRIPOD.replace("[[modules]]", "[[modules]]\nname = \"other\"\n[[modules]]");
    let error = Structure::from_toml(&text).unwrap_err().to_string();
    assert!(error.contains("member `one` does not say which module it belongs to"), "{error}");
}

#[test]
fn equipment_of_another_modules_member_is_refused() {
    let text = shared::small().to_toml();
    let gage =
        text.replace(r#"{ name = "g2", member = "post2" }"#, r#"{ name = "g2", member = "leg1" }"#);
    let error = Structure::from_toml(&gage).unwrap_err().to_string();
    assert!(
        error.contains(
            "gage `g2` of module `upper` sits on member `leg1`, which belongs to another module"
        ),
        "{error}"
    );
    let actuator = text.replace(r#"between = ["M1", "T1"]"#, r#"between = ["B1", "T1"]"#);
    let error = Structure::from_toml(&actuator).unwrap_err().to_string();
    assert!(error.contains("acts on node `B1`, which belongs to another module"), "{error}");
    let interface =
        text.replace(r#"lower_interface = ["M1", "M2", "M3"]"#, r#"lower_interface = ["B1"]"#);
    let error = Structure::from_toml(&interface).unwrap_err().to_string();
    assert!(error.contains("stands on node `B1`, which none of its members touches"), "{error}");
}

#[test]
fn the_two_forms_are_not_mixed() {
    let tower = include_str!("../../../configs/tower.toml");
    let mixed = tower.replace(
        "name = \"tower\"",
        "name = \"tower\"\nnodes = [{ name = \"N\", position_m = [0.0, 0.0, 0.0] }]",
    );
    assert!(
        Structure::from_toml(&mixed)
            .unwrap_err()
            .to_string()
            .contains("leave out either it or the lists")
    );
    let lacking =
        tower.replacen("column = \"column_10mm\"\n", "", 1).replacen("storeys = 3\n", "", 1);
    let errors = Structure::from_toml(&lacking).unwrap_err().to_string();
    assert!(
        errors.contains("module `module1` lacks `column`") && errors.contains("lacks `storeys`"),
        "{errors}"
    );
    let explicit = only(r#"name = "only""#, "name = \"only\"\nstoreys = 2");
    assert!(explicit.contains("add a table `[storeys]` or list the members"), "{explicit}");
    let tall = tower.replacen("storeys = 3", "storeys = 999999999999", 1);
    assert!(Structure::from_toml(&tall).unwrap_err().to_string().contains("use at most 500"));
    let line =
        tower.replace("[4.75, 4.75], [0.0, 4.75]]", "]").replace("[4.75, 0.0], ]", "[4.75, 0.0]]");
    assert!(
        Structure::from_toml(&line).unwrap_err().to_string().contains("has 2 corners; use 3 to 32")
    );
}

#[test]
fn a_structure_that_nothing_holds_is_told_so() {
    let floating = TRIPOD.replace(r#", fixed = ["x", "y", "z"]"#, r#", fixed = ["z"]"#);
    let error = Mechanics::assemble(&Structure::from_toml(&floating).unwrap()).unwrap_err();
    let expected =
        "the structure is a mechanism: no support holds the structure in x and y; add one";
    assert_eq!(error.to_string(), expected);
}

#[test]
fn a_mechanism_names_the_node_and_the_direction_free_to_move() {
    let leaning = TRIPOD
        .replace(
            r#"  { name = "three", ends = ["C", "T"], section = "bar" },"#,
            "  { name = \"three\", ends = [\"A\", \"B\"], section = \"bar\" },",
        )
        .replace(r#"  { name = "C", position_m = [1.0, 2.0, 0.0], fixed = ["x", "y", "z"] },"#, "")
        .replace("[1.0, 1.0, 3.0]", "[1.0, 0.0, 3.0]");
    let error = Mechanics::assemble(&Structure::from_toml(&leaning).unwrap()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the structure is a mechanism: node `T` is free to move in y; add a member or a support that holds it"
    );
}

#[test]
fn pinned_columns_make_the_tower_a_mechanism() {
    let tower =
        include_str!("../../../configs/tower.toml").replace("kind = \"beam\"", "kind = \"rod\"");
    let error = Mechanics::assemble(&Structure::from_toml(&tower).unwrap()).unwrap_err();
    let ModelError::Mechanism { what } = &error else { panic!("{error}") };
    let storey = "nodes `L01C1`, `L01C2`, `L01C3`, `L01C4` turn together about z; the members that";
    assert!(what.starts_with(storey), "{error}");
}

/// A mast whose legs lean to its axis and have no diagonals: the ring on top turns with the arm that it carries.
const MAST: &str = r#"
name = "pylon"
nodes = [
  { name = "B1", position_m = [-3.0, -3.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "B2", position_m = [3.0, -3.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "B3", position_m = [3.0, 3.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "B4", position_m = [-3.0, 3.0, 0.0], fixed = ["x", "y", "z"] },
  { name = "T1", position_m = [-1.5, -1.5, 9.0] },
  { name = "T2", position_m = [1.5, -1.5, 9.0] },
  { name = "T3", position_m = [1.5, 1.5, 9.0] },
  { name = "T4", position_m = [-1.5, 1.5, 9.0] },
  { name = "C", position_m = [0.0, 0.0, 8.0] },
  { name = "ARM", position_m = [6.0, 0.0, 9.0] },
]
members = [
  { name = "E1", module = "m1", ends = ["B1", "T1"], section = "rod" },
  { name = "E2", module = "m1", ends = ["B2", "T2"], section = "rod" },
  { name = "E3", module = "m1", ends = ["B3", "T3"], section = "rod" },
  { name = "E4", module = "m1", ends = ["B4", "T4"], section = "rod" },
  { name = "E5", module = "m1", ends = ["T1", "T2"], section = "rod" },
  { name = "E6", module = "m1", ends = ["T2", "T3"], section = "rod" },
  { name = "E7", module = "m1", ends = ["T3", "T4"], section = "rod" },
  { name = "E8", module = "m1", ends = ["T4", "T1"], section = "rod" },
  { name = "E9", module = "m1", ends = ["T1", "T3"], section = "rod" },
  { name = "E10", module = "m1", ends = ["B1", "C"], section = "rod" },
  { name = "E11", module = "m1", ends = ["B2", "C"], section = "rod" },
  { name = "E12", module = "m1", ends = ["B3", "C"], section = "rod" },
  { name = "E13", module = "m1", ends = ["B4", "C"], section = "rod" },
  { name = "E14", module = "m1", ends = ["T1", "C"], section = "rod" },
  { name = "E15", module = "m1", ends = ["T2", "C"], section = "rod" },
  { name = "E16", module = "m1", ends = ["T3", "C"], section = "rod" },
  { name = "E17", module = "m1", ends = ["T4", "C"], section = "rod" },
  { name = "E18", module = "m1", ends = ["ARM", "T2"], section = "rod" },
  { name = "E19", module = "m1", ends = ["ARM", "T3"], section = "rod" },
  { name = "E20", module = "m1", ends = ["ARM", "C"], section = "rod" },
]
[damping]
alpha_per_s = 0.05
beta_s = 0.001
[materials.steel]
young_pa = 210e9
poisson = 0.3
density_kg_per_m3 = 7850.0
[sections.rod]
kind = "rod"
material = "steel"
area_m2 = 5e-4
[[modules]]
name = "m1"
gages = [{ name = "g1", member = "E1" }]
"#;

#[test]
fn a_group_that_turns_as_a_whole_is_named_with_the_members_that_let_it() {
    let assembled = |ends: &str| {
        let more = format!(
            "  {{ name = \"X\", module = \"m1\", ends = {ends}, section = \"rod\" }},\n]\n[damping]"
        );
        let text =
            if ends.is_empty() { MAST.to_owned() } else { MAST.replace("]\n[damping]", &more) };
        Mechanics::assemble(&Structure::from_toml(&text).unwrap()).map_err(|e| e.to_string())
    };
    let expected = "the structure is a mechanism: nodes `T1`, `T2`, `T3`, `T4`, `C`, `ARM` turn together about z; the \
        members that join them to the rest do not prevent it (`E1`, `E2`, `E3`, `E4`, `E10`, `E11`, `E12`, `E13`); \
        brace them with a diagonal";
    assert_eq!(assembled("").unwrap_err(), expected);
    let at_the_arm = assembled(r#"["ARM", "T1"]"#).unwrap_err();
    assert_eq!(at_the_arm, expected, "a member there does not help");
    assembled(r#"["B1", "T2"]"#).unwrap();
}

#[test]
fn columns_free_to_twist_are_a_mechanism() {
    let tower = include_str!("../../../configs/tower.toml")
        .replace(r#"base = ["x", "y", "z", "rz"]"#, r#"base = ["x", "y", "z"]"#);
    let error = Mechanics::assemble(&Structure::from_toml(&tower).unwrap()).unwrap_err();
    assert!(error.to_string().contains("is free to turn about z"), "{error}");
}

#[test]
fn what_carries_no_mass_or_cannot_move_is_named() {
    let massless = TRIPOD.replace(", mass_kg = 100.0", "").replace("7850.0", "0.0");
    let error = Mechanics::assemble(&Structure::from_toml(&massless).unwrap()).unwrap_err();
    assert!(error.to_string().starts_with("node `T` can move but has no mass"), "{error}");
    let held = TRIPOD.replace("mass_kg = 100.0", r#"fixed = ["x", "y", "z"]"#);
    let error = Mechanics::assemble(&Structure::from_toml(&held).unwrap()).unwrap_err();
    assert_eq!(error, ModelError::NothingMoves);
}

#[test]
fn numbers_in_absurd_units_make_no_model() {
    for (from, to) in [
        ("mass_kg = 100.0", "mass_kg = 1e300"),
        ("young_pa = 210e9", "young_pa = 1e300"),
        ("young_pa = 210e9", "young_pa = 1e-20"),
        ("density_kg_per_m3 = 7850.0", "density_kg_per_m3 = 1e7"),
        ("area_m2 = 1e-4", "area_m2 = 1e-300"),
        ("beta_s = 0.001", "beta_s = 1e300"),
        ("alpha_per_s = 0.1", "alpha_per_s = 1e300"),
    ] {
        assert!(TRIPOD.contains(from), "{from}");
        let error = Structure::from_toml(&TRIPOD.replace(from, to)).unwrap_err().to_string();
        let key = from.split(' ').next().unwrap();
        assert!(
            error.contains(&format!("`{key}` of ")) && error.contains("; use "),
            "{to}: {error}"
        );
    }
    let damped = TRIPOD.replace("beta_s = 0.001", "beta_s = 1e14");
    let structure = Structure::from_toml(&damped).unwrap();
    let error = ModalStepper::of_module(&structure, 1e-3).unwrap_err().to_string();
    assert!(error.starts_with("the structure has a mode of "), "{error}");
    assert!(error.ends_with("in the wrong unit"), "{error}");
}

#[test]
fn a_perturbation_that_removes_a_member_is_refused() {
    let tripod = Structure::from_toml(TRIPOD).unwrap();
    let mut perturbation = Perturbation::identity(&tripod);
    perturbation.member_stiffness[1] = 0.0;
    let error = Mechanics::assemble(&tripod.perturbed(&perturbation)).unwrap_err().to_string();
    assert_eq!(error, "the factor on the stiffness of `two` is 0; use a finite number above 0");
    let mut perturbation = Perturbation::identity(&tripod);
    perturbation.node_mass[3] = f64::NAN;
    let error = Mechanics::assemble(&tripod.perturbed(&perturbation)).unwrap_err().to_string();
    assert!(error.contains("the factor on the mass of `T` is NaN"), "{error}");
}

#[test]
fn an_unknown_module_is_named_with_those_that_exist() {
    let error = shared::small().local(&"middle".parse().unwrap()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "unknown module `middle` of structure `small`: expected one of `lower`, `upper`"
    );
}

#[test]
fn what_a_description_says_forges_no_further_line() {
    let text = TRIPOD.replace(r#"section = "bar" }"#, r#"section = "b\nERROR c" }"#);
    let errors = Structure::from_toml(&text).unwrap_err();
    assert_eq!(errors.to_string().lines().count(), 3, "{errors}");
    assert!(errors.to_string().contains(r"`b\nERROR c`"), "{errors}");
}
