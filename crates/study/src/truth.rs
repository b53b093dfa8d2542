//! What is true of recorded runs: a table (CSV) with one line a run.

use std::io::{self, Write};

use names::fault::Fault;

use crate::case::Injection;
use crate::scenarios::Record;

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

    /// Adds a run.
    ///
    /// # Errors
    /// What `out` fails with.
    pub fn add(&mut self, file: &str, number: u64, record: &Record) -> io::Result<()> {
        let [number, seed] = [number, record.seed].map(|number| number.to_string());
        let [component, kind, parameters, onset] = match &record.injection {
            Some(Injection { at, component, fault, .. }) => {
                let kind = fault.kind().to_string();
                [component.to_string(), kind, parameters(fault), at.to_string()]
            }
            None => Default::default(),
        };
        let row = [file, &number, &seed, &component, &kind, &parameters, &onset];
        Ok(self.out.write_record(row)?)
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
