//! From what was found to the message.

use crate::identification::{Candidate, Identification, SignaturePoint, Size};
use vocabulary::{ComponentKind, FaultSize, MAX_SIGNATURE_POINTS, Signature, fault::FaultKind};

use super::Speaker;

impl Speaker {
    /// The message on what was found of a component's fault.
    #[must_use]
    pub fn identification(
        &self,
        found: Identification,
        time_unix_ns: u64,
    ) -> vocabulary::Identification {
        let kind = found.component.kind();
        vocabulary::Identification {
            structure: self.structure.clone(),
            module: self.module.clone(),
            component: self.path(&found.component),
            run: found.run,
            sequence: found.sequence,
            as_of_step: found.as_of,
            decided: found.decided().is_some(),
            candidates: found.candidates.iter().map(candidate).collect(),
            signature: signature(kind, &found.signature),
            time_unix_ns,
        }
    }
}

fn candidate(candidate: &Candidate) -> vocabulary::Candidate {
    let Candidate { kind, probability, size } = *candidate;
    let size = size.zip(unit(kind)).and_then(|(size, unit)| to_wire_size(size, unit));
    vocabulary::Candidate { kind, probability, size }
}

/// JSON has no infinities: a size that is not finite is none.
fn to_wire_size(size: Size, unit: &str) -> Option<FaultSize> {
    let Size { value, low, high } = size;
    let finite = [value, low, high].iter().all(|bound| bound.is_finite());
    finite.then(|| FaultSize { value, low, high, unit: unit.to_owned() })
}

/// What the size of a kind is measured in; `None` where it has none.
fn unit(kind: FaultKind) -> Option<&'static str> {
    match kind {
        FaultKind::Bias | FaultKind::Intermittent => Some("m"),
        FaultKind::Drift => Some("m/s"),
        FaultKind::RandomWalk => Some("m per step"),
        FaultKind::Gain => Some("1"),
        FaultKind::InternalLeakage | FaultKind::ExternalLeakageA | FaultKind::ExternalLeakageB => {
            Some("m²")
        }
        FaultKind::HardOver
        | FaultKind::Stiction
        | FaultKind::ZeroOutput
        | FaultKind::Stuck
        | FaultKind::NoSignal => None,
    }
}

fn signature(kind: ComponentKind, points: &[SignaturePoint]) -> Option<Signature> {
    let unit = match kind {
        ComponentKind::Sensor => "m",
        ComponentKind::Actuator => "m³",
    };
    let is_finite = |one: &&SignaturePoint| one.measured.is_finite() && one.fitted.is_finite();
    let finite: Vec<_> = points.iter().filter(is_finite).copied().collect();
    let points: Vec<_> = thinned(&finite).collect();
    (!points.is_empty()).then(|| Signature { unit: unit.to_owned(), points })
}

/// At most [`MAX_SIGNATURE_POINTS`] of these, evenly spread, the first and the last among them.
fn thinned<T: Copy>(all: &[T]) -> impl Iterator<Item = T> + '_ {
    let kept = all.len().min(MAX_SIGNATURE_POINTS);
    let last = all.len().saturating_sub(1);
    (0..kept).map(move |place| all[place * last / kept.saturating_sub(1).max(1)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{RunId, Step};

    fn speaker() -> Speaker {
        Speaker::of("t".parse().unwrap(), "m1".parse().unwrap())
    }

    fn found(
        component: &str,
        candidates: Vec<Candidate>,
        points: u64,
    ) -> vocabulary::Identification {
        let point = |step| SignaturePoint { step: Step(step), measured: 1e-5, fitted: 2e-5 };
        let found = Identification {
            run: RunId(1),
            sequence: 4,
            component: component.parse().unwrap(),
            as_of: Step(9),
            candidates,
            signature: (0..points).map(point).collect(),
        };
        speaker().identification(found, 5)
    }

    fn bias(probability: f64, low: f64) -> Candidate {
        let size = Some(Size { value: 4.5e-5, low, high: 4.6e-5 });
        Candidate { kind: FaultKind::Bias, probability, size }
    }

    #[test]
    fn kind_and_size_are_told_with_their_unit_and_whether_they_are_decided() {
        let message = found("sensor/g1", vec![bias(0.97, 4.4e-5)], 0);
        assert!(message.decided);
        assert_eq!(message.component.to_string(), "m1/sensor/g1");
        let size = message.candidates[0].size.clone().unwrap();
        assert_eq!((size.value, size.low, size.unit.as_str()), (4.5e-5, 4.4e-5, "m"));
        assert!(!found("sensor/g1", vec![bias(0.9, 4.4e-5)], 0).decided);
        let endless = found("sensor/g1", vec![bias(0.9, f64::NEG_INFINITY)], 0);
        assert_eq!(endless.candidates[0].size, None);
        let nothing = found("sensor/g1", Vec::new(), 0);
        assert!(!nothing.decided && nothing.candidates.is_empty());
    }

    #[test]
    fn a_long_signature_is_thinned_and_keeps_its_ends() {
        assert_eq!(found("sensor/g1", Vec::new(), 0).signature, None);
        for (points, kept) in [(1, 1), (2, 2), (120, 120), (121, 120), (3500, 120)] {
            let signature = found("actuator/a1", Vec::new(), points).signature.unwrap();
            assert_eq!((signature.points.len(), signature.unit.as_str()), (kept, "m³"));
            assert_eq!(signature.points[0].step, Step(0));
            assert_eq!(signature.points.last().unwrap().step, Step(points - 1));
            assert!(signature.points.windows(2).all(|pair| pair[0].step < pair[1].step));
        }
    }
}
