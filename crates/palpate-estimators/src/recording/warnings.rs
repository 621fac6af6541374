//! Warnings about recordings.

use std::fmt;
use std::mem::discriminant;

use super::{Recording, Repeats, Row};
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::units::{Dimension, Quantity};
use palpate_numerics::median;

/// Defect of a usable recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// Removed repeats.
    RepeatsLeftOut(Repeats),
    /// Repeats counted as independent.
    RepeatsCounted {
        /// Repeated rows.
        rows: u64,
        /// All rows.
        of: usize,
    },
    /// Channels slower than the logger.
    SlowChannels {
        /// Channel names.
        channels: Vec<String>,
    },
    /// Constant channel.
    Dead {
        /// Channel name.
        channel: String,
        /// Constant value.
        value: Quantity,
    },
    /// Extreme values in at least a tenth of the rows, at three or more positions.
    Saturated {
        /// Channel name.
        channel: String,
        /// Extreme value.
        at: Quantity,
        /// Rows at this value.
        rows: usize,
        /// All rows.
        of: usize,
    },
    /// Outliers: more than 8 standard deviations, and 1 % of the channel's span, from the median of their
    /// repeats, without drift.
    ///
    /// Repeats have equal position and force. The standard deviation is 1.4826/√2 times the median magnitude
    /// of differences of successive unequal repeats. The drift is a polyline through medians of up to 20
    /// blocks of at least 5 rows, fitted alternately with medians of repeats. After a drift warning, blocks
    /// have 5 rows, contacts and untouched rows may have separate polylines, and limits grow by the change
    /// between knots.
    RepeatsDisagree {
        /// Channel name.
        channel: String,
        /// Outliers.
        rows: usize,
        /// Rows with repeats.
        of: usize,
        /// Worst row, from 1 below the header.
        worst_row: usize,
        /// Worst deviation.
        deviation: Quantity,
        /// Standard deviation of a repeat.
        spread: Quantity,
    },
    /// Drift.
    ///
    /// Sign test of Cox and Stuart (1955), pooled over positions: each repeat of the first half pairs with
    /// one of the second. The difference D of rising and falling pairs has |D| ≥ half of the pairs and |D| ≥
    /// 4·√pairs.
    Drift {
        /// Channel name.
        channel: String,
        /// Drifting rows.
        rows: DriftRows,
        /// Median change of the pairs.
        change: Quantity,
        /// Pairs in this direction.
        agreeing: usize,
        /// All pairs.
        pairs: usize,
    },
    /// No positive force.
    NoPositiveForce {
        /// Least force, in newtons.
        least_n: f64,
    },
    /// Forces of both signs.
    NegativeForces {
        /// Rows with negative force.
        rows: usize,
        /// Touched rows.
        of: usize,
        /// Least force, in newtons.
        least_n: f64,
    },
}

/// Rows with drift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriftRows {
    /// Repeats of contacts.
    Contacts,
    /// Untouched rows.
    Untouched,
    /// Both, if neither alone shows the drift.
    All,
}

/// Greatest number of named channels.
const NAMED_CHANNELS: usize = 4;
const SATURATED_SHARE: f64 = 0.1;
const SATURATED_POSITIONS: usize = 3;
const FAR_OUT_DEVIATIONS: f64 = 8.0;
const FAR_OUT_SPAN: f64 = 0.01;
const MOST_BLOCKS: usize = 20;
const LEAST_BLOCK: usize = 5;
/// With 10, a linear drift over repeats in random order settles to 1 %.
const DRIFT_TURNS: usize = 10;
const DRIFT_SHARE: f64 = 0.5;
const DRIFT_DEVIATIONS: f64 = 4.0;

impl Recording {
    /// Returns the warnings.
    pub fn warnings(&self) -> Vec<Warning> {
        let repeats = self.repeats();
        let channels = (0..self.channels.len()).filter_map(|index| Channel::new(self, index));
        let of_channels = channels.flat_map(|channel| channel.warnings(&repeats));
        self.repeat_warnings().into_iter().chain(of_channels).chain(self.force_warning()).collect()
    }

