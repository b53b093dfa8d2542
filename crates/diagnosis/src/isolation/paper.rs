//! Algorithm 4.3 of the paper: only actuator faults explain, and permanently.

use vocabulary::{Component, ComponentPath, Step};

use super::case::Judgement;

/// Judges a change: an actuator's is always its own fault; a sensor's is explained by the earliest
/// actuator fault anywhere, if there is one. `actuator_faults` are those known as of the judgement.
pub(crate) fn judge<'a>(
    component: &Component,
    actuator_faults: impl Iterator<Item = (&'a ComponentPath, Step)>,
) -> Judgement {
    if matches!(component, Component::Actuator(_)) {
        return Judgement::Root;
    }
    let earliest = actuator_faults.min_by(|a, b| a.1.cmp(&b.1).then_with(|| a.0.cmp(b.0)));
    match earliest {
        Some((path, since)) => Judgement::Explained { by: path.clone(), since },
        None => Judgement::Root,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_actuator_fault_anywhere_explains_a_sensor_but_never_another_actuator() {
        let path: ComponentPath = "m2/actuator/a1".parse().unwrap();
        let faults = [(&path, Step(5))];
        let sensor: Component = "sensor/g1".parse().unwrap();
        let actuator: Component = "actuator/a2".parse().unwrap();
        let explained = Judgement::Explained { by: path.clone(), since: Step(5) };
        assert_eq!(judge(&sensor, faults.into_iter()), explained);
        assert_eq!(judge(&actuator, faults.into_iter()), Judgement::Root);
        assert_eq!(judge(&sensor, std::iter::empty()), Judgement::Root);
    }
}
