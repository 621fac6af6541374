//! From values to shares of an axis.

use super::chart::{Axis, Chart, Mark, Scale, SeriesKind};

/// Largest magnitude that is drawn; beyond it a range could overflow.
const LARGEST: f64 = 1e300;
/// Smallest value drawn on a logarithmic axis.
const SMALLEST: f64 = 1e-300;
/// Share of the range that an automatic axis leaves free at each end.
const PADDING: f64 = 0.04;

/// An axis with its ends settled: `low` < `high`, and both positive on a logarithmic axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AxisScale {
    pub low: f64,
    pub high: f64,
    pub scale: Scale,
}

impl AxisScale {
    /// The ends that the axis asks for, or those that its values need.
    pub fn new(axis: &Axis, values: &[f64]) -> Self {
        let (low, high) = fixed_ends(axis).unwrap_or_else(|| automatic_ends(axis.scale, values));
        AxisScale { low, high, scale: axis.scale }
    }

    /// Where a value of the data lies: 0 at the low end, 1 at the high end, outside them beyond (held within
    /// ±1e6). `None` where the scale cannot show it.
    pub fn share(&self, value: f64) -> Option<f64> {
        drawable(self.scale, value).then(|| self.tick_share(value))
    }

    /// As [`AxisScale::share`] for a value on the axis itself, whose rounded ends may exceed what data may be.
    pub fn tick_share(&self, value: f64) -> f64 {
        let share = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log10 => (value.log10() - self.low.log10()) / (self.high.log10() - self.low.log10()),
        };
        share.clamp(-1e6, 1e6)
    }

    /// As [`AxisScale::share`], but a finite value that is not positive lies on the low end of a logarithmic axis.
    pub fn share_or_low_end(&self, value: f64) -> Option<f64> {
        match self.scale {
            Scale::Log10 if value <= 0.0 && value.is_finite() => Some(0.0),
            _ => self.share(value),
        }
    }
}

fn drawable(scale: Scale, value: f64) -> bool {
    match scale {
        Scale::Linear => value.abs() <= LARGEST,
        Scale::Log10 => (SMALLEST..=LARGEST).contains(&value),
    }
}

fn fixed_ends(axis: &Axis) -> Option<(f64, f64)> {
    let (low, high) = axis.range?;
    let (low, high) = (low.min(high), low.max(high));
    let usable = drawable(axis.scale, low) && drawable(axis.scale, high) && !too_narrow(low, high);
    usable.then_some((low, high))
}

/// Whether neighbouring ticks between the two could not be told apart.
fn too_narrow(low: f64, high: f64) -> bool {
    high - low <= 1e-9 * low.abs().max(high.abs()) || high - low < SMALLEST
}

fn automatic_ends(scale: Scale, values: &[f64]) -> (f64, f64) {
    let shown = || values.iter().copied().filter(|&value| drawable(scale, value));
    let (low, high) = (shown().fold(f64::INFINITY, f64::min), shown().fold(f64::NEG_INFINITY, f64::max));
    match scale {
        Scale::Linear if low > high => (0.0, 1.0),
        Scale::Linear => linear_ends(low, high),
        Scale::Log10 if low > high => (1.0, 10.0),
        Scale::Log10 => log_ends(low, high),
    }
}

fn linear_ends(low: f64, high: f64) -> (f64, f64) {
    if too_narrow(low, high) {
        let middle = low / 2.0 + high / 2.0;
        let margin = if middle.abs() < SMALLEST { 1.0 } else { 0.1 * middle.abs() };
        return (middle - margin, middle + margin);
    }
    let span = high - low;
    let step = round_step_above(span / 20.0);
    let padded_low = ((low - PADDING * span) / step).floor() * step;
    let padded_high = ((high + PADDING * span) / step).ceil() * step;
    (
        if low >= 0.0 { padded_low.max(0.0) } else { padded_low },
        if high <= 0.0 { padded_high.min(0.0) } else { padded_high },
    )
}

fn log_ends(low: f64, high: f64) -> (f64, f64) {
    let factor = (high / low).powf(PADDING).max(if high / low < 1.5 { 3.0 } else { 1.0 });
    ((low / factor).max(SMALLEST), (high * factor).min(LARGEST))
}

/// The smallest of 1, 2 or 5 times a power of ten that is at least `least` (which is positive).
pub(crate) fn round_step_above(least: f64) -> f64 {
    let decade = 10_f64.powi(least.log10().floor() as i32);
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|m| m * decade)
        .find(|&step| step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

/// Every x and every y that the chart's data and marks name.
pub(crate) fn values(chart: &Chart) -> (Vec<f64>, Vec<f64>) {
    let (mut xs, mut ys) = (Vec::new(), Vec::new());
    for series in &chart.series {
        match &series.kind {
            SeriesKind::Line { points, .. } | SeriesKind::Points { points, .. } => {
                for &(x, y) in points.iter().filter(|(x, y)| x.is_finite() && y.is_finite()) {
                    xs.push(x);
                    ys.push(y);
                }
            }
            SeriesKind::Band { points } => {
                xs.extend(points.iter().map(|point| point.x));
                ys.extend(points.iter().flat_map(|point| [point.low, point.high]));
            }
            SeriesKind::ErrorBars { points, .. } => {
                xs.extend(points.iter().map(|point| point.x));
                ys.extend(points.iter().flat_map(|point| [point.low, point.y, point.high]));
            }
        }
    }
    for mark in &chart.marks {
        match mark {
            Mark::VerticalLine { x, .. } => xs.push(*x),
            Mark::HorizontalLine { y, .. } => ys.push(*y),
            Mark::Span { low, high, .. } => xs.extend([*low, *high]),
        }
    }
    (xs, ys)
}