    /// Returns one line per kind of defect.
    pub fn warning_lines(&self) -> Vec<String> {
        let warnings = self.warnings();
        let mut lines = Vec::new();
        for (i, first) in warnings.iter().enumerate() {
            let alike = |warning: &&Warning| discriminant(*warning) == discriminant(first);
            if warnings[..i].iter().any(|warning| alike(&warning)) {
                continue;
            }
            let group: Vec<&Warning> = warnings[i..].iter().filter(alike).collect();
            let mut line = group_line(&group);
            let numbers_rows = matches!(first, Warning::RepeatsDisagree { .. });
            if numbers_rows && self.provenance.repeats.as_ref().is_some_and(|repeats| repeats.removed > 0) {
                line += " (row numbers without the repeated rows)";
            }
            lines.push(line);
        }
        lines
    }

    fn repeat_warnings(&self) -> Vec<Warning> {
        let Some(repeats) = &self.provenance.repeats else {
            let counted =
                self.counted_repeats().map(|rows| Warning::RepeatsCounted { rows, of: self.rows.len() });
            return counted.into_iter().collect();
        };
        let left_out = (repeats.removed > 0).then(|| Warning::RepeatsLeftOut(repeats.clone()));
        let channels = repeats.slow_channels.clone();
        let slow = (!channels.is_empty()).then_some(Warning::SlowChannels { channels });
        left_out.into_iter().chain(slow).collect()
    }

    fn force_warning(&self) -> Option<Warning> {
        let forces_n: Option<Vec<f64>> = self.rows.iter().map(|row| row.force_n).collect();
        let forces_n = forces_n.filter(|forces_n| !forces_n.is_empty())?;
        let least_n = forces_n.iter().copied().fold(f64::INFINITY, f64::min);
        let rows = forces_n.iter().filter(|force_n| **force_n < 0.0).count();
        let of = forces_n.iter().filter(|force_n| **force_n != 0.0).count();
        match (rows, forces_n.iter().any(|force_n| *force_n > 0.0)) {
            (_, false) => Some(Warning::NoPositiveForce { least_n }),
            (0, true) => None,
            (rows, true) => Some(Warning::NegativeForces { rows, of, least_n }),
        }
    }

    /// Row indices of equal position and force, in order.
    pub(crate) fn repeats(&self) -> Vec<Vec<usize>> {
        let key = |i: &usize| {
            let row: &Row = &self.rows[*i];
            [row.position.x_m, row.position.y_m, row.force_n.unwrap_or(f64::NEG_INFINITY)]
        };
        let mut order: Vec<usize> = (0..self.rows.len()).collect();
        order.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
        let groups = order.chunk_by(|a, b| key(a) == key(b)).filter(|group| group.len() > 1);
        groups.map(<[usize]>::to_vec).collect()
    }
}

struct Channel<'a> {
    recording: &'a Recording,
    index: usize,
    values: Vec<f64>,
    lowest: f64,
    highest: f64,
}

impl<'a> Channel<'a> {
    fn new(recording: &'a Recording, index: usize) -> Option<Self> {
        let values: Option<Vec<f64>> =
            recording.rows.iter().map(|row| row.reading.get(index).copied()).collect();
        let values = values.filter(|values| !values.is_empty())?;
        let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Some(Self { recording, index, values, lowest, highest })
    }

    fn warnings(&self, repeats: &[Vec<usize>]) -> Vec<Warning> {
        if self.lowest == self.highest {
            let dead = Warning::Dead { channel: self.name(), value: self.quantity(self.lowest) };
            return if self.values.len() > 1 { vec![dead] } else { Vec::new() };
        }
        let saturated = [self.lowest, self.highest].into_iter().filter_map(|extreme| self.saturated(extreme));
        let drift = self.drift(repeats);
        saturated.chain(self.repeats_disagree(repeats, drift.as_ref())).chain(drift).collect()
    }

