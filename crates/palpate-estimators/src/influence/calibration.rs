//! Calibration rows: rows of one place and force, averaged.

use crate::recording::{LEAST_FREEDOM, Recording, is_same_force};
use crate::setup::Setup;
use crate::thinning::thinned;
use ndarray::{Array2, Axis as Dimension, aview1};
use palpate_mechanics::contact::Position;
use palpate_numerics::{mean, mean_and_variance};
use std::cmp::Ordering;
use std::sync::Arc;

/// Rows that are averaged, and the order of their means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Averaging {
    /// Consecutive rows, with little drift between them.
    Consecutive,
    /// All rows of one place and force, by place, then force.
    ByPlace,
    /// All rows of one place and force, by their first row.
    ByFirstRow,
}

/// Row of a recording.
#[derive(Clone, Debug)]
pub(super) struct Observation<'a> {
    pub position_m: Vec<f64>,
    pub force_n: f64,
    /// From 0 at the first row to 1 at the last.
    pub time: f64,
    pub row: usize,
    /// Variance of the reading over that of the noise.
    pub relative_variance: f64,
    pub reading: &'a [f64],
}

impl Observation<'_> {
    fn compare(&self, other: &Self) -> Ordering {
        compare(&self.position_m, &other.position_m).then(self.force_n.total_cmp(&other.force_n))
    }
}

/// Returns the indices of the observations of each calibration row.
pub(super) fn groups(rows: &[Observation], averaging: Averaging) -> Vec<Vec<usize>> {
    let mut indices: Vec<usize> = (0..rows.len()).collect();
    if averaging != Averaging::Consecutive {
        indices.sort_by(|a, b| rows[*a].compare(&rows[*b]));
    }
    let is_one = |a: &usize, b: &usize| rows[*a].compare(&rows[*b]).is_eq();
    let mut groups: Vec<_> = indices.chunk_by(is_one).map(<[usize]>::to_vec).collect();
    if averaging == Averaging::ByFirstRow {
        groups.sort_by_key(|group| group[0]);
    }
    groups
}

/// Means of the observations of one place and force.
#[derive(Clone, Debug)]
pub(super) struct CalibrationRows {
    /// Along and, on a plane, across.
    pub positions_m: Vec<Vec<f64>>,
    /// 0 of an untouched surface.
    pub force_n: Vec<f64>,
    /// Noise variance of a reading over that of the mean: the number of rows, for equal variances.
    pub count: Vec<f64>,
    /// From 0 at the first row to 1 at the last.
    pub time: Vec<f64>,
    /// First row of each mean.
    pub row: Vec<usize>,
    /// Subtracted from the readings of each channel.
    pub centre: Vec<f64>,
    /// Mean reading minus the centre.
    pub means: Array2<f64>,
    /// Rounding variance of each channel; 0 where none is detected.
    pub rounding: Vec<f64>,
    /// Repeats of the whole recording, also in subsets.
    pub repeats: Arc<Repeats>,
}

/// Scatter of repeats, one row per place and force.
#[derive(Clone, Debug)]
pub(super) struct Repeats {
    pub positions_m: Vec<Vec<f64>>,
    pub force_n: Vec<f64>,
    pub degrees_of_freedom: Vec<f64>,
    /// Squared deviations from the mean of repeats.
    pub squares: Array2<f64>,
}

/// Number of presses below which noise and hyperparameters need prior information.
pub(crate) const FEW: f64 = 25.0;

impl CalibrationRows {
    /// Averages the rows of a recording but for the `excluded`; `None` where a force is missing.
    pub fn of_recording(
        setup: &Setup,
        recording: &Recording,
        averaging: Averaging,
        excluded: &[usize],
    ) -> Option<Self> {
        let extent = setup.surface().extent();
        let times = relative_times(recording);
        let mut rows = Vec::with_capacity(recording.rows.len());
        for (row, found) in recording.rows.iter().enumerate() {
            let force_n = found.force_n.or(setup.force_n()).filter(|force_n| force_n.is_finite())?;
            // Without a force the position does not matter.
            let position_m: Vec<f64> = match force_n {
                0.0 => vec![0.0; extent.dimensions()],
                _ => extent.coordinates_m(found.position).collect(),
            };
            if excluded.binary_search(&row).is_err() {
                let (time, reading) = (times[row], found.reading.as_slice());
                rows.push(Observation { position_m, force_n, time, row, relative_variance: 1.0, reading });
            }
        }
        let channels = 0..recording.channels.len();
        let centre = channels.map(|c| mean(rows.iter().map(|row| row.reading[c]))).collect();
        Some(Self::averaged(&rows, &groups(&rows, averaging), centre))
    }

