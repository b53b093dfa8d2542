//! Metrics derived from the status: pure functions from messages to the text format of Prometheus.
//!
//! | file | job |
//! |---|---|
//! | `module`, `plant` | metrics of a diagnoser, of a plant |
//!
//! Units are seconds and bytes. Labels have few values, known from the configuration: the module and its
//! structure, its own components, its peers, and the names of states and reasons.

mod module;
mod plant;
#[cfg(test)]
pub(crate) mod testing;

use std::fmt;

use shell::health::{ProcessReport, render};
use vocabulary::PlantStatus;

use diagnosis::messages::Speaker;
pub(crate) use module::{
    AsideReport, ComponentReport, IdentificationReport, KindReport, ModuleReport,
};

/// Metrics of a diagnoser; those common to all processes until the first report.
pub(crate) fn of_module(
    speaker: &Speaker,
    report: Option<&ModuleReport>,
    process: &ProcessReport,
) -> Result<String, fmt::Error> {
    let Speaker { structure, module, .. } = speaker;
    let labels = vec![("structure", structure.to_string()), ("module", module.to_string())];
    let (report, process) = (report.cloned(), *process);
    render(labels, move |sheet| {
        process.write(sheet)?;
        report.as_ref().map_or(Ok(()), |report| module::write(report, sheet))
    })
}

/// Metrics of a plant.
pub(crate) fn of_plant(
    status: &PlantStatus,
    process: &ProcessReport,
) -> Result<String, fmt::Error> {
    let labels = vec![("structure", status.structure.to_string())];
    let (status, process) = (status.clone(), *process);
    render(labels, move |sheet| {
        process.write(sheet)?;
        plant::write(&status, sheet)
    })
}

#[cfg(test)]
mod tests {
    use super::testing::{module_report, numbers, plant_status, process, speaker};
    use super::*;
    use vocabulary::{ModulePhase, PlantPhase, Shelving};

    const TIME_UNIX_NS: u64 = 1_800_000_000_123_456_789;

    fn suppression() -> Shelving {
        Shelving {
            since_unix_ns: 1,
            until_unix_ns: 2,
            by: "ada".to_owned(),
            on_behalf_of: None,
            reason: "painting".to_owned(),
        }
    }

    fn module_text() -> String {
        let report = module_report(ModulePhase::InService);
        of_module(&speaker(), Some(&report), &process()).unwrap()
    }

    fn plant_text() -> String {
        of_plant(&plant_status(PlantPhase::Running), &process()).unwrap()
    }

    /// The value of the sample with this name and these labels.
    #[track_caller]
    fn value(text: &str, sample: &str) -> f64 {
        let found: Vec<&str> =
            text.lines().filter_map(|line| line.strip_prefix(sample)?.strip_prefix(' ')).collect();
        assert_eq!(found.len(), 1, "{sample} in {text}");
        found[0].parse().unwrap()
    }

    fn samples(text: &str) -> Vec<(&str, f64)> {
        let lines = text.lines().filter(|line| !line.starts_with('#'));
        lines
            .map(|line| line.rsplit_once(' ').unwrap())
            .map(|(s, v)| (s, v.parse().unwrap()))
            .collect()
    }

    /// What a field's number is as a metric, in base units.
    fn as_metric(field: &str, number: f64) -> f64 {
        match field {
            "time_unix_ns" => (number / 1e3).floor() / 1e6,
            "next_sequence" => number - 1.0,
            _ if field.ends_with("_ms") => number / 1e3,
            _ => number,
        }
    }

    #[track_caller]
    fn holds_every_number_but(text: &str, status: &impl serde::Serialize, others: &[&str]) {
        let values: Vec<f64> = samples(text).into_iter().map(|(_, value)| value).collect();
        for (field, number) in numbers(&serde_json::to_value(status).unwrap()) {
            if !others.contains(&field.as_str()) {
                assert!(values.contains(&as_metric(&field, number)), "{field} {number} in {text}");
            }
        }
    }

