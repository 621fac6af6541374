//! Strips without Poisson's effect are beams.

use super::*;
use crate::surface::Beam;

const LENGTH_M: f64 = 0.4;
const WIDTH_M: f64 = 0.04;

fn strip(left: Edge, right: Edge) -> Plate {
    let edges = Edges { left, right, bottom: Edge::Free, top: Edge::Free };
    plate(PlateSpec { poissons_ratio: 0.0, ..steel(LENGTH_M, WIDTH_M, edges, 40) })
}

/// Mean of an influence function across the strip, for a line load.
fn across(plate: &Plate, kind: SensorKind, sensor: Position, x_m: f64) -> f64 {
    let influence = plate.influence_function(kind, sensor);
    let mesh = mesh_of(plate);
    let places = simpson(mesh.rows, mesh.side_y_m);
    places.iter().map(|(y_m, weight)| weight * influence.at(at(x_m, *y_m))).sum::<f64>() / WIDTH_M
}

/// Element boundaries, where the elements represent a beam's cubics exactly.
const SENSORS_M: [f64; 3] = [0.05, 0.2, 0.33];
const CONTACTS_M: [f64; 4] = [0.04, 0.11, 0.2, 0.37];

#[test]
fn a_strip_on_simple_ends_is_the_beam() {
    let strip = strip(Edge::Simple, Edge::Simple);
    let beam = Beam::new(LENGTH_M, WIDTH_M, 0.8e-3, 200e9).unwrap();
    for kind in [SensorKind::Deflection, SensorKind::Slope, SensorKind::Strain] {
        let scale = beam.full_scale(kind);
        for sensor_m in SENSORS_M {
            for contact_m in CONTACTS_M {
                let found = across(&strip, kind, at(sensor_m, 0.013), contact_m);
                let expected = beam.influence(kind, Position::along(sensor_m), Position::along(contact_m));
                let error = (found - expected).abs() / scale;
                assert!(
                    error < 1e-9,
                    "{kind} at {sensor_m} of {contact_m}: {found} against {expected}, {error:.1e}"
                );
            }
        }
    }
}

/// y = −x²·(3·a − x)/(6·E·I) up to the force at a, and a straight line beyond.
#[test]
fn a_strip_clamped_at_one_end_is_the_cantilever() {
    let strip = strip(Edge::Clamped, Edge::Free);
    let stiffness = strip.spec().flexural_rigidity() * WIDTH_M;
    let scale = LENGTH_M.powi(3) / (3.0 * stiffness);
    for sensor_m in SENSORS_M {
        for contact_m in CONTACTS_M {
            let (near, far) = (sensor_m.min(contact_m), sensor_m.max(contact_m));
            let expected = -near * near * (3.0 * far - near) / (6.0 * stiffness);
            let found = across(&strip, SensorKind::Deflection, at(sensor_m, 0.031), contact_m);
            assert!((found - expected).abs() < 1e-9 * scale, "{found} against {expected}");
        }
    }
}
