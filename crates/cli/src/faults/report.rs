//! The picture for people.

use std::fmt::Write;

use names::StructureName;
use observer::{ModulePicture, Picture, Urgency};
use wire::{FaultState, FaultTransition};

use super::component_table::components;
use super::module_table::modules;
use super::roll_up::by_urgency;
use super::structure_table::{NO_STRUCTURE, structures};
use crate::paint::{Colour, Paint};
use wording::{printable, utc};

/// The text: of several structures a table, then each of them with its modules, its components, and what is not
/// known. Unless all of it is asked for, of several only those in which not all is well.
pub(super) fn report(picture: &Picture, all: bool, width: Option<u16>, paint: Paint) -> String {
    let mut text = String::new();
    let of_all = by_urgency(picture);
    let several = of_all.len() > 1;
    // Writing to a string does not fail.
    if several {
        let (table, colours) = structures(&of_all);
        let _ = writeln!(text, "{}\n", table.painted(width, &colours, paint));
    }
    for of in of_all.iter().filter(|of| all || !several || !of.all_is_well) {
        let name = of.structure.map_or(NO_STRUCTURE, StructureName::as_str);
        let (table, colours) = modules(of.members);
        let table = table.painted(width, &colours, paint);
        let states = states(of.members, all, width, paint);
        let _ = write!(text, "{}\n{table}\n\n{states}\n", paint.bold(name));
    }
    for problem in &picture.problems {
        let line = format!("not understood: {}", printable(problem));
        let _ = writeln!(text, "{}", paint.in_colour(Colour::Yellow, &line));
    }
    text
}

fn states(modules: &[ModulePicture], all: bool, width: Option<u16>, paint: Paint) -> String {
    let every = modules.iter().flat_map(|module| &module.components);
    let listed = |component: &FaultTransition| {
        !matches!(component.state(), FaultState::Normal | FaultState::Unknown)
            || component.aside().is_some()
    };
    let mut shown: Vec<&FaultTransition> =
        every.filter(|component| all || listed(component)).collect();
    shown.sort_by_key(|component| Urgency::of(component));
    let mut lines = Vec::new();
    if !shown.is_empty() {
        let (table, colours) = components(&shown);
        lines.push(format!("{}\n", table.painted(width, &colours, paint)));
    }
    lines.push(counts(modules));
    lines.extend(
        modules.iter().filter_map(unknown).map(|line| paint.in_colour(Colour::Yellow, &line)),
    );
    for module in modules.iter().filter(|module| !module.answers()) {
        let line = format!("nothing is known of the components of {}", module.member.module);
        lines.push(paint.in_colour(Colour::Red, &line));
    }
    for module in modules.iter().filter(|module| module.has_several_processes()) {
        let line = format!(
            "warning: several processes run as {}; an order may reach only one of them: end the others",
            module.member.module
        );
        lines.push(paint.in_colour(Colour::Yellow, &line));
    }
    lines.join("\n")
}

/// How many components are in each state, the normal ones first, then the most urgent; at last those of any state that
/// are set aside.
fn counts(modules: &[ModulePicture]) -> String {
    let count = |state| modules.iter().map(|module| module.count(state)).sum::<usize>();
    let total: usize = modules.iter().map(|module| module.components.len()).sum();
    let others = [
        FaultState::Latched,
        FaultState::Acknowledged,
        FaultState::Unconfirmed,
        FaultState::Tentative,
        FaultState::Explained,
        FaultState::Unknown,
    ];
    let others = others.into_iter().map(|state| (state, count(state))).filter(|(_, n)| *n > 0);
    let verified = modules.iter().map(|module| module.verified()).sum::<usize>();
    let first = match (verified, count(FaultState::Normal) - verified) {
        (_, 0) => format!("{verified} of {total} components are normal"),
        (0, unverified) => format!("{unverified} of {total} components are normal, not verified"),
        (_, unverified) => format!(
            "{verified} of {total} components are normal, {unverified} normal but not verified"
        ),
    };
    let others = others.map(|(state, n)| format!("{n} {state}"));
    let aside = modules.iter().map(ModulePicture::set_aside).sum::<usize>();
    let aside = (aside > 0).then(|| format!("{aside} set aside"));
    std::iter::once(first).chain(others).chain(aside).collect::<Vec<_>>().join(", ")
}

