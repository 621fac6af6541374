//! The limit as a line among errors: what physics allows, for the eye to compare with.

use super::{Chart, Series, SeriesKind, Stroke};
use crate::bench::Bench;
use crate::limit::{Bound, Force, Limit, LimitCurve, LimitError, LimitPoint};
use crate::sensing::{Layout, NoiseError, Sensor, SensorKind};

/// The founding paper's readings are clean, and without noise there is no limit. Its errors are drawn against the limit of
/// the noise that a plain displacement sensor has, as in `examples/paper.toml`.
const ASSUMED_NOISE_M: f64 = 5e-6;
/// What the line is called in a legend, at the beginning.
const LABEL: &str = "limit";

/// The mean error of the best unbiased estimator along a bench's surface, in mm, dashed in black; `None` where there is
/// none: a surface without a model, clean sensors, a force that is not known.
pub(super) fn limit_line(bench: &Bench) -> Option<Series> {
    Some(line(&curve(bench, &bench.layout).ok()?, format!("{LABEL}: what physics allows")))
}

/// The same; where deflection sensors are clean, for a noise that the legend states.
pub(super) fn limit_line_or_assumed(bench: &Bench) -> Option<Series> {
    let clean = |sensor: &Sensor| sensor.kind == SensorKind::Deflection && sensor.channel.noise_sd == 0.0;
    match curve(bench, &bench.layout) {
        Err(LimitError::Noise(NoiseError::Singular { .. })) if bench.layout.sensors.iter().all(clean) => {
            let mut layout = bench.layout.clone();
            layout.sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = ASSUMED_NOISE_M);
            Some(line(&curve(bench, &layout).ok()?, assumed_label()))
        }
        _ => limit_line(bench),
    }
}

/// The mean error of the best unbiased estimator of an arm, in mm, dashed; `None` where there is none. The locator knows the force,
/// or does not; contacts have `force_n` newtons either way.
pub(super) fn limit_line_of_arm(bench: &Bench, force_n: f64, colour: usize, label: String) -> Option<Series> {
    let limit = Limit::of(bench).ok()?;
    let force = if bench.force_n.is_some() { Force::Known } else { Force::Unknown };
    let curve = LimitCurve::over(&limit, force_n, force).ok()?;
    Some(Series { colour, ..line(&curve, label) })
}

/// What to say of the line in the caption of a chart that has it; else nothing.
pub(super) fn limit_in_words(chart: &Chart) -> String {
    let Some(line) = chart.series.iter().find(|series| series.label.starts_with(LABEL)) else {
        return String::new();
    };
    let mut words = " Black dashes: the limit, which is the mean error of the best unbiased estimator for noisy readings and a \
                     known force (Cramér–Rao bound)."
        .to_owned();
    if line.label == assumed_label() {
        words += " The readings here are clean, so errors may lie below it.";
    }
    words
}

fn assumed_label() -> String {
    format!("{LABEL}: what physics allows at {} µm noise", ASSUMED_NOISE_M * 1e6)
}

fn curve(bench: &Bench, layout: &Layout) -> Result<LimitCurve, LimitError> {
    let limit = Limit::new(bench.surface.model().ok_or(LimitError::NoModel)?, layout)?;
    LimitCurve::over(&limit, bench.force_n.ok_or(LimitError::NoForce)?, Force::Known)
}

fn line(curve: &LimitCurve, label: String) -> Series {
    let points = along(curve, |bound| bound.mean_error_m() * 1e3);
    Series { label, colour: 6, kind: SeriesKind::Line { points, stroke: Stroke::Dashed } }
}

/// A figure of the bound by x in mm, on a plane its mean across the width; a gap where there is no bound.
pub(super) fn along(curve: &LimitCurve, figure: impl Fn(&Bound) -> f64) -> Vec<(f64, f64)> {
    let mut points: Vec<_> = curve.points.iter().collect();
    points.sort_by(|a, b| a.position.x_m.total_cmp(&b.position.x_m));
    let columns = points.chunk_by(|a, b| a.position.x_m == b.position.x_m);
    let mean = |column: &[&LimitPoint]| {
        let figures: Option<Vec<f64>> =
            column.iter().map(|point| point.bound.as_ref().map(&figure)).collect();
        figures.map_or(f64::NAN, |figures| figures.iter().sum::<f64>() / figures.len() as f64)
    };
    columns.map(|column| (column[0].position.x_m * 1e3, mean(column))).collect()
}
