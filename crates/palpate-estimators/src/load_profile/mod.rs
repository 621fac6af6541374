//! Load profiles: force distribution over a surface from one reading.
//!
//! A load p(a) ≥ 0 gives y_i = ∫ f_i(a)·p(a) da + noise, with influence functions f_i:
//!
//! 1. Each of n cells ([`Cells`]) has a force; A is the mean influence of cells on sensors, over noise.
//! 2. For a smoothness λ, x minimises ½·‖A·x − y‖² + ½·λ·xᵀP·x + μ·Σx over x ≥ 0. xᵀP·x is the sum of squared
//!    second differences, without load beyond the edges. μ = n/F is the maximum-entropy prior of forces with
//!    mean F/n, which suppresses load in insensitive places.
//! 3. Profile and covariance are mixed over λ by evidence, in the Gaussian approximation on non-zero cells.
//! 4. Patches are connected loaded parts, or more if the reading requires more uniform loads
//!    (`patch_number`). Intervals are those of uniform loads, without a prior, or else of any shape
//!    (`bounds`); values outside are replaced.
//! 5. The total is bounded over loads of any shape.
//!
//! Sources: MacKay, *Bayesian Interpolation*, Neural Computation 4 (1992), for the evidence; Jaynes, *Prior
//! Probabilities*, IEEE Trans. SSC 4 (1968), for the prior.

mod bounds;
mod cells;
mod cumulative;
mod even_loads;
mod patch_number;
mod patches;
mod profile_likelihood;
mod smoothness;

pub use crate::influence::LoadChannel;
pub use cells::Cells;
pub use patches::{CentreOfPressure, PATCH_SHARE, Patch};

use ndarray::{Array1, Array2, Axis};
use serde::Serialize;

use crate::fit::{LARGEST, ReadingError};
use crate::influence::NotProportional;
use crate::setup::Setup;
use crate::status::chi_squared_bound;
use bounds::Bounds;
use cumulative::CumulativeInfluence;
use even_loads::LoadQuantity;
use palpate_core::Status;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, NoiseError, Sensor};
use palpate_mechanics::surface::{Extent, Surface, UniformLoad, Unsolvable};
use palpate_numerics::watch::{Cancelled, Watch};
use palpate_numerics::{Cholesky, extend_to, hull, median, normal_interval_95};
use patch_number::{PatchLoads, Tables};
use patches::{centre_of, contains, find_patches, mean_position, nearest};
use smoothness::{Mixture, Problem};

/// Channels of a bench.
#[derive(Clone)]
pub struct LoadSensors<'a> {
    /// Surface extent.
    pub extent: Extent,
    /// Channels; `None` if disabled.
    pub channels: Vec<Option<LoadChannel<'a>>>,
}

