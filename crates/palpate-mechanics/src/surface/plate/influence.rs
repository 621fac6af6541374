//! Influence functions of sensors on a plate, and full scales.

use super::mesh::{Derivative, Mesh, NODE_DEGREES};
use super::solution::{Functional, PlateSolution, TOGETHER};
use super::spec::{self, PlateSpec};
use crate::contact::Position;
use crate::sensing::SensorKind;
use crate::surface::{ContactLoad, InfluenceFunction, ReadingsByContact};
use palpate_numerics::watch::{Cancelled, Watch};

/// Influence function as bicubic patches: the deflection under the sensor's functional s as a load, s'·K⁻¹·f
/// = (K⁻¹·s)'·f (Maxwell, Betti). A downward unit force is −1 times the shape functions.
pub(super) struct PlateInfluence {
    mesh: Mesh,
    degrees: Vec<f64>,
}

impl PlateInfluence {
    pub fn of_all(
        spec: &PlateSpec,
        solved: &PlateSolution,
        kind: SensorKind,
        sensors: &[Position],
        watch: Watch,
    ) -> Result<Vec<Self>, Cancelled> {
        let reads: Vec<SensorResponse> =
            sensors.iter().map(|sensor| SensorResponse::new(spec, solved, kind, *sensor)).collect();
        let load = |reads: &SensorResponse| match reads {
            SensorResponse::Shape(functional, factor) => Some((functional.clone(), *factor)),
            SensorResponse::Contact(_) | SensorResponse::Nothing => None,
        };
        let loads: Vec<_> = reads.iter().filter_map(load).collect();
        let mut solutions = solved.solutions(&loads, watch)?.into_iter();
        let degrees = reads.into_iter().filter_map(|reads| match reads {
            SensorResponse::Shape(..) => solutions.next(),
            SensorResponse::Contact(degrees) => Some(degrees),
            SensorResponse::Nothing => Some(vec![0.0; solved.mesh.degrees()]),
        });
        Ok(degrees.map(|degrees| Self { mesh: solved.mesh, degrees }).collect())
    }

    pub fn bytes(&self) -> usize {
        size_of_val(self.degrees.as_slice())
    }

    pub fn bytes_of(spec: &PlateSpec) -> f64 {
        (size_of::<f64>() * Mesh::new(spec.extent(), spec.elements).degrees()) as f64
    }

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

/// ∂²w/∂x², the mean of both sides between elements.
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

enum SensorResponse {
    Shape(Functional, f64),
    Contact(Vec<f64>),
    Nothing,
}

impl SensorResponse {
    fn new(spec: &PlateSpec, solved: &PlateSolution, kind: SensorKind, at: Position) -> Self {
        let mesh = &solved.mesh;
        match kind {
            SensorKind::Deflection => Self::Shape(weights(mesh, at, Derivative::None), -1.0),
            SensorKind::Slope => Self::Shape(weights(mesh, at, Derivative::X), -1.0),
            // Strain on the lower face is (t/2)·∂²w/∂x², with w upward.
            SensorKind::Strain => Self::Shape(curvature(mesh, at), -0.5 * spec.thickness_m),
            SensorKind::Reaction => Self::reaction(spec, solved, at),
            SensorKind::Raw => Self::Nothing,
        }
    }

    fn reaction(spec: &PlateSpec, solved: &PlateSolution, at: Position) -> Self {
        let force = spec::support_at(spec, at).and_then(|support| solved.reaction(support));
        force.map_or(Self::Nothing, Self::Contact)
    }
}

/// Readings by contact: the sensors' functionals of the shape K⁻¹·f.
pub(super) struct PlateReadings<'a> {
    solved: &'a PlateSolution,
    sensors: Vec<SensorResponse>,
}

impl<'a> PlateReadings<'a> {
    pub const BYTES_EACH: f64 =
        (size_of::<SensorResponse>() + 4 * NODE_DEGREES * size_of::<(usize, f64)>()) as f64;

