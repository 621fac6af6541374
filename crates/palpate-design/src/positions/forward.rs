//! Readings as a Gaussian process of the contact's position, in units of their noise.

use super::design::PositionError;
use ndarray::Array2;

use palpate_estimators::arrangement::cells;
use palpate_estimators::recording::{Recording, Row};
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::CleanSensors;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::surface::Extent;
use palpate_numerics::mean;
use palpate_numerics::regression::{GaussianProcess, Kernel, Regression, Samples};
use palpate_numerics::small::dot;
use palpate_numerics::watch::Watch;

/// Positions at which a model is asked, along a line and along each side of a plane.
const ASKED: usize = 60;
const ASKED_ON_A_PLANE: usize = 14;
/// Noise of a sensor whose channel has none, as a share of its full scale: what is then left is the error of
/// interpolating.
const NOMINAL_NOISE: f64 = 1e-4;
/// Distinct positions without which nobody knows how smooth a function is.
const FEWEST_POSITIONS: usize = 4;
/// How smooth readings may be.
const KERNELS: [Kernel; 3] = [Kernel::Matern32, Kernel::Matern52, Kernel::SquaredExponential];
/// Rounds in which presses are brought to one amplitude.
const AMPLITUDE_ROUNDS: usize = 8;
/// Variance of the forces at one position, of their squared mean, below which they are one force.
const NEGLIGIBLE_SPREAD: f64 = 1e-12;

/// Whitened readings as functions of position.
pub(super) struct ForwardModel {
    process: GaussianProcess,
    /// Its correlation: of the kernels that were tried, the one under which the readings are the most probable.
    kernel: Kernel,
    /// The variance of the functions before any press, the sensors' mean.
    signal_variance: f64,
    /// Noise variance of the presses that it was learnt from, in units of a reading's: less than 1 where a press is the mean of many readings, 0 where it is clean.
    press_variance: f64,
    extent: Extent,
    force: Force,
}

impl ForwardModel {
    /// Model of a bench from the clean readings that its mechanics give.
    pub fn from_mechanics(setup: &Setup, force: Force, watch: Watch) -> Result<Self, PositionError> {
        let surface = setup.surface().model().ok_or(PositionError::NoModel)?;
        let force_n = setup.force_n().ok_or(PositionError::NoForce)?;
        let extent = surface.extent();
        let side = match extent {
            Extent::Line { .. } => ASKED,
            Extent::Plane { .. } => ASKED_ON_A_PLANE,
        };
        let positions = cells(extent, side, side);
        let sensors = CleanSensors::new_watched(surface, setup.layout(), watch)?;
        let clean: Vec<Vec<f64>> =
            positions.iter().map(|&position| sensors.reading(Contact { position, force_n })).collect();
        let full_scale = |s: usize| clean.iter().map(|reading| reading[s].abs()).fold(0.0, f64::max);
        let sd = |s: usize| match setup.layout().sensors()[s].channel.reading_sd() {
            sd if sd > 0.0 => sd,
            _ => (NOMINAL_NOISE * full_scale(s)).max(f64::MIN_POSITIVE),
        };
        let sds: Vec<(usize, f64)> = living(setup.layout()).map(|s| (s, sd(s))).collect();
        // The model is exact: regressions take as much noise as rounding leaves.
        Self::fit(&positions, &clean, &sds, 0.0, extent, force, watch)
    }

    /// Model of a bench from a recording begun, whose noise its repeats tell, or else the layout, and no reading in use has less than the layout
    /// says; untouched rows tell the offsets.
    pub fn from_recording(
        recording: &Recording,
        layout: &Layout,
        extent: Extent,
        force: Force,
        watch: Watch,
    ) -> Result<Self, PositionError> {
        if recording.channels.len() != layout.len() {
            return Err(PositionError::Channels { needed: layout.len(), found: recording.channels.len() });
        }
        let presses = recording.touched();
        let found = presses.distinct_positions().len();
        if found < FEWEST_POSITIONS {
            return Err(PositionError::TooFewPresses { found, needed: FEWEST_POSITIONS });
        }
        let mut scaled = at_one_force(&presses, &offsets(recording));
        let sds = living(layout).map(|s| {
            let stated = layout.sensors()[s].channel.reading_sd();
            let sd = scatter(&presses, &scaled, s).unwrap_or(stated);
            if sd > 0.0 { Ok((s, sd)) } else { Err(PositionError::NoNoise { channel: s + 1 }) }
        });
        let mut sds = sds.collect::<Result<Vec<_>, _>>()?;
        if force == Force::Unknown && sds.len() > 1 {
            at_one_amplitude(&presses, &mut scaled, &mut sds);
        }
        // A press may be the mean of the readings of a second; what is located are single ones.
        let in_use = sds.iter().map(|&(s, sd)| (s, sd.max(layout.sensors()[s].channel.reading_sd())));
        let in_use: Vec<(usize, f64)> = in_use.collect();
        let press_variance = mean(sds.iter().zip(&in_use).map(|((_, press), (_, sd))| (press / sd).powi(2)));
        let positions: Vec<Position> = presses.rows.iter().map(|row| row.position).collect();
        Self::fit(&positions, &scaled, &in_use, press_variance, extent, force, watch)
    }

