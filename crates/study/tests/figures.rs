//! Figures: well-formed, faithful to the run, the same for the same input.

use crate::tower;
use figure::plot::{
    Figure, MarkKind, Panel, PanelMark, PanelRow, PlotAxis, Series, SeriesStyle, Shape,
};
use roxmltree::{Document, Node};
use study::StudyError;
use study::figure::{figure4, figure5, figure6, limits_figure, power_figure};
use study::limits::{LimitCurve, LimitDetector, LimitPoint, Reached, SizedKind, Within};
use study::scenarios::{ScenarioCampaign, ScenarioRanges};
use study::share_interval;
use truss::Structure;

/// A seed with which the second module, too, changes after a hard-over.
const SEED: u64 = 12;
/// Largest size that a figure may have \[bytes\].
const LARGEST: usize = 400_000;

fn campaign() -> ScenarioCampaign {
    tower::scenarios(tower::system(0.1, 1), ScenarioRanges::default())
}

fn all_of(figure: impl Fn(&ScenarioCampaign, u64) -> Result<String, StudyError>) -> String {
    figure(&campaign(), SEED).unwrap()
}

fn number(node: Node, attribute: &str) -> f64 {
    node.attribute(attribute).unwrap().parse().unwrap()
}

fn texts<'a>(document: &'a Document) -> Vec<(&'a str, Node<'a, 'a>)> {
    let texts = document.descendants().filter(|node| node.has_tag_name("text"));
    texts.filter_map(|node| Some((node.text()?.trim(), node))).collect()
}

/// Corners of a line drawn as steps from point to point.
fn corners(path: Node) -> Vec<[f64; 2]> {
    let data = path.attribute("d").unwrap().replace('-', " -").replace(['M', 'l'], " ");
    let numbers: Vec<f64> = data.split_whitespace().map(|x| x.parse().unwrap()).collect();
    let mut here = [0.0; 2];
    let steps = numbers.chunks_exact(2).map(|step| {
        here = [here[0] + step[0], here[1] + step[1]];
        here
    });
    steps.collect()
}

fn plain(panel: Panel) -> String {
    let rows = vec![PanelRow::new(100.0, vec![panel])];
    let words = || "a < b & \"c\"".to_owned();
    Figure { title: words(), subtitle: words(), description: words(), rows }.svg()
}

/// Of ten runs of each size.
fn curve(kind: SizedKind, found: &[(f64, u64, Option<f64>)]) -> LimitCurve {
    let points = found.iter().map(|&(size, count, median_delay_ms)| {
        let share_95 = share_interval(count, 10);
        let right = Reached { count, share_95, median_delay_ms, within_s: None };
        LimitPoint { size, runs: 10, found: right, right }
    });
    let sure = found.iter().filter(|(_, count, _)| *count == 10);
    LimitCurve {
        weather: "none".to_owned(),
        detector: LimitDetector::Isolation,
        kind,
        unit: kind.unit(),
        points: points.collect(),
        found: Vec::new(),
        right: sure.map(|&(size, ..)| Within { within_s: 1.0, size }).collect(),
    }
}

