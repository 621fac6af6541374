//! The elements, their order of elimination, and their memory.

use proptest::prelude::*;

use super::super::dissection::{coupled_pairs, nested_dissection};
use super::super::mesh::{Mesh, element_stiffness};
use super::*;
use crate::surface::Extent;

/// Degrees of freedom of w = (a·x² + 2·b·x·y + c·y²)/2 in one element.
fn bent(mesh: &Mesh, [a, b, c]: [f64; 3]) -> [f64; 16] {
    let (h_x, h_y) = (mesh.side_x_m, mesh.side_y_m);
    std::array::from_fn(|i| {
        let (x, y) = (i % 4, i / 4);
        let (x_m, y_m) = ((x / 2) as f64 * h_x, (y / 2) as f64 * h_y);
        match (x % 2, y % 2) {
            (0, 0) => 0.5 * (a * x_m * x_m + 2.0 * b * x_m * y_m + c * y_m * y_m),
            (1, 0) => h_x * (a * x_m + b * y_m),
            (0, 1) => h_y * (b * x_m + c * y_m),
            _ => h_x * h_y * b,
        }
    })
}

proptest! {
    #[test]
    fn constant_curvatures_have_their_bending_energy(
        curvatures in [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64], nu in -0.9..0.5f64, width in 0.2..3.0f64,
    ) {
        let mesh = Mesh { columns: 1, rows: 1, side_x_m: 0.7, side_y_m: width };
        let stiffness = element_stiffness(&mesh, 5.0, nu);
        let w = bent(&mesh, curvatures);
        let forces = stiffness.map(|row| row.iter().zip(&w).map(|(k, w)| k * w).sum::<f64>());
        let energy: f64 = forces.iter().zip(&w).map(|(f, w)| 0.5 * f * w).sum();
        let [a, b, c] = curvatures;
        let density = 0.5 * 5.0 * (a * a + c * c + 2.0 * nu * a * c + 2.0 * (1.0 - nu) * b * b);
        prop_assert!((energy - density * 0.7 * width).abs() < 1e-12 * 20.0);
    }

    #[test]
    fn nested_dissection_names_every_node_once(columns in 1..40usize, rows in 1..40usize) {
        let mut order = nested_dissection(columns, rows);
        prop_assert_eq!(order.len(), columns * rows);
        order.sort_unstable();
        order.dedup();
        prop_assert_eq!(order.len(), columns * rows);
        prop_assert!(order.iter().all(|(column, row)| *column < columns && *row < rows));
    }
}

#[test]
fn no_factor_is_larger_than_was_estimated() {
    for (length_m, width_m, elements) in [(0.3, 0.3, 16), (0.3, 0.3, 48), (0.3, 0.1, 90), (0.2, 1.0, 60)] {
        let spec = steel(length_m, width_m, Edges::all(Edge::Free), elements);
        let spec = PlateSpec {
            supports: vec![simple_at(0.0, 0.0), simple_at(0.1, 0.0), simple_at(0.0, 0.1)],
            ..spec
        };
        let plate = plate(spec);
        let (columns, rows) = mesh_of(&plate).nodes();
        let estimated = 16.0 * coupled_pairs(columns, rows);
        let stored = plate.factor_size().unwrap() as f64;
        println!(
            "{columns} × {rows} nodes: {stored} numbers, {:.3} of those that couple",
            stored / estimated
        );
        assert!((0.7..1.2).contains(&(stored / estimated)), "{estimated} for {stored} numbers");
        assert!(8.0 * 1.2 * estimated < plate.estimated_bytes());
    }
}

#[test]
fn a_mesh_has_no_element_longer_than_wide_unless_four_are_too_many() {
    let mesh = |length_m, width_m, elements| {
        let Mesh { columns: across, rows: up, .. } =
            Mesh::new(Extent::plane(length_m, width_m).unwrap(), elements);
        (across, up)
    };
    assert_eq!(mesh(0.3, 0.3, 48), (48, 48));
    assert_eq!(mesh(0.3, 0.2, 48), (48, 32));
    assert_eq!(mesh(0.2, 0.3, 50), (34, 50));
    assert_eq!(mesh(0.4, 0.01, 40), (40, 4));
}

/// Largest difference of deflections between two meshes, as a share of full scale, also for contacts at the
/// sensors.
fn difference(one: &Plate, other: &Plate) -> f64 {
    let place = |x: f64, y: f64| at(one.spec().length_m * x, one.spec().width_m * y);
    let sensors = [(0.25, 0.25), (0.5, 0.5), (0.611, 0.3), (0.9, 0.07), (0.99, 0.4)];
    let mut worst = 0.0f64;
    for (x, y) in sensors {
        let sensor = place(x, y);
        let [here, there] =
            [one, other].map(|plate| plate.influence_function(SensorKind::Deflection, sensor));
        let grid = (0..1600).map(|i| place((i % 40) as f64 / 39.0, (i / 40) as f64 / 39.0));
        for contact in grid.chain([sensor]) {
            worst = worst.max((here.at(contact) - there.at(contact)).abs());
        }
    }
    worst / one.full_scale(SensorKind::Deflection)
}

/// Convergence at a force's singularity is of second order, so the error of the finer of two meshes is a
/// third of their difference.
#[test]
fn the_default_mesh_holds_deflections_to_a_ten_thousandth_of_full_scale() {
    let mut on_points = steel(0.3, 0.2, Edges::all(Edge::Free), 64);
    on_points.supports = vec![simple_at(0.02, 0.03), simple_at(0.28, 0.03), simple_at(0.15, 0.17)];
    let specs = [
        ("simple, square", steel(0.3, 0.3, Edges::all(Edge::Simple), 64), 1e-4),
        ("clamped, square", steel(0.3, 0.3, Edges::all(Edge::Clamped), 64), 1e-4),
        ("clamped, 3 : 2", steel(0.3, 0.2, Edges::all(Edge::Clamped), 64), 2e-4),
        ("on three points, 3 : 2", on_points, 1e-4),
    ];
    assert_eq!(PlateSpec::DEFAULT_ELEMENTS, 2 * 64);
    for (name, spec, most) in specs {
        let fine = plate(PlateSpec { elements: PlateSpec::DEFAULT_ELEMENTS, ..spec.clone() });
        let error = difference(&fine, &plate(spec)) / 3.0;
        println!("{name}: {error:.1e} of full scale");
        assert!(error < most, "{name}: {error:e}");
    }
}
