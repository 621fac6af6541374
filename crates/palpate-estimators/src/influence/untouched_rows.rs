//! Offsets of a surface with a model by the untouched rows: their mean, or with a drift the interpolation in
//! time between rests.
//!
//! With the weights a and b of two rests of n and m rows, a reading minus that offset has the variance
//! σ²·(1 + a²/n + b²/m).

use crate::offset_course::OffsetCourse;
use crate::recording::{Recording, Row};
use crate::untouched_drift::UntouchedDrift;
use palpate_numerics::mean;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct UntouchedRows {
    pub mean: Vec<f64>,
    pub count: f64,
    /// Squared deviations about the mean of the rest, or of all rows without a drift.
    pub scatter: Vec<f64>,
    pub freedom: f64,
    /// Empty without a drift.
    untouched: Vec<UntouchedMean>,
}

#[derive(Clone, Debug, PartialEq)]
struct UntouchedMean {
    time: f64,
    mean: Vec<f64>,
    count: f64,
}

/// Offset of a row, with its variance relative to that of the noise.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RowOffset {
    pub values: Vec<f64>,
    pub relative_variance: f64,
}

impl UntouchedRows {
    pub fn of_recording(recording: &Recording) -> Option<Self> {
        let mean = recording.untouched_mean()?;
        let untouched = recording.untouched_groups();
        let drifts = UntouchedDrift::of_recording(recording).is_some();
        let times = recording.times_or_order();
        let mean_of = |rows: &Vec<usize>| UntouchedMean {
            time: self::mean(rows.iter().map(|row| times[*row])),
            mean: recording.mean_reading(rows),
            count: rows.len() as f64,
        };
        let all: Vec<Vec<usize>> = if drifts { untouched.clone() } else { vec![untouched.concat()] };
        let means: Vec<Vec<f64>> = all.iter().map(|rows| recording.mean_reading(rows)).collect();
        let scatter = |c: usize| -> f64 {
            let of_group = |(rows, mean): (&Vec<usize>, &Vec<f64>)| -> f64 {
                rows.iter().map(|row| (recording.rows[*row].reading[c] - mean[c]).powi(2)).sum()
            };
            all.iter().zip(&means).map(of_group).sum()
        };
        let count: usize = untouched.iter().map(Vec::len).sum();
        Some(Self {
            scatter: (0..recording.channels.len()).map(scatter).collect(),
            freedom: (count - all.len()) as f64,
            count: count as f64,
            untouched: if drifts { untouched.iter().map(mean_of).collect() } else { Vec::new() },
            mean,
        })
    }

    pub fn drifts(&self) -> bool {
        !self.untouched.is_empty()
    }

    pub fn offset_at(&self, time: f64) -> RowOffset {
        let after = self.untouched.partition_point(|mean| mean.time <= time);
        let of_rest = |mean: &UntouchedMean| RowOffset {
            values: mean.mean.clone(),
            relative_variance: mean.count.recip(),
        };
        match (after.checked_sub(1).and_then(|i| self.untouched.get(i)), self.untouched.get(after)) {
            (None, None) => RowOffset { values: self.mean.clone(), relative_variance: self.count.recip() },
            (Some(only), None) | (None, Some(only)) => of_rest(only),
            (Some(before), Some(after)) => {
                let b = (time - before.time) / (after.time - before.time);
                let a = 1.0 - b;
                let pairs = before.mean.iter().zip(&after.mean);
                RowOffset {
                    values: pairs.map(|(before, after)| a * before + b * after).collect(),
                    relative_variance: a * a / before.count + b * b / after.count,
                }
            }
        }
    }

    /// Returns the touched rows minus their offsets, each with its index and the relative variance of the reading.
    ///
    /// Without a drift, the learning accounts for the common error of the mean.
    pub fn tared_rows(&self, recording: &Recording) -> Vec<(usize, Row, f64)> {
        let times = recording.times_or_order();
        let rows = recording.rows.iter().zip(times).enumerate().filter(|(_, (row, _))| row.touches());
        rows.map(|(i, (row, time))| {
            let RowOffset { values, relative_variance } = self.offset_at(time);
            let mut row = row.clone();
            row.reading.iter_mut().zip(values).for_each(|(value, offset)| *value -= offset);
            (i, row, 1.0 + if self.drifts() { relative_variance } else { 0.0 })
        })
        .collect()
    }
}

/// Offsets at the rows of `asked`; `None` without a drift or without times.
pub(super) fn offset_course(recording: &Recording, asked: &Recording) -> Option<OffsetCourse> {
    let untouched = UntouchedRows::of_recording(recording).filter(UntouchedRows::drifts)?;
    recording.times_s()?;
    let at_rows: Vec<Vec<f64>> =
        asked.times_s()?.into_iter().map(|time_s| untouched.offset_at(time_s).values).collect();
    let column = |c: usize| at_rows.iter().map(|values| values[c]).collect();
    Some(OffsetCourse {
        at_rows: (0..untouched.mean.len()).map(|c| Some(column(c))).collect(),
        means: untouched.mean.iter().copied().map(Some).collect(),
    })
}
