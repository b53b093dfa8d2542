//! Cylinders that are hard over are shut off: by an operator's order, or by their module itself, one at a time.
//!
//! Authority: the faults that the plant was given, and the chambers' pressures.

use crate::support::{LIMIT, Rig, first, in_time};
use daemon::config::{PlantFlags, ScheduledFault, Speed};
use observer::{OrderRequest, QueryError};
use plant::ToleranceSettings;
use vocabulary::{Ability, Capability, Obeyed, Order, OrderKind, Sample, Step, fault::Fault};
use zenoh::Session;

const TANK_PA: f64 = 1e5;

fn hard_over(at: u64, component: &str) -> ScheduledFault {
    ScheduledFault {
        at_step: Step(at),
        until_step: None,
        component: component.parse().unwrap(),
        fault: Fault::HardOver {},
    }
}

/// Waits until a module says this of its first cylinder.
async fn says(observer: &Session, module: &str, ability: Ability) {
    let read = |received: &zenoh::sample::Sample| {
        let said: Capability = vocabulary::decode(&received.payload().to_bytes()).unwrap();
        let said = &said.cylinders[0];
        (said.name.as_str() == "a1" && said.ability == ability && said.decided).then_some(())
    };
    let key = format!("trusswatch/*/{module}/capability");
    first(observer, &key, &format!("{ability:?} of {module}"), read).await;
}

/// Waits until the first cylinder of a module has empty chambers, or has them no longer.
async fn is_empty(observer: &Session, module: &str, wanted: bool) {
    let read = |received: &zenoh::sample::Sample| {
        let sample: Sample = vocabulary::decode(&received.payload().to_bytes()).unwrap();
        let pressures_pa = sample.pressures_pa[0];
        let is_empty = pressures_pa.iter().all(|pa| *pa < 2.0 * TANK_PA);
        (is_empty == wanted).then_some(())
    };
    first(observer, &format!("trusswatch/*/{module}/sample"), "chambers", read).await;
}

/// What becomes of an order, once the module knows what its peer has shut off.
async fn order(observer: &Session, module: &str, kind: OrderKind) -> Result<Obeyed, QueryError> {
    let component = Some("actuator/a1".parse().unwrap());
    let order = Order { component, by: "ada".to_owned(), ..Order::default() };
    let (structure, module) = ("tower".parse().unwrap(), module.parse().unwrap());
    let request = OrderRequest { structure, module, kind, operator: None, order };
    let ordered = async {
        loop {
            let outcome = session::client::order(observer, &request, LIMIT).await;
            match &outcome {
                Err(refused) if refused.to_string().contains("is not known") => {
                    first(observer, "trusswatch/*/*/capability", "a peer's word", |_| Some(()))
                        .await;
                }
                _ => return outcome,
            }
        }
    };
    in_time("an order's outcome", ordered).await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_cylinder_that_is_hard_over_is_shut_off_by_order_and_the_next_by_its_module() {
    let flags = PlantFlags { speed: Some(Speed::Factor(2.0)), ..PlantFlags::default() };
    let mut rig = Rig::new("plant.toml", &["module1.toml", "module2.toml"], &flags);
    rig.plant.schedule.faults =
        vec![hard_over(6000, "module1/actuator/a1"), hard_over(14_000, "module2/actuator/a1")];
    rig.plant.tolerance = ToleranceSettings { most_shut_off: 1, ..ToleranceSettings::default() };
    rig.diagnosers[1].tolerance.by_itself = true;
    let diagnosers = [rig.start_diagnoser(0), rig.start_diagnoser(1)];
    let observer = rig.observer().await;
    let (structure, all) = (rig.plant.structure.name.clone(), rig.modules());
    session::client::wait_for(&observer, &structure, &all, false, LIMIT).await.unwrap();
    let refused = order(&observer, "module1", OrderKind::ShutOff).await.unwrap_err().to_string();
    assert!(refused.contains("only a cylinder with a latched fault"), "{refused}");
    let plant = rig.start_plant();
    says(&observer, "module1", Ability::HardOver).await;
    order(&observer, "module1", OrderKind::ShutOff).await.unwrap();
    is_empty(&observer, "module1", true).await;
    says(&observer, "module1", Ability::ShutOff).await;

    // A second cylinder must wait, whether an operator asks or its module.
    says(&observer, "module2", Ability::HardOver).await;
    let refused = order(&observer, "module2", OrderKind::ShutOff).await.unwrap_err().to_string();
    assert!(refused.contains("1 of at most 1 cylinders are shut off"), "{refused}");
    let obeyed = order(&observer, "module1", OrderKind::PutBack).await.unwrap();
    assert_eq!(obeyed.state, vocabulary::FaultState::Latched);
    is_empty(&observer, "module1", false).await;
    is_empty(&observer, "module2", true).await;
    says(&observer, "module2", Ability::ShutOff).await;
    // What an operator puts back, the module leaves.
    order(&observer, "module2", OrderKind::PutBack).await.unwrap();
    is_empty(&observer, "module2", false).await;
    says(&observer, "module2", Ability::HardOver).await;
    plant.stop().await;
    for diagnoser in diagnosers {
        in_time("the end", diagnoser.stop()).await;
    }
}