    /// Averages each group of observations.
    pub fn averaged(rows: &[Observation], groups: &[Vec<usize>], centre: Vec<f64>) -> Self {
        let channels = centre.len();
        let of = |group: &[usize], value: &dyn Fn(&Observation) -> f64| {
            mean(group.iter().map(|i| value(&rows[*i])))
        };
        let mut means = Array2::zeros((groups.len(), channels));
        let mut squares = Array2::zeros((groups.len(), channels));
        for ((mut means, mut squares), group) in
            means.outer_iter_mut().zip(squares.outer_iter_mut()).zip(groups)
        {
            for (c, centre) in centre.iter().enumerate() {
                let mean = of(group, &|row| row.reading[c]);
                squares[c] = group.iter().map(|i| (rows[*i].reading[c] - mean).powi(2)).sum::<f64>();
                means[c] = mean - centre;
            }
        }
        let repeated: Vec<usize> = (0..groups.len()).filter(|i| groups[*i].len() > 1).collect();
        let column = |c: usize| -> Vec<f64> { rows.iter().map(|row| row.reading[c]).collect() };
        let first = |group: &Vec<usize>| &rows[group[0]];
        let count = |group: &Vec<usize>| group.len() as f64 / of(group, &|row| row.relative_variance);
        Self {
            positions_m: groups.iter().map(|group| first(group).position_m.clone()).collect(),
            force_n: groups.iter().map(|group| first(group).force_n).collect(),
            count: groups.iter().map(count).collect(),
            time: groups.iter().map(|group| of(group, &|row| row.time)).collect(),
            row: groups.iter().map(|group| first(group).row).collect(),
            rounding: (0..channels).map(|c| rounding_variance(&column(c))).collect(),
            repeats: Arc::new(Repeats {
                positions_m: repeated.iter().map(|i| first(&groups[*i]).position_m.clone()).collect(),
                force_n: repeated.iter().map(|i| first(&groups[*i]).force_n).collect(),
                degrees_of_freedom: repeated.iter().map(|i| (groups[*i].len() - 1) as f64).collect(),
                squares: squares.select(Dimension(0), &repeated),
            }),
            centre,
            means,
        }
    }

    /// Appends the mean of `count` untouched rows, with their scatter.
    pub fn push_untouched(&mut self, mean: &[f64], count: f64, scatter: &[f64], degrees_of_freedom: f64) {
        const AS_MANY: &str = "untouched rows have the channels of the others";
        // Without a force the position does not matter.
        let any_m = self.positions_m.last().cloned().unwrap_or_default();
        self.positions_m.push(any_m.clone());
        self.force_n.push(0.0);
        self.count.push(count);
        self.time.push(0.0);
        self.row.push(0);
        self.means.push_row(aview1(mean)).expect(AS_MANY);
        let repeats = Arc::make_mut(&mut self.repeats);
        repeats.positions_m.push(any_m);
        repeats.force_n.push(0.0);
        repeats.degrees_of_freedom.push(degrees_of_freedom);
        repeats.squares.push_row(aview1(scatter)).expect(AS_MANY);
    }

    pub fn position(&self, i: usize) -> Position {
        let of = |k: usize| self.positions_m[i].get(k).copied().unwrap_or(0.0);
        Position { x_m: of(0), y_m: of(1) }
    }

    /// Rows of a touched surface.
    pub fn touched(&self) -> Vec<usize> {
        (0..self.len()).filter(|i| self.force_n[*i] != 0.0).collect()
    }

    pub fn len(&self) -> usize {
        self.force_n.len()
    }

    /// Weight of priors: 1 for few presses, 0 for many.
    pub fn fewness(&self) -> f64 {
        const FEWER: f64 = 5.0;
        ((FEW - self.len() as f64) / FEWER).clamp(0.0, 1.0)
    }

    pub fn distinct_forces(&self) -> usize {
        let mut forces = self.force_n.clone();
        forces.sort_by(f64::total_cmp);
        forces.dedup_by(|a, b| is_same_force(*a, *b));
        forces.len()
    }