    #[test]
    fn every_number_of_a_status_is_a_metric() {
        let status = module_report(ModulePhase::InService).status;
        // Names of runs, journals and steps count nothing; faults are counted by state, from the components.
        let others =
            ["run", "incarnation", "in_service_since_step", "latched", "unconfirmed", "unknown"];
        holds_every_number_but(&module_text(), &status, &others);
        holds_every_number_but(&plant_text(), &plant_status(PlantPhase::Running), &["run"]);
    }

    /// The whole text of a module and of a plant, in which every number is another one: a metric that takes the number
    /// of another one shows. `BLESS=1` rewrites the files, so that a change is meant and shows.
    #[test]
    fn the_text_is_the_one_that_was_agreed_on() {
        let mut report = module_report(ModulePhase::InService);
        report.status.reference = Some("fedcba9876543210".to_owned());
        report.status.suppressed = Some(suppression());
        report.status.journal.problem = None;
        report.status.time_unix_ns = TIME_UNIX_NS;
        let module = of_module(&speaker(), Some(&report), &process()).unwrap();
        let mut status = plant_status(PlantPhase::Running);
        status.waiting_for = vec!["module1".parse().unwrap(), "module2".parse().unwrap()];
        status.time_unix_ns = TIME_UNIX_NS;
        let plant = of_plant(&status, &process()).unwrap();
        for (name, present) in [("module", module), ("plant", plant)] {
            let file = format!("{}/tests/data/metrics/{name}.txt", env!("CARGO_MANIFEST_DIR"));
            if std::env::var_os("BLESS").is_some() {
                std::fs::write(&file, &present).unwrap();
            }
            let agreed = std::fs::read_to_string(&file).unwrap();
            assert_eq!(present, agreed, "{name} is now\n{present}");
        }
    }

    #[test]
    fn a_journal_that_cannot_be_written_shows() {
        let failing = r#"trusswatch_journal_failing{structure="tower",module="module1"}"#;
        assert_eq!(value(&module_text(), failing), 1.0);
    }

    #[test]
    fn faults_are_counted_by_state_and_named_by_component() {
        let text = module_text();
        let own = r#"structure="tower",module="module1""#;
        for (state, expected) in [
            ("normal", 1.0),
            ("unknown", 0.0),
            ("tentative", 0.0),
            ("unconfirmed", 0.0),
            ("explained", 0.0),
            ("latched", 1.0),
            ("acknowledged", 1.0),
        ] {
            let sample = format!("trusswatch_components{{{own},state=\"{state}\"}}");
            assert_eq!(value(&text, &sample), expected, "{state}");
        }
        for (component, faulty) in [("actuator/a1", 1.0), ("sensor/g1", 1.0), ("sensor/g2", 0.0)] {
            let labels = format!("{{{own},component=\"{component}\"}}");
            assert_eq!(value(&text, &format!("trusswatch_component_faulty{labels}")), faulty);
        }
        for (component, acknowledged) in
            [("actuator/a1", 0.0), ("sensor/g1", 1.0), ("sensor/g2", 0.0)]
        {
            let sample =
                format!("trusswatch_component_acknowledged{{{own},component=\"{component}\"}}");
            assert_eq!(value(&text, &sample), acknowledged, "{component}");
        }
        let status = module_report(ModulePhase::InService).status;
        let shares = status.margins[0].shares().into_iter();
        let known: Vec<_> = shares.filter_map(|(test, share)| Some((test, share?))).collect();
        assert_eq!(
            known.iter().map(|(test, _)| *test).collect::<Vec<_>>(),
            ["change", "oil_content"]
        );
        for (test, share) in known {
            let labels = format!("{{{own},component=\"actuator/a1\",test=\"{test}\"}}");
            assert_eq!(value(&text, &format!("trusswatch_limit_ratio{labels}")), share);
        }
        let undefined = format!("trusswatch_limit_ratio{{{own},component=\"sensor/g2\"");
        assert!(!text.contains(&undefined), "{text}");
    }