    fn saturated(&self, extreme: f64) -> Option<Warning> {
        let there: Vec<usize> = (0..self.values.len()).filter(|i| self.values[*i] == extreme).collect();
        let (rows, of) = (there.len(), self.values.len());
        let positions = self.recording.subset(&there).distinct_positions().len();
        let much = rows as f64 >= SATURATED_SHARE * of as f64 && positions >= SATURATED_POSITIONS;
        much.then(|| Warning::Saturated { channel: self.name(), at: self.quantity(extreme), rows, of })
    }

    /// A drift with a warning may be fast, so its blocks are short. Contacts and untouched rows share a drift
    /// or have one each, whichever explains more rows.
    fn repeats_disagree(&self, repeats: &[Vec<usize>], drift: Option<&Warning>) -> Option<Warning> {
        if drift.is_none() {
            let driftless = self.without_drift(repeats, MOST_BLOCKS);
            return self
                .outlier_warning(&Driftless { steps: vec![0.0; self.values.len()], ..driftless }, repeats);
        }
        let touches = |group: &Vec<usize>| self.recording.rows[group[0]].touches();
        let (touched, untouched) = repeats.iter().cloned().partition::<Vec<_>, _>(touches);
        let mut apart = self.without_drift(&touched, usize::MAX);
        let of_untouched = self.without_drift(&untouched, usize::MAX);
        for i in untouched.iter().flatten() {
            (apart.values[*i], apart.steps[*i]) = (of_untouched.values[*i], of_untouched.steps[*i]);
        }
        let together = self.without_drift(repeats, usize::MAX);
        let far_off = [apart, together].map(|driftless| self.outlier_warning(&driftless, repeats));
        far_off.into_iter().min_by_key(|warning| warning.as_ref().map_or(0, Warning::extent)).flatten()
    }

    fn outlier_warning(&self, driftless: &Driftless, repeats: &[Vec<usize>]) -> Option<Warning> {
        let Driftless { values, steps: drift_steps } = driftless;
        // Equal repeats of a slow or coarse channel do not show the scatter.
        let pairs = repeats.iter().flat_map(|rows| rows.windows(2));
        let pairs = pairs.filter(|pair| self.values[pair[1]] != self.values[pair[0]]);
        let steps = pairs.map(|pair| (values[pair[1]] - values[pair[0]]).abs()).collect();
        let spread = 1.4826 / std::f64::consts::SQRT_2 * median(steps)?;
        let bound = (FAR_OUT_DEVIATIONS * spread).max(FAR_OUT_SPAN * (self.highest - self.lowest));
        let mut rows = 0;
        let mut worst = (0, 0.0);
        for group in repeats {
            let Some(middle) = median_of(values, group) else { continue };
            for i in group {
                let deviation = values[*i] - middle;
                let is_far_off = deviation.abs() > bound + drift_steps[*i];
                rows += usize::from(is_far_off);
                if is_far_off && deviation.abs() > f64::abs(worst.1) {
                    worst = (*i, deviation);
                }
            }
        }
        (rows > 0).then(|| Warning::RepeatsDisagree {
            channel: self.name(),
            rows,
            of: repeats.iter().map(Vec::len).sum(),
            worst_row: worst.0 + 1,
            deviation: self.quantity(worst.1),
            spread: self.quantity(spread),
        })
    }

    /// Alternates between the drift and the medians of the repeats.
    fn without_drift(&self, repeats: &[Vec<usize>], most_blocks: usize) -> Driftless {
        let mut rows: Vec<usize> = repeats.iter().flatten().copied().collect();
        rows.sort_unstable();
        let blocks = (rows.len() / LEAST_BLOCK).min(most_blocks);
        let mut driftless = Driftless { values: self.values.clone(), steps: vec![0.0; self.values.len()] };
        if blocks < 2 {
            return driftless;
        }
        let Driftless { values, steps } = &mut driftless;
        let mut off = vec![0.0; values.len()];
        for _ in 0..DRIFT_TURNS {
            for group in repeats {
                let middle = median_of(values, group).unwrap_or_default();
                group.iter().for_each(|i| off[*i] = self.values[*i] - middle);
            }
            let knots = rows.chunks(rows.len().div_ceil(blocks)).filter_map(|block| {
                let at = block.iter().sum::<usize>() as f64 / block.len() as f64;
                Some((at, median_of(&off, block)?))
            });
            let knots: Vec<(f64, f64)> = knots.collect();
            for i in &rows {
                let (height, step) = on_polyline(&knots, *i as f64);
                (values[*i], steps[*i]) = (self.values[*i] - height, step);
            }
        }
        driftless
    }

