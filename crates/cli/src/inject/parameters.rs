//! A fault and its size from the command line.

use std::sync::LazyLock;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, value_parser};
use vocabulary::fault::{Fault, FaultKind, FaultParameter};

/// The parameters of all faults, each with its option: `--offset-m` for `offset_m`.
static OPTIONS: LazyLock<Vec<(FaultParameter, String)>> = LazyLock::new(|| {
    let mut options: Vec<(FaultParameter, String)> = Vec::new();
    for parameter in FaultKind::ALL.iter().flat_map(|kind| kind.parameters()) {
        if options.iter().all(|(known, _)| known.name != parameter.name) {
            options.push((*parameter, parameter.name.replace('_', "-")));
        }
    }
    options
});

/// The parameters that are given, by their names; each fault has its own among them.
#[derive(Debug, Clone, Default)]
pub(super) struct FaultParameters(Vec<(&'static str, f64)>);

impl Args for FaultParameters {
    fn augment_args(command: Command) -> Command {
        command.args(OPTIONS.iter().map(|(parameter, option)| {
            Arg::new(parameter.name)
                .long(option.as_str())
                .help(parameter.help.trim_end_matches('.'))
                .help_heading("Size of the fault")
                .value_name("NUMBER")
                .value_parser(value_parser!(f64))
                .allow_hyphen_values(true)
        }))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for FaultParameters {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = |name| matches.get_one::<f64>(name).map(|number| (name, *number));
        Ok(Self(OPTIONS.iter().filter_map(|(parameter, _)| given(parameter.name)).collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Reads the name of a fault; the help says what each is and what it needs.
pub(super) fn kinds() -> impl TypedValueParser<Value = FaultKind> {
    let value = |kind: FaultKind| {
        let brief = kind.help().split(". ").next().unwrap_or_default().trim_end_matches('.');
        let options: Vec<String> = kind.parameters().iter().map(|one| option(one.name)).collect();
        let help = match &options[..] {
            [] => brief.to_owned(),
            options => format!("{brief} ({})", options.join(", ")),
        };
        PossibleValue::new(kind.as_str()).help(help)
    };
    PossibleValuesParser::new(FaultKind::ALL.map(value))
        .try_map(|name| FaultKind::named(&name).ok_or_else(|| format!("unknown fault `{name}`")))
}

impl FaultParameters {
    /// The fault of this kind with these parameters, or none without a kind.
    pub(super) fn fault(&self, kind: Option<FaultKind>) -> Result<Option<Fault>, String> {
        let what = kind.map_or("a repair".to_owned(), |kind| format!("`{kind}`"));
        let needed = kind.map_or(&[][..], FaultKind::parameters);
        for (name, _) in &self.0 {
            if needed.iter().all(|parameter| parameter.name != *name) {
                return Err(format!("{what} takes no {}", option(name)));
            }
        }
        let number = |name| self.0.iter().find(|(given, _)| *given == name).map(|given| given.1);
        if let Some(missing) = needed.iter().find(|parameter| number(parameter.name).is_none()) {
            return Err(format!("{what} needs {}", option(missing.name)));
        }
        // What is missing would not be a number.
        let fault = kind.map(|kind| Fault::new(kind, |name| number(name).unwrap_or(f64::NAN)));
        fault.map_or(Ok(()), |fault| fault.check()).map_err(|error| error.to_string())?;
        Ok(fault)
    }
}

fn option(name: &str) -> String {
    format!("--{}", name.replace('_', "-"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_takes_its_own_parameters_and_no_others() {
        // Times are longer than areas are wide.
        let number = |name: &'static str| (name, if name.ends_with("_s") { 1e-3 } else { 1e-5 });
        let given = OPTIONS.iter().map(|(parameter, _)| number(parameter.name));
        let given = FaultParameters(given.collect());
        for kind in FaultKind::ALL {
            let names = kind.parameters().iter().map(|parameter| parameter.name);
            let own = FaultParameters(names.clone().map(number).collect());
            assert_eq!(own.fault(Some(kind)).unwrap().map(|fault| fault.kind()), Some(kind));
            let problem = given.fault(Some(kind)).unwrap_err();
            assert!(problem.contains("takes no --"), "{problem}");
            if let Some(first) = { names }.next() {
                let problem = FaultParameters::default().fault(Some(kind)).unwrap_err();
                assert_eq!(problem, format!("`{kind}` needs {}", option(first)));
            }
        }
        assert_eq!(FaultParameters::default().fault(None), Ok(None));
        assert!(given.fault(None).unwrap_err().contains("a repair takes no --area-m2"));
    }

    #[test]
    fn a_size_out_of_range_is_named() {
        let problem =
            FaultParameters(vec![("offset_m", 7.0)]).fault(Some(FaultKind::Bias)).unwrap_err();
        assert!(problem.contains("offset_m") && problem.contains("±1 m"), "{problem}");
        let problem =
            FaultParameters(vec![("gain", 0.0)]).fault(Some(FaultKind::Gain)).unwrap_err();
        assert!(problem.contains("`gain`") && problem.contains("`zero_output`"), "{problem}");
    }
}
