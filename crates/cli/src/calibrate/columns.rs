//! Which columns of a recording belong to which channels.

use study::{ResidualRecording, StepOrder};
use vocabulary::ComponentPath;

/// The columns of a recording: the channels of some modules.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct ChannelColumns {
    /// Places of the modules whose channels are there, rising, with how many channels they have.
    modules: Vec<(usize, usize)>,
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
        let is_there = |path: &ComponentPath| header.contains(&path.to_string());
        let mut modules = Vec::new();
        for (place, paths) in channels.iter().enumerate() {
            if !paths.iter().any(is_there) {
                continue;
            }
            if let Some(missing) = paths.iter().find(|path| !is_there(path)) {
                return Err(format!(
                    "missing column `{missing}`; give all of a module's components"
                ));
            }
            modules.push((place, paths.len()));
        }
        if modules.is_empty() {
            let example = channels.iter().flatten().next();
            let example = example.map_or_else(String::new, |path| format!(" like `{path}`"));
            return Err(format!(
                "no column is a component of the modules; name the columns by components{example}"
            ));
        }
        Ok(ChannelColumns { modules })
    }

    /// Their names, in the order of [`ChannelColumns::take`].
    pub(super) fn names(&self, channels: &[Vec<ComponentPath>]) -> Vec<String> {
        let of_modules = self.modules.iter().filter_map(|(place, _)| channels.get(*place));
        of_modules.flatten().map(ToString::to_string).collect()
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
        ChannelColumns::find(&header, &channels()).map(|columns| columns.names(&channels()))
    }

    #[test]
    fn the_order_of_columns_does_not_matter_and_unknown_ones_are_left_out() {
        let found = find(&["m2/sensor/g1", "note", "step", "m2/actuator/a1", ""]).unwrap();
        assert_eq!(found, ["m2/actuator/a1", "m2/sensor/g1"]);
    }

    #[test]
    fn a_module_without_one_of_its_components_is_refused() {
        let error = find(&["m1/actuator/a1", "m1/sensor/g1", "m2/sensor/g1"]).unwrap_err();
        assert!(error.contains("missing column `m2/actuator/a1`"), "{error}");
    }

    #[test]
    fn a_table_of_something_else_is_refused_with_an_example() {
        let error = find(&["step", "a1", "g1"]).unwrap_err();
        assert!(error.contains("like `m1/actuator/a1`"), "{error}");
    }
}
