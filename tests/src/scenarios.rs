//! Fault scenarios that cover every kind of fault of the paper, short enough for many of them.

use daemon::config::{Schedule, ScheduledFault};
use vocabulary::{Step, fault::Fault};

/// Steps of a scenario.
pub const STEPS: u64 = 4200;
/// First step with the fault.
pub const ONSET: u64 = 3300;

/// One permanent fault after the warm-up.
#[must_use]
pub fn single(component: &str, fault: Fault) -> Schedule {
    let component = component.parse().unwrap();
    let fault = ScheduledFault { at_step: Step(ONSET), until_step: None, component, fault };
    Schedule { faults: vec![fault] }
}

/// Every kind of fault of the paper and a missing signal, in both modules.
#[must_use]
pub fn all() -> Vec<Schedule> {
    let walk = |increment_m| Fault::RandomWalk { drift_m_per_s: 6e-5, increment_m };
    vec![
        single("module1/sensor/g2", Fault::Bias { offset_m: 1.5e-4 }),
        single("module2/sensor/g7", Fault::Bias { offset_m: -3e-4 }),
        single("module1/sensor/g5", walk(2e-5)),
        single("module2/sensor/g1", walk(6e-6)),
        single("module1/sensor/g6", Fault::ZeroOutput {}),
        single("module2/sensor/g5", Fault::NoSignal {}),
        single("module1/actuator/a3", Fault::InternalLeakage { area_m2: 3e-7 }),
        single("module2/actuator/a4", Fault::ExternalLeakageA { area_m2: 2e-7 }),
        single("module2/actuator/a1", Fault::ExternalLeakageB { area_m2: 4e-7 }),
        single("module1/actuator/a1", Fault::HardOver {}),
        single("module2/actuator/a2", Fault::HardOver {}),
    ]
}

/// Faults that no change shows, and the steps in which the comparison with the reference finds them: two from the first
/// step on, and one that creeps.
#[must_use]
pub fn unseen() -> (Schedule, u64) {
    let from = |step, component: &str, fault| ScheduledFault {
        at_step: Step(step),
        until_step: None,
        component: component.parse().unwrap(),
        fault,
    };
    let drift = Fault::RandomWalk { drift_m_per_s: 4e-6, increment_m: 0.0 };
    let faults = vec![
        from(0, "module1/sensor/g3", Fault::Bias { offset_m: 6e-5 }),
        from(0, "module2/actuator/a2", Fault::InternalLeakage { area_m2: 1e-7 }),
        from(5000, "module2/sensor/g1", drift),
    ];
    (Schedule { faults }, 30_000)
}
