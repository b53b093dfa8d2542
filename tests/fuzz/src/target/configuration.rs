//! Configuration files, each with the shipped small mast's other files beside it.

use daemon::config::{
    PlantFlags, Schedule, load_diagnoser, load_plant, load_schedule, load_uncalibrated,
};
use diagnosis::DetectionSection;
use diagnosis::thresholds::{MadeFor, Thresholds};
use diagnosis::{Action, Diagnoser, ModuleSetup};
use settings::ConfigErrors;
use vocabulary::{RunId, Step};

use super::module::samples_of;
use crate::refusal::names_places;
use crate::workbench::with_file;

/// What is accepted is a diagnoser that works, and would be accepted for calibration too; a mistake is
/// named with its place.
pub(super) fn check_diagnoser(bytes: &[u8]) {
    with_file(bytes, |file| {
        let uncalibrated = load_uncalibrated(file);
        match load_diagnoser(file) {
            Ok(config) => {
                works(config.module_setup());
                assert!(uncalibrated.is_ok(), "{uncalibrated:?}");
            }
            Err(errors) => names_places(&errors),
        }
        if let Err(errors) = uncalibrated {
            names_places(&errors);
        }
    });
}

fn works(setup: ModuleSetup) {
    let module = setup.structure.module(&setup.module).unwrap();
    let size = (module.actuators.len(), module.gages.len());
    let mut diagnoser = Diagnoser::new(setup).unwrap();
    let mut actions = Vec::new();
    for sample in samples_of(size, RunId(1), Step(0), 40) {
        diagnoser.take_sample(&sample, &mut actions);
    }
    assert_eq!(diagnoser.counters().samples, 40);
    assert!(!actions.iter().any(|action| matches!(action, Action::Rejected { .. })));
}

/// Thresholds that fit are the very numbers of the file, and are written and read back; a mistake is named
/// with its place.
pub(super) fn check_thresholds(bytes: &[u8]) {
    let read = std::str::from_utf8(bytes).ok().and_then(|text| toml::from_str(text).ok());
    if let Some(thresholds) = read.as_ref() {
        comes_back(thresholds);
    }
    with_file(bytes, |file| match load_diagnoser(&file.with_file_name("lower.toml")) {
        Ok(config) => {
            let setup = config.module_setup();
            let module = setup.structure.module(&setup.module).unwrap();
            let components: Vec<_> = module.components().collect();
            let (name, detection) = (&setup.module, DetectionSection::from(setup.detection));
            let thresholds: Thresholds = read.unwrap();
            let used_for = MadeFor::new(&setup.structure, setup.step_s);
            let fitted = thresholds.fit(name, &components, &detection, Some(&used_for));
            assert_eq!(fitted, Ok(setup.thresholds.clone()));
            assert!(setup.thresholds.iter().all(|value| value.is_finite() && *value > 0.0));
            assert_eq!(config.thresholds, thresholds.fingerprint());
        }
        Err(errors) => names_places(&errors),
    });
}

fn comes_back(thresholds: &Thresholds) {
    let text = toml::to_string(thresholds).unwrap();
    let back: Thresholds = toml::from_str(&text).unwrap();
    // Not-a-number equals nothing, hence the text.
    assert_eq!(format!("{back:?}"), format!("{thresholds:?}"));
}

/// What is accepted is a plant that runs, twice the same; a mistake is named with its place.
pub(super) fn check_plant(bytes: &[u8]) {
    with_file(bytes, |file| match load_plant(file, &PlantFlags::default()) {
        Ok(config) => {
            let [mut one, mut other] = [(); 2].map(|()| config.make_plant().unwrap());
            for _ in 0..5 {
                assert_eq!(format!("{:?}", one.advance()), format!("{:?}", other.advance()));
            }
        }
        Err(errors) => names_places(&errors),
    });
}

/// A schedule is written and read back; a mistake is named with its place.
pub(super) fn check_schedule(bytes: &[u8]) {
    with_file(bytes, |file| match load_schedule(file) {
        Ok(schedule) => {
            let text = toml::to_string(&schedule).unwrap();
            with_file(text.as_bytes(), |file| {
                assert_eq!(debug(load_schedule(file)), debug(Ok(schedule)));
            });
        }
        Err(errors) => names_places(&errors),
    });
}

/// Not-a-number equals nothing, hence the text.
fn debug(schedule: Result<Schedule, ConfigErrors>) -> String {
    format!("{schedule:?}")
}
