//! Round numbers along an axis, how they are written, and where their labels stand.

use super::chart::Scale;
use super::geometry::Rect;
use super::scale::{AxisScale, round_step_above};
use super::svg::{Anchor, Label, QUIET_INK};
use super::text;

/// Most ticks on one axis.
const MOST: usize = 11;
/// Multiples of a power of ten, from fine to coarse, for a logarithmic axis of few decades.
const LOG_MULTIPLES: [&[f64]; 3] = [&[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];

pub(crate) const TICK_SIZE: f64 = 11.5;
/// From the plot to the labels of the vertical axis.
pub(crate) const TICK_GAP: f64 = 8.0;
/// From the plot down to the middle of the labels of the horizontal axis.
const TICK_DROP: f64 = 16.0;
/// Least distances between neighbouring labels, and between their middles.
pub(crate) const LABEL_GAP: f64 = 14.0;
const LEAST_X_PITCH: f64 = 40.0;
const LEAST_Y_PITCH: f64 = 26.0;

/// A value with a line of the grid and a label.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub value: f64,
    pub label: String,
}

/// The ticks that are asked for where they fit; else the finest round ones that `fits` accepts. `fits` must accept a single tick.
pub(crate) fn choose(
    axis: &AxisScale,
    asked: Option<&[(f64, String)]>,
    fits: &dyn Fn(&[Tick]) -> bool,
) -> Vec<Tick> {
    match (asked, axis.scale) {
        (Some(asked), _) => chosen(axis, asked, fits),
        (None, Scale::Linear) => linear(axis, fits),
        (None, Scale::Log10) => logarithmic(axis, fits),
    }
}

/// Positions of unlabelled grid lines between the decades of a logarithmic axis; none where the ticks are not
/// successive decades.
pub(crate) fn minor(axis: &AxisScale, ticks: &[Tick]) -> Vec<f64> {
    let decades =
        ticks.len() > 1 && ticks.windows(2).all(|pair| (pair[1].value / pair[0].value - 10.0).abs() < 1e-6);
    if axis.scale == Scale::Linear || !decades {
        return Vec::new();
    }
    multiples_of_decades(axis, &[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], 1)
}

/// Those on the axis that leave each other room.
fn chosen(axis: &AxisScale, asked: &[(f64, String)], fits: &dyn Fn(&[Tick]) -> bool) -> Vec<Tick> {
    let on_axis = asked.iter().filter(|(value, _)| within(axis, *value));
    let mut asked: Vec<Tick> =
        on_axis.map(|(value, label)| Tick { value: *value, label: label.clone() }).collect();
    asked.sort_by(|a, b| a.value.total_cmp(&b.value));
    asked.dedup_by(|a, b| a.value == b.value);
    let mut kept: Vec<Tick> = Vec::new();
    for tick in asked {
        kept.push(tick);
        if !fits(&kept) {
            kept.pop();
        }
    }
    kept
}

fn linear(axis: &AxisScale, fits: &dyn Fn(&[Tick]) -> bool) -> Vec<Tick> {
    let mut step = round_step_above((axis.high - axis.low) / (MOST as f64 - 1.0));
    loop {
        let ticks = linear_with_step(axis, step);
        if ticks.len() < 2 || (ticks.len() <= MOST && fits(&ticks)) {
            return ticks;
        }
        step = round_step_above(1.5 * step);
    }
}

fn linear_with_step(axis: &AxisScale, step: f64) -> Vec<Tick> {
    let first = (axis.low / step - 1e-6).ceil();
    let last = (axis.high / step + 1e-6).floor();
    let largest = axis.low.abs().max(axis.high.abs());
    let count = (last - first + 1.0).max(0.0) as usize;
    (0..count)
        .map(|index| (first + index as f64) * step)
        .map(|value| Tick { value, label: linear_label(value, step, largest) })
        .collect()
}

fn logarithmic(axis: &AxisScale, fits: &dyn Fn(&[Tick]) -> bool) -> Vec<Tick> {
    let labelled = |values: Vec<f64>| -> Vec<Tick> {
        values.into_iter().map(|value| Tick { value, label: log_label(value) }).collect()
    };
    let acceptable = |ticks: &Vec<Tick>| ticks.len() <= MOST && fits(ticks);
    let decades = axis.high.log10() - axis.low.log10();
    if decades < 0.7 {
        return linear(axis, fits);
    }
    let finest = if decades > 2.3 { 2 } else { 0 };
    let multiples = LOG_MULTIPLES[finest..].iter().map(|multiples| multiples_of_decades(axis, multiples, 1));
    let strides =
        [2, 3, 5, 10, 20, 50, 100, 200, 500].map(|stride| multiples_of_decades(axis, &[1.0], stride));
    multiples
        .chain(strides)
        .map(labelled)
        .find(acceptable)
        .unwrap_or_else(|| labelled(multiples_of_decades(axis, &[1.0], 1).into_iter().take(1).collect()))
}

