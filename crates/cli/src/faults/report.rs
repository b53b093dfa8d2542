//! The report in readable form.

use std::fmt::Write;

use observer::{
    DetectionFacts, ModuleView, Scene, StateRow, StructureRow, Urgency, in_a_sentence, rows,
    structures,
};
use vocabulary::StructureName;

use crate::paint::{Colour, Paint, tone_colour};
use crate::table::{TextTable, table};
use vocabulary::words::{NOTHING, Tone, or_nothing, printable, utc};

/// Placeholder for the name of an unknown structure.
const NO_STRUCTURE: &str = "(no structure seen)";

/// A table, with the colour of each row.
type Painted = (TextTable, Vec<Option<Colour>>);

/// The text: a table of structures if there are several, then each structure with its modules and everything that is
/// not normal. Of several structures, those in which all is well are omitted unless `all` is set.
pub(super) fn report(scene: &Scene, all: bool, width: Option<u16>, paint: Paint) -> String {
    let mut text = String::new();
    let structures = structures(scene);
    let several = structures.len() > 1;
    let painted = |(table, colours): Painted| table.painted(width, &colours, paint);
    // Writing to a string does not fail.
    if several {
        let _ = writeln!(text, "{}\n", painted(structure_table(&structures)));
    }
    for of in structures.iter().filter(|of| all || !several || !of.all_is_well) {
        let _ = writeln!(text, "{}", paint.bold(name(of)));
        let _ = writeln!(text, "{}\n", painted(module_table(of.modules)));
        let every = all.then(|| rows(of.modules));
        let listed = every.as_ref().unwrap_or(&of.alarms);
        if !listed.is_empty() {
            let _ = writeln!(text, "{}\n", painted(state_table(listed)));
        }
        let _ = writeln!(text, "{}", in_a_sentence(of.modules));
    }
    for problem in &scene.problems {
        let line = format!("not understood: {}", printable(problem));
        let _ = writeln!(text, "{}", paint.in_colour(Colour::Yellow, &line));
    }
    text
}

fn name<'a>(of: &StructureRow<'a>) -> &'a str {
    of.structure.map_or(NO_STRUCTURE, StructureName::as_str)
}

fn structure_table(structures: &[StructureRow<'_>]) -> Painted {
    let heading = [
        "structure",
        "modules in service",
        "not answering",
        "latched",
        "acknowledged",
        "unconfirmed",
        "unknown",
        "shelved or suppressed",
        "normal",
    ];
    let mut table = table(&heading);
    for of in structures {
        let counts = &of.counts;
        table.add_row([
            name(of).to_owned(),
            format!("{} of {}", of.modules_in_service, of.module_count),
            (of.module_count - of.modules_answering).to_string(),
            counts.latched.to_string(),
            counts.acknowledged.to_string(),
            counts.unconfirmed.to_string(),
            counts.unknown.to_string(),
            counts.set_aside.to_string(),
            counts.normal_of_total(),
        ]);
    }
    table.align_right(1..heading.len());
    let colour = |of: &StructureRow<'_>| match of.alarms.first() {
        _ if of.all_is_well => None,
        Some(row) if row.urgency <= Urgency::Unreliable => Some(Colour::Red),
        _ => Some(Colour::Yellow),
    };
    (table, structures.iter().map(colour).collect())
}

fn module_table(modules: &[ModuleView]) -> Painted {
    let mut table = table(&["module", "phase", "step", "lag", "sample age", "journal", "remarks"]);
    for module in modules {
        table.add_row([
            module.module.to_string(),
            module.condition().to_owned(),
            or_nothing(module.present_status().and_then(|status| status.step)),
            or_nothing(module.lag()),
            or_nothing(module.sample_age()),
            or_nothing(module.journal()),
            if_any(&module.remarks()),
        ]);
    }
    table.align_right(2..5);
    (table, modules.iter().map(|module| tone_colour(module.tone())).collect())
}

fn state_table(rows: &[StateRow]) -> Painted {
    let heading = [
        "component",
        "state",
        "kind of fault",
        "onset",
        "decided",
        "since",
        "residual",
        "divergence",
        "why",
    ];
    let mut table = table(&heading);
    let step = |step: Option<vocabulary::Step>| or_nothing(step.map(|step| format!("step {step}")));
    for row in rows {
        let measured = &row.measured;
        table.add_row([
            row.name(),
            row.state.clone(),
            if_any(&row.what()),
            step(measured.onset_step),
            step(measured.decided_step),
            or_nothing(row.since_unix_ns.map(utc)),
            detected(measured, 0, "residual"),
            detected(measured, 1, "divergence"),
            if_any(&row.why),
        ]);
    }
    table.align_right([3, 4, 6, 7]);
    table.break_times(5);
    table.stack(&[&[0], &[1, 5], &[3, 4], &[6, 7], &[2, 8]]);
    let colour = |row: &StateRow| match row.tone {
        Tone::Calm => Some(Colour::Dim),
        tone => tone_colour(tone),
    };
    (table, rows.iter().map(colour).collect())
}