    /// Contacts, else untouched rows, else both.
    fn drift(&self, repeats: &[Vec<usize>]) -> Option<Warning> {
        let rows = &self.recording.rows;
        let is_of = |group: &Vec<usize>, kind: DriftRows| match kind {
            DriftRows::Contacts => rows[group[0]].touches(),
            DriftRows::Untouched => !rows[group[0]].touches(),
            DriftRows::All => true,
        };
        [DriftRows::Contacts, DriftRows::Untouched, DriftRows::All].into_iter().find_map(|kind| {
            let groups = repeats.iter().filter(|group| is_of(group, kind));
            self.drift_of(groups, kind)
        })
    }

    fn drift_of<'g>(
        &self,
        repeats: impl Iterator<Item = &'g Vec<usize>>,
        rows: DriftRows,
    ) -> Option<Warning> {
        let mut changes = Vec::new();
        for rows in repeats {
            let (earlier, later) = (&rows[..rows.len() / 2], &rows[rows.len().div_ceil(2)..]);
            changes.extend(earlier.iter().zip(later).map(|(a, b)| self.values[*b] - self.values[*a]));
        }
        let pairs = changes.len();
        let rising = changes.iter().filter(|change| **change > 0.0).count();
        let falling = changes.iter().filter(|change| **change < 0.0).count();
        let difference = rising.abs_diff(falling) as f64;
        let is_drift = difference >= DRIFT_SHARE * pairs as f64
            && difference >= DRIFT_DEVIATIONS * (pairs as f64).sqrt();
        let change = self.quantity(median(changes)?);
        is_drift.then(|| Warning::Drift {
            channel: self.name(),
            rows,
            change,
            agreeing: rising.max(falling),
            pairs,
        })
    }

    fn name(&self) -> String {
        self.recording.channels[self.index].clone()
    }

    fn quantity(&self, value: f64) -> Quantity {
        let dimension = self.recording.kinds.get(self.index).map_or(Dimension::None, |kind| kind.dimension());
        Quantity { value, dimension }
    }
}

struct Driftless {
    values: Vec<f64>,
    /// Change between adjacent knots, which bounds the polyline's error.
    steps: Vec<f64>,
}

fn median_of(values: &[f64], rows: &[usize]) -> Option<f64> {
    median(rows.iter().map(|i| values[*i]).collect())
}

/// Extrapolated height at `at`, and step height.
fn on_polyline(knots: &[(f64, f64)], at: f64) -> (f64, f64) {
    let piece = knots.partition_point(|(x, _)| *x < at).clamp(1, knots.len() - 1);
    let ((x0, y0), (x1, y1)) = (knots[piece - 1], knots[piece]);
    (y0 + (y1 - y0) * (at - x0) / (x1 - x0), (y1 - y0).abs())
}

impl Warning {
    fn channel(&self) -> Option<&str> {
        match self {
            Self::Dead { channel, .. }
            | Self::Saturated { channel, .. }
            | Self::RepeatsDisagree { channel, .. }
            | Self::Drift { channel, .. } => Some(channel),
            Self::RepeatsLeftOut(_)
            | Self::RepeatsCounted { .. }
            | Self::SlowChannels { .. }
            | Self::NoPositiveForce { .. }
            | Self::NegativeForces { .. } => None,
        }
    }

    fn extent(&self) -> usize {
        match self {
            Self::Saturated { rows, .. } | Self::RepeatsDisagree { rows, .. } => *rows,
            Self::Drift { agreeing, .. } => *agreeing,
            _ => 0,
        }
    }
}

