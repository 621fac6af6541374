//! Presses of a recording, scaled to one force (or amplitude), and their noise.

use super::design::PositionError;
use palpate_estimators::recording::{Recording, Row, is_one_force};
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::Extent;
use palpate_numerics::mean;
use palpate_numerics::small::dot;

/// Least number of distinct positions for an estimate of the smoothness.
const FEWEST_POSITIONS: usize = 4;
/// Share of a side that the presses must cover.
const LEAST_REACH: f64 = 0.1;
/// Largest number of untouched rows without a noise estimate.
const FEWEST_UNTOUCHED: usize = 4;
/// Quantile of the standard normal distribution at 95 %.
const ONE_SIDED_95: f64 = 1.644_853_626_951_472_2;
const AMPLITUDE_ROUNDS: usize = 8;
/// Relative variance below which forces are equal.
const NEGLIGIBLE_SPREAD: f64 = 1e-12;

pub(super) struct Presses {
    pub positions: Vec<Position>,
    /// Readings minus offsets, one value per enabled channel.
    pub readings: Vec<Vec<f64>>,
    pub places: Vec<(Position, usize)>,
    pub reading_sds: Vec<f64>,
    /// Noise variance relative to a reading; below 1 for means of readings.
    pub variance: f64,
    /// Standard deviations per enabled channel: of a press, and as stated for a reading.
    press_sds: Vec<f64>,
    stated_sds: Vec<f64>,
    /// Stated noise, else noise of the untouched rows, else 0.
    quiet_sds: Vec<f64>,
    /// Repeated presses, and degrees of freedom of their scatter.
    repeated: Vec<usize>,
    degrees_of_freedom: usize,
    /// Relative variances due to placement; empty if unknown.
    placement_variances: Vec<f64>,
}

impl Presses {
    /// Reads the presses. Noise comes from repeats, else from the setup; a reading has at least the stated
    /// noise.
    pub fn new(recording: &Recording, setup: &Setup) -> Result<Self, PositionError> {
        let layout = setup.layout();
        if recording.channels.len() != layout.len() {
            return Err(PositionError::Channels { needed: layout.len(), found: recording.channels.len() });
        }
        let touched: Vec<&Row> = recording.rows.iter().filter(|row| row.touches()).collect();
        let groups = by_position(&touched);
        if groups.len() < FEWEST_POSITIONS {
            return Err(PositionError::TooFewPresses { found: groups.len(), needed: FEWEST_POSITIONS });
        }
        let offsets = recording.untouched_mean().or_else(|| offsets(&touched, &groups, layout.len()));
        if offsets.is_none() && setup.surface().model().is_none() && forces_differ(&touched) {
            return Err(PositionError::NoOffset);
        }
        let offsets = offsets.unwrap_or_default();
        // A constant channel has no information.
        let changes = |s: &usize| touched.iter().any(|row| row.reading[*s] != touched[0].reading[*s]);
        let living: Vec<usize> = enabled_sensors(layout).filter(changes).collect();
        if living.is_empty() {
            return Err(PositionError::NothingTold);
        }
        let stated: Vec<f64> = living.iter().map(|&s| layout.sensors()[s].channel.reading_sd()).collect();
        let mut readings = at_one_force(&touched, &living, &offsets);
        let places = groups.iter().map(|group| (touched[group[0]].position, group.len())).collect();
        let repeated: Vec<Vec<usize>> = groups.into_iter().filter(|group| group.len() > 1).collect();
        let freedom = repeated.iter().map(|group| group.len() - 1).sum();
        let sds = living.iter().enumerate().map(|(j, &s)| {
            let sd = scatter(&readings, &repeated, j).unwrap_or(stated[j]);
            if sd > 0.0 { Ok(sd) } else { Err(PositionError::NoNoise { channel: s + 1 }) }
        });
        let mut sds = sds.collect::<Result<Vec<f64>, _>>()?;
        if setup.force() == Force::Unknown && sds.len() > 1 {
            bring_to_one_amplitude(&mut readings, &repeated, &mut sds);
        }
        let positions = touched.iter().map(|row| row.position).collect();
        let untouched: Vec<&Row> = recording.rows.iter().filter(|row| !row.touches()).collect();
        let quiet = living.iter().zip(&stated).map(|(&s, stated)| match *stated {
            0.0 => scatter_of_successive(&untouched, s),
            stated => stated,
        });
        let quiet_sds = quiet.collect();
        let mut presses = Self {
            positions,
            readings,
            places,
            reading_sds: Vec::new(),
            variance: 0.0,
            press_sds: sds,
            stated_sds: stated,
            quiet_sds,
            repeated: repeated.concat(),
            degrees_of_freedom: freedom,
            placement_variances: Vec::new(),
        };
        presses.whiten();
        Ok(presses)
    }

