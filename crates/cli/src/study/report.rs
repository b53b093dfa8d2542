//! The figures of a campaign, and the report that shows everything on one page.

use std::path::Path;

use study::Campaign;
use study::figure::{figure4, figure5, figure6};
use study::report::{Report, ReportFigure, ReportTable, html};

use super::files::write;
use super::runs::unusable;
use super::tables::Titled;
use crate::failure::Failure;

/// Draws the figures, and writes them and the report into the campaign's directory.
pub(super) fn leave(
    directory: &Path,
    heading: &str,
    campaign: &Campaign,
    tables: &[Titled],
) -> Result<(), Failure> {
    let figures = paper_figures(campaign)?;
    for figure in &figures {
        write(&directory.join(format!("{}.svg", figure.name)), &figure.svg)?;
    }
    let report = Report {
        title: "trusswatch: a study".to_owned(),
        paragraphs: vec![heading.to_owned()],
        tables: tables.iter().map(report_table).collect(),
        figures: figures
            .into_iter()
            .map(|figure| ReportFigure { caption: figure.caption, svg: figure.svg })
            .collect(),
    };
    write(&directory.join("report.html"), html(&report))
}

/// A figure, and the name of its file.
struct Named {
    name: &'static str,
    caption: String,
    svg: String,
}

/// The paper's figures, on this campaign's diagnosers and its seed's tower.
fn paper_figures(campaign: &Campaign) -> Result<Vec<Named>, Failure> {
    let seed = campaign.seed;
    let named = |name, caption: &str, svg: Result<String, study::StudyError>| {
        let svg = svg.map_err(|error| unusable(&error))?;
        Ok::<_, Failure>(Named { name, caption: caption.to_owned(), svg })
    };
    Ok(vec![
        named(
            "figure4",
            "A random walk and a bias in two gages of one module (Fig. 4 of the paper)",
            figure4(campaign, seed),
        )?,
        named(
            "figure5",
            "An external leakage of one cylinder (Fig. 5 of the paper)",
            figure5(campaign, seed),
        )?,
        named(
            "figure6",
            "A valve that stands open: the neighbour changes too, and its change is explained \
             (Fig. 6 of the paper)",
            figure6(campaign, seed),
        )?,
    ])
}

fn report_table(titled: &Titled) -> ReportTable {
    ReportTable {
        title: titled.title.to_owned(),
        note: titled.note.clone(),
        heading: titled.heading.iter().map(ToString::to_string).collect(),
        rows: titled.rows.clone(),
    }
}
