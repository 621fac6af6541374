//! How large the influences on a plate are.

use super::influence::PlateInfluence;
use super::solved::Solved;
use super::spec::PlateSpec;
use super::{Plate, check};
use crate::contact::Position;
use crate::sensing::SensorKind;

/// Elements along the longer side of the mesh on which scales are taken, at most.
const ELEMENTS: usize = 24;

/// Sensors along each side of the grid over which the largest is sought, the edges included.
const SENSORS: usize = 9;

/// The largest magnitude of each kind of influence, in the order of [`SensorKind::ALL`].
pub(super) struct FullScales([f64; SensorKind::ALL.len()]);

impl FullScales {
    /// Those of `plate`; NaN when its equations have no solution.
    pub fn of(plate: &Plate) -> Self {
        let spec = plate.spec();
        let mut coarse = PlateSpec { elements: spec.elements.min(ELEMENTS), ..spec.clone() };
        if check::check(&coarse).is_err() {
            // Supports that only the finer mesh can tell apart.
            coarse.elements = spec.elements;
        }
        match Solved::new(&coarse) {
            Ok(solved) => Self(SensorKind::ALL.map(|kind| largest(&coarse, &solved, kind))),
            Err(_) => Self([f64::NAN; SensorKind::ALL.len()]),
        }
    }

    /// The one of `kind`.
    pub fn of_kind(&self, kind: SensorKind) -> f64 {
        let index = SensorKind::ALL.iter().position(|other| *other == kind);
        index.map_or(0.0, |i| self.0[i])
    }
}

fn largest(spec: &PlateSpec, solved: &Solved, kind: SensorKind) -> f64 {
    let sensors: Vec<Position> = match kind {
        SensorKind::Raw => Vec::new(),
        SensorKind::Reaction => spec.supports.iter().map(|support| support.position).collect(),
        SensorKind::Deflection | SensorKind::Slope | SensorKind::Strain => grid(spec),
    };
    let functions = PlateInfluence::of_all(spec, solved, kind, &sensors);
    functions.iter().map(PlateInfluence::largest).fold(0.0, f64::max)
}

fn grid(spec: &PlateSpec) -> Vec<Position> {
    let at = |i: usize, size_m: f64| i as f64 / (SENSORS - 1) as f64 * size_m;
    let columns =
        |j| (0..SENSORS).map(move |i| Position { x_m: at(i, spec.length_m), y_m: at(j, spec.width_m) });
    (0..SENSORS).flat_map(columns).collect()
}