    /// Returns whether drift is identifiable.
    ///
    /// With one force and one pass along the surface, time and position are confounded. Different forces or
    /// untouched rows far apart identify drift, or neighbours at different times: the mean square of time
    /// steps over the variance, 2 in random order (von Neumann, Annals of Mathematical Statistics 12, 1941).
    pub fn identifies_drift(&self) -> bool {
        /// Standard deviation over the mean.
        const LEAST_FORCES: f64 = 0.1;
        /// Fraction of the recording between untouched rows.
        const LEAST_SPAN: f64 = 0.5;
        const LEAST_STEPS: f64 = 0.5;
        let (untouched, mut pressed): (Vec<usize>, Vec<usize>) =
            (0..self.len()).partition(|i| self.force_n[*i] == 0.0);
        let (mean_n, variance_n2) = mean_and_variance(pressed.iter().map(|i| self.force_n[*i]));
        if variance_n2.sqrt() >= LEAST_FORCES * mean_n.abs() {
            return true;
        }
        let times = || untouched.iter().map(|i| self.time[*i]);
        if times().fold(f64::NEG_INFINITY, f64::max) - times().fold(f64::INFINITY, f64::min) >= LEAST_SPAN {
            return true;
        }
        pressed.sort_by(|a, b| {
            let by_time = self.time[*a].total_cmp(&self.time[*b]);
            compare(&self.positions_m[*a], &self.positions_m[*b]).then(by_time)
        });
        let (_, variance) = mean_and_variance(pressed.iter().map(|i| self.time[*i]));
        let steps = pressed.windows(2).map(|pair| (self.time[pair[1]] - self.time[pair[0]]).powi(2));
        pressed.len() > 1 && mean(steps) >= LEAST_STEPS * variance
    }

    /// Distinct pressed positions, ascending.
    pub fn positions_m(&self) -> Vec<&[f64]> {
        let pressed = self.positions_m.iter().zip(&self.force_n).filter(|(_, force_n)| **force_n != 0.0);
        let mut positions: Vec<&[f64]> = pressed.map(|(position_m, _)| position_m.as_slice()).collect();
        positions.sort_by(|a, b| compare(a, b));
        positions.dedup();
        positions
    }

    /// Rows minus one per position and for the offset, at least [`LEAST_FREEDOM`].
    pub fn noise_freedom(&self) -> f64 {
        let rows = self.count.iter().sum::<f64>();
        (rows - self.positions_m().len() as f64 - 1.0).max(LEAST_FREEDOM)
    }

    pub fn greatest_force_n(&self) -> f64 {
        self.force_n.iter().fold(0.0, |most, force_n| most.max(force_n.abs()))
    }

    pub fn changing_channels(&self) -> Vec<usize> {
        let changes = |c: &usize| {
            let most = self.means.column(*c).iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            most > 1e-12 * self.centre[*c].abs() && most > 0.0
        };
        (0..self.centre.len()).filter(changes).collect()
    }

    pub fn of_channels(&self, channels: &[usize]) -> Self {
        let of = |values: &[f64]| channels.iter().map(|c| values[*c]).collect();
        Self {
            centre: of(&self.centre),
            means: self.means.select(Dimension(1), channels),
            rounding: of(&self.rounding),
            repeats: Arc::new(Repeats {
                squares: self.repeats.squares.select(Dimension(1), channels),
                ..(*self.repeats).clone()
            }),
            ..self.clone()
        }
    }

    pub fn select(&self, kept: &[usize]) -> Self {
        let of = |values: &[f64]| kept.iter().map(|i| values[*i]).collect();
        Self {
            positions_m: kept.iter().map(|i| self.positions_m[*i].clone()).collect(),
            force_n: of(&self.force_n),
            count: of(&self.count),
            time: of(&self.time),
            row: kept.iter().map(|i| self.row[*i]).collect(),
            means: self.means.select(Dimension(0), kept),
            centre: self.centre.clone(),
            rounding: self.rounding.clone(),
            repeats: Arc::clone(&self.repeats),
        }
    }

    pub fn thinned(&self, most: usize) -> Self {
        let kept: Vec<usize> = thinned(self.len(), most).collect();
        self.select(&kept)
    }