#[test]
fn the_papers_figures_are_well_formed_described_and_not_too_large() {
    for svg in [all_of(figure4), all_of(figure5), all_of(figure6)] {
        let document = Document::parse(&svg).unwrap();
        let root = document.root_element();
        assert_eq!(root.tag_name().name(), "svg");
        for child in ["title", "desc"] {
            let child = root.children().find(|node| node.has_tag_name(child)).unwrap();
            assert!(child.text().unwrap().contains("module1"));
        }
        assert!(svg.len() < LARGEST, "{} bytes", svg.len());
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        // Several figures share a page: nothing in them may carry an identifier.
        assert!(document.descendants().all(|node| node.attribute("id").is_none()));
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    assert_eq!(all_of(figure4), all_of(figure4));
    assert_ne!(all_of(figure4), figure4(&campaign(), SEED + 1).unwrap());
}

#[test]
fn the_onset_stands_where_the_axis_says_10_8() {
    let svg = all_of(figure5);
    let document = Document::parse(&svg).unwrap();
    let texts = texts(&document);
    let tick = texts.iter().find(|(words, _)| *words == "10.8").unwrap().1;
    let mut onsets = document.descendants().filter(|node| node.attribute("class") == Some("onset"));
    let onset = onsets.next().unwrap();
    assert_eq!(number(onset, "x1"), number(tick, "x"));
    assert_eq!(number(onset, "x1"), number(onset, "x2"));
    let label = texts.iter().find(|(words, _)| words.contains("external leakage")).unwrap().1;
    assert!(number(label, "x") < number(onset, "x1"));
}

#[test]
fn a_hard_over_is_named_and_explains_what_the_neighbour_sees() {
    let svg = all_of(figure6);
    let document = Document::parse(&svg).unwrap();
    let texts = texts(&document);
    let says = |what: &str| texts.iter().any(|(words, _)| words.starts_with(what));
    assert!(says("a3 named after"));
    assert!(says("explained by module1/actuator/a3"));
}

#[test]
fn a_structure_without_the_component_is_refused_with_its_position() {
    let text = include_str!("../../../configs/small.toml");
    let mut small = campaign();
    small.system.structure = Structure::from_toml(text).unwrap();
    let mut bare = campaign();
    bare.system.structure.modules[0].gages.truncate(4);
    let mut alone = campaign();
    alone.system.structure.modules.truncate(1);
    let message = |figure: Result<String, StudyError>| figure.unwrap_err().to_string();
    assert!(message(figure4(&bare, 1)).contains("gage 5 of equipped module 1"));
    assert!(message(figure6(&small, 1)).contains("actuator 3 of equipped module 1"));
    assert!(message(figure6(&alone, 1)).contains("equipped module 2"));
}

#[test]
fn a_single_peak_among_many_values_reaches_its_height() {
    let height = |i: u32| if i == 61_234 { 10.0 } else { 1.0 + f64::from(i % 7) };
    let points = (0..100_000).map(|i| [f64::from(i), height(i)]).collect();
    let series = Series::new("", Shape::Line, SeriesStyle::nth(0), points);
    let axes = [PlotAxis::linear("x"), PlotAxis::linear("y").over([0.0, 10.0])];
    let [x, y] = axes;
    let svg = plain(Panel::new("peak", x, y, vec![series]));
    let document = Document::parse(&svg).unwrap();
    let path = document.descendants().find(|node| node.has_tag_name("path")).unwrap();
    let frame = document.descendants().filter(|node| node.has_tag_name("rect")).nth(1).unwrap();
    let corners = corners(path);
    let top = corners.iter().map(|corner| corner[1]).fold(f64::MAX, f64::min);
    assert!((top - number(frame, "y")).abs() < 0.11, "{top}");
    assert!(corners.len() < 2000, "{}", corners.len());
}

#[test]
fn values_without_a_place_break_a_line_and_draw_nothing() {
    let points = vec![[0.0, 1.0], [1.0, 2.0], [2.0, f64::NAN], [3.0, -1.0], [4.0, 3.0], [5.0, 1.0]];
    let series = Series::new("", Shape::Line, SeriesStyle::nth(0), points);
    let svg = plain(Panel::new("gap", PlotAxis::linear("x"), PlotAxis::log("y"), vec![series]));
    let document = Document::parse(&svg).unwrap();
    let path = document.descendants().find(|node| node.has_tag_name("path")).unwrap();
    assert_eq!(path.attribute("d").unwrap().matches('M').count(), 2);
    assert!(!svg.contains("NaN"));
}

#[test]
fn dots_stand_beside_a_named_level() {
    let points = vec![[0.0, 3.0], [1.0, 5.0], [2.0, 4.0]];
    let series = Series::new("", Shape::Dots, SeriesStyle::nth(0), points);
    let series = series.spread(vec![[2.0, 4.0], [4.5, 5.5], [3.0, 6.0]]);
    let level = PanelMark::new(MarkKind::Level, 4.5, "limit");
    let panel = Panel::new("delays", PlotAxis::linear("run"), PlotAxis::linear("ms"), vec![series]);
    let svg = plain(panel.marked([level]));
    let document = Document::parse(&svg).unwrap();
    assert!(texts(&document).iter().any(|(words, _)| *words == "limit"));
    let dots = document.descendants().filter(|node| node.has_tag_name("circle"));
    assert_eq!(dots.count(), 3);
}

#[test]
fn power_curves_are_drawn_with_what_there_is_of_them() {
    let full = curve(
        SizedKind::BiasInNoise,
        &[(1.0, 1, None), (10.0, 7, Some(4.0)), (100.0, 10, Some(0.0))],
    );
    let blind = curve(SizedKind::WalkInNoise, &[(1.0, 0, None), (10.0, 0, None)]);
    let single = curve(SizedKind::LeakInNoise, &[(2.0, 10, Some(1.0))]);
    let empty = curve(SizedKind::DriftInNoise, &[]);
    for curves in [vec![], vec![full.clone()], vec![full, blind, single, empty]] {
        let svg = power_figure(&curves);
        let document = Document::parse(&svg).unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        let texts = texts(&document);
        for curve in &curves {
            assert!(texts.iter().any(|(words, _)| words.ends_with(curve.kind.title())));
        }
        assert_eq!(texts.iter().any(|(words, _)| *words == "100 gage noise"), !curves.is_empty());
    }
}

#[test]
fn limits_are_drawn_by_weather_and_detector_with_what_there_is_of_them() {
    let within = [(0.002, 5.0), (0.02, 2.0)].map(|(within_s, size)| Within { within_s, size });
    let curve = |detector, kind: SizedKind, found: &[Within]| LimitCurve {
        weather: "alike".to_owned(),
        detector,
        kind,
        unit: kind.unit(),
        points: Vec::new(),
        found: found.to_vec(),
        right: Vec::new(),
    };
    let limits = vec![
        curve(LimitDetector::Change, SizedKind::Bias, &within),
        curve(LimitDetector::Reference, SizedKind::Bias, &[]),
    ];
    for curves in [vec![], limits] {
        let svg = limits_figure(&curves);
        let document = Document::parse(&svg).unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf") && svg.len() < LARGEST);
        let texts = texts(&document);
        let says = |wanted: &str| texts.iter().filter(|(words, _)| *words == wanted).count();
        assert_eq!((says("(a) bias, found"), says("(b) bias, right")), (1, 1));
        assert_eq!((says("(d) external leakage, found"), says("time [s]")), (1, 1));
        // in the panels of what is found and of what is right
        let drawn = 2 * usize::from(!curves.is_empty());
        assert_eq!((says("change, alike"), says("reference, alike")), (drawn, drawn));
        let lines = document.descendants().filter(|node| node.has_tag_name("path")).count();
        assert_eq!(lines, drawn / 2, "one curve has points");
        assert_eq!(
            svg.contains("bias, change, weather alike: 2 µε found within 0.02 s"),
            drawn > 0
        );
    }
}
