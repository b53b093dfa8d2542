//! What is true of recorded runs: a table (CSV) with one line a run.

use std::io::{self, Write};

use truss::fault::Fault;

use crate::record::{NominalRecord, ScenarioRecord};

/// Writes the lines of an index of recordings.
#[derive(Debug)]
pub struct TruthIndex<W> {
    out: W,
}

impl<W: Write> TruthIndex<W> {
    /// Begins the index with its header row. The columns: `file`, the recording; `number` and `seed` of
    /// the run; `component`, the path of the faulty one; `kind` of the fault; its `parameters` as
    /// `name=value`, separated by blanks; `onset`, the first step with the fault. A nominal run has
    /// nothing in the last four.
    ///
    /// # Errors
    /// What `out` fails with.
    pub fn begin(mut out: W) -> io::Result<Self> {
        writeln!(out, "file,number,seed,component,kind,parameters,onset")?;
        Ok(Self { out })
    }

    /// Adds a run with a fault.
    ///
    /// # Errors
    /// What `out` fails with.
    pub fn scenario(&mut self, file: &str, record: &ScenarioRecord) -> io::Result<()> {
        let ScenarioRecord { number, seed, component, fault, onset, .. } = record;
        let (file, kind, parameters) = (field(file), fault.kind(), parameters(fault));
        writeln!(self.out, "{file},{number},{seed},{component},{kind},{parameters},{onset}")
    }

    /// Adds a run without a fault.
    ///
    /// # Errors
    /// What `out` fails with.
    pub fn nominal(&mut self, file: &str, record: &NominalRecord) -> io::Result<()> {
        let NominalRecord { number, seed, .. } = record;
        writeln!(self.out, "{},{number},{seed},,,,", field(file))
    }

    /// Ends the index; returns what it was written to.
    ///
    /// # Errors
    /// What `out` fails with.
    pub fn end(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}

/// A text as a field of a table, in quotes if it needs them.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

fn parameters(fault: &Fault) -> String {
    match *fault {
        Fault::InternalLeakage { area_m2 }
        | Fault::ExternalLeakageA { area_m2 }
        | Fault::ExternalLeakageB { area_m2 } => format!("area_m2={area_m2:e}"),
        Fault::Bias { offset_m } => format!("offset_m={offset_m:e}"),
        Fault::RandomWalk { drift_m_per_s, increment_m } => {
            format!("drift_m_per_s={drift_m_per_s:e} increment_m={increment_m:e}")
        }
        Fault::HardOver {} | Fault::ZeroOutput {} => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_commas_are_quoted_and_parameters_named() {
        assert_eq!(field("a.csv"), "a.csv");
        assert_eq!(field("a, \"b\".csv"), "\"a, \"\"b\"\".csv\"");
        let walk = Fault::RandomWalk { drift_m_per_s: -2e-5, increment_m: 3e-6 };
        assert_eq!(parameters(&walk), "drift_m_per_s=-2e-5 increment_m=3e-6");
    }
}
