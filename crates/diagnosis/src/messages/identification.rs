//! From what was found to the message.

use crate::identification::IdentificationResult;
use vocabulary::{
    Candidate, ComponentKind, FaultSize, Identification, MAX_SIGNATURE_POINTS, Signature,
    SignaturePoint,
};

use super::Speaker;

impl Speaker {
    /// The message on what was found of a component's fault.
    #[must_use]
    pub fn identification(&self, found: IdentificationResult, time_unix_ns: u64) -> Identification {
        let kind = found.component.kind();
        Identification {
            structure: self.structure.clone(),
            module: self.module.clone(),
            component: self.path(&found.component),
            run: found.run,
            sequence: found.sequence,
            as_of_step: found.as_of,
            decided: found.decided().is_some(),
            signature: signature(kind, &found.signature),
            candidates: found.candidates.into_iter().map(writable).collect(),
            since_unix_ns: None,
            time_unix_ns,
        }
    }
}

/// A size that is not finite is omitted, because JSON has no infinities.
fn writable(candidate: Candidate) -> Candidate {
    let is_finite = |FaultSize { value, low, high, .. }: &FaultSize| {
        [value, low, high].iter().all(|bound| bound.is_finite())
    };
    Candidate { size: candidate.size.filter(is_finite), ..candidate }
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
    use vocabulary::{RunId, Step, fault::FaultKind};

    fn speaker() -> Speaker {
        Speaker::of("t".parse().unwrap(), "m1".parse().unwrap())
    }

    fn found(component: &str, candidates: Vec<Candidate>, points: u64) -> Identification {
        let point = |step| SignaturePoint { step: Step(step), measured: 1e-5, fitted: 2e-5 };
        let found = IdentificationResult {
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
        let size = Some(FaultSize { value: 4.5e-5, low, high: 4.6e-5, own_unit: false });
        Candidate { kind: FaultKind::Bias.into(), probability, size }
    }

    #[test]
    fn kind_and_size_are_told_and_whether_they_are_decided() {
        let message = found("sensor/g1", vec![bias(0.97, 4.4e-5)], 0);
        assert!(message.decided);
        assert_eq!(message.component.to_string(), "m1/sensor/g1");
        let size = message.candidates[0].size.unwrap();
        assert_eq!((size.value, size.low), (4.5e-5, 4.4e-5));
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
