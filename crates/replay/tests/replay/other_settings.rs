//! What would have been named with other settings.

use replay::{
    Beginnings, ModuleRecord, ProcessCourse, ReplayPart, ReplaySettings, courses, latest_setup,
    together,
};
use vocabulary::ComponentPath;

use crate::{collect, replay_all, with_fault, without_reference};

fn named(records: &[ModuleRecord], settings: &ReplaySettings) -> Vec<ComponentPath> {
    let runs = Beginnings::of(records);
    let known: Vec<Vec<ProcessCourse>> = records
        .iter()
        .map(|record| courses(record).into_iter().map(|(_, course)| course.unwrap()).collect())
        .collect();
    let parts = records.iter().zip(&known).map(|(record, courses)| {
        let setup = settings.applied_to(latest_setup(record).unwrap());
        ReplayPart::new(record, courses, setup, &runs)
    });
    let verdicts = together(&parts.collect::<Vec<_>>()).unwrap();
    let of_module = |(record, verdicts): (&ModuleRecord, Vec<replay::ReplayedTransition>)| {
        let module = record.module.clone();
        let latched = verdicts.into_iter().filter(|v| v.transition.verdict.is_latched());
        latched
            .map(|v| ComponentPath { module: module.clone(), component: v.transition.component })
            .collect::<Vec<_>>()
    };
    records.iter().zip(verdicts).flat_map(of_module).collect()
}

#[test]
fn the_same_settings_give_the_same_verdicts_without_recorded_answers() {
    let records = collect(&with_fault());
    assert_eq!(named(&records, &ReplaySettings::default()), ["module1/sensor/g5".parse().unwrap()]);
    let exact = replay_all(&records);
    let exact = exact.iter().flat_map(|one| &one.as_ref().unwrap().transitions);
    assert_eq!(exact.filter(|v| v.transition.verdict.is_latched()).count(), 1);
}

#[test]
fn with_thresholds_a_million_times_as_large_no_change_is_named() {
    let records = collect(&without_reference());
    assert_eq!(named(&records, &ReplaySettings::default()), ["module1/sensor/g5".parse().unwrap()]);
    let settings = ReplaySettings { threshold_factor: Some(1e6), ..ReplaySettings::default() };
    assert_eq!(named(&records, &settings), Vec::<ComponentPath>::new());
}

#[test]
fn without_what_the_processes_took_all_samples_are_taken_in_order() {
    let mut records = collect(&with_fault());
    records.iter_mut().for_each(|record| record.inputs.clear());
    assert_eq!(named(&records, &ReplaySettings::default()), ["module1/sensor/g5".parse().unwrap()]);
}
