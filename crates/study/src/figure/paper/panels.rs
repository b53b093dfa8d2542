//! The panels of a run.

use vocabulary::{ComponentKind, ComponentPath, Step};

use super::story::{FigureChannels, FigureRun, WINDOW_S};
use crate::statistics::first_beyond;
use crate::trace::{ChannelTrace, ModuleTrace};
use figure::plot::{MarkKind, Marker, Panel, PanelMark, PlotAxis, Series, SeriesStyle, Shape};

/// The time range around a fault \[ms\].
const CLOSE_UP_MS: [f64; 2] = [-10.0, 40.0];
/// The axis of divergences begins where this share of them is below, within these bounds.
const QUIET_SHARE: f64 = 0.02;
const LOWEST_RATIO: [f64; 2] = [1e-3, 1e-1];
/// The axis of divergences extends at least to this value, so that the threshold is not at the edge.
const HIGHEST_RATIO: f64 = 3.0;
const THRESHOLD: &str = "threshold";

impl FigureRun {
    /// The demands of the controller, or the readings of the gages.
    pub(super) fn signals(&self, title: impl Into<String>, channels: &FigureChannels) -> Panel {
        let (unit, scale) = unit(channels.kind);
        let quantity = match channels.kind {
            ComponentKind::Actuator => "demand",
            ComponentKind::Sensor => "elongation",
        };
        let series = self.series(channels, |module, index, _| {
            let signals = match channels.kind {
                ComponentKind::Actuator => &module.demands_n,
                ComponentKind::Sensor => &module.elongations_m,
            };
            signals.get(index).map(|values| values.iter().map(|x| scale * x).collect())
        });
        Panel::new(title, time_axis(), PlotAxis::linear(format!("{quantity} [{unit}]")), series)
    }

    /// The residuals.
    pub(super) fn residuals(&self, title: impl Into<String>, channels: &FigureChannels) -> Panel {
        let (unit, scale) = unit(channels.kind);
        let series = self.series(channels, |_, _, channel| {
            Some(channel.residual.iter().map(|x| scale * x).collect())
        });
        Panel::new(title, time_axis(), PlotAxis::linear(format!("residual [{unit}]")), series)
    }

    /// Divergences over their thresholds, with the verdicts.
    pub(super) fn divergences(&self, title: impl Into<String>, channels: &FigureChannels) -> Panel {
        let mut series = self.series(channels, |_, _, channel| Some(ratios(channel)));
        let axis = ratio_axis(&series);
        series.extend(self.verdicts(channels, |step| self.seconds(step)));
        let level = PanelMark::new(MarkKind::Level, 1.0, THRESHOLD);
        let panel = Panel::new(title, time_axis(), axis, series);
        panel.marked([level]).note(self.summary(channels))
    }

    /// Divergences over their thresholds shortly before and after fault number `fault`, counted from 0; time is
    /// relative to the fault.
    pub(super) fn close_up(
        &self,
        title: impl Into<String>,
        channels: &FigureChannels,
        fault: usize,
    ) -> Panel {
        let injection = self.injections.get(fault);
        let onset_s = injection.map_or(0.0, |injection| self.seconds(injection.at));
        // Rounded, so that rounding errors do not exclude the last step.
        let ms = |seconds: f64| (1e6 * (seconds - onset_s)).round() / 1e3;
        let mut series = self.series(channels, |_, _, channel| Some(ratios(channel)));
        for series in &mut series {
            let [from, to] = CLOSE_UP_MS;
            series.points.iter_mut().for_each(|point| point[0] = ms(point[0]));
            series.points.retain(|[x, _]| (from..=to).contains(x));
        }
        let axis = ratio_axis(&series);
        series.extend(self.verdicts(channels, |step| ms(self.seconds(step))));
        let x = PlotAxis::linear("time since the fault [ms]").over(CLOSE_UP_MS);
        let level = PanelMark::new(MarkKind::Level, 1.0, THRESHOLD);
        let marks = injection.map(|injection| self.close_up_marks(channels, injection));
        Panel::new(title, x, axis, series).marked([level]).marked(marks.unwrap_or_default())
    }

