//! `trusswatch model`: summarises, draws or exports a structure.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use truss::{Prediction, Structure};
use vocabulary::ModuleName;

use crate::failure::Failure;
use crate::output;
use crate::table::{table, terminal_width};

/// Summarize, draw or export a description of a structure
///
/// Without further options: a table of counts, masses, natural frequencies and modules.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Description of the structure (TOML)
    file: PathBuf,
    /// Only this module: its name, or its number counted from 1
    #[arg(long, value_name = "NAME|NUMBER")]
    module: Option<String>,
    /// How the module is held besides by its own supports
    #[arg(long, value_enum, default_value_t = Held::Elastic, requires = "module")]
    held: Held,
    /// Print the model as JSON: nodes, members, masses, supports, frequencies, static responses
    #[arg(long, conflicts_with = "toml")]
    json: bool,
    /// Print the description written out in full; with --module it is a diagnoser's structure file
    #[arg(long)]
    toml: bool,
    /// Draw the structure into this SVG file (`-` for standard output, then nothing else is printed)
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

/// How a module is held at the nodes that it shares with the rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Held {
    /// By the rest's stiffness, statically condensed: right for its own cylinders in any structure
    Elastic,
    /// Clamped where it stands on earlier modules, as in the paper: for a tower
    Clamped,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let whole = read(&arguments.file)?;
    let structure = match &arguments.module {
        Some(wanted) => local(&whole, wanted, arguments.held, &arguments.file)?,
        None => whole.clone(),
    };
    let mut out = output::stdout();
    if let Some(svg) = &arguments.svg {
        if svg == Path::new("-") {
            writeln!(out, "{}", figure::structure::drawing(&structure))?;
            return Ok(());
        }
        fs::write(svg, figure::structure::drawing(&structure))
            .map_err(|error| Failure::unwritable(svg, error))?;
    }
    let unusable = |e| Failure::input(format!("{}: {e}", arguments.file.display()));
    if arguments.toml {
        write!(out, "{}", structure.to_toml())?;
    } else if arguments.json {
        write!(out, "{}", output::text(&structure.export().map_err(unusable)?)?)?;
    } else {
        write!(out, "{}", structure.summary().map_err(unusable)?)?;
        if arguments.module.is_some() {
            write_predictions(&mut out, &whole.predictions(&structure).map_err(unusable)?)?;
        }
    }
    Ok(out.flush()?)
}

/// How much of each cylinder's effect on each gage the local model predicts.
fn write_predictions(out: &mut impl Write, predictions: &[Prediction]) -> Result<(), Failure> {
    let mut lines = table(&["gage", "cylinder", "effect [µm/kN]", "predicted", ""]);
    for prediction in predictions.iter().filter(|prediction| prediction.matters) {
        let Prediction { gage, module, actuator, whole_m_per_n, .. } = prediction;
        lines.add_row([
            gage.to_string(),
            format!("{module}/{actuator}"),
            format!("{:.3}", 1e9 * whole_m_per_n),
            // Not "-0 %".
            format!("{} %", (100.0 * prediction.share()).round() + 0.0),
            if prediction.is_wrong() { "WARNING: wrong by more than a third" } else { "" }
                .to_owned(),
        ]);
    }
    writeln!(
        out,
        "\nEffects of at least a tenth of a gage's largest, by the local model against the whole structure:"
    )?;
    Ok(writeln!(out, "{}", lines.text(terminal_width()))?)
}

/// Reads a description, or reports all errors in it.
pub(crate) fn read(file: &Path) -> Result<Structure, Failure> {
    let name = file.display();
    let text = fs::read_to_string(file).map_err(|error| Failure::unreadable(file, error))?;
    Structure::from_toml(&text).map_err(|errors| {
        Failure::inputs(errors.iter().map(|error| format!("{name}: {error}")).collect())
    })
}

/// The module with this name or, failing that, this number.
fn local(
    structure: &Structure,
    wanted: &str,
    held: Held,
    file: &Path,
) -> Result<Structure, Failure> {
    let named = || structure.modules.iter().find(|module| module.name.as_str() == wanted);
    let numbered = || structure.modules.get(wanted.parse::<usize>().ok()?.checked_sub(1)?);
    let Some(module) = named().or_else(numbered) else {
        let known: Vec<_> = structure.modules.iter().map(|m| format!("`{}`", m.name)).collect();
        let (known, count) = (known.join(", "), structure.modules.len());
        return Err(Failure::usage(format!(
            "{}: unknown module `{wanted}`: expected {known}, or a number from 1 to {count}",
            file.display()
        )));
    };
    let name: &ModuleName = &module.name;
    let local = match held {
        Held::Elastic => structure.embedded(name),
        Held::Clamped => structure.local(name),
    };
    local.map_err(|e| Failure::input(format!("{}: {e}", file.display())))
}
