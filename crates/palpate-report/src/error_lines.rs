use super::numbers::mm;
use super::{BandPoint, Chart, Mark, Series};
use palpate_estimators::evaluation::Quantiles;
use palpate_estimators::setup::Setup;
use palpate_mechanics::limit::{Bound, CramerRaoBound, Force, LimitCurve, LimitError};
use palpate_mechanics::sensing::{Layout, NoiseError, Sensor, SensorKind};

/// Noise of a common displacement sensor, as in `examples/paper.toml`: without noise, as in the
/// founding paper, there is no limit.
const ASSUMED_NOISE_M: f64 = 5e-6;
const LABEL: &str = "limit";

/// Median line, optionally with a band from the 5th to the 95th percentile.
pub(super) fn banded(label: &str, colour: usize, along: &[(f64, Quantiles)], with_band: bool) -> Vec<Series> {
    let line = Series::line(label, colour, along.iter().map(|&(x, spread)| (x, spread.median)).collect());
    let band = along.iter().map(|&(x, spread)| BandPoint { x, low: spread.p05, high: spread.p95 });
    let band = with_band.then(|| Series::band("", colour, band.collect()));
    band.into_iter().chain([line]).collect()
}

pub(super) fn tolerance_mark(tolerance_m: f64) -> Mark {
    Mark::HorizontalLine { y: tolerance_m * 1e3, label: format!("tolerance, {} mm", mm(tolerance_m)) }
}

/// Mean error of the best unbiased estimator, in mm. `None` for a surface without a model, sensors
/// without noise, or an unknown force.
pub(super) fn limit_line(setup: &Setup) -> Option<Series> {
    Some(line(&curve(setup, setup.layout()).ok()?, 6, format!("{LABEL}: what physics allows")))
}

/// [`limit_line`], with an assumed noise for deflection sensors without noise.
pub(super) fn limit_line_or_assumed(setup: &Setup) -> Option<Series> {
    let clean = |sensor: &Sensor| sensor.kind == SensorKind::Deflection && sensor.channel.noise_sd == 0.0;
    match curve(setup, setup.layout()) {
        Err(LimitError::Noise(NoiseError::Singular { .. })) if setup.layout().sensors().iter().all(clean) => {
            let mut layout = setup.layout().clone();
            let assume = |sensor: &mut Sensor| sensor.channel.noise_sd = ASSUMED_NOISE_M;
            layout.edit(|sensors| sensors.iter_mut().for_each(assume)).ok()?;
            Some(line(&curve(setup, &layout).ok()?, 6, assumed_label()))
        }
        _ => limit_line(setup),
    }
}

/// Mean error of the best unbiased estimator of an arm, in mm.
pub(super) fn limit_line_of_arm(setup: &Setup, force_n: f64, colour: usize, label: &str) -> Option<Series> {
    let limit = setup.cramer_rao_bound().ok()?;
    let force = setup.force();
    Some(line(&LimitCurve::over_surface(&limit, force_n, force).ok()?, colour, label.to_owned()))
}

pub(super) fn limit_in_words(chart: &Chart) -> String {
    let Some(line) = chart.series.iter().find(|series| series.label.starts_with(LABEL)) else {
        return String::new();
    };
    let mut words = " Dashes without a colour: the limit, which is the mean error of the best unbiased estimator for noisy readings and a \
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

fn curve(setup: &Setup, layout: &Layout) -> Result<LimitCurve, LimitError> {
    let limit = CramerRaoBound::new(setup.surface().model().ok_or(LimitError::NoModel)?, layout)?;
    LimitCurve::over_surface(&limit, setup.force_n().ok_or(LimitError::NoForce)?, Force::Known)
}

fn line(curve: &LimitCurve, colour: usize, label: String) -> Series {
    Series::dashes(label, colour, in_milli(curve.by_x(Bound::mean_error_m)))
}

/// Converts m to mm, N to mN.
pub(super) fn in_milli(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.into_iter().map(|(x, y)| (x * 1e3, y * 1e3)).collect()
}