    /// One line per channel over the window. The second module's lines are dotted and have the colours of the first's.
    fn series(
        &self,
        channels: &FigureChannels,
        values: impl Fn(&ModuleTrace, usize, &ChannelTrace) -> Option<Vec<f64>>,
    ) -> Vec<Series> {
        let mut all = Vec::new();
        for (number, module) in channels.modules.iter().enumerate() {
            for (index, channel) in module.of_kind(channels.kind).enumerate() {
                let Some(values) = values(module, index, channel) else { continue };
                let path = ComponentPath {
                    module: module.module.clone(),
                    component: channel.component.clone(),
                };
                let stroke = self.stroke(channels, number, index, &path);
                let name = channels.name(&path);
                all.push(Series::new(name, Shape::Line, stroke, self.in_window(&values)));
            }
        }
        all
    }

    fn stroke(
        &self,
        channels: &FigureChannels,
        module: usize,
        index: usize,
        path: &ComponentPath,
    ) -> SeriesStyle {
        let stroke = match (channels.modules.len(), module) {
            (1, _) => SeriesStyle::nth(index),
            (_, 0) => SeriesStyle::nth(index).solid(),
            _ => SeriesStyle::nth(index).dotted(),
        };
        let faulty = self.injections.iter().any(|injection| injection.component == *path);
        if faulty { stroke.emphasised() } else { stroke }
    }

    fn in_window(&self, values: &[f64]) -> Vec<[f64; 2]> {
        let [from, to] = WINDOW_S;
        let points = self.trace.steps.iter().map(|step| self.seconds(*step)).zip(values);
        points.filter(|(time, _)| (from..=to).contains(time)).map(|(time, y)| [time, *y]).collect()
    }

    /// A marker at each change that was named or explained.
    fn verdicts(&self, channels: &FigureChannels, time: impl Fn(Step) -> f64) -> Vec<Series> {
        let of = |named: bool| -> Vec<[f64; 2]> {
            let findings = self
                .findings
                .iter()
                .filter(|found| found.by.is_none() == named && channels.holds(&found.component));
            findings.map(|found| [time(found.detection), found.ratio]).collect()
        };
        let marked = |name, marker, named| {
            let stroke = SeriesStyle { colour: "#000000", marker, ..SeriesStyle::nth(0) };
            Series::new(name, Shape::Dots, stroke, of(named))
        };
        let series =
            [marked("named", Marker::Diamond, true), marked("explained", Marker::Ring, false)];
        series.into_iter().filter(|series| !series.points.is_empty()).collect()
    }
}

/// The display unit for signals of such components, and its factor relative to N or m.
fn unit(kind: ComponentKind) -> (&'static str, f64) {
    match kind {
        ComponentKind::Actuator => ("kN", 1e-3),
        ComponentKind::Sensor => ("µm", 1e6),
    }
}

/// Time in a run.
fn time_axis() -> PlotAxis {
    PlotAxis::linear("time [s]").over(WINDOW_S)
}

/// D/γ.
fn ratios(channel: &ChannelTrace) -> Vec<f64> {
    channel.divergence.iter().map(|divergence| divergence / channel.threshold).collect()
}

/// A logarithmic axis from the level of quiet channels to the peaks.
fn ratio_axis(series: &[Series]) -> PlotAxis {
    let ratios = series.iter().flat_map(|series| series.points.iter().map(|point| point[1]));
    let mut ratios: Vec<f64> = ratios.filter(|ratio| ratio.is_finite() && *ratio > 0.0).collect();
    ratios.sort_by(f64::total_cmp);
    let [lowest, highest] = LOWEST_RATIO;
    let low = first_beyond(&ratios, QUIET_SHARE).unwrap_or(highest).clamp(lowest, highest);
    let high = ratios.last().copied().unwrap_or(1.0).max(HIGHEST_RATIO);
    let decade = 10f64.powf(low.log10().floor());
    PlotAxis::log("D / γ").over([decade, 1.3 * high])
}