/// Unsuitable setup.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LoadSensorsError {
    /// No model or fitted influence functions.
    #[error(
        "a spread load needs the influence functions of a surface with a model, or of a locator of kind `influence`"
    )]
    NoModel,
    /// Readings of several loads that do not add up.
    #[error(transparent)]
    NotProportional(#[from] NotProportional),
    /// No noise, or only disabled sensors.
    #[error(transparent)]
    Noise(#[from] NoiseError),
    /// Unsolvable surface.
    #[error("the equations of the surface could not be solved: {error}; {help}", error = .0, help = .0.help())]
    Surface(#[from] Unsolvable),
}

impl<'a> LoadSensors<'a> {
    /// Creates sensors on a surface with a model; the noise is √(σ² + q²/12) with resolution q.
    ///
    /// # Errors
    /// [`LoadSensorsError`].
    pub fn new(surface: &'a dyn Surface, layout: &Layout) -> Result<Self, LoadSensorsError> {
        Self::new_watched(surface, layout, Watch::NONE)
    }

    /// As [`LoadSensors::new`], with a watch.
    ///
    /// # Errors
    /// [`LoadSensorsError`], also by cancellation.
    pub fn new_watched(
        surface: &'a dyn Surface,
        layout: &Layout,
        watch: Watch,
    ) -> Result<Self, LoadSensorsError> {
        surface.check_solution_watched(watch)?;
        let channel = |(sensor, sd): (&Sensor, Option<f64>)| -> Result<_, Cancelled> {
            let Some(noise_sd) = sd else { return Ok(None) };
            let mut found = surface.influence_functions_watched(sensor.kind, &[sensor.position], watch)?;
            Ok(found.pop().map(|influence| LoadChannel { influence, offset: 0.0, noise_sd }))
        };
        let channels = layout.sensors().iter().zip(layout.reading_sds()?).map(channel);
        let channels = channels.collect::<Result<_, _>>().map_err(Unsolvable::from)?;
        Ok(Self { extent: surface.extent(), channels })
    }

    /// Creates the sensors of a setup with a model.
    ///
    /// # Errors
    /// [`LoadSensorsError`].
    pub fn from_setup(setup: &'a Setup) -> Result<Self, LoadSensorsError> {
        Self::from_setup_watched(setup, Watch::NONE)
    }

    /// As [`LoadSensors::from_setup`], with a watch.
    ///
    /// # Errors
    /// [`LoadSensorsError`], also by cancellation.
    pub fn from_setup_watched(setup: &'a Setup, watch: Watch) -> Result<Self, LoadSensorsError> {
        let model = setup.surface().model().ok_or(LoadSensorsError::NoModel)?;
        Self::new_watched(model, setup.layout(), watch)
    }

    /// Enabled channels.
    pub fn enabled(&self) -> impl Iterator<Item = &LoadChannel<'a>> {
        self.channels.iter().flatten()
    }
}

/// Estimator of load profiles.
///
/// ```
/// use palpate_estimators::{load_profile::Profiler, setup::Setup, simulate::simulate_loads};
/// use palpate_mechanics::surface::UniformLoad;
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let load = UniformLoad::along(mm(120.0), mm(160.0), 2.0);
/// let readings = simulate_loads(&setup, &[load], 1, 0)?;
/// let profile = Profiler::from_setup(&setup)?.profile(&readings[0])?;
/// assert!((profile.total_n - 2.0).abs() < 0.2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Profiler<'a> {
    sensors: LoadSensors<'a>,
    cells: Cells,
    problem: Problem,
    cumulative: CumulativeInfluence,
    /// Goodness-of-fit bound, error rate 0.001.
    worst_misfit: f64,
}

/// Estimated load.
#[derive(Clone, Debug)]
pub struct LoadProfile {
    /// Status; ambiguous means an unresolved number of patches.
    pub status: Status,
    /// Surface cells.
    pub cells: Cells,
    /// Cell forces in newtons.
    pub forces_n: Vec<f64>,
    /// Covariance of cell forces in N².
    pub covariance_n2: Array2<f64>,
    /// Total force in newtons, of cells, or of patches if uniform loads exclude it.
    pub total_n: f64,
    /// Standard deviation of the cell total.
    pub total_sd_n: f64,
    /// Bounds of the total.
    pub bounds: ForceBounds,
    /// Centre of pressure; `None` without load.
    pub centre: Option<CentreOfPressure>,
    /// Patches along x.
    pub patches: Vec<Patch>,
    /// Fitted reading; `None` if disabled.
    pub fitted: Vec<Option<f64>>,
    /// Residuals over noise; `None` if disabled.
    pub residuals: Vec<Option<f64>>,
    /// Least sum of squared residuals.
    pub chi_squared: f64,
    /// Goodness-of-fit bound of the misfit, error rate 0.001.
    pub worst_misfit: f64,
    /// Most probable λ, in 1/N²; `None` without load.
    pub smoothness: Option<f64>,
}

/// 95 % intervals of the total force for any shape, possibly infinite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ForceBounds {
    /// Total, in newtons.
    pub total_95_n: (f64, f64),
    /// Distance from the edges, in metres, within which a load reads like a larger force at the edge.
    pub margin_m: f64,
    /// Total in newtons, without load within that distance.
    pub seen_95_n: (f64, f64),
}