/// One of the two figures of the detection; with its name unless that is the column's.
fn detected(measured: &DetectionFacts, place: usize, column: &str) -> String {
    or_nothing(measured.at_detection.as_ref().map(|both| match &both[place] {
        (name, text) if *name == column => text.clone(),
        (name, text) => format!("{name} {text}"),
    }))
}

fn if_any(text: &str) -> String {
    if text.is_empty() { NOTHING.to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::{latched, module, unknown_state};
    use observer::testing::{agreeing, at, identification, mute, scene, state};
    use vocabulary::{FaultState, FaultTransition, ModulePhase};

    fn text(modules: Vec<ModuleView>, all: bool, width: Option<u16>) -> String {
        let text = report(&scene(modules), all, width, Paint::NONE);
        text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
    }

    fn modules() -> Vec<ModuleView> {
        let normal = state("m1/sensor/g1", FaultState::Normal);
        let identification = Some(Box::new(identification(false, &["bias", "drift"])));
        let latched = FaultTransition { identification, ..latched("m1/sensor/g2") };
        let first = module("m1", ModulePhase::InService, vec![normal, latched]);
        let stale = module("m2", ModulePhase::Stale, vec![unknown_state("m2/sensor/g1")]);
        vec![first, stale, mute("m3", Some("m1"))]
    }

    #[test]
    fn the_tables_are_these() {
        let expected = "\
tower
  module   phase           step      lag   sample age   journal   remarks
──────────────────────────────────────────────────────────────────────────────
  m1       in service      4711   1.2 ms       3.0 ms   none      -
  m2       STALE           4711   1.2 ms       3.0 ms   none      -
  m3       NOT ANSWERING      -        -            -   -         peer of m1

  component      state           kind of fault                      onset   decided   since                        residual          divergence   why
──────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────
  m1/sensor/g2   latched         bias or drift: not yet decided   step 40   step 46   1970-01-01T00:00:01.000Z   +600.00 µm   422.6 × threshold   NOT IN THE JOURNAL
  m2             STALE           1 component unknown                    -         -   -                                   -                   -   -
  m3             NOT ANSWERING   its components are unknown             -         -   -                                   -                   -   peer of m1

2 of 3 modules not in service; 1 of 3 components are normal, not verified, 1 latched, 1 unknown; those of m3 unknown";
        let text = text(modules(), false, None);
        assert_eq!(text, expected, "\n{text}");
    }

    #[test]
    fn of_several_structures_each_has_a_line_and_those_that_are_not_well_have_more() {
        let normal = || vec![agreeing(state("m1/sensor/g1", FaultState::Normal))];
        let modules = || {
            vec![
                at("east", module("m1", ModulePhase::InService, normal())),
                at("west", module("m1", ModulePhase::InService, vec![latched("m1/sensor/g1")])),
                at("west", mute("m2", Some("m1"))),
            ]
        };
        let some = text(modules(), false, None);
        let table = "\
  structure   modules in service   not answering   latched   acknowledged   unconfirmed   unknown   shelved or suppressed   normal
────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────
  west                    1 of 2               1         1              0             0         0                       0   0 of 1
  east                    1 of 1               0         0              0             0         0                       0   1 of 1

west
  module   phase";
        assert!(some.trim_start().starts_with(table), "\n{some}");
        assert!(!some.contains("\neast\n"), "{some}");
        assert!(text(modules(), true, None).contains("\neast\n"));
    }

    #[test]
    fn long_names_fit_the_terminal_unless_it_does_not_matter() {
        let name = "tower-north-upper-module1";
        let component = format!("{name}/actuator/cylinder-inner-a3");
        let components = vec![latched(&component), latched("m1/sensor/g2")];
        let modules = || vec![module(name, ModulePhase::InService, components.clone())];
        let folded = text(modules(), false, Some(80));
        assert!(folded.lines().all(|line| line.chars().count() <= 80), "{folded}");
        assert!(folded.contains("m1/sensor/g2") && folded.contains("1970-01-01"), "{folded}");
        let wide = text(modules(), false, None);
        let row =
            [component.as_str(), "latched", "step 40", "422.6 × threshold", "NOT IN THE JOURNAL"];
        assert!(wide.lines().any(|line| row.iter().all(|cell| line.contains(cell))), "{wide}");
    }

    #[test]
    fn with_all_every_component_has_its_line() {
        let text = text(modules(), true, None);
        for (component, state) in [
            ("m1/sensor/g1", "normal, not verified"),
            ("m1/sensor/g2", "latched"),
            ("m2/sensor/g1", "unknown"),
        ] {
            let is_row =
                |line: &str| line.trim_start().starts_with(component) && line.contains(state);
            assert!(text.lines().any(is_row), "{text}");
        }
    }
}
