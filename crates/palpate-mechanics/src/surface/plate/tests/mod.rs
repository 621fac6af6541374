//! Plates compared with series and beams, and properties of every plate.

mod balance;
mod beams;
mod mesh;
mod properties;
mod refusals;
mod series;
mod stopped;

use super::*;

/// Steel plate, 0.8 mm thick.
fn steel(length_m: f64, width_m: f64, edges: Edges, elements: usize) -> PlateSpec {
    PlateSpec {
        length_m,
        width_m,
        thickness_m: 0.8e-3,
        youngs_modulus_pa: 200e9,
        poissons_ratio: 0.3,
        edges,
        supports: Vec::new(),
        elements,
    }
}

fn plate(spec: PlateSpec) -> Plate {
    let plate = Plate::new(spec).unwrap();
    plate.solve().unwrap();
    plate
}

fn at(x_m: f64, y_m: f64) -> Position {
    Position { x_m, y_m }
}

fn simple_at(x_m: f64, y_m: f64) -> PointSupport {
    PointSupport { position: at(x_m, y_m), kind: PointSupportKind::Simple }
}

fn elastic_at(x_m: f64, y_m: f64, stiffness_n_per_m: f64) -> PointSupport {
    PointSupport { position: at(x_m, y_m), kind: PointSupportKind::Elastic { stiffness_n_per_m } }
}

fn deflection(plate: &Plate, sensor: Position, contact: Position) -> f64 {
    plate.influence(SensorKind::Deflection, sensor, contact)
}

/// Integral of an influence function over the plate, for a load of 1 Pa, by Simpson's rule on the elements
/// (exact for cubics).
fn under_uniform_load(plate: &Plate, kind: SensorKind, sensor: Position) -> f64 {
    let influence = plate.influence_function(kind, sensor);
    let mesh = mesh_of(plate);
    let (along_x, along_y) = (simpson(mesh.columns, mesh.side_x_m), simpson(mesh.rows, mesh.side_y_m));
    let lines = along_y.iter().map(|(y_m, weight_y)| {
        let line: f64 = along_x.iter().map(|(x_m, weight_x)| weight_x * influence.at(at(*x_m, *y_m))).sum();
        weight_y * line
    });
    lines.sum()
}

/// Points and weights of Simpson's rule over `count` intervals of `side_m`.
fn simpson(count: usize, side_m: f64) -> Vec<(f64, f64)> {
    let halves = 2 * count;
    let weight = |i: usize| match i {
        0 => 1.0,
        i if i == halves => 1.0,
        i => 2.0 + 2.0 * (i % 2) as f64,
    };
    (0..=halves).map(|i| (i as f64 * side_m / 2.0, weight(i) * side_m / 6.0)).collect()
}

fn mesh_of(plate: &Plate) -> super::mesh::Mesh {
    super::mesh::Mesh::new(plate.extent(), plate.spec().elements)
}

/// log₂ of the ratio of each error to the next.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}

fn off(found: f64, expected: f64) -> f64 {
    (found / expected - 1.0).abs()
}
