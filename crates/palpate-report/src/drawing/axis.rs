use super::geometry::Rect;
use super::svg::{Anchor, Label, QUIET_INK};
use super::text;

/// Axis of a chart.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// Quantity with its unit: "load position, mm".
    pub label: String,
    /// Ends in either order. `None`, equal or undrawable ends: the padded range of data and marks.
    /// A linear axis then ends on round numbers, and is not padded across zero.
    pub range: Option<(f64, f64)>,
    /// Mapping of values to lengths.
    pub scale: Scale,
    /// Labelled values; a label without room is omitted. `None`: as many round numbers as are
    /// readable.
    pub ticks: Option<Vec<(f64, String)>>,
}

impl Axis {
    /// Linear axis with automatic range and ticks.
    pub fn linear(label: impl Into<String>) -> Self {
        Axis { label: label.into(), ..Axis::default() }
    }

    /// Logarithmic axis with automatic range and ticks.
    pub fn log10(label: impl Into<String>) -> Self {
        Axis { label: label.into(), scale: Scale::Log10, ..Axis::default() }
    }

    /// Sets the range.
    pub fn from_to(self, low: f64, high: f64) -> Self {
        Axis { range: Some((low, high)), ..self }
    }

    /// Sets names instead of numbers.
    pub fn named(self, names: Vec<(f64, String)>) -> Self {
        Axis { ticks: Some(names), ..self }
    }

    /// Sets the ticks.
    pub fn ticks_at(self, values: impl IntoIterator<Item = f64>) -> Self {
        self.named(values.into_iter().map(|value| (value, plain(value))).collect())
    }
}

/// Mapping of values to lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// Equal differences have equal lengths.
    #[default]
    Linear,
    /// Equal ratios have equal lengths.
    Log10,
}

/// Larger magnitudes could overflow.
const LARGEST: f64 = 1e300;
const SMALLEST: f64 = 1e-300;
const PADDING: f64 = 0.04;

/// Range with `low` < `high`, both positive on a logarithmic axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AxisScale {
    pub low: f64,
    pub high: f64,
    pub scale: Scale,
}

impl AxisScale {
    pub fn new(axis: &Axis, values: &[f64]) -> Self {
        let (low, high) = fixed_ends(axis).unwrap_or_else(|| automatic_ends(axis.scale, values));
        AxisScale { low, high, scale: axis.scale }
    }

    /// 0 at the low end, 1 at the high end, limited to ±1e6; `None` for an undrawable value.
    pub fn share(&self, value: f64) -> Option<f64> {
        drawable(self.scale, value).then(|| self.tick_share(value))
    }

    /// Position of a tick; rounded ends may exceed the bounds of data.
    pub fn tick_share(&self, value: f64) -> f64 {
        let share = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Log10 => (value.log10() - self.low.log10()) / (self.high.log10() - self.low.log10()),
        };
        share.clamp(-1e6, 1e6)
    }

    /// [`Self::share`], but non-positive values lie on the low end of a logarithmic axis.
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

/// Smallest of 1, 2 or 5 times a power of ten ≥ `least` > 0.
fn round_step_above(least: f64) -> f64 {
    let decade = 10_f64.powi(least.log10().floor() as i32);
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|m| m * decade)
        .find(|&step| step >= least * (1.0 - 1e-9))
        .unwrap_or(10.0 * decade)
}

const MOST: usize = 11;
/// From fine to coarse, for few decades.
const LOG_MULTIPLES: [&[f64]; 3] = [&[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];

pub(crate) const TICK_SIZE: f64 = 11.5;
pub(crate) const TICK_GAP: f64 = 8.0;
const TICK_DROP: f64 = 16.0;
/// Least distances between neighbouring labels, and between their middles.
pub(crate) const LABEL_GAP: f64 = 14.0;
const LEAST_X_PITCH: f64 = 40.0;
const LEAST_Y_PITCH: f64 = 26.0;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub value: f64,
    pub label: String,
}

/// Ticks of `asked` that fit, or the finest round ones. `fits` must accept a single tick.
pub(crate) fn choose_ticks(
    axis: &AxisScale,
    ticks: Option<&[(f64, String)]>,
    fits: &dyn Fn(&[Tick]) -> bool,
) -> Vec<Tick> {
    match (ticks, axis.scale) {
        (Some(asked), _) => chosen(axis, asked, fits),
        (None, Scale::Linear) => linear(axis, fits),
        (None, Scale::Log10) => logarithmic(axis, fits),
    }
}

/// Grid lines between successive decades of a logarithmic axis.
pub(crate) fn minor_ticks(axis: &AxisScale, ticks: &[Tick]) -> Vec<f64> {
    let decades =
        ticks.len() > 1 && ticks.windows(2).all(|pair| (pair[1].value / pair[0].value - 10.0).abs() < 1e-6);
    if axis.scale == Scale::Linear || !decades {
        return Vec::new();
    }
    multiples_of_decades(axis, &[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], 1)
}

fn chosen(axis: &AxisScale, asked: &[(f64, String)], fits: &dyn Fn(&[Tick]) -> bool) -> Vec<Tick> {
    let on_axis = asked.iter().filter(|(value, _)| is_on_axis(axis, *value));
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

fn multiples_of_decades(axis: &AxisScale, multiples: &[f64], stride: i32) -> Vec<f64> {
    let first = axis.low.log10().floor() as i32;
    let last = axis.high.log10().floor() as i32;
    (first..=last)
        .filter(|decade| decade.rem_euclid(stride) == 0)
        .flat_map(|decade| multiples.iter().map(move |multiple| multiple * 10_f64.powi(decade)))
        .filter(|&value| is_on_axis(axis, value))
        .collect()
}

fn is_on_axis(axis: &AxisScale, value: f64) -> bool {
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

/// Exponent of the first digit; rounded up for a value that prints as the next power.
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

pub(crate) fn rows_fit(axis: &AxisScale, ticks: &[Tick], height: f64) -> bool {
    pairs(axis, ticks).all(|(pitch, _, _)| pitch * height >= LEAST_Y_PITCH)
}

pub(crate) fn columns_fit(axis: &AxisScale, ticks: &[Tick], width: f64) -> bool {
    pairs(axis, ticks).all(|(pitch, before, after)| {
        let labels = text::width(&before.label, TICK_SIZE) / 2.0 + text::width(&after.label, TICK_SIZE) / 2.0;
        pitch * width >= (labels + LABEL_GAP).max(LEAST_X_PITCH)
    })
}

fn pairs<'t>(axis: &AxisScale, ticks: &'t [Tick]) -> impl Iterator<Item = (f64, &'t Tick, &'t Tick)> {
    ticks.windows(2).map(|pair| {
        let pitch = axis.tick_share(pair[1].value) - axis.tick_share(pair[0].value);
        (pitch, &pair[0], &pair[1])
    })
}
