//! Treatment of repeated readings.

use serde::{Deserialize, Serialize};

use super::sample_hold::{RepeatCause, RepeatCounts, is_same_reading};
use super::{Recording, Row};
use palpate_numerics::median;

/// Treatment of repeats in every channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RepeatedReadings {
    /// Collapses runs that chance does not explain.
    #[default]
    Auto,
    /// Collapses every run of repeated readings into one row.
    Collapse,
    /// Keeps every row.
    Keep,
}

impl RepeatedReadings {
    /// True by default.
    pub fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
}

/// Repeats in a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Repeats {
    /// Removed rows.
    #[serde(rename = "left_out")]
    pub removed: usize,
    /// Rows in the file.
    pub of: usize,
    /// True for a logger faster than its sensors.
    pub sample_and_hold: bool,
    /// Channels slower than the logger.
    pub slow_channels: Vec<String>,
}

impl Recording {
    /// Treats repeated readings and reports them in the provenance.
    ///
    /// Keeps the first row of a run. Under sample and hold and [`RepeatedReadings::Collapse`], runs continue
    /// through changes of contact, because later rows are outdated.
    #[must_use]
    pub fn treat_repeated_readings(mut self, treatment: RepeatedReadings) -> Self {
        let of = self.rows.len();
        let cause = match treatment {
            RepeatedReadings::Keep => None,
            RepeatedReadings::Collapse => Some(RepeatCause::SampleAndHold),
            RepeatedReadings::Auto => self.repeat_counts().cause(),
        };
        let any_contact = cause == Some(RepeatCause::SampleAndHold);
        if cause.is_some() {
            self.rows.dedup_by(|row, before| {
                is_same_reading(&row.reading, &before.reading)
                    && (any_contact || is_same_contact(row, before))
            });
        }
        let left_out = of - self.rows.len();
        let slow_channels = if treatment.is_auto() { self.slow_channels() } else { Vec::new() };
        self.provenance.rows = self.rows.len();
        if left_out > 0 || !slow_channels.is_empty() || treatment == RepeatedReadings::Keep {
            self.provenance.repeats =
                Some(Repeats { removed: left_out, of, sample_and_hold: any_contact, slow_channels });
        }
        self
    }

    /// Repeats under sample and hold.
    pub(super) fn counted_repeats(&self) -> Option<u64> {
        let counts = self.repeat_counts();
        (counts.cause() == Some(RepeatCause::SampleAndHold)).then(|| counts.repeats())
    }

    fn slow_channels(&self) -> Vec<String> {
        let counts = self.repeat_counts();
        let slow = self.channels.iter().enumerate().filter(|(c, _)| counts.is_slow(*c));
        slow.map(|(_, channel)| channel.clone()).collect()
    }

    fn repeat_counts(&self) -> RepeatCounts {
        let channels = self.channels.len();
        let mut counts = RepeatCounts::new(channels);
        if self.rows.iter().any(|row| row.reading.len() != channels) {
            return counts;
        }
        for c in 0..channels {
            let values = self.rows.iter().map(|row| row.reading[c]);
            // A channel without repeats needs no range.
            if self.rows.windows(2).any(|pair| pair[0].reading[c] == pair[1].reading[c]) {
                counts.set_range(c, values);
            }
        }
        let stretches = Stretches::new(&self.rows);
        for pair in self.rows.windows(2) {
            if stretches.hold_pair(&pair[0], &pair[1]) {
                counts.add(&pair[0].reading, &pair[1].reading);
            } else {
                counts.end_stretch();
            }
        }
        counts
    }
}

fn is_same_contact(a: &Row, b: &Row) -> bool {
    let place = |row: &Row| row.touches().then_some(row.position);
    place(a) == place(b) && a.force_n == b.force_n && a.nuisances == b.nuisances
}

/// Consecutive rows belong to one stretch if they have one place and usual changes of force and nuisance
/// coordinates: at most the median, 0 for nominal forces and the scatter for measured ones.
struct Stretches {
    /// False for a sliding contact: all rows are then one stretch.
    by_place: bool,
    force_n: f64,
    nuisances: Vec<f64>,
}

impl Stretches {
    fn new(rows: &[Row]) -> Self {
        let pairs = || rows.windows(2).map(|pair| (&pair[0], &pair[1])).filter(|(a, b)| is_one_place(a, b));
        let usual = |change: &dyn Fn(&Row, &Row) -> f64| {
            median(pairs().map(|(a, b)| change(a, b)).collect()).unwrap_or_default()
        };
        let nuisances = rows.iter().map(|row| row.nuisances.len()).max().unwrap_or_default();
        Self {
            by_place: pairs().next().is_some(),
            force_n: usual(&force_change),
            nuisances: (0..nuisances).map(|i| usual(&|a, b| nuisance_change(a, b, i))).collect(),
        }
    }

    fn hold_pair(&self, a: &Row, b: &Row) -> bool {
        let usual = |(i, bound): (usize, &f64)| nuisance_change(a, b, i) <= *bound;
        !self.by_place
            || is_one_place(a, b)
                && force_change(a, b) <= self.force_n
                && self.nuisances.iter().enumerate().all(usual)
    }
}

fn is_one_place(a: &Row, b: &Row) -> bool {
    a.touches() == b.touches() && (!a.touches() || a.position == b.position)
}

fn force_change(a: &Row, b: &Row) -> f64 {
    match (a.force_n, b.force_n) {
        (Some(a), Some(b)) => (a - b).abs(),
        _ => 0.0,
    }
}

fn nuisance_change(a: &Row, b: &Row, index: usize) -> f64 {
    match (a.nuisances.get(index), b.nuisances.get(index)) {
        (Some(a), Some(b)) => (a - b).abs(),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests;