/// Worst warning, then other channels.
fn group_line(group: &[&Warning]) -> String {
    // The first of several warnings with the same extent.
    let Some(worst) = group.iter().rev().max_by_key(|warning| warning.extent()) else { return String::new() };
    let others = group.iter().filter_map(|warning| warning.channel());
    let others: Vec<&str> = others.filter(|channel| Some(*channel) != worst.channel()).collect();
    // A question ends a sentence.
    let (end, channel) = if worst.to_string().ends_with('?') { ("", "Channel") } else { (";", "channel") };
    match others.len() {
        0 => worst.to_string(),
        1 => format!("{worst}{end} {channel} {} too", channel_list(&others)),
        count => format!("{worst}{end} {count} more channels too: {}", channel_list(&others)),
    }
}

pub(crate) fn channel_list(channels: &[impl AsRef<str>]) -> String {
    let named = channels.iter().take(NAMED_CHANNELS).map(|channel| format!("`{}`", channel.as_ref()));
    let named = named.collect::<Vec<_>>().join(", ");
    match channels.len().saturating_sub(NAMED_CHANNELS) {
        0 => named,
        more => format!("{named} and {more} more"),
    }
}

impl fmt::Display for Repeats {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { removed: left_out, of, sample_and_hold, .. } = self;
        let cause = if *sample_and_hold {
            "the logger is faster than its sensors"
        } else {
            "no repeat differs from the row before it"
        };
        write!(
            f,
            "{left_out} of {of} rows repeat the row before them in every channel: {cause}; each reading counts once \
             (`repeated_readings = \"keep\"` in [recording] counts all)"
        )
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RepeatsLeftOut(repeats) => repeats.fmt(f),
            Self::RepeatsCounted { rows, of } => write!(
                f,
                "{rows} of {of} rows repeat the row before them in every channel, and count as independent repeats; \
                 `repeated_readings = \"collapse\"` in [recording] counts each reading once"
            ),
            Self::SlowChannels { channels } => write!(
                f,
                "channels that repeat their value while others change: {}; are their sensors slower than the logger? Record at their rate",
                channel_list(channels)
            ),
            Self::Dead { channel, value } => {
                let value = value.in_full();
                write!(f, "channel `{channel}` reads {value} in every row: is it connected?")
            }
            Self::Saturated { channel, at, rows, of } => {
                let at = at.in_full();
                write!(
                    f,
                    "channel `{channel}` is at {at}, its extreme, in {rows} of {of} rows: does it saturate?"
                )
            }
            Self::RepeatsDisagree { channel, rows, of, worst_row, deviation, spread } => write!(
                f,
                "channel `{channel}` disagrees with its repeats in {rows} of {of} rows, most in row {worst_row}, by {deviation} where \
                 {spread} is usual"
            ),
            Self::Drift { channel, rows, change, agreeing, pairs } => {
                let rows = match rows {
                    DriftRows::Contacts | DriftRows::All => "later repeats",
                    DriftRows::Untouched => "later untouched rows",
                };
                write!(
                    f,
                    "channel `{channel}` drifts: {agreeing} of {pairs} {rows} lie on the same side of the earlier ones, by \
                     {change} in the median"
                )
            }
            Self::NoPositiveForce { least_n: 0.0 } => f.write_str(
                "the force is 0 in every row, so no row has a contact: name another column as `force`, or none if no force was measured",
            ),
            Self::NoPositiveForce { least_n } => write!(
                f,
                "no force is greater than 0, and the least is {} N; a push is positive: change the sign of the column, or name \
                 another one as `force`",
                SensorKind::Reaction.unit().format_si(*least_n)
            ),
            Self::NegativeForces { rows, of, least_n } => write!(
                f,
                "the force is negative in {rows} of {of} presses, down to {} N; a push is positive: check sign and zero of the \
                 force column",
                SensorKind::Reaction.unit().format_si(*least_n)
            ),
        }
    }
}
