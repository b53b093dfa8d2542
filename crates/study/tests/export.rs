//! Recordings of runs.

use crate::tower;
use diagnosis::divergence::DivergenceBank;
use diagnosis::{ModuleSetup, Monitor, Observation, Rule};
use study::{RecordedChange, export};
use vocabulary::{Component, ComponentPath, Signal, Step};

/// The scenario with a hard-over.
const HARD_OVER: u64 = 3;

struct ResidualRecording {
    names: Vec<String>,
    rows: Vec<Vec<String>>,
}

fn read(bytes: &[u8]) -> ResidualRecording {
    let text = std::str::from_utf8(bytes).unwrap();
    let fields = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let mut lines = text.lines().map(fields);
    ResidualRecording { names: lines.next().unwrap(), rows: lines.collect() }
}

/// The changes that a module's own bank and monitors find in a recording.
fn changes_of(setup: &ModuleSetup, recording: &ResidualRecording) -> Vec<RecordedChange> {
    let module = setup.structure.module(&setup.module).unwrap();
    let components: Vec<Component> = module.components().collect();
    let path = |component: &Component| ComponentPath {
        module: setup.module.clone(),
        component: component.clone(),
    };
    let place = |c: &Component| {
        let column = Signal::Residual.column(&path(c));
        recording.names.iter().position(|name| *name == column).unwrap()
    };
    let places: Vec<usize> = components.iter().map(place).collect();
    let mut bank =
        DivergenceBank::new(setup.detection.divergence, &setup.prior_scatters()).unwrap();
    let monitor = |&threshold: &f64| {
        Monitor::new(threshold, setup.detection.warm_up_vectors, setup.isolation.quiet_steps)
    };
    let mut monitors: Vec<Monitor> = setup.thresholds.iter().map(monitor).collect();
    let mut changes = Vec::new();
    for row in &recording.rows {
        let step = Step(row[0].parse().unwrap());
        let residuals: Vec<f64> = places.iter().map(|&p| row[p].parse().unwrap()).collect();
        let outcomes = bank.push(&residuals);
        for (channel, monitor) in monitors.iter_mut().enumerate() {
            let observation = monitor.observe(step, residuals[channel], outcomes[channel]);
            if matches!(observation, Observation::Changed { .. }) {
                changes.push(RecordedChange { component: path(&components[channel]), step });
            }
        }
    }
    changes
}

fn sorted(mut changes: Vec<RecordedChange>) -> Vec<RecordedChange> {
    changes.sort_by(|a, b| (a.step, &a.component).cmp(&(b.step, &b.component)));
    changes
}

#[test]
fn a_recording_gives_the_very_changes_of_its_run() {
    let campaign = tower::campaign(Rule::FirstChange);
    let mut changes = 0;
    for number in 0..7 {
        let mut bytes = Vec::new();
        let (record, exported) = export(&campaign, number, false, &mut bytes).unwrap();
        let recording = read(&bytes);
        assert_eq!(recording.rows.len() as u64, campaign.system.steps(5.0));
        let of_module = |setup| changes_of(setup, &recording);
        let found = campaign.system.setups.iter().flat_map(of_module).collect();
        assert_eq!(sorted(found), sorted(exported.clone()));
        assert_eq!(record.conversation.changes, exported.len() as u64);
        assert_eq!(record, tower::row(&campaign, number));
        changes += exported.len();
    }
    assert!(changes >= 7, "only {changes} changes");
}

#[test]
fn the_truth_stands_beside_every_step() {
    let campaign = tower::campaign(Rule::FirstChange);
    let mut bytes = Vec::new();
    let (record, _) = export(&campaign, HARD_OVER, false, &mut bytes).unwrap();
    let injection = record.injection.unwrap();
    let recording = read(&bytes);
    assert_eq!(recording.names[..3], ["step", "fault", "module1/actuator/a1/residual"]);
    assert_eq!(recording.names.len(), 2 + 2 * 12);
    for (row, step) in recording.rows.iter().zip(0..) {
        let faulty =
            if step >= injection.at.0 { injection.component.to_string() } else { "".into() };
        assert_eq!((row[0].parse(), &row[1]), (Ok(step), &faulty));
        assert_eq!(row.len(), recording.names.len());
    }
}

#[test]
fn a_nominal_run_has_no_fault_and_no_change() {
    let campaign = tower::campaign(Rule::FirstChange);
    let mut bytes = Vec::new();
    let (record, changes) = export(&campaign, campaign.scenarios + 2, false, &mut bytes).unwrap();
    assert_eq!((record.injection, changes), (None, Vec::new()));
    assert!(read(&bytes).rows.iter().all(|row| row[1].is_empty()));
}

#[test]
fn readings_stand_beside_the_residuals_if_wanted() {
    let campaign = tower::campaign(Rule::FirstChange);
    let [plain, full] = [false, true].map(|readings| {
        let mut bytes = Vec::new();
        export(&campaign, HARD_OVER, readings, &mut bytes).unwrap();
        read(&bytes)
    });
    assert_eq!((plain.names.len(), full.names.len()), (2 + 24, 2 + 8 * 4 + 16 * 2));
    let kept: Vec<usize> =
        plain.names.iter().map(|n| full.names.iter().position(|m| m == n).unwrap()).collect();
    for (row, both) in plain.rows.iter().zip(&full.rows) {
        assert!(kept.iter().map(|place| &both[*place]).eq(row));
    }
    let value = |name: &str| {
        let place = full.names.iter().position(|known| known == name).unwrap();
        full.rows.iter().map(move |row| row[place].parse::<f64>().unwrap())
    };
    let is_pressure = |pascal: f64| (1e5..3e7).contains(&pascal);
    assert!(value("module2/actuator/a4/pressure_b_pa").all(is_pressure));
    assert!(value("module1/actuator/a1/demand_n").all(|newton| newton.abs() < 2e5));
    assert!(value("module2/sensor/g8/elongation_m").all(|metre| metre.abs() < 0.02));
}