/// What is not known of a module that answers, since when and why.
fn unknown(module: &ModulePicture) -> Option<String> {
    let count = module.count(FaultState::Unknown);
    let first =
        module.components.iter().find(|component| component.state() == FaultState::Unknown)?;
    let module = &module.member.module;
    let unknown = first.unknown.as_ref()?;
    let (since, reason) = (utc(unknown.since_unix_ns), printable(&unknown.reason));
    Some(format!("{module}: {count} unknown since {since}: {reason}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::{
        agreeing, at, identification, latched, module, picture, shelved, silent, state, suppressed,
        unknown_state,
    };
    use wire::ModulePhase;

    fn lines(all: bool) -> Vec<String> {
        let normal = state("m1/sensor/g1", FaultState::Normal);
        let identification = Some(Box::new(identification(false, &["bias", "drift"])));
        let latched = FaultTransition { identification, ..latched("m1/sensor/g2") };
        let first = module("m1", ModulePhase::InService, vec![normal, latched]);
        let stale = module("m2", ModulePhase::Stale, vec![unknown_state("m2/sensor/g1")]);
        let picture = picture(vec![first, stale, silent("m3", Some("m1"))]);
        let paint = Paint::for_terminal(false);
        report(&picture, all, None, paint).lines().map(|line| line.trim_end().to_owned()).collect()
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

  component      state     kind of fault                      onset   decided   published                    residual          divergence   why
────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────
  m1/sensor/g2   latched   bias or drift: not yet decided   step 40   step 46   1970-01-01T00:00:01.000Z   +600.00 µm   422.6 × threshold   NOT IN THE JOURNAL

1 of 3 components are normal, not verified, 1 latched, 1 unknown
m2: 1 unknown since 1970-01-01T00:00:02.000Z: no sample for 500 ms
nothing is known of the components of m3";
        let text = lines(false).join("\n");
        assert_eq!(text, expected, "\n{text}");
    }

    #[test]
    fn of_several_structures_each_has_a_line_and_those_that_are_not_well_have_more() {
        let normal = || vec![agreeing(state("m1/sensor/g1", FaultState::Normal))];
        let picture = picture(vec![
            at("east", module("m1", ModulePhase::InService, normal())),
            at("west", module("m1", ModulePhase::InService, vec![latched("m1/sensor/g1")])),
            at("west", silent("m2", Some("m1"))),
        ]);
        let report = |all| report(&picture, all, None, Paint::for_terminal(false));
        let text = report(false);
        let table = "\
  structure   modules in service   not answering   latched   acknowledged   unconfirmed   unknown   set aside   normal and verified
─────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────────
  west                    1 of 2               1         1              0             0         0           0                0 of 1
  east                    1 of 1               0         0              0             0         0           0                1 of 1

west
  module   phase";
        assert!(text.trim_start().starts_with(table), "\n{text}");
        assert!(!text.contains("\neast\n"), "{text}");
        assert!(report(true).contains("\neast\n"));
    }

    #[test]
    fn what_is_set_aside_is_listed_with_by_whom_why_and_until_when_after_what_needs_attention() {
        let quiet = shelved(state("m1/sensor/g1", FaultState::Normal));
        let fault = FaultTransition { durable: true, ..latched("m1/sensor/g2") };
        let known = shelved(FaultTransition { durable: true, ..latched("m1/actuator/a1") });
        let first = module("m1", ModulePhase::InService, vec![known, quiet, fault]);
        let stopped = suppressed(state("m2/sensor/g1", FaultState::Unknown));
        let second = module("m2", ModulePhase::Stale, vec![stopped]);
        let text = report(&picture(vec![first, second]), false, None, Paint::for_terminal(false));
        let rows: Vec<&str> = text
            .lines()
            .filter(|line| line.contains("sensor/g") || line.contains("actuator/a"))
            .collect();
        let starts = ["m1/sensor/g2", "m1/actuator/a1", "m2/sensor/g1", "m1/sensor/g1"];
        for (row, start) in rows.iter().zip(starts) {
            assert!(row.trim_start().starts_with(start), "{text}");
        }
        let shelved = "shelved until 1970-01-01T02:00:00.000Z by ada: the gage is being rewired";
        assert!(
            rows[1].contains("latched, shelved") && rows[1].trim_end().ends_with(shelved),
            "{text}"
        );
        assert!(rows[3].contains("normal, not verified, shelved"), "{text}");
        let suppressed = "suppressed until 1970-01-01T02:00:00.000Z by ada: painting";
        assert!(rows[2].trim_end().ends_with(suppressed), "{text}");
        let of_module = text.lines().find(|line| line.trim_start().starts_with("m2 ")).unwrap();
        assert!(of_module.trim_end().ends_with(suppressed), "{text}");
        assert!(text.contains("2 latched, 1 unknown, 3 set aside"), "{text}");
    }

    #[test]
    fn several_processes_of_one_module_are_warned_of() {
        let mut one =
            module("m1", ModulePhase::InService, vec![state("m1/sensor/g1", FaultState::Normal)]);
        let paint = Paint::for_terminal(false);
        let text = |one: &ModulePicture| report(&picture(vec![one.clone()]), false, None, paint);
        assert!(!text(&one).contains("warning"), "{}", text(&one));
        one.processes.extend(["a1", "b2"].map(|id| id.parse::<zenoh::session::ZenohId>().unwrap()));
        let warning = "warning: several processes run as m1; an order may reach only one of them: end the others";
        assert!(text(&one).contains(warning), "{}", text(&one));
    }

    #[test]
    fn a_clock_that_is_wrong_is_remarked_on_and_no_time_is_given_by_it() {
        let mut one =
            module("m1", ModulePhase::InService, vec![state("m1/sensor/g1", FaultState::Normal)]);
        let status = one.member.status.as_mut().unwrap();
        (status.lag_ms, status.sample_age_ms) = (Some(-3_600_000.0), Some(-3_599_000.0));
        let text = report(&picture(vec![one]), false, None, Paint::for_terminal(false));
        let remark = "its clock is 3600 s behind the publisher's; check time synchronisation";
        assert!(text.contains(remark) && !text.contains("-3600"), "{text}");
    }

    #[test]
    fn what_agrees_with_its_reference_is_normal_and_the_rest_is_not_verified() {
        let verified = agreeing(state("m1/sensor/g1", FaultState::Normal));
        let returned = agreeing(latched("m1/sensor/g2"));
        let other = state("m1/sensor/g3", FaultState::Normal);
        let text = |components: &[&FaultTransition]| {
            let components = components.iter().map(|one| (*one).clone()).collect();
            let picture = picture(vec![module("m1", ModulePhase::InService, components)]);
            report(&picture, false, None, Paint::for_terminal(false))
        };
        let all = text(&[&verified, &returned]);
        assert!(all.contains("\n1 of 2 components are normal, 1 latched\n"), "{all}");
        assert!(all.contains("agrees with its reference again"), "{all}");
        let some = text(&[&verified, &returned, &other]);
        assert!(some.contains("1 of 3 components are normal, 1 normal but not verified"), "{some}");
    }

    #[test]
    fn long_names_fit_the_terminal_unless_it_does_not_matter() {
        let name = "tower-north-upper-module1";
        let component = format!("{name}/actuator/cylinder-inner-a3");
        let components = vec![latched(&component), latched("m1/sensor/g2")];
        let picture = picture(vec![module(name, ModulePhase::InService, components)]);
        let paint = Paint::for_terminal(false);
        let folded = report(&picture, false, Some(80), paint);
        assert!(folded.lines().all(|line| line.chars().count() <= 80), "{folded}");
        assert!(folded.contains("m1/sensor/g2") && folded.contains("1970-01-01"), "{folded}");
        let wide = report(&picture, false, None, paint);
        let row =
            [component.as_str(), "latched", "step 40", "422.6 × threshold", "NOT IN THE JOURNAL"];
        assert!(wide.lines().any(|line| row.iter().all(|cell| line.contains(cell))), "{wide}");
    }

    #[test]
    fn with_all_every_component_has_its_line() {
        let text = lines(true);
        for component in [
            "m1/sensor/g1   normal, not verified",
            "m1/sensor/g2   latched",
            "m2/sensor/g1   unknown",
        ] {
            assert!(text.iter().any(|line| line.trim_start().starts_with(component)), "{text:#?}");
        }
    }
}
