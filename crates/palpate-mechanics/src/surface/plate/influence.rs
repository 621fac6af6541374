//! The influence function of one sensor on a plate, and how large influences are.

use super::mesh::{Derivative, Mesh, NODE_DEGREES};
use super::solved::{Functional, Solved};
use super::spec::{self, PlateSpec, PointSupport, PointSupportKind};
use crate::contact::Position;
use crate::sensing::SensorKind;
use crate::surface::InfluenceFunction;

/// Bicubic patches over the plate, with their own degrees of freedom.
///
/// By Maxwell's and Betti's reciprocity they are the deflection of the plate under what the sensor reads, taken as a load:
/// the reading of u = K⁻¹·f is s'·K⁻¹·f = (K⁻¹·s)'·f, and a downward unit force is −1 times the shape functions there.
pub(super) struct PlateInfluence {
    mesh: Mesh,
    degrees: Vec<f64>,
}

impl PlateInfluence {
    /// The influence functions of sensors of this `kind` at `sensors`; 0 everywhere for a raw channel, or a reaction where
    /// there is no support.
    pub fn of_all(spec: &PlateSpec, solved: &Solved, kind: SensorKind, sensors: &[Position]) -> Vec<Self> {
        let mesh = solved.mesh;
        let by_load = |load: &dyn Fn(Position) -> Functional, factor: f64| {
            let loads: Vec<_> = sensors.iter().map(|sensor| (load(*sensor), factor)).collect();
            solved.solutions(&loads)
        };
        let degrees = match kind {
            SensorKind::Deflection => by_load(&|sensor| weights(&mesh, sensor, Derivative::None), -1.0),
            SensorKind::Slope => by_load(&|sensor| weights(&mesh, sensor, Derivative::X), -1.0),
            // Strain on the lower face, t/2 below the middle, is (t/2)·∂²w/∂x²: a plate that is hollow above is stretched
            // below.
            SensorKind::Strain => by_load(&|sensor| curvature(&mesh, sensor), -0.5 * spec.thickness_m),
            SensorKind::Reaction => sensors.iter().map(|sensor| reaction(spec, solved, *sensor)).collect(),
            SensorKind::Raw => vec![vec![0.0; mesh.degrees()]; sensors.len()],
        };
        degrees.into_iter().map(|degrees| Self { mesh, degrees }).collect()
    }

    /// The largest magnitude at the nodes.
    pub fn largest(&self) -> f64 {
        let deflections = self.degrees.iter().step_by(NODE_DEGREES);
        deflections.fold(0.0, |largest: f64, value| largest.max(value.abs()))
    }
}

impl InfluenceFunction for PlateInfluence {
    fn at(&self, contact: Position) -> f64 {
        self.mesh.value(&self.degrees, self.mesh.locate(contact), Derivative::None)
    }

    fn gradient(&self, contact: Position) -> [f64; 2] {
        let place = self.mesh.locate(contact);
        [Derivative::X, Derivative::Y].map(|of| self.mesh.value(&self.degrees, place, of))
    }
}

/// Influence function of a plate whose equations have no solution: NaN everywhere.
pub(super) struct NotANumber;

impl InfluenceFunction for NotANumber {
    fn at(&self, _: Position) -> f64 {
        f64::NAN
    }

    fn gradient(&self, _: Position) -> [f64; 2] {
        [f64::NAN; 2]
    }
}

fn weights(mesh: &Mesh, at: Position, of: Derivative) -> Functional {
    mesh.weights(mesh.locate(at), of).to_vec()
}

/// ∂²w/∂x², which jumps from element to element: between two, the mean of both sides.
fn curvature(mesh: &Mesh, at: Position) -> Functional {
    let place = mesh.locate(at);
    let here = mesh.weights(place, Derivative::XX);
    match mesh.seen_from_before(place) {
        None => here.to_vec(),
        Some(before) => {
            let before = mesh.weights(before, Derivative::XX);
            here.into_iter().chain(before).map(|(degree, weight)| (degree, 0.5 * weight)).collect()
        }
    }
}

/// The force of the support at `at` on the plate, positive upward: of an elastic one −k·w.
fn reaction(spec: &PlateSpec, solved: &Solved, at: Position) -> Vec<f64> {
    let none = || vec![0.0; solved.mesh.degrees()];
    let Some(i) = spec::support_at(spec, at) else { return none() };
    let PointSupport { position, kind } = spec.supports[i];
    match kind {
        PointSupportKind::Simple => solved.reaction(i).unwrap_or_else(none),
        PointSupportKind::Elastic { stiffness_n_per_m } => {
            let load = weights(&solved.mesh, position, Derivative::None);
            solved.solutions(&[(load, stiffness_n_per_m)]).pop().unwrap_or_else(none)
        }
    }
}

/// Elements along the longer side of the mesh on which scales are taken, at most.
const ELEMENTS: usize = 24;

/// Sensors along each side of the grid over which the largest is sought, the edges included.
const SENSORS: usize = 9;

/// Largest magnitude of the influence of each kind of sensor, in the order of [`SensorKind::ALL`]; NaN when the plate's equations
/// have no solution.
pub(super) fn full_scales(spec: &PlateSpec) -> [f64; SensorKind::ALL.len()] {
    let mut coarse = PlateSpec { elements: spec.elements.min(ELEMENTS), ..spec.clone() };
    if spec::check(&coarse).is_err() {
        // Supports that only the finer mesh can tell apart.
        coarse.elements = spec.elements;
    }
    match Solved::new(&coarse) {
        Ok(solved) => SensorKind::ALL.map(|kind| largest(&coarse, &solved, kind)),
        Err(_) => [f64::NAN; SensorKind::ALL.len()],
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
