//! A freeze frame as CSV: one row a step.

use figure::freeze_frame::seconds;
use vocabulary::FreezeFrame;

/// The step, the time since the detection, and the traces with their units in the header; a value that is not there is
/// empty.
pub(in crate::fault) fn csv(frame: &FreezeFrame) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let named = frame.traces.iter().map(|trace| format!("{} [{}]", trace.name, trace.unit));
    writer.write_record(
        ["step".to_owned(), "since detection [s]".to_owned()].into_iter().chain(named),
    )?;
    for (row, step) in frame.steps.iter().enumerate() {
        let values = frame.traces.iter().map(|trace| {
            let value = trace.values.get(row).copied().flatten();
            value.map_or_else(String::new, |value| value.to_string())
        });
        let time = seconds(frame, step.0);
        writer.write_record([step.to_string(), time.to_string()].into_iter().chain(values))?;
    }
    writer.into_inner().map_err(|error| csv::Error::from(error.into_error()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use figure::freeze_frame::testing::frame;

    #[test]
    fn every_step_has_a_row_and_what_is_undefined_is_empty() {
        let text = String::from_utf8(csv(&frame()).unwrap()).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "step,since detection [s],reading [m],residual [m],divergence [1]");
        assert_eq!(lines[1], "1000,-0.102,0.000001,0,");
        assert_eq!(lines[199], "1199,0.097,0.000046,0.000045,50");
        assert_eq!(lines.len(), 200);
    }
}