    #[test]
    fn what_is_set_aside_is_named_with_how_and_until_when() {
        let text = module_text();
        let own = r#"structure="tower",module="module1""#;
        let of = |component: &str, how: &str| {
            let labels = format!("{{{own},component=\"{component}\",how=\"{how}\"}}");
            value(&text, &format!("trusswatch_component_set_aside{labels}"))
        };
        assert_eq!((of("sensor/g1", "shelved"), of("sensor/g1", "suppressed")), (1.0, 0.0));
        assert_eq!((of("sensor/g2", "shelved"), of("sensor/g2", "suppressed")), (0.0, 0.0));
        let end = "trusswatch_component_set_aside_end_timestamp_seconds";
        let labels = format!("{{{own},component=\"sensor/g1\",how=\"shelved\"}}");
        assert_eq!(value(&text, &format!("{end}{labels}")), 1_800_000_000.5);
        assert_eq!(samples(&text).iter().filter(|(name, _)| name.starts_with(end)).count(), 1);
        assert_eq!(value(&text, &format!("trusswatch_module_suppressed{{{own}}}")), 0.0);
    }

    #[test]
    fn what_faults_are_is_told_with_its_probability_and_how_it_was_found() {
        let text = module_text();
        let own = r#"structure="tower",module="module1""#;
        let count = |name: &str, labels: &str| value(&text, &format!("{name}{{{own}{labels}}}"));
        for (kind, probability) in [("bias", 0.75), ("drift", 0.125)] {
            let labels = format!(",component=\"sensor/g1\",kind=\"{kind}\"");
            assert_eq!(count("trusswatch_fault_kind_probability", &labels), probability);
        }
        assert_eq!(count("trusswatch_identifications_total", ""), 40.0);
        assert_eq!(count("trusswatch_identification_seconds_total", ""), 1.5);
        assert_eq!(count("trusswatch_identifications_published_total", ""), 3.0);
        let labels = ",reason=\"turned_away\"";
        assert_eq!(count("trusswatch_identifications_missed_total", labels), 2.0);
        let labels = ",reason=\"failed\"";
        assert_eq!(count("trusswatch_identifications_missed_total", labels), 1.0);
    }

    #[test]
    fn exactly_one_phase_is_the_present_one() {
        for (text, present) in [
            (
                module_text(),
                r#"trusswatch_phase{structure="tower",module="module1",phase="in_service"}"#,
            ),
            (plant_text(), r#"trusswatch_plant_phase{structure="tower",phase="running"}"#),
        ] {
            let phases = samples(&text);
            let phases = phases.iter().filter(|(sample, _)| sample.contains("_phase{"));
            assert_eq!(phases.map(|(_, value)| value).sum::<f64>(), 1.0);
            assert_eq!(value(&text, present), 1.0);
        }
    }

    #[test]
    fn labels_are_few_and_every_metric_has_its_help() {
        let known = [
            "structure",
            "module",
            "phase",
            "state",
            "component",
            "kind",
            "reason",
            "outcome",
            "peer",
            "version",
            "fingerprint",
            "how",
            "test",
        ];
        for text in [module_text(), plant_text()] {
            for (sample, _) in samples(&text) {
                let (name, labels) = sample.split_once('{').unwrap();
                assert!(name.starts_with("trusswatch_") || name.starts_with("process_"), "{name}");
                let labels = labels.strip_suffix("\"}").unwrap().split("\",");
                for (label, _) in labels.map(|label| label.split_once("=\"").unwrap()) {
                    assert!(known.contains(&label), "{sample}");
                }
            }
            for help in text.lines().filter(|line| line.starts_with("# HELP")) {
                assert!(help.ends_with('.'), "{help}");
            }
            assert!(text.ends_with("# EOF\n"));
        }
    }

    #[test]
    fn before_the_first_report_there_is_the_process() {
        let text = of_module(&speaker(), None, &process()).unwrap();
        let build = r#"trusswatch_build_info{structure="tower",module="module1",version="0.2.0"}"#;
        assert_eq!(value(&text, build), 1.0);
        assert!(text.contains("process_cpu_seconds_total") && !text.contains("trusswatch_phase"));
    }
}
