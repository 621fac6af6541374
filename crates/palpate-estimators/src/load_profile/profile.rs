//! The profile of a load, from one reading.

use ndarray::{Array1, Array2};
use palpate_core::Status;
use serde::Serialize;

use super::patches::{Patch, find_patches};
use super::resolution::Resolution;
use super::smoothness::{Mixture, Problem};
use super::{Cells, LoadSensors};
use crate::fit::ReadingError;
use palpate_mechanics::contact::Position;
use palpate_numerics::{chi_squared_bound, normal_interval_95};

/// Readings that noise alone makes this rarely are a contact; those that a load and noise make this rarely are not of the
/// model.
const RARE: f64 = 1e-4;

/// Turns readings of one bench into load profiles.
pub struct Profiler<'a> {
    sensors: LoadSensors<'a>,
    cells: Cells,
    problem: Problem,
    /// What the misfit of a reading seldom exceeds by noise.
    worst_misfit: f64,
}

/// A load, as one reading tells it.
#[derive(Clone, Debug)]
pub struct LoadProfile {
    /// How far it is to be believed: located, no contact, or outside the model, when no load explains the reading within
    /// its noise.
    pub status: Status,
    /// The cells of the surface.
    pub cells: Cells,
    /// Force of each cell, in newtons.
    pub forces_n: Vec<f64>,
    /// Covariance of the cells' forces, in N².
    pub covariance_n2: Array2<f64>,
    /// Their sum, in newtons.
    pub total_n: f64,
    /// Standard deviation of the sum.
    pub total_sd_n: f64,
    /// Where the whole force acts; `None` without load.
    pub centre: Option<CentreOfPressure>,
    /// The patches that carry load, along x.
    pub patches: Vec<Patch>,
    /// What each channel would read of this load, in its SI unit; `None` for dead channels.
    pub fitted: Vec<Option<f64>>,
    /// Reading less fitted, over the standard deviation of the noise; `None` for dead channels.
    pub residuals: Vec<Option<f64>>,
    /// The least sum of squared residuals that any smoothness leaves.
    pub misfit: f64,
    /// What it seldom exceeds by noise: once in 10,000 readings, whatever the load.
    pub worst_misfit: f64,
    /// λ of the most probable smoothness, in 1/N²; `None` without load.
    pub smoothness: Option<f64>,
}

/// Where a spread force acts as a whole: the mean position of the load.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CentreOfPressure {
    /// The place.
    pub position: Position,
    /// Standard deviation along x, in metres.
    pub sd_x_m: f64,
    /// Standard deviation along y, in metres; 0 on a line.
    pub sd_y_m: f64,
}

impl<'a> Profiler<'a> {
    /// For readings of these sensors.
    pub fn new(sensors: LoadSensors<'a>) -> Self {
        let cells = Cells::over(sensors.extent);
        let rows: Vec<Vec<f64>> = sensors
            .alive()
            .map(|channel| {
                let mean = |cell| {
                    let points = cells.points(cell);
                    points.iter().map(|point| channel.influence.at(*point)).sum::<f64>() / points.len() as f64
                };
                (0..cells.len()).map(|cell| mean(cell) / channel.noise_sd).collect()
            })
            .collect();
        let influence = Array2::from_shape_fn((rows.len(), cells.len()), |(i, cell)| rows[i][cell]);
        let worst_misfit = chi_squared_bound(RARE, rows.len().max(1));
        Self { sensors, cells, problem: Problem::new(influence, cells.roughness()), worst_misfit }
    }

    /// The cells of its profiles.
    pub fn cells(&self) -> Cells {
        self.cells
    }