    /// Partitions into at most `most` cells of neighbours, in length scales; presses of one position are
    /// consecutive.
    pub fn cells(&self, touched: &[usize], most: usize, lengths_m: &[f64]) -> Vec<Vec<usize>> {
        let position_m = |i: usize| self.positions_m[i].as_slice();
        let mut touched = touched.to_vec();
        touched.sort_by(|a, b| compare(position_m(*a), position_m(*b)));
        let places: Vec<&[usize]> = touched.chunk_by(|a, b| position_m(*a) == position_m(*b)).collect();
        let mut cells = Vec::new();
        let mut open = vec![(places, most.max(1))];
        while let Some((mut places, share)) = open.pop() {
            if share == 1 || places.len() <= 1 {
                cells.extend((!places.is_empty()).then(|| places.concat()));
                continue;
            }
            let at = |place: &[usize], k: usize| position_m(place[0])[k] / lengths_m[k];
            let width = |k: usize| {
                let coordinates = places.iter().map(|place| at(place, k));
                coordinates.clone().fold(f64::NEG_INFINITY, f64::max)
                    - coordinates.fold(f64::INFINITY, f64::min)
            };
            let widest = (0..lengths_m.len()).max_by(|a, b| width(*a).total_cmp(&width(*b))).unwrap_or(0);
            places.sort_by(|a, b| at(a, widest).total_cmp(&at(b, widest)));
            let low_share = share / 2;
            let high = places.split_off((places.len() * low_share / share).max(1));
            open.push((high, share - low_share));
            open.push((places, low_share));
        }
        cells
    }

    /// Partitions into neighbours, with about `size` presses and at least `places` positions.
    pub fn parts(&self, size: usize, places: usize, lengths_m: &[f64]) -> Vec<Vec<usize>> {
        let (untouched, touched): (Vec<usize>, Vec<usize>) =
            (0..self.len()).partition(|i| self.force_n[*i] == 0.0);
        let most = self.len().div_ceil(size).min(self.positions_m().len() / places);
        let cells = self.cells(&touched, most, lengths_m);
        // A cell may be larger; each part has presses from all of it.
        let split = |cell: &Vec<usize>| -> Vec<Vec<usize>> {
            let count = cell.len().div_ceil(2 * size);
            (0..count).map(|k| cell.iter().skip(k).step_by(count).copied().collect()).collect()
        };
        let mut parts: Vec<Vec<usize>> = cells.iter().flat_map(split).collect();
        let count = parts.len().max(1);
        for (k, i) in untouched.into_iter().enumerate() {
            if let Some(part) = parts.get_mut(k % count) {
                part.push(i);
            }
        }
        parts
    }
}

/// step²/12 for the coarsest power of ten that divides all values; 0 without one.
fn rounding_variance(values: &[f64]) -> f64 {
    const POWERS: std::ops::RangeInclusive<i32> = -9..=6;
    /// Tolerance relative to the step or to binary precision.
    const WITHIN: f64 = 1e-6;
    let is_step = |step: &f64| {
        let is_multiple = |value: &f64| {
            let steps = value / step;
            (steps - steps.round()).abs() <= WITHIN && steps.abs() < WITHIN / f64::EPSILON
        };
        // With a step far above all values, each would be the multiple 0.
        values.iter().all(is_multiple) && values.iter().any(|value| (value / step).round() != 0.0)
    };
    POWERS.rev().map(|power| 10f64.powi(power)).find(is_step).map_or(0.0, |step| step * step / 12.0)
}

/// Fractions of the recording; by row order without times.
pub(super) fn relative_times(recording: &Recording) -> Vec<f64> {
    let times = recording.times_or_order();
    shares(&times, &times)
}

/// Fractions of the span of `of`, from 0 to 1.
pub(super) fn shares(times: &[f64], of: &[f64]) -> Vec<f64> {
    let (first, last) = of
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), time| (first.min(*time), last.max(*time)));
    let span = if last > first { last - first } else { 1.0 };
    times.iter().map(|time| ((time - first) / span).clamp(0.0, 1.0)).collect()
}

pub(super) fn compare(a: &[f64], b: &[f64]) -> Ordering {
    a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_that_of_the_coarsest_step_of_all_values() {
        let of = |values: &[f64], step: f64| {
            let (found, expected) = (rounding_variance(values), step * step / 12.0);
            assert!((found - expected).abs() <= 1e-9 * expected, "{values:?}: {found}, {expected}");
        };
        of(&[12.0, 7.0, -3.0], 1.0);
        of(&[120.0, 70.0], 10.0);
        of(&[1.25, 3.5, 0.0], 0.01);
        // Metres: deflections in whole micrometres, and unrounded ones.
        of(&[1.5e-4, 2.53e-4], 1e-6);
        of(&[1.2345678912e-4, 2.5e-4], 0.0);
        of(&[0.0, 0.0], 0.0);
    }
}
