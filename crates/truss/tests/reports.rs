//! Authority: the structure itself. Summary and export say what the structure holds.
#![allow(clippy::unwrap_used, reason = "a failing test may panic")]

mod shared;

use truss::{Mechanics, Structure};

#[test]
fn the_summary_counts_what_is_there() {
    let summary = shared::tower().summary().unwrap();
    assert_eq!((summary.nodes, summary.beams, summary.rods), (52, 48, 104));
    assert_eq!(summary.degrees_of_freedom, 144);
    assert!((summary.storey_mass_kg - 36_000.0).abs() < 1e-6);
    assert_eq!(summary.modules.len(), 4);
    assert_eq!(summary.modules[1].actuators, ["a1", "a2", "a3", "a4"]);
    assert_eq!(summary.modules[1].gages.len(), 8);
    assert!(summary.modules[3].actuators.is_empty());
    assert!(summary.modules.iter().all(|module| module.local_frequency_hz.is_some()));
}

#[test]
fn the_summary_prints_as_a_table() {
    let text = shared::tower().summary().unwrap().to_string();
    for line in [
        "members            152 (48 beams, 104 rods)",
        "   1     1.70 Hz      2.9 %",
        "   3     2.52 Hz      4.1 %",
        "module3      16        38     6.95 Hz   none",
    ] {
        assert!(text.lines().any(|own| own == line), "{line}\n{text}");
    }
}

#[test]
fn a_module_that_cannot_stand_alone_is_said_to_be_a_mechanism() {
    // One pinned leg and its module stand only as long as the module below holds their top.
    let text = shared::small().to_toml().replace(
        r#"ends = ["B3", "M3"], section = "pinned_leg", module = "lower""#,
        r#"ends = ["B3", "M3"], section = "pinned_leg", module = "leg""#,
    );
    let leg = "\n[[modules]]\nname = \"leg\"\nlower_interface = []\n";
    let structure = Structure::from_toml(&(text + leg)).unwrap();
    let summary = structure.summary().unwrap();
    assert_eq!(summary.modules[2].local_frequency_hz, None);
    assert!(summary.to_string().contains("mechanism"));
    let alone = structure.local(&"leg".parse().unwrap()).unwrap();
    assert!(Mechanics::assemble(&alone).is_err());
}

#[test]
fn the_export_holds_every_node_member_mass_and_support() {
    for structure in shared::all() {
        let export = structure.export().unwrap();
        assert_eq!(export.nodes.len(), structure.nodes.len());
        assert_eq!(export.members.len(), structure.members.len());
        assert_eq!(export.nodal_masses_kg, structure.nodal_masses_kg());
        let held = structure.nodes.iter().filter(|node| node.support.is_any()).count();
        assert_eq!(export.fixed.len(), held);
        assert!(export.members.iter().all(|member| !member.module.is_empty()));
        for member in &export.members {
            let beam = member.kind == "beam";
            assert_eq!(member.iy_m4.is_some() && member.local_z.is_some(), beam);
        }
        let elongations =
            export.static_responses.iter().map(|r| r.static_elongations_m_per_n.len());
        assert!(elongations.into_iter().all(|count| count == export.gages.len()));
    }
}

#[test]
fn the_export_is_readable_json_with_units_in_its_names() {
    let export = serde_json::to_value(shared::tower().export().unwrap()).unwrap();
    for key in ["nodes", "members", "nodal_masses_kg", "fixed", "natural_frequencies_hz", "notes"] {
        assert!(export.get(key).is_some(), "{key}");
    }
    assert_eq!(export["natural_frequencies_hz"].as_array().unwrap().len(), 12);
    assert_eq!(export["fixed"][0]["directions"], serde_json::json!(["x", "y", "z", "rz"]));
    let column = &export["members"][0];
    assert_eq!(column["ends"], serde_json::json!(["L00C1", "L01C1"]));
    assert_eq!(column["e_pa"], 210e9);
}
