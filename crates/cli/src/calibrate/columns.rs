//! Which columns of a recording belong to which channels.

use study::{ResidualRecording, StepOrder};
use vocabulary::{ComponentPath, Signal};

use crate::export::RESIDUALS;

/// The columns of a recording: the channels of some modules.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct ChannelColumns {
    /// Places of the modules whose channels are there, rising, with how many channels they have.
    modules: Vec<(usize, usize)>,
    names: Vec<String>,
}

impl ChannelColumns {
    /// Finds the columns of those modules of which any is there.
    ///
    /// # Errors
    /// In words, what is missing.
    pub(super) fn find(
        header: &[String],
        channels: &[Vec<ComponentPath>],
    ) -> Result<ChannelColumns, String> {
        let one_module = channels.len() == 1;
        let find = |path: &ComponentPath| Signal::Residual.find(header, path, one_module);
        let mut columns = ChannelColumns::default();
        for (place, paths) in channels.iter().enumerate() {
            let found: Vec<Option<&String>> = paths.iter().map(find).collect();
            if found.iter().all(Option::is_none) {
                continue;
            }
            if let Some((path, _)) = paths.iter().zip(&found).find(|(_, name)| name.is_none()) {
                let missing = Signal::Residual.column(path);
                return Err(format!(
                    "missing column `{missing}`; give all of a module's components; {RESIDUALS}"
                ));
            }
            columns.modules.push((place, paths.len()));
            columns.names.extend(found.into_iter().flatten().cloned());
        }
        if columns.modules.is_empty() {
            let example = channels.iter().flatten().next();
            let example = example.map_or_else(String::new, |path| {
                format!(" like `{}`", Signal::Residual.column(path))
            });
            return Err(format!(
                "no column is a residual of the modules; name the columns by components{example}; {RESIDUALS}"
            ));
        }
        Ok(columns)
    }

    /// Their names, in the order of [`ChannelColumns::take`].
    pub(super) fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    /// Gives each module its part of a row.
    ///
    /// # Errors
    /// A step not above that of the row before.
    pub(super) fn take(
        &self,
        step: u64,
        row: &[f64],
        recordings: &mut [ResidualRecording],
    ) -> Result<(), StepOrder> {
        let mut rest = row;
        for (place, channels) in &self.modules {
            let (residuals, others) = rest.split_at((*channels).min(rest.len()));
            rest = others;
            if let Some(recording) = recordings.get_mut(*place) {
                recording.push(Some(step), residuals)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channels() -> Vec<Vec<ComponentPath>> {
        let paths = |names: [&str; 2]| names.map(|name| name.parse().unwrap()).to_vec();
        vec![paths(["m1/actuator/a1", "m1/sensor/g1"]), paths(["m2/actuator/a1", "m2/sensor/g1"])]
    }

    fn find(header: &[&str]) -> Result<Vec<String>, String> {
        let header: Vec<String> = header.iter().map(ToString::to_string).collect();
        ChannelColumns::find(&header, &channels()).map(|columns| columns.names())
    }

    #[test]
    fn the_order_of_columns_does_not_matter_and_unknown_ones_are_left_out() {
        let header = ["m2/sensor/g1", "note", "step", "m2/actuator/a1/residual", ""];
        assert_eq!(find(&header).unwrap(), ["m2/actuator/a1/residual", "m2/sensor/g1"]);
    }

    #[test]
    fn a_module_without_one_of_its_components_is_refused() {
        let error = find(&["m1/actuator/a1", "m1/sensor/g1", "m2/sensor/g1"]).unwrap_err();
        assert!(error.contains("missing column `m2/actuator/a1/residual`"), "{error}");
    }

    #[test]
    fn a_table_of_something_else_is_refused_with_an_example() {
        let error = find(&["step", "a1", "g1"]).unwrap_err();
        assert!(error.contains("like `m1/actuator/a1/residual`"), "{error}");
    }
}