impl<'a> Profiler<'a> {
    /// Creates a profiler of a setup.
    ///
    /// # Errors
    /// [`LoadSensorsError`].
    pub fn from_setup(setup: &'a Setup) -> Result<Self, LoadSensorsError> {
        Ok(Self::new(LoadSensors::from_setup(setup)?))
    }

    /// Creates a profiler.
    pub fn new(sensors: LoadSensors<'a>) -> Self {
        let cells = Cells::new(sensors.extent);
        let worst_misfit = chi_squared_bound(sensors.enabled().count());
        let cumulative = CumulativeInfluence::new(&sensors, &cells);
        let problem = Problem::new(cumulative.over_cells(&cells), cells.roughness());
        Self { sensors, cells, problem, cumulative, worst_misfit }
    }

    /// Cells of the profiles.
    pub fn cells(&self) -> Cells {
        self.cells
    }

    /// Sensors.
    pub fn sensors(&self) -> &LoadSensors<'a> {
        &self.sensors
    }

    /// Estimates the load from a reading in SI units.
    ///
    /// # Errors
    /// [`ReadingError`].
    pub fn profile(&self, reading: &[f64]) -> Result<LoadProfile, ReadingError> {
        ReadingError::check(reading, self.sensors.channels.len())?;
        let channels = self.sensors.channels.iter().zip(reading);
        let whitened = channels.filter_map(|(channel, value)| {
            let channel = channel.as_ref()?;
            // Clamped, so that squares of huge values are finite.
            Some(((value - channel.offset) / channel.noise_sd).clamp(-LARGEST, LARGEST))
        });
        let y: Array1<f64> = whitened.collect();
        let silent = y.dot(&y) <= self.worst_misfit;
        let mixture = if silent { None } else { self.problem.solve(&y) };
        let smoothness = mixture.as_ref().map(|mixture| mixture.smoothness);
        let cells = self.cells.len();
        let Mixture { forces, covariance, least_misfit, .. } = mixture.unwrap_or_else(|| Mixture {
            forces: Array1::zeros(cells),
            covariance: Array2::zeros((cells, cells)),
            smoothness: 0.0,
            least_misfit: y.dot(&y),
        });
        let forces_n = forces.to_vec();
        let mut patches = find_patches(&self.cells, &forces_n, &covariance);
        let everything: Vec<usize> = (0..cells).collect();
        let mut centre = centre_of(&self.cells, &everything, &forces_n, &covariance);
        let mut total_n = forces.sum();
        let shapes = Bounds::new(&self.problem.influence, &y);
        let mut bounds = self.bounds(&shapes, &y, total_n);
        let even = self.patch_loads(&shapes, &y, &patches);
        let misfit = even.as_ref().map_or(least_misfit, |even| least_misfit.min(even.reported.chi_squared()));
        if let Some(centre) = &mut centre {
            match &even {
                Some(even) => {
                    self.apply_uniform_loads(even, &mut patches, (centre, &mut total_n, &mut bounds));
                }
                None => self.take_bounds(&shapes, &mut patches, centre),
            }
        }
        let is_resolved = even.is_none_or(|even| even.unresolved.is_none());
        let status = match smoothness {
            Some(_) if misfit > self.worst_misfit => Status::OutsideModel,
            Some(_) if is_resolved => Status::Located,
            Some(_) => Status::Ambiguous,
            None if silent => Status::NoContact,
            None => Status::OutsideModel,
        };
        let (fitted, residuals) = self.fitted(&y, &forces);
        Ok(LoadProfile {
            status,
            cells: self.cells,
            total_n,
            total_sd_n: covariance.sum().sqrt(),
            bounds,
            centre,
            patches,
            forces_n,
            covariance_n2: covariance,
            fitted,
            residuals,
            chi_squared: misfit,
            worst_misfit: self.worst_misfit,
            smoothness,
        })
    }

    fn bounds(&self, shapes: &Bounds, y: &Array1<f64>, total_n: f64) -> ForceBounds {
        let influence = &self.problem.influence;
        let cells = self.cells.len();
        let total_95_n = extend_to(shapes.of_sum(&Array1::ones(cells)), total_n);
        if total_n <= 0.0 {
            return ForceBounds { total_95_n, margin_m: 0.0, seen_95_n: total_95_n };
        }
        let blind = self.blind_cells(total_n);
        let seen: Vec<usize> = (0..cells).filter(|cell| !blind.contains(cell)).collect();
        let of_seen = Bounds::new(&influence.select(Axis(1), &seen), y).of_sum(&Array1::ones(seen.len()));
        let margin_m = blind.iter().map(|cell| self.cells.edge_distance_m(*cell)).fold(0.0, f64::max);
        ForceBounds { total_95_n, margin_m, seen_95_n: extend_to(of_seen, total_n) }
    }

    /// `None` if the misfit exceeds the noise.
    fn patch_loads(
        &'a self,
        shapes: &Bounds,
        y: &'a Array1<f64>,
        patches: &[Patch],
    ) -> Option<PatchLoads<'a>> {
        let starts: Vec<UniformLoad> = patches.iter().map(|patch| patch.as_load(self.cells.extent)).collect();
        let tables = Tables {
            cells: &self.cells,
            cumulative: &self.cumulative,
            influence: &self.problem.influence,
            least_misfit: shapes.least_misfit(),
        };
        PatchLoads::new(&tables, y, &starts).filter(|even| even.reported.chi_squared() <= self.worst_misfit)
    }

    /// Applies the number and intervals of uniform loads, and their values where these intervals exclude the
    /// profile's.
    fn apply_uniform_loads(
        &self,
        PatchLoads { reported, unresolved }: &PatchLoads,
        patches: &mut Vec<Patch>,
        (centre, total_n, bounds): (&mut CentreOfPressure, &mut f64, &mut ForceBounds),
    ) {
        let extent = self.cells.extent;
        if patches.len() != reported.count() {
            *patches =
                (0..reported.count()).map(|number| Patch::of_even_loads(reported, number, extent)).collect();
        }
        for (number, patch) in patches.iter_mut().enumerate() {
            patch.adopt_intervals(reported, number, extent);
        }
        if let Some(even) = unresolved {
            let nearest: Vec<Option<usize>> =
                (0..even.count()).map(|load| nearest(patches, even.fitted_load(load).centre())).collect();
            for (number, patch) in patches.iter_mut().enumerate() {
                let loads = (0..even.count()).filter(|load| nearest[*load] == Some(number));
                patch.widen(even, &loads.collect::<Vec<usize>>(), extent);
            }
        }
        let mut of_total = reported.interval_95(LoadQuantity::Total);
        centre.adopt_position_intervals(reported, extent, LoadQuantity::CentreOfPressure);
        if let Some(even) = unresolved {
            of_total = hull(of_total, even.interval_95(LoadQuantity::Total));
            centre.widen(even, extent, [LoadQuantity::CentreOfPressure].into_iter());
        }
        let is_held = centre.contains(centre.position) && contains(of_total, *total_n);
        if !is_held {
            centre.move_to(mean_position(patches));
            *total_n = patches.iter().map(|patch| patch.force_n).sum();
        }
        // Uniform loads may be narrower than a cell.
        bounds.total_95_n = extend_to(hull(bounds.total_95_n, of_total), *total_n);
        bounds.seen_95_n = extend_to(bounds.seen_95_n, *total_n);
    }

    /// Applies the bounds of any shape, with cells assigned to the nearest patch.
    fn take_bounds(&self, bounds: &Bounds, patches: &mut [Patch], centre: &mut CentreOfPressure) {
        let nearest: Vec<Option<usize>> = self.cells.centres().map(|place| nearest(patches, place)).collect();
        for (number, patch) in patches.iter_mut().enumerate() {
            let listed: Vec<usize> =
                (0..nearest.len()).filter(|cell| nearest[*cell] == Some(number)).collect();
            let mut c = Array1::zeros(nearest.len());
            listed.iter().for_each(|cell| c[*cell] = 1.0);
            patch.force_95_n = extend_to(bounds.of_sum(&c), patch.force_n);
            patch.centre.take_bounds(bounds, &self.cells, &listed);
        }
        let everything: Vec<usize> = (0..nearest.len()).collect();
        centre.take_bounds(bounds, &self.cells, &everything);
    }

    /// Edge cells within 1.96 standard deviations of the edge, by their limit.
    fn blind_cells(&self, force_n: f64) -> Vec<usize> {
        let extent = self.cells.extent;
        let is_blind = |cell: &usize| -> bool {
            let (from, to) = self.cells.corners(*cell);
            let limits = patch_limits(&self.sensors, &[UniformLoad::new(from, to, force_n)]);
            let Some(limit) = limits.as_deref().and_then(<[_]>::first) else { return true };
            let within =
                |at_m: f64, side_m: f64, sd_m: f64| at_m.min(side_m - at_m) < normal_interval_95(0.0, sd_m).1;
            let Position { x_m, y_m } = self.cells.centre(*cell);
            within(x_m, extent.length_m(), limit.sd_x_m)
                || extent.width_m().is_some_and(|width_m| within(y_m, width_m, limit.sd_y_m))
        };
        // From the edges inwards, without gaps.
        let Cells { columns, rows, .. } = self.cells;
        let from_edge = |cell: &usize| {
            let (column, row) = (cell % columns, cell / columns);
            let along = column.min(columns - 1 - column);
            if rows == 1 { along } else { along.min(row).min(rows - 1 - row) }
        };
        let mut blind = Vec::new();
        for ring in 0..columns {
            let cells = (0..self.cells.len()).filter(|cell| from_edge(cell) == ring);
            let found: Vec<usize> = cells.filter(|cell| is_blind(cell)).collect();
            if found.is_empty() {
                break;
            }
            blind.extend(found);
        }
        blind
    }

    /// Resolution at the profile's smoothness; `None` without load.
    pub fn resolution(&self, profile: &LoadProfile) -> Option<Resolution> {
        let (problem, cells) = (&self.problem, self.cells);
        let hessian = &problem.gram + &(profile.smoothness? * &problem.roughness);
        let factor = Cholesky::factor(hessian).ok()?;
        let half = factor.solve_lower_matrix(problem.gram.clone());
        // H⁻¹ = L⁻ᵀ·L⁻¹, and gram is symmetric: R = L⁻ᵀ·(L⁻¹·AᵀA).
        let kernels = factor.inverse_lower().t().dot(&half);
        let widths_m = (0..cells.len()).map(|cell| width_m(&cells, &kernels.row(cell).to_vec())).collect();
        Some(Resolution { cells, kernels, widths_m })
    }

    fn fitted(&self, y: &Array1<f64>, forces: &Array1<f64>) -> (Vec<Option<f64>>, Vec<Option<f64>>) {
        let explained = self.problem.influence.dot(forces);
        let mut each = explained.iter().zip(y);
        let channel = |channel: &Option<LoadChannel>| {
            let channel = channel.as_ref()?;
            let (explained, read) = each.next()?;
            Some((channel.offset + explained * channel.noise_sd, read - explained))
        };
        self.sensors.channels.iter().map(channel).map(|pair| (pair.map(|p| p.0), pair.map(|p| p.1))).unzip()
    }
}