    fn whiten(&mut self) {
        let sds = self.press_sds.iter().zip(&self.stated_sds);
        self.reading_sds = sds.map(|(sd, stated)| sd.max(*stated)).collect();
        self.variance =
            mean(self.press_sds.iter().zip(&self.reading_sds).map(|(press, sd)| (press / sd).powi(2)));
    }

    pub fn variance_of(&self, press: usize) -> f64 {
        self.variance + self.placement_variances.get(press).unwrap_or(&0.0)
    }

    /// Separates the placement error from the scatter of repeats. `placed` is its variance in each whitened
    /// reading.
    ///
    /// The scatter s² contains noise s²·(1 − p) and placement p·s², the mean of `placed` over repeated
    /// presses. The standard error of s² is s²·√(2/ν) for ν degrees of freedom. If this does not resolve the
    /// noise, the stated or untouched noise is used, or the 95 % bound.
    pub fn place_with(&mut self, placed: &[Vec<f64>]) {
        let before = self.reading_sds.clone();
        if self.degrees_of_freedom > 0 {
            let resolved = (ONE_SIDED_95 * (2.0 / self.degrees_of_freedom as f64).sqrt()).min(1.0);
            for (channel, sd) in self.press_sds.iter_mut().enumerate() {
                let by_placement = mean(self.repeated.iter().map(|&press| placed[press][channel]));
                let share = 1.0 - by_placement * (before[channel] / *sd).powi(2);
                let known = (self.quiet_sds[channel] / *sd).powi(2);
                let bound = if known > 0.0 { known.min(resolved) } else { resolved };
                *sd *= if share > resolved { share } else { bound }.sqrt();
            }
            self.whiten();
        }
        let scales: Vec<f64> =
            before.iter().zip(&self.reading_sds).map(|(old, new)| (old / new).powi(2)).collect();
        let variance =
            |placed: &Vec<f64>| mean(placed.iter().zip(&scales).map(|(placed, scale)| placed * scale));
        self.placement_variances = placed.iter().map(variance).collect();
    }

    pub fn check_reach(&self, extent: Extent) -> Result<(), PositionError> {
        let check = |axis: char, coordinate: fn(Position) -> f64, side_m: f64| {
            let along = || self.places.iter().map(|(position, _)| coordinate(*position));
            let reach_m = along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min);
            match reach_m < LEAST_REACH * side_m {
                true => Err(PositionError::SmallPart { axis, reach_m, side_m }),
                false => Ok(()),
            }
        };
        check('x', |at| at.x_m, extent.length_m())?;
        extent.width_m().map_or(Ok(()), |width_m| check('y', |at| at.y_m, width_m))
    }
}

pub(super) fn enabled_sensors(layout: &Layout) -> impl Iterator<Item = usize> {
    (0..layout.len()).filter(|s| !layout.sensors()[*s].channel.disabled)
}

fn by_position(presses: &[&Row]) -> Vec<Vec<usize>> {
    let order = |a: &usize, b: &usize| presses[*a].position.cmp_by_x_then_y(&presses[*b].position);
    let mut indices: Vec<usize> = (0..presses.len()).collect();
    indices.sort_by(order);
    indices.chunk_by(|a, b| order(a, b).is_eq()).map(<[usize]>::to_vec).collect()
}

fn forces_differ(presses: &[&Row]) -> bool {
    !is_one_force(presses.iter().filter_map(|row| row.force_n))
}

