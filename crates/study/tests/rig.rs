//! The rig: what the paper reports, in one process.

use crate::tower;
use diagnosis::Verdict;
use study::{Rig, RigEvent, TimedFault};

#[test]
fn a_healthy_tower_in_the_wind_raises_no_alarm() {
    let mut rig = tower::rig(11, Vec::new());
    rig.run(12_000).unwrap();
    assert_eq!(rig.take_occurrences(), []);
}

#[test]
fn the_paper_s_stories_end_with_the_right_component_and_no_other() {
    let strain = 60e-6 * 3.0;
    let stories = [
        ("module1/sensor/g1", tower::bias(strain)),
        ("module1/sensor/g5", tower::random_walk()),
        ("module1/actuator/a1", tower::leakage()),
        ("module2/actuator/a3", tower::hard_over()),
        ("module2/sensor/g2", tower::bias(-strain)),
    ];
    for (component, fault) in stories {
        let component: vocabulary::ComponentPath = component.parse().unwrap();
        let at = vocabulary::Step(5000);
        let injection = TimedFault { at, until: None, component: component.clone(), fault };
        let mut rig = tower::rig(12, vec![injection]);
        rig.run(6000).unwrap();
        let occurrences = rig.take_occurrences();
        let latched: Vec<_> = occurrences.iter().filter_map(tower::latched).collect();
        assert_eq!(latched.len(), 1, "{component}: {latched:?}");
        assert_eq!(latched[0].0, component);
        assert!(latched[0].1 >= at);
    }
}

#[test]
fn a_hard_over_in_one_module_is_explained_to_the_other_by_the_peer_s_answer() {
    let component = "module1/actuator/a3".parse().unwrap();
    let at = vocabulary::Step(5000);
    let fault = tower::hard_over();
    let mut rig = tower::rig(12, vec![TimedFault { at, until: None, component, fault }]);
    rig.run(8000).unwrap();
    let occurrences = rig.take_occurrences();
    let explained = occurrences.iter().filter(|occurrence| match occurrence {
        RigEvent::Transition { module, transition } => {
            module.as_str() == "module2"
                && matches!(&transition.verdict, Verdict::Explained { by, .. }
                    if by.to_string() == "module1/actuator/a3")
        }
        _ => false,
    });
    assert!(explained.count() > 0, "the neighbour changes too");
    let asked = occurrences
        .iter()
        .any(|o| matches!(o, RigEvent::Question { asker, .. } if asker.as_str() == "module2"));
    assert!(asked);
}

#[test]
fn the_same_seed_gives_the_same_story_and_another_seed_another() {
    let run = |seed| {
        let component = "module1/sensor/g2".parse().unwrap();
        let at = vocabulary::Step(3000);
        let fault = tower::random_walk();
        let mut rig = tower::rig(seed, vec![TimedFault { at, until: None, component, fault }]);
        rig.run(4000).unwrap();
        rig.take_occurrences()
    };
    assert_eq!(run(5), run(5));
    assert_ne!(run(5), run(6));
}

#[test]
fn setups_in_the_wrong_order_are_refused() {
    let (structure, parameters, mut setups) = tower::parts();
    setups.reverse();
    let plant = study::plant(&structure, &parameters, 0.0, 1).unwrap();
    let error = Rig::new(plant, setups, Vec::new(), vocabulary::RunId(1)).unwrap_err();
    assert!(error.to_string().contains("module2, module1"), "{error}");
}