    /// Fits to readings at some positions: those of the sensors in `sds`, divided by their standard deviations, then have the
    /// `press_variance`.
    fn fit(
        positions: &[Position],
        readings: &[Vec<f64>],
        sds: &[(usize, f64)],
        press_variance: f64,
        extent: Extent,
        force: Force,
        watch: Watch,
    ) -> Result<Self, PositionError> {
        let rows = positions.len();
        let coordinates = Array2::from_shape_fn((rows, extent.dimensions()), |(row, k)| {
            [positions[row].x_m, positions[row].y_m][k]
        });
        let whitened =
            Array2::from_shape_fn((rows, sds.len()), |(row, j)| readings[row][sds[j].0] / sds[j].1);
        let samples = Samples {
            coordinates: coordinates.view(),
            outputs: whitened.view(),
            noise_variance: Some(&vec![press_variance; rows]),
        };
        let mut fitted = Vec::new();
        for kernel in KERNELS {
            fitted.push((kernel, Regression { kernel, ..Regression::default() }.fit(samples, watch)?));
        }
        fitted.sort_by(|(_, a), (_, b)| a.log_evidence().total_cmp(&b.log_evidence()));
        let (kernel, process) = fitted.pop().expect("there are kernels");
        let outputs = process.outputs();
        let signal_variance = mean((0..outputs).map(|j| process.signal_variance(j)));
        Ok(Self { process, kernel, signal_variance, press_variance, extent, force })
    }

    /// Noise variance of a press, in units of a reading's.
    pub fn press_variance(&self) -> f64 {
        self.press_variance
    }

    /// The covariance of a whitened reading's function at two positions before any press.
    pub fn covariance(&self, a: Position, b: Position) -> f64 {
        let scales = &self.process.hyperparameters().length_scales;
        let r2: f64 =
            [a.x_m - b.x_m, a.y_m - b.y_m].iter().zip(scales).map(|(d, scale)| (d / scale).powi(2)).sum();
        self.signal_variance * self.kernel.correlation(r2)
    }

    /// What a reading tells of a position once everything is calibrated, by the expected readings' slopes.
    pub fn information(&self, at: Position) -> Information {
        let (outputs, d) = (self.process.outputs(), self.process.coordinates());
        let (mut means, mut slopes) = (vec![0.0; outputs], vec![0.0; outputs * d]);
        let point = [at.x_m, at.y_m];
        self.process.mean_and_gradient_into(
            &point[..d],
            &mut means,
            &mut slopes,
            &mut self.process.scratch(),
        );
        let dot = |f: &dyn Fn(usize) -> (f64, f64)| (0..outputs).map(f).map(|(a, b)| a * b).sum::<f64>();
        // By ln W a reading that is linear in the force changes as much as it is.
        let by_force = dot(&|j| (means[j], means[j])).max(f64::MIN_POSITIVE);
        let entry = |k: usize, l: usize| {
            let plain = dot(&|j| (slopes[j * d + k], slopes[j * d + l]));
            match self.force {
                Force::Known => plain,
                Force::Unknown => {
                    let [a, b] = [k, l].map(|k| dot(&|j| (slopes[j * d + k], means[j])));
                    plain - a * b / by_force
                }
            }
        };
        match self.extent {
            Extent::Line { .. } => Information { xx: entry(0, 0), xy: 0.0, yy: 0.0 },
            Extent::Plane { .. } => Information { xx: entry(0, 0), xy: entry(0, 1), yy: entry(1, 1) },
        }
    }
}