impl LoadProfile {
    /// Density with 95 % interval, clipped at 0, in N/m or N/m².
    pub fn density(&self, cell: usize) -> (f64, (f64, f64)) {
        let measure = self.cells.measure();
        let (force, sd) = (self.forces_n[cell], self.covariance_n2[[cell, cell]].sqrt());
        let (low, high) = normal_interval_95(force, sd);
        (force / measure, (low.max(0.0) / measure, high / measure))
    }

    /// Standard deviation of the density, in N/m or N/m².
    pub fn density_sd(&self, cell: usize) -> f64 {
        self.covariance_n2[[cell, cell]].sqrt() / self.cells.measure()
    }
}

/// Cramér–Rao bounds of one patch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PatchLimit {
    /// Standard deviation of the centre along x, in metres.
    pub sd_x_m: f64,
    /// Standard deviation of the centre along y, in metres.
    pub sd_y_m: f64,
    /// Standard deviation of the force, in newtons.
    pub sd_force_n: f64,
}

/// Cramér–Rao bounds of uniform patches of known number and sizes: the inverse Fisher information (Σ_i
/// ∇m_i·∇m_iᵀ/σ_i²)⁻¹ of centres and forces, with readings m_i (Kay, *Fundamentals of Statistical Signal
/// Processing: Estimation Theory*, 1993, section 3.9). `None` if undetermined.
pub fn patch_limits(sensors: &LoadSensors, loads: &[UniformLoad]) -> Option<Vec<PatchLimit>> {
    // Force, and coordinates of the centre.
    let each = 1 + sensors.extent.dimensions();
    let alive: Vec<_> = sensors.enabled().collect();
    let mut slopes = Array2::zeros((alive.len(), each * loads.len()));
    for (channel, mut row) in alive.iter().zip(slopes.outer_iter_mut()) {
        for (number, load) in loads.iter().enumerate() {
            let first = each * number;
            row[first] = load.mean(&*channel.influence) / channel.noise_sd;
            for (i, slope) in load.mean_gradient(&*channel.influence).into_iter().take(each - 1).enumerate() {
                row[first + 1 + i] = load.force_n() * slope / channel.noise_sd;
            }
        }
    }
    // Columns of length 1, so that newtons and metres have equal weight.
    let lengths: Vec<f64> = slopes.columns().into_iter().map(|column| column.dot(&column).sqrt()).collect();
    for (mut column, length) in slopes.columns_mut().into_iter().zip(&lengths) {
        column /= *length;
    }
    let inverse = Cholesky::factor(slopes.t().dot(&slopes)).ok()?.inverse();
    let sd = |parameter: usize| inverse[[parameter, parameter]].sqrt() / lengths[parameter];
    let limit = |number: usize| {
        let first = each * number;
        let sd_y_m = sensors.extent.width_m().map_or(0.0, |_| sd(first + 2));
        PatchLimit { sd_x_m: sd(first + 1), sd_y_m, sd_force_n: sd(first) }
    };
    Some((0..loads.len()).map(limit).collect())
}