    pub fn new(spec: &PlateSpec, solved: &'a PlateSolution, sensors: &[(SensorKind, Position)]) -> Self {
        let sensors =
            sensors.iter().map(|(kind, at)| SensorResponse::new(spec, solved, *kind, *at)).collect();
        Self { solved, sensors }
    }
}

impl ReadingsByContact for PlateReadings<'_> {
    fn readings_of_loads(&self, loads: &[ContactLoad]) -> Vec<Vec<f64>> {
        let mesh = &self.solved.mesh;
        let load = |load: &ContactLoad| match *load {
            ContactLoad::Force(at) => weights(mesh, at, Derivative::None),
            ContactLoad::ByX(at) => weights(mesh, at, Derivative::X),
            ContactLoad::ByY(at) => weights(mesh, at, Derivative::Y),
            ContactLoad::Degree(degree) => vec![(degree, 1.0)],
        };
        let value = |functional: &Functional, degrees: &[f64]| -> f64 {
            functional.iter().map(|(degree, weight)| weight * degrees[*degree]).sum()
        };
        let loads: Vec<(Functional, f64)> = loads.iter().map(|of| (load(of), 1.0)).collect();
        let readings = |(shape, (load, _)): (Vec<f64>, &(Functional, f64))| {
            let reading = |reads: &SensorResponse| match reads {
                SensorResponse::Shape(functional, factor) => factor * value(functional, &shape),
                SensorResponse::Contact(degrees) => value(load, degrees),
                SensorResponse::Nothing => 0.0,
            };
            self.sensors.iter().map(reading).collect()
        };
        let each = loads.chunks(TOGETHER).flat_map(|loads| {
            // Few solutions need no watch.
            let solutions = self.solved.solutions(loads, Watch::NONE).unwrap_or_default();
            solutions.into_iter().zip(loads).map(readings).collect::<Vec<_>>()
        });
        each.collect()
    }

    fn degrees(&self, contact: Position) -> Vec<(usize, f64)> {
        weights(&self.solved.mesh, contact, Derivative::None)
    }

    fn batch_size(&self) -> usize {
        TOGETHER
    }
}

const ELEMENTS: usize = 24;

const SENSORS: usize = 9;

/// Largest influence of each of [`SensorKind::ALL`]; NaN without a solution.
pub(super) fn full_scales(spec: &PlateSpec) -> [f64; SensorKind::ALL.len()] {
    let mut coarse = PlateSpec { elements: spec.elements.min(ELEMENTS), ..spec.clone() };
    if spec::check(&coarse).is_err() {
        // Only the finer mesh separates the supports.
        coarse.elements = spec.elements;
    }
    match PlateSolution::new(&coarse, Watch::NONE) {
        Ok(solved) => SensorKind::ALL.map(|kind| largest(&coarse, &solved, kind)),
        Err(_) => [f64::NAN; SensorKind::ALL.len()],
    }
}

fn largest(spec: &PlateSpec, solved: &PlateSolution, kind: SensorKind) -> f64 {
    let sensors: Vec<Position> = match kind {
        SensorKind::Raw => Vec::new(),
        SensorKind::Reaction => spec.supports.iter().map(|support| support.position).collect(),
        SensorKind::Deflection | SensorKind::Slope | SensorKind::Strain => grid(spec),
    };
    let functions = PlateInfluence::of_all(spec, solved, kind, &sensors, Watch::NONE).unwrap_or_default();
    functions.iter().map(PlateInfluence::largest).fold(0.0, f64::max)
}

fn grid(spec: &PlateSpec) -> Vec<Position> {
    let at = |i: usize, size_m: f64| i as f64 / (SENSORS - 1) as f64 * size_m;
    let columns =
        |j| (0..SENSORS).map(move |i| Position { x_m: at(i, spec.length_m), y_m: at(j, spec.width_m) });
    (0..SENSORS).flat_map(columns).collect()
}