    /// The sensors that it reads.
    pub fn sensors(&self) -> &LoadSensors<'a> {
        &self.sensors
    }

    /// The load that a reading tells: one finite value a channel, in SI units.
    ///
    /// # Errors
    /// [`ReadingError`] for another number of channels or a value that is not finite.
    pub fn profile(&self, reading: &[f64]) -> Result<LoadProfile, ReadingError> {
        ReadingError::check(reading, self.sensors.channels.len())?;
        let channels = self.sensors.channels.iter().zip(reading);
        let whitened = channels.filter_map(|(channel, value)| {
            let channel = channel.as_ref()?;
            Some((value - channel.offset) / channel.noise_sd)
        });
        let y: Array1<f64> = whitened.collect();
        let silent = y.dot(&y) <= self.worst_misfit;
        let mixture = if silent { None } else { self.problem.solve(&y) };
        Ok(match mixture {
            Some(mixture) => self.loaded(&y, &mixture),
            None => self.unloaded(&y, if silent { Status::NoContact } else { Status::OutsideModel }),
        })
    }

    /// What this layout resolves at the smoothness of a profile; `None` for a profile without load.
    pub fn resolution(&self, profile: &LoadProfile) -> Option<Resolution> {
        Resolution::of(&self.problem, self.cells, profile.smoothness?)
    }

    fn loaded(&self, y: &Array1<f64>, mixture: &Mixture) -> LoadProfile {
        let Mixture { forces, covariance, smoothness, least_misfit } = mixture;
        let total_n = forces.sum();
        let outside = *least_misfit > self.worst_misfit;
        let status = if outside { Status::OutsideModel } else { Status::Located };
        let forces_n = forces.to_vec();
        let patches = find_patches(&self.cells, &forces_n, covariance);
        let everything: Vec<usize> = (0..self.cells.len()).collect();
        let centre = centre_of(&self.cells, &everything, &forces_n, covariance);
        let (fitted, residuals) = self.fitted(y, forces);
        LoadProfile {
            status,
            cells: self.cells,
            forces_n,
            total_n,
            total_sd_n: covariance.sum().sqrt(),
            covariance_n2: covariance.clone(),
            centre,
            patches,
            fitted,
            residuals,
            misfit: *least_misfit,
            worst_misfit: self.worst_misfit,
            smoothness: Some(*smoothness),
        }
    }

    fn unloaded(&self, y: &Array1<f64>, status: Status) -> LoadProfile {
        let cells = self.cells.len();
        let (fitted, residuals) = self.fitted(y, &Array1::zeros(cells));
        LoadProfile {
            status,
            cells: self.cells,
            forces_n: vec![0.0; cells],
            covariance_n2: Array2::zeros((cells, cells)),
            total_n: 0.0,
            total_sd_n: 0.0,
            centre: None,
            patches: Vec::new(),
            fitted,
            residuals,
            misfit: y.dot(y),
            worst_misfit: self.worst_misfit,
            smoothness: None,
        }
    }

    /// What the channels would read of the load, and what is left of the reading, channel by channel.
    fn fitted(&self, y: &Array1<f64>, forces: &Array1<f64>) -> (Vec<Option<f64>>, Vec<Option<f64>>) {
        let explained = self.problem.influence.dot(forces);
        let mut each = explained.iter().zip(y);
        let channel = |channel: &Option<super::LoadChannel>| {
            let channel = channel.as_ref()?;
            let (explained, read) = each.next()?;
            Some((channel.offset + explained * channel.noise_sd, read - explained))
        };
        self.sensors.channels.iter().map(channel).map(|pair| (pair.map(|p| p.0), pair.map(|p| p.1))).unzip()
    }
}

impl LoadProfile {
    /// Density of the load in a cell and the ends of its 95 % interval, held at 0: N/m on a line, N/m² on a plane.
    pub fn density(&self, cell: usize) -> (f64, (f64, f64)) {
        let measure = self.cells.measure();
        let (force, sd) = (self.forces_n[cell], self.covariance_n2[[cell, cell]].sqrt());
        let (low, high) = normal_interval_95(force, sd);
        (force / measure, (low.max(0.0) / measure, high / measure))
    }

    /// Standard deviation of the density in a cell: N/m on a line, N/m² on a plane.
    pub fn density_sd(&self, cell: usize) -> f64 {
        self.covariance_n2[[cell, cell]].sqrt() / self.cells.measure()
    }

    /// The ends of the total force's 95 % interval, in newtons.
    pub fn total_95_n(&self) -> (f64, f64) {
        let (low, high) = normal_interval_95(self.total_n, self.total_sd_n);
        (low.max(0.0), high)
    }
}

impl CentreOfPressure {
    /// The ends of the 95 % interval along x, in metres.
    pub fn x_95_m(&self) -> (f64, f64) {
        normal_interval_95(self.position.x_m, self.sd_x_m)
    }

    /// The ends of the 95 % interval along y, in metres.
    pub fn y_95_m(&self) -> (f64, f64) {
        normal_interval_95(self.position.y_m, self.sd_y_m)
    }
}

/// The mean position of the force of some cells, with its standard deviation to first order; `None` where they have none.
pub(super) fn centre_of(
    cells: &Cells,
    listed: &[usize],
    forces_n: &[f64],
    covariance: &Array2<f64>,
) -> Option<CentreOfPressure> {
    let force: f64 = listed.iter().map(|cell| forces_n[*cell]).sum();
    if force <= 0.0 {
        return None;
    }
    let along = |coordinate: fn(Position) -> f64| {
        let at = |cell: &usize| coordinate(cells.centre(*cell));
        let mean = listed.iter().map(|cell| at(cell) * forces_n[*cell]).sum::<f64>() / force;
        let slopes: Vec<f64> = listed.iter().map(|cell| (at(cell) - mean) / force).collect();
        (mean, sd_of_sum(listed, &slopes, covariance))
    };
    let ((x_m, sd_x_m), (y_m, sd_y_m)) = (along(|p| p.x_m), along(|p| p.y_m));
    Some(CentreOfPressure { position: Position { x_m, y_m }, sd_x_m, sd_y_m })
}

/// Standard deviation of Σ slope·force over some cells.
pub(super) fn sd_of_sum(listed: &[usize], slopes: &[f64], covariance: &Array2<f64>) -> f64 {
    let row = |(i, a): (&usize, &f64)| {
        listed.iter().zip(slopes).map(|(j, b)| a * b * covariance[[*i, *j]]).sum::<f64>()
    };
    listed.iter().zip(slopes).map(row).sum::<f64>().max(0.0).sqrt()
}