/// Averaging kernels of the linearised inverse, R = (AᵀA + λ·P)⁻¹·AᵀA: without the constraint x ≥ 0, cell i
/// is estimated as Σ_k R_ik·x_k (Backus and Gilbert, *The Resolving Power of Gross Earth Data*, Geophys. J.
/// R. astr. Soc. 16, 1968).
#[derive(Clone, Debug, PartialEq)]
pub struct Resolution {
    /// Cells.
    pub cells: Cells,
    /// R, by rows.
    pub kernels: Array2<f64>,
    /// Widths at half height in metres; on a plane the root of the area.
    pub widths_m: Vec<f64>,
}

impl Resolution {
    /// Median width in metres.
    pub fn median_width_m(&self) -> f64 {
        median(self.widths_m.clone()).unwrap_or(0.0)
    }
}

fn width_m(cells: &Cells, kernel: &[f64]) -> f64 {
    let Some(top) = (0..kernel.len()).max_by(|a, b| kernel[*a].total_cmp(&kernel[*b])) else { return 0.0 };
    let half = 0.5 * kernel[top];
    if let Extent::Plane { .. } = cells.extent {
        let above = kernel.iter().filter(|value| **value > half).count();
        return (above as f64 * cells.measure()).sqrt();
    }
    // Cells from the top to half height, interpolated between two cells; the edge is also an end.
    let reach = |steps: &mut dyn Iterator<Item = usize>| {
        let (mut before, mut reached) = (kernel[top], 0.0);
        for cell in steps {
            if kernel[cell] <= half {
                return reached + (before - half) / (before - kernel[cell]);
            }
            (before, reached) = (kernel[cell], reached + 1.0);
        }
        reached + 0.5
    };
    cells.sides_m()[0] * (reach(&mut (0..top).rev()) + reach(&mut (top + 1..kernel.len())))
}

#[cfg(test)]
mod coverage;
#[cfg(test)]
mod tests;
