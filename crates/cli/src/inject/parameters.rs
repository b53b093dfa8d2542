//! A fault and its size from the command line.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use vocabulary::fault::{Fault, FaultKind};

/// The parameters of all faults; each fault has its own among them.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Size of the fault")]
pub(super) struct FaultParameters {
    /// Leak coefficient [m²]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    area_m2: Option<f64>,
    /// Offset of the elongation [m]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    offset_m: Option<f64>,
    /// Drift of the elongation, of a random walk its mean [m/s]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    drift_m_per_s: Option<f64>,
    /// Standard deviation of the increment per step [m]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    increment_m: Option<f64>,
    /// Multiple of the elongation that the gage reads; 1 is healthy
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    gain: Option<f64>,
    /// Mean time for which a bad contact is closed [s]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    closed_s: Option<f64>,
    /// Mean time for which a bad contact is open, and the reading off by the offset [s]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    open_s: Option<f64>,
    /// Flow by which the command may differ from a sticking spool's before it moves [m³/s]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    band_m3_per_s: Option<f64>,
}

/// Reads the name of a fault.
pub(super) fn kinds() -> impl TypedValueParser<Value = FaultKind> {
    let names = FaultKind::ALL.map(FaultKind::as_str);
    PossibleValuesParser::new(names).try_map(|name| {
        let kind = FaultKind::ALL.into_iter().find(|kind| kind.as_str() == name);
        kind.ok_or_else(|| format!("unknown fault `{name}`"))
    })
}

impl FaultParameters {
    /// The fault of this kind with these parameters, or none without a kind.
    pub(super) fn fault(&self, kind: Option<FaultKind>) -> Result<Option<Fault>, String> {
        let fault = kind.map(|kind| self.with(kind));
        let wanted = fault.map(|fault| fault.parameters()).unwrap_or_default();
        for (name, value) in self.all() {
            let what = kind.map_or("a repair".to_owned(), |kind| format!("`{kind}`"));
            match (wanted.iter().any(|(wanted, _)| *wanted == name), value) {
                (true, None) => return Err(format!("{what} needs {}", flag(name))),
                (false, Some(_)) => return Err(format!("{what} takes no {}", flag(name))),
                _ => {}
            }
        }
        if let Some(fault) = &fault {
            fault.check().map_err(|error| error.to_string())?;
        }
        Ok(fault)
    }

    fn all(&self) -> [(&'static str, Option<f64>); 8] {
        [
            ("area_m2", self.area_m2),
            ("offset_m", self.offset_m),
            ("drift_m_per_s", self.drift_m_per_s),
            ("increment_m", self.increment_m),
            ("gain", self.gain),
            ("closed_s", self.closed_s),
            ("open_s", self.open_s),
            ("band_m3_per_s", self.band_m3_per_s),
        ]
    }

    /// What is missing is not a number here.
    fn with(&self, kind: FaultKind) -> Fault {
        let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let (area_m2, offset_m) = (number(self.area_m2), number(self.offset_m));
        let drift_m_per_s = number(self.drift_m_per_s);
        match kind {
            FaultKind::InternalLeakage => Fault::InternalLeakage { area_m2 },
            FaultKind::ExternalLeakageA => Fault::ExternalLeakageA { area_m2 },
            FaultKind::ExternalLeakageB => Fault::ExternalLeakageB { area_m2 },
            FaultKind::HardOver => Fault::HardOver {},
            FaultKind::Stiction => Fault::Stiction { band_m3_per_s: number(self.band_m3_per_s) },
            FaultKind::Bias => Fault::Bias { offset_m },
            FaultKind::Drift => Fault::Drift { drift_m_per_s },
            FaultKind::RandomWalk => {
                Fault::RandomWalk { drift_m_per_s, increment_m: number(self.increment_m) }
            }
            FaultKind::Gain => Fault::Gain { gain: number(self.gain) },
            FaultKind::ZeroOutput => Fault::ZeroOutput {},
            FaultKind::Stuck => Fault::Stuck {},
            FaultKind::Intermittent => Fault::Intermittent {
                offset_m,
                closed_s: number(self.closed_s),
                open_s: number(self.open_s),
            },
            FaultKind::NoSignal => Fault::NoSignal {},
        }
    }
}

fn flag(name: &str) -> String {
    format!("--{}", name.replace('_', "-"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(kind: FaultKind) -> Vec<&'static str> {
        let parameters = FaultParameters::default().with(kind).parameters();
        parameters.into_iter().map(|(name, _)| name).collect()
    }

    #[test]
    fn every_fault_takes_its_own_parameters_and_no_others() {
        let given = FaultParameters {
            area_m2: Some(3e-7),
            offset_m: Some(-6e-4),
            drift_m_per_s: Some(2e-4),
            increment_m: Some(2e-5),
            gain: Some(0.9),
            closed_s: Some(0.5),
            open_s: Some(0.02),
            band_m3_per_s: Some(1e-5),
        };
        for kind in FaultKind::ALL {
            let only = |name, value: Option<f64>| value.filter(|_| names(kind).contains(&name));
            let own = FaultParameters {
                area_m2: only("area_m2", given.area_m2),
                offset_m: only("offset_m", given.offset_m),
                drift_m_per_s: only("drift_m_per_s", given.drift_m_per_s),
                increment_m: only("increment_m", given.increment_m),
                gain: only("gain", given.gain),
                closed_s: only("closed_s", given.closed_s),
                open_s: only("open_s", given.open_s),
                band_m3_per_s: only("band_m3_per_s", given.band_m3_per_s),
            };
            assert_eq!(own.fault(Some(kind)).unwrap().map(|fault| fault.kind()), Some(kind));
            let problem = given.fault(Some(kind)).unwrap_err();
            assert!(problem.contains("takes no --"), "{problem}");
            if let Some(first) = names(kind).first() {
                let problem = FaultParameters::default().fault(Some(kind)).unwrap_err();
                assert_eq!(problem, format!("`{kind}` needs {}", flag(first)));
            }
        }
        assert_eq!(FaultParameters::default().fault(None), Ok(None));
        assert!(given.fault(None).unwrap_err().contains("a repair takes no --area-m2"));
    }

    #[test]
    fn a_size_out_of_range_is_named() {
        let given = FaultParameters { offset_m: Some(7.0), ..FaultParameters::default() };
        let problem = given.fault(Some(FaultKind::Bias)).unwrap_err();
        assert!(problem.contains("offset_m") && problem.contains("±1 m"), "{problem}");
        let given = FaultParameters { gain: Some(0.0), ..FaultParameters::default() };
        let problem = given.fault(Some(FaultKind::Gain)).unwrap_err();
        assert!(problem.contains("`gain`") && problem.contains("`zero_output`"), "{problem}");
    }
}