/// The Fisher information of a position in one reading, in 1/m²; of a line only `xx`.
#[derive(Clone, Copy)]
pub(super) struct Information {
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Information {
    /// The standard deviation, in metres, of a position that is told with this noise variance, in units of a reading's: the
    /// information divided by it, and what the surface's size tells. In two dimensions that of the distance.
    pub fn sd_m(self, noise_variance: f64, extent: Extent) -> f64 {
        let told = |information: f64| information / noise_variance;
        let size = |side_m: f64| 12.0 / (side_m * side_m);
        let xx = told(self.xx) + size(extent.length_m());
        let Some(width_m) = extent.width_m() else { return 1.0 / xx.sqrt() };
        let (yy, xy) = (told(self.yy) + size(width_m), told(self.xy));
        ((xx + yy) / (xx * yy - xy * xy)).sqrt()
    }
}

/// Indices of the sensors that are alive.
fn living(layout: &Layout) -> impl Iterator<Item = usize> {
    (0..layout.len()).filter(|s| !layout.sensors()[*s].channel.dead)
}

/// Readings of presses beyond their channels' offsets, which grow with the force, brought to the mean force where forces are known.
fn at_one_force(presses: &Recording, offsets: &[f64]) -> Vec<Vec<f64>> {
    let forces: Option<Vec<f64>> =
        presses.rows.iter().map(|row| row.force_n.filter(|force_n| *force_n > 0.0)).collect();
    let mean = forces.as_ref().map(|forces| mean(forces.iter().copied()));
    let scaled = |(i, row): (usize, &Row)| {
        let factor = forces.as_ref().zip(mean).map_or(1.0, |(forces, mean)| mean / forces[i]);
        row.reading.iter().zip(offsets).map(|(value, offset)| factor * (value - offset)).collect()
    };
    presses.rows.iter().enumerate().map(scaled).collect()
}

/// Brings the presses of each position to one amplitude, as locating at an unknown force looks at the shape of a reading alone: however hard
/// they were, or at whatever depth, is no noise. Updates the channels' standard deviations, by what is left across the mean.
///
/// With readings in units of their noise, u, and their mean m at the position, u becomes u − (u·m/m·m − 1)·m; of a channel's
/// variance 1 − m_j²/m·m is left.
fn at_one_amplitude(presses: &Recording, readings: &mut [Vec<f64>], sds: &mut [(usize, f64)]) {
    let groups: Vec<Vec<usize>> = presses
        .distinct_positions()
        .into_iter()
        .map(|position| (0..readings.len()).filter(|&i| presses.rows[i].position == position).collect())
        .filter(|rows: &Vec<usize>| rows.len() > 1)
        .collect();
    // What counts as across the mean depends on the noise, and converges in a few rounds.
    for _ in 0..AMPLITUDE_ROUNDS {
        let (mut squares, mut freedom) = (vec![0.0; sds.len()], vec![0.0; sds.len()]);
        for rows in &groups {
            let whitened = |&i: &usize| sds.iter().map(|&(s, sd)| readings[i][s] / sd).collect();
            let presses: Vec<Vec<f64>> = rows.iter().map(whitened).collect();
            let mean: Vec<f64> = (0..sds.len()).map(|j| mean(presses.iter().map(|u| u[j]))).collect();
            let size = dot(&mean, &mean);
            if size == 0.0 {
                continue;
            }
            for (&i, u) in rows.iter().zip(&presses) {
                let excess = dot(u, &mean) / size - 1.0;
                for (j, &(s, sd)) in sds.iter().enumerate() {
                    readings[i][s] -= excess * mean[j] * sd;
                    squares[j] += (u[j] - (1.0 + excess) * mean[j]).powi(2);
                }
            }
            let repeats = (rows.len() - 1) as f64;
            freedom.iter_mut().zip(&mean).for_each(|(sum, m)| *sum += repeats * (1.0 - m * m / size));
        }
        for (j, (_, sd)) in sds.iter_mut().enumerate() {
            if squares[j] > 0.0 && freedom[j] > 0.0 {
                *sd *= (squares[j] / freedom[j]).sqrt();
            }
        }
    }
}

/// What every channel reads while nothing touches: the mean of the untouched rows, or else what presses of one position at several
/// forces tell, reading = offset + force × g(position) in least squares with a g of its own for each position. Zeros where
/// neither is there.
fn offsets(recording: &Recording) -> Vec<f64> {
    if let Some(untouched) = recording.untouched_mean() {
        return untouched;
    }
    let (mut sums, mut weight) = (vec![0.0; recording.channels.len()], 0.0);
    for position in recording.distinct_positions() {
        let rows = recording.rows.iter().filter(|row| row.position == position);
        let pressed: Vec<(f64, &[f64])> =
            rows.filter_map(|row| Some((row.force_n?, row.reading.as_slice()))).collect();
        let squares: f64 = pressed.iter().map(|(force_n, _)| force_n * force_n).sum();
        let total_n: f64 = pressed.iter().map(|(force_n, _)| force_n).sum();
        if squares > 0.0 {
            // What is left of 1 beside the force at the position: the part by which a reading tells the offset.
            let slope = total_n / squares;
            for (force_n, reading) in &pressed {
                let left = 1.0 - slope * force_n;
                weight += left;
                sums.iter_mut().zip(*reading).for_each(|(sum, value)| *sum += left * value);
            }
        }
    }
    let is_told = weight > NEGLIGIBLE_SPREAD * recording.rows.len() as f64;
    sums.into_iter().map(|sum| if is_told { sum / weight } else { 0.0 }).collect()
}

/// Standard deviation of a channel about its means at each position; `None` where no position was pressed twice.
fn scatter(recording: &Recording, readings: &[Vec<f64>], channel: usize) -> Option<f64> {
    let (mut squares, mut freedom) = (0.0, 0usize);
    for position in recording.distinct_positions() {
        let repeats: Vec<f64> = recording
            .rows
            .iter()
            .zip(readings)
            .filter(|(row, _)| row.position == position)
            .map(|(_, reading)| reading[channel])
            .collect();
        let mean = mean(repeats.iter().copied());
        squares += repeats.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        freedom += repeats.len() - 1;
    }
    (freedom > 0).then(|| (squares / freedom as f64).sqrt()).filter(|sd| *sd > 0.0)
}