/// Estimates offsets by least squares of reading = offset + force × g(position); `None` if the forces do not
/// determine them.
fn offsets(presses: &[&Row], groups: &[Vec<usize>], channels: usize) -> Option<Vec<f64>> {
    let (mut sums, mut weight) = (vec![0.0; channels], 0.0);
    for group in groups {
        let forces: Vec<f64> = group.iter().map(|&i| presses[i].force_n).collect::<Option<_>>()?;
        // The part of 1 that is orthogonal to the forces at the position: it determines the offset.
        let slope = forces.iter().sum::<f64>() / dot(&forces, &forces);
        for (&i, force_n) in group.iter().zip(&forces) {
            let left = 1.0 - slope * force_n;
            weight += left;
            sums.iter_mut().zip(&presses[i].reading).for_each(|(sum, value)| *sum += left * value);
        }
    }
    let is_told = weight > NEGLIGIBLE_SPREAD * presses.len() as f64;
    is_told.then(|| sums.into_iter().map(|sum| sum / weight).collect())
}

fn at_one_force(presses: &[&Row], channels: &[usize], offsets: &[f64]) -> Vec<Vec<f64>> {
    let forces: Option<Vec<f64>> =
        presses.iter().map(|row| row.force_n.filter(|force_n| *force_n > 0.0)).collect();
    let mean = forces.as_ref().map(|forces| mean(forces.iter().copied()));
    let scaled = |(i, row): (usize, &&Row)| {
        let factor = forces.as_ref().zip(mean).map_or(1.0, |(forces, mean)| mean / forces[i]);
        let beyond = |&s: &usize| row.reading[s] - offsets.get(s).unwrap_or(&0.0);
        channels.iter().map(|s| factor * beyond(s)).collect()
    };
    presses.iter().enumerate().map(scaled).collect()
}

/// Pooled standard deviation of repeats, if above 0.
fn scatter(readings: &[Vec<f64>], repeated: &[Vec<usize>], channel: usize) -> Option<f64> {
    let (mut squares, mut freedom) = (0.0, 0usize);
    for group in repeated {
        let mean = mean(group.iter().map(|&i| readings[i][channel]));
        squares += group.iter().map(|&i| (readings[i][channel] - mean).powi(2)).sum::<f64>();
        freedom += group.len() - 1;
    }
    (freedom > 0).then(|| (squares / freedom as f64).sqrt()).filter(|sd| *sd > 0.0)
}

/// Noise from differences of successive rows, robust against slow drift; 0 with too few rows.
fn scatter_of_successive(untouched: &[&Row], channel: usize) -> f64 {
    if untouched.len() <= FEWEST_UNTOUCHED {
        return 0.0;
    }
    let squares =
        untouched.windows(2).map(|pair| (pair[1].reading[channel] - pair[0].reading[channel]).powi(2));
    (0.5 * mean(squares)).sqrt()
}

/// Scales the presses of each position to one amplitude and updates the standard deviations.
///
/// With whitened readings u and their mean m, u becomes u − (u·m/m·m − 1)·m. The share 1 − m_j²/m·m of a
/// channel's variance remains.
fn bring_to_one_amplitude(readings: &mut [Vec<f64>], repeated: &[Vec<usize>], sds: &mut [f64]) {
    // The direction orthogonal to the mean depends on the noise; a few rounds converge.
    for _ in 0..AMPLITUDE_ROUNDS {
        let (mut squares, mut freedom) = (vec![0.0; sds.len()], vec![0.0; sds.len()]);
        for group in repeated {
            let whitened =
                |&i: &usize| readings[i].iter().zip(sds.iter()).map(|(value, sd)| value / sd).collect();
            let presses: Vec<Vec<f64>> = group.iter().map(whitened).collect();
            let mean: Vec<f64> = (0..sds.len()).map(|j| mean(presses.iter().map(|u| u[j]))).collect();
            let size = dot(&mean, &mean);
            if size == 0.0 {
                continue;
            }
            for (&i, u) in group.iter().zip(&presses) {
                let excess = dot(u, &mean) / size - 1.0;
                for (j, sd) in sds.iter().enumerate() {
                    readings[i][j] -= excess * mean[j] * sd;
                    squares[j] += (u[j] - (1.0 + excess) * mean[j]).powi(2);
                }
            }
            let repeats = (group.len() - 1) as f64;
            freedom.iter_mut().zip(&mean).for_each(|(sum, m)| *sum += repeats * (1.0 - m * m / size));
        }
        for ((sd, squares), freedom) in sds.iter_mut().zip(squares).zip(freedom) {
            if squares > 0.0 && freedom > 0.0 {
                *sd *= (squares / freedom).sqrt();
            }
        }
    }
}