/// `multiples` of every `stride`-th power of ten that lie on the axis.
fn multiples_of_decades(axis: &AxisScale, multiples: &[f64], stride: i32) -> Vec<f64> {
    let first = axis.low.log10().floor() as i32;
    let last = axis.high.log10().floor() as i32;
    (first..=last)
        .filter(|decade| decade.rem_euclid(stride) == 0)
        .flat_map(|decade| multiples.iter().map(move |multiple| multiple * 10_f64.powi(decade)))
        .filter(|&value| within(axis, value))
        .collect()
}

fn within(axis: &AxisScale, value: f64) -> bool {
    (-1e-6..=1.0 + 1e-6).contains(&axis.tick_share(value))
}

fn linear_label(value: f64, step: f64, largest: f64) -> String {
    let step_exponent = exponent(step);
    if value.abs() < 1e-6 * step {
        "0".to_owned()
    } else if largest >= 1e7 || step < 1e-5 {
        scientific(value, (exponent(value) - step_exponent).max(0) as usize)
    } else {
        grouped(&format!("{:.*}", (-step_exponent).max(0) as usize, value))
    }
}

fn log_label(value: f64) -> String {
    match exponent(value) {
        shown @ -5..=6 => grouped(&format!("{:.*}", (-shown).max(0) as usize, value)),
        _ => scientific(value, 0),
    }
}

/// A number as a person would write it: at most six digits.
pub(crate) fn plain(value: f64) -> String {
    match exponent(value) {
        _ if value == 0.0 => "0".to_owned(),
        shown @ -5..=6 => {
            let decimals = (5 - shown).max(0) as usize;
            let text = format!("{value:.decimals$}");
            grouped(if decimals == 0 { &text } else { text.trim_end_matches('0').trim_end_matches('.') })
        }
        _ => scientific(value, 5),
    }
}

/// The power of ten of the first digit; rounded up for a value that prints as the next power.
fn exponent(value: f64) -> i32 {
    (value.abs().log10() + 1e-9).floor() as i32
}

fn scientific(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$e}");
    let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
    let mantissa =
        if mantissa.contains('.') { mantissa.trim_end_matches('0').trim_end_matches('.') } else { mantissa };
    format!("{mantissa}e{power}").replace('-', "−")
}

/// A decimal number with a comma between thousands and a true minus sign.
fn grouped(number: &str) -> String {
    let (sign, magnitude) = number.strip_prefix('-').map_or(("", number), |rest| ("−", rest));
    let whole = magnitude.find('.').unwrap_or(magnitude.len());
    let mut text = sign.to_owned();
    for (index, digit) in magnitude.char_indices() {
        if index > 0 && index < whole && (whole - index) % 3 == 0 {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// The labels of both axes of a plot.
pub(crate) fn tick_labels(
    plot: &Rect,
    (x, x_ticks): (&AxisScale, &[Tick]),
    (y, y_ticks): (&AxisScale, &[Tick]),
) -> Vec<Label> {
    let label = |tick: &Tick, at, anchor| Label {
        text: tick.label.clone(),
        at,
        anchor,
        size: TICK_SIZE,
        colour: QUIET_INK,
    };
    let columns = x_ticks.iter().map(|tick| {
        let at = (plot.left + x.tick_share(tick.value) * plot.width(), plot.bottom + TICK_DROP);
        label(tick, at, Anchor::Middle)
    });
    let rows = y_ticks.iter().map(|tick| {
        let at = (plot.left - TICK_GAP, plot.bottom - y.tick_share(tick.value) * plot.height());
        label(tick, at, Anchor::End)
    });
    columns.chain(rows).collect()
}

/// Whether labels above each other leave room between them on an axis of that height.
pub(crate) fn rows_fit(axis: &AxisScale, ticks: &[Tick], height: f64) -> bool {
    pairs(axis, ticks).all(|(pitch, _, _)| pitch * height >= LEAST_Y_PITCH)
}

/// Whether labels beside each other leave room between them on an axis of that width.
pub(crate) fn columns_fit(axis: &AxisScale, ticks: &[Tick], width: f64) -> bool {
    pairs(axis, ticks).all(|(pitch, before, after)| {
        let labels = text::width(&before.label, TICK_SIZE) / 2.0 + text::width(&after.label, TICK_SIZE) / 2.0;
        pitch * width >= (labels + LABEL_GAP).max(LEAST_X_PITCH)
    })
}

/// Neighbouring ticks and how far apart they are as a share of the axis.
fn pairs<'t>(axis: &AxisScale, ticks: &'t [Tick]) -> impl Iterator<Item = (f64, &'t Tick, &'t Tick)> {
    ticks.windows(2).map(|pair| {
        let pitch = axis.tick_share(pair[1].value) - axis.tick_share(pair[0].value);
        (pitch, &pair[0], &pair[1])
    })
}
