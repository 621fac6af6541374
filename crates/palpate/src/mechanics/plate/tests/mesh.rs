//! The elements, their order of elimination, and what they need.

use proptest::prelude::*;

use super::super::dissection::{coupled_pairs, nested_dissection};
use super::super::mesh::Mesh;
use super::super::stiffness::element_stiffness;
use super::*;
use crate::mechanics::Extent;

/// The degrees of freedom of w = (a·x² + 2·b·x·y + c·y²)/2 in one element.
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
        let mesh = Mesh { across: 1, up: 1, side_x_m: 0.7, side_y_m: width };
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
        let stored = plate.factor_size(EliminationOrder::AsNumbered).unwrap() as f64;
        println!(
            "{columns} × {rows} nodes: {stored} numbers, {:.3} of those that couple",
            stored / estimated
        );
        let bytes = plate.estimated_bytes();
        assert!(8.0 * stored < bytes && bytes < 3.0 * 8.0 * stored, "{bytes} for {stored} numbers");
    }
}

#[test]
fn a_mesh_has_no_element_longer_than_wide_unless_four_are_too_many() {
    let mesh = |length_m, width_m, elements| {
        let Mesh { across, up, .. } = Mesh::new(Extent { length_m, width_m: Some(width_m) }, elements);
        (across, up)
    };
    assert_eq!(mesh(0.3, 0.3, 48), (48, 48));
    assert_eq!(mesh(0.3, 0.2, 48), (48, 32));
    assert_eq!(mesh(0.2, 0.3, 50), (34, 50));
    assert_eq!(mesh(0.4, 0.01, 40), (40, 4));
}

#[test]
fn the_default_mesh_holds_deflections_to_a_ten_thousandth_of_full_scale() {
    let mut on_points = steel(0.3, 0.2, Edges::all(Edge::Free), 48);
    on_points.supports = vec![simple_at(0.02, 0.03), simple_at(0.28, 0.03), simple_at(0.15, 0.17)];
    let cantilever = Edges { left: Edge::Clamped, ..Edges::all(Edge::Free) };
    let specs = [
        ("simple", steel(0.3, 0.3, Edges::all(Edge::Simple), 48)),
        ("clamped", steel(0.3, 0.2, Edges::all(Edge::Clamped), 48)),
        ("cantilever", steel(0.3, 0.3, cantilever, 48)),
        ("on points", on_points),
    ];
    for (name, spec) in specs {
        let elements = PlateSpec::DEFAULT_ELEMENTS;
        let [coarse, fine] =
            [elements, 2 * elements].map(|n| plate(PlateSpec { elements: n, ..spec.clone() }));
        let mut worst = 0.0f64;
        for i in 0..5 {
            let sensor = at(
                0.3 * [0.25, 0.5, 0.611, 0.9, 0.99][i],
                coarse.spec().width_m * [0.25, 0.5, 0.3, 0.07, 0.4][i],
            );
            let [of_coarse, of_fine] =
                [&coarse, &fine].map(|plate| plate.influence_function(SensorKind::Deflection, sensor));
            for j in 0..40 {
                for k in 0..40 {
                    let contact = at(0.3 * j as f64 / 39.0, coarse.spec().width_m * k as f64 / 39.0);
                    worst = worst.max((of_coarse.at(contact) - of_fine.at(contact)).abs());
                }
            }
            worst = worst.max((of_coarse.at(sensor) - of_fine.at(sensor)).abs());
        }
        // With the second order of a force's singularity, the finer mesh has a quarter of the coarser one's error.
        let error = 4.0 / 3.0 * worst / coarse.full_scale(SensorKind::Deflection);
        println!("{name}: {error:.1e} of full scale");
        assert!(error < 1e-4, "{name}: {error:e}");
    }
}
