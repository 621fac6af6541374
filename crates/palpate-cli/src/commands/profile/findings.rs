//! What is printed of a profile, in the units that people read.

use palpate_estimators::estimator::{
    CentreOfPressure, LoadProfile, Patch, PatchLimit, Profiler, patch_limits,
};
use palpate_mechanics::surface::{Extent, UniformLoad};

/// All that a reading tells of the load; what it does not tell is null.
#[derive(serde::Serialize)]
pub struct Findings {
    /// The line of the reading; null for a simulated one.
    pub line: Option<u64>,
    pub status: &'static str,
    pub misfit: f64,
    pub worst_misfit: f64,
    pub total_n: Interval,
    pub centre_x_mm: Option<Interval>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre_y_mm: Option<Interval>,
    /// Median width of the averaging kernels.
    pub resolution_mm: Option<f64>,
    pub patches: Vec<PatchFound>,
    /// The loads that were simulated.
    pub loads: Vec<TrueLoad>,
    pub profile: Vec<CellFound>,
    /// Residual of each channel over its noise; null for dead ones.
    pub residuals: Vec<Option<f64>>,
    #[serde(skip)]
    pub extent: Extent,
}

/// A value, its standard deviation and the ends of its 95 % interval.
#[derive(serde::Serialize)]
pub struct Interval {
    pub value: f64,
    pub sd: f64,
    pub low: f64,
    pub high: f64,
}

#[derive(serde::Serialize)]
pub struct PatchFound {
    pub stretch_mm: [f64; 2],
    pub centre_x_mm: Interval,
    /// What a plane has besides.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub across: Option<Across<Interval>>,
    pub force_n: Interval,
    /// Least standard deviations for evenly loaded patches of this number and these sizes.
    pub limit_x_mm: Option<f64>,
    pub limit_force_n: Option<f64>,
}

#[derive(serde::Serialize)]
pub struct TrueLoad {
    pub stretch_mm: [f64; 2],
    pub centre_x_mm: f64,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub across: Option<Across<f64>>,
    pub force_n: f64,
    pub limit_x_mm: Option<f64>,
    pub limit_force_n: Option<f64>,
}

/// A patch or a load across the width of a plane.
#[derive(serde::Serialize)]
pub struct Across<T> {
    pub stretch_y_mm: [f64; 2],
    pub centre_y_mm: T,
    pub limit_y_mm: Option<f64>,
}

/// A cell of the surface with its density, in N/mm on a line and N/mm² on a plane.
#[derive(serde::Serialize)]
pub struct CellFound {
    x_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<f64>,
    density: f64,
    low: f64,
    high: f64,
}

impl Interval {
    fn new(value: f64, sd: f64, (low, high): (f64, f64), unit: f64) -> Self {
        Self { value: value * unit, sd: sd * unit, low: low * unit, high: high * unit }
    }
}

impl Findings {
    pub fn of(
        profiler: &Profiler,
        profile: &LoadProfile,
        limits: Option<&[PatchLimit]>,
        truth: &[UniformLoad],
        line: Option<u64>,
    ) -> Self {
        let extent = profile.cells.extent;
        let of_truth = patch_limits(profiler.sensors(), truth);
        let limit =
            |limits: Option<&[PatchLimit]>, i: usize| limits.and_then(|limits| limits.get(i).copied());
        let patches = profile.patches.iter().enumerate();
        let loads = truth.iter().enumerate();
        Self {
            line,
            status: profile.status.name(),
            misfit: profile.misfit,
            worst_misfit: profile.worst_misfit,
            total_n: Interval::new(profile.total_n, profile.total_sd_n, profile.total_95_n(), 1.0),
            centre_x_mm: profile.centre.map(|centre| x_mm(&centre)),
            centre_y_mm: profile.centre.and_then(|centre| extent.across(y_mm(&centre))),
            resolution_mm: profiler.resolution(profile).map(|resolution| resolution.median_width_m() * 1e3),
            patches: patches.map(|(i, patch)| PatchFound::of(patch, limit(limits, i), extent)).collect(),
            loads: loads.map(|(i, load)| TrueLoad::of(load, limit(of_truth.as_deref(), i), extent)).collect(),
            profile: (0..profile.cells.len()).map(|cell| CellFound::of(profile, cell)).collect(),
            residuals: profile.residuals.clone(),
            extent,
        }
    }
}

impl PatchFound {
    fn of(patch: &Patch, limit: Option<PatchLimit>, extent: Extent) -> Self {
        Self {
            stretch_mm: [patch.from.x_m * 1e3, patch.to.x_m * 1e3],
            centre_x_mm: x_mm(&patch.centre),
            across: extent.across(Across {
                stretch_y_mm: [patch.from.y_m * 1e3, patch.to.y_m * 1e3],
                centre_y_mm: y_mm(&patch.centre),
                limit_y_mm: limit.map(|limit| limit.sd_y_m * 1e3),
            }),
            force_n: Interval::new(patch.force_n, patch.force_sd_n, patch.force_95_n(), 1.0),
            limit_x_mm: limit.map(|limit| limit.sd_x_m * 1e3),
            limit_force_n: limit.map(|limit| limit.sd_force_n),
        }
    }
}

impl TrueLoad {
    fn of(load: &UniformLoad, limit: Option<PatchLimit>, extent: Extent) -> Self {
        Self {
            stretch_mm: [load.from().x_m * 1e3, load.to().x_m * 1e3],
            centre_x_mm: load.centre().x_m * 1e3,
            across: extent.across(Across {
                stretch_y_mm: [load.from().y_m * 1e3, load.to().y_m * 1e3],
                centre_y_mm: load.centre().y_m * 1e3,
                limit_y_mm: limit.map(|limit| limit.sd_y_m * 1e3),
            }),
            force_n: load.force_n(),
            limit_x_mm: limit.map(|limit| limit.sd_x_m * 1e3),
            limit_force_n: limit.map(|limit| limit.sd_force_n),
        }
    }
}

impl CellFound {
    fn of(profile: &LoadProfile, cell: usize) -> Self {
        let extent = profile.cells.extent;
        let per_mm = match extent {
            Extent::Line { .. } => 1e-3,
            Extent::Plane { .. } => 1e-6,
        };
        let (centre, (density, (low, high))) = (profile.cells.centre(cell), profile.density(cell));
        Self {
            x_mm: centre.x_m * 1e3,
            y_mm: extent.across(centre.y_m * 1e3),
            density: density * per_mm,
            low: low * per_mm,
            high: high * per_mm,
        }
    }
}

fn x_mm(centre: &CentreOfPressure) -> Interval {
    Interval::new(centre.position.x_m, centre.sd_x_m, centre.x_95_m(), 1e3)
}

fn y_mm(centre: &CentreOfPressure) -> Interval {
    Interval::new(centre.position.y_m, centre.sd_y_m, centre.y_95_m(), 1e3)
}
