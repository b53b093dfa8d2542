//! What is true of recorded runs: a table (CSV) with one line a run.

use std::io::{self, Write};

use names::fault::Fault;

use crate::record::{NominalRecord, ScenarioRecord};

const COLUMNS: [&str; 7] = ["file", "number", "seed", "component", "kind", "parameters", "onset"];

/// Writes the lines of an index of recordings.
#[derive(Debug)]
pub struct TruthIndex<W: Write> {
    out: csv::Writer<W>,
}

impl<W: Write> TruthIndex<W> {
    /// Begins the index with its header row. The columns: `file`, the recording; `number` and `seed` of
    /// the run; `component`, the path of the faulty one; `kind` of the fault; its `parameters` as
    /// `name=value`, separated by blanks; `onset`, the first step with the fault. A nominal run has
    /// nothing in the last four.
    ///
    /// # Errors
    /// What `out` fails with.
    pub fn begin(out: W) -> io::Result<Self> {
        let mut out = csv::Writer::from_writer(out);
        out.write_record(COLUMNS)?;
        Ok(Self { out })
    }

    /// Adds a run with a fault.
    ///
    /// # Errors
    /// What `out` fails with.
    pub fn scenario(&mut self, file: &str, record: &ScenarioRecord) -> io::Result<()> {
        let ScenarioRecord { number, seed, component, fault, onset, .. } = record;
        let [number, seed, onset] = [*number, *seed, onset.0].map(|number| number.to_string());
        let (component, kind) = (component.to_string(), fault.kind().as_str());
        let parameters = parameters(fault);
        let row = [file, &number, &seed, &component, kind, &parameters, &onset];
        Ok(self.out.write_record(row)?)
    }

    /// Adds a run without a fault.
    ///
    /// # Errors
    /// What `out` fails with.
    pub fn nominal(&mut self, file: &str, record: &NominalRecord) -> io::Result<()> {
        let [number, seed] = [record.number, record.seed].map(|number| number.to_string());
        Ok(self.out.write_record([file, &number, &seed, "", "", "", ""])?)
    }

    /// Ends the index; returns what it was written to.
    ///
    /// # Errors
    /// What `out` fails with.
    pub fn end(self) -> io::Result<W> {
        self.out.into_inner().map_err(|error| error.into_error())
    }
}

fn parameters(fault: &Fault) -> String {
    let named = |(name, value): (&str, f64)| format!("{name}={value:e}");
    fault.parameters().into_iter().map(named).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_named() {
        let walk = Fault::RandomWalk { drift_m_per_s: -2e-5, increment_m: 3e-6 };
        assert_eq!(parameters(&walk), "drift_m_per_s=-2e-5 increment_m=3e-6");
        let contact = Fault::Intermittent { offset_m: 5e-5, closed_s: 0.5, open_s: 0.02 };
        assert_eq!(parameters(&contact), "offset_m=5e-5 closed_s=5e-1 open_s=2e-2");
        assert_eq!(parameters(&Fault::Stuck {}), "");
    }
}
