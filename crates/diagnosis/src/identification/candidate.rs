//! A kind that a fault may be of.

use std::fmt;

use names::fault::FaultKind;

use super::mixture::Size;

/// A kind that a fault may be of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// The kind.
    pub kind: FaultKind,
    /// How probable it is.
    pub probability: f64,
    /// How large it is if it is of this kind, where that means anything: a bias \[m\], a drift \[m/s\], a gain \[–\], the
    /// increment of a random walk \[m per step\], a leak's coefficient \[m²\], the band of a sticking valve \[m³/s\].
    pub size: Option<Size>,
}

/// For people: `bias of +45.1 µm (44.8 to 45.4)`.
impl fmt::Display for Candidate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.words())?;
        let Some(Size { value, low, high }) = self.size else { return Ok(()) };
        let (scale, unit) = match self.kind {
            FaultKind::Bias => (1e6, " µm"),
            FaultKind::Drift => (1e6, " µm/s"),
            FaultKind::RandomWalk => (1e6, " µm a step"),
            FaultKind::Stiction => (1e6, " cm³/s"),
            FaultKind::InternalLeakage
            | FaultKind::ExternalLeakageA
            | FaultKind::ExternalLeakageB => {
                return write!(f, ", {value:.2e} m² ({low:.2e} to {high:.2e})");
            }
            _ => (1.0, ""),
        };
        let [value, low, high] = [value, low, high].map(|size| size * scale);
        write!(f, " of {value:.3}{unit} ({low:.3} to {high:.3})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_read_a_size_with_its_interval_in_small_units() {
        let candidate = |kind, size: Option<[f64; 3]>| Candidate {
            kind,
            probability: 1.0,
            size: size.map(|[low, value, high]| Size { value, low, high }),
        };
        let read = [
            candidate(FaultKind::Bias, Some([44.8e-6, 45.1e-6, 45.4e-6])),
            candidate(FaultKind::ExternalLeakageA, Some([9e-8, 1e-7, 1.1e-7])),
            candidate(FaultKind::ZeroOutput, None),
        ]
        .map(|candidate| candidate.to_string());
        let expected = [
            "bias of 45.100 µm (44.800 to 45.400)",
            "external leakage of chamber A, 1.00e-7 m² (9.00e-8 to 1.10e-7)",
            "zero output",
        ];
        assert_eq!(read, expected);
    }
}
