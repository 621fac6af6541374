use std::sync::LazyLock;

use super::*;

static LINE: LazyLock<Extent> = LazyLock::new(|| Extent::line(0.4).unwrap());
static PLANE: LazyLock<Extent> = LazyLock::new(|| Extent::plane(0.3, 0.2).unwrap());

fn millimetres(arrangement: &Arrangement, count: usize) -> Vec<f64> {
    let positions = arrangement.positions(count, *LINE).unwrap();
    positions.iter().map(|position| position.x_m * 1e3).collect()
}

#[track_caller]
fn assert_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
    }
}

fn edge_dense(middle: usize) -> Arrangement {
    Arrangement::EdgeDense { middle, portion: Arrangement::PAPER_PORTION }
}

#[test]
fn sets_1_to_3_are_equally_spaced() {
    let twenty: Vec<f64> = (0..20).map(|i| 10.0 + 20.0 * f64::from(i)).collect();
    let thirty: Vec<f64> = (0..30).map(|i| 20.0 / 3.0 + 40.0 / 3.0 * f64::from(i)).collect();
    let ten = [20.0, 60.0, 100.0, 140.0, 180.0, 220.0, 260.0, 300.0, 340.0, 380.0];
    assert_close(&millimetres(&Arrangement::Even, 10), &ten);
    assert_close(&millimetres(&Arrangement::Even, 20), &twenty);
    assert_close(&millimetres(&Arrangement::Even, 30), &thirty);
}

#[test]
fn even_positions_over_a_portion_include_its_ends() {
    let over = |portion| Arrangement::EvenOver { portion };
    assert_close(&millimetres(&over((0.1, 0.9)), 5), &[40.0, 120.0, 200.0, 280.0, 360.0]);
    assert_close(&millimetres(&over((0.1, 0.5)), 1), &[120.0]);
    // The paper's ten even positions span 0.05 to 0.95 of the length.
    assert_close(&millimetres(&over((0.05, 0.95)), 10), &millimetres(&Arrangement::Even, 10));
    for portion in [(0.5, 0.5), (-0.1, 0.5), (0.5, 1.1), (f64::NAN, 0.5)] {
        let refused = over(portion).positions(3, *LINE).unwrap_err();
        assert!(matches!(refused, ArrangementError::EvenPortion { .. }), "{refused}");
    }
    assert!(matches!(over((0.1, 0.9)).positions(3, *PLANE), Err(ArrangementError::LineOnPlane { .. })));
}

fn table_3(edge: u32, pitch_mm: f64, middle: &[f64]) -> Vec<f64> {
    let left = (1..=edge).map(|i| f64::from(i) * pitch_mm);
    let right = (1..=edge).rev().map(|i| 400.0 - f64::from(i) * pitch_mm);
    left.chain(middle.iter().copied()).chain(right).collect()
}

#[test]
fn six_in_the_middle_are_e1_1_e2_1_and_e3_1() {
    let middle = [100.0, 140.0, 180.0, 220.0, 260.0, 300.0];
    assert_close(&millimetres(&edge_dense(6), 10), &table_3(2, 100.0 / 3.0, &middle));
    assert_close(&millimetres(&edge_dense(6), 20), &table_3(7, 12.5, &middle));
    assert_close(&millimetres(&edge_dense(6), 30), &table_3(12, 100.0 / 13.0, &middle));
}

#[test]
fn four_in_the_middle_are_e1_2_e2_2_and_e3_2() {
    let middle = [100.0, 500.0 / 3.0, 700.0 / 3.0, 300.0];
    assert_close(&millimetres(&edge_dense(4), 10), &table_3(3, 25.0, &middle));
    assert_close(&millimetres(&edge_dense(4), 20), &table_3(8, 100.0 / 9.0, &middle));
    assert_close(&millimetres(&edge_dense(4), 30), &table_3(13, 100.0 / 14.0, &middle));
}

#[test]
fn all_in_the_middle_leave_the_edges_empty() {
    assert_close(&millimetres(&edge_dense(3), 3), &[100.0, 200.0, 300.0]);
}

#[test]
fn invalid_arrangement_is_refused_with_value_and_bound() {
    let explicit = |x_m| Arrangement::Explicit(vec![Position::along(0.1), Position::along(x_m)]);
    let refusals = [
        (Arrangement::Even, 0),
        (edge_dense(1), 10),
        (edge_dense(12), 10),
        (edge_dense(5), 10),
        (Arrangement::EdgeDense { middle: 4, portion: (0.5, 0.5) }, 10),
        (Arrangement::EdgeDense { middle: 4, portion: (f64::NAN, 0.5) }, 10),
        (explicit(0.2), 3),
        (explicit(0.41), 2),
        (explicit(f64::NAN), 2),
    ];
    let messages = refusals.map(|(rule, count)| rule.positions(count, *LINE).unwrap_err().to_string());
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn a_grid_lies_in_the_middles_of_cells() {
    let grid = Arrangement::Grid { columns: 3, rows: 2 };
    let positions = grid.positions(6, *PLANE).unwrap();
    let millimetres: Vec<_> = positions.iter().map(|p| [p.x_m, p.y_m].map(|m| (m * 1e3).round())).collect();
    let expected =
        [[50.0, 50.0], [150.0, 50.0], [250.0, 50.0], [50.0, 150.0], [150.0, 150.0], [250.0, 150.0]];
    assert_eq!(millimetres, expected);
}

#[test]
fn lines_and_planes_are_not_mixed_up() {
    let grid = Arrangement::Grid { columns: 3, rows: 2 };
    let explicit = Arrangement::Explicit(vec![Position { x_m: 0.1, y_m: 0.25 }]);
    let refusals = [
        (grid.clone(), 6, *LINE),
        (grid, 7, *PLANE),
        (Arrangement::Even, 6, *PLANE),
        (edge_dense(4), 10, *PLANE),
        (explicit.clone(), 1, *PLANE),
        (explicit, 1, *LINE),
    ];
    let messages =
        refusals.map(|(rule, count, extent)| rule.positions(count, extent).unwrap_err().to_string());
    insta::assert_snapshot!(messages.join("\n"), @r"
    a grid of 3 × 2 training positions needs a plane; this surface is a line
    6 training positions are listed, but their count is given as 7
    6 training positions along a line do not define positions on a plane; a plane needs a grid
    10 training positions along a line do not define positions on a plane; a plane needs a grid
    training position 1 is at 100 mm, 250 mm, off the surface; it must be within 0 and 300 mm along, 0 and 200 mm across
    training position 1 is at 100 mm, 250 mm, off the surface; it must be within 0 and 400 mm
    ");
}

#[test]
fn judging_covers_the_surface() {
    let line = all_over(*LINE);
    assert_eq!((line.len(), line[0], line[398]), (399, Position::along(0.001), Position::along(0.399)));
    let plane = all_over(*PLANE);
    assert_eq!(plane.len(), 24 * 16);
    let mean = |of: fn(&Position) -> f64| plane.iter().map(of).sum::<f64>() / plane.len() as f64;
    assert!((mean(|p| p.x_m) - 0.15).abs() < 1e-12 && (mean(|p| p.y_m) - 0.1).abs() < 1e-12);
    assert_eq!(every(*LINE, 0.1).unwrap().len(), 3);
    let apart = every(*PLANE, 0.05).unwrap();
    assert_eq!((apart.len(), apart[0]), (15, Position { x_m: 0.05, y_m: 0.05 }));
    assert!(every(*PLANE, 0.25).is_err() && every(*PLANE, 1e-5).is_err() && every(*PLANE, f64::NAN).is_err());
}

#[test]
fn chebyshevs_nodes_are_the_zeros_of_his_polynomial() {
    let found = Arrangement::Chebyshev.positions(7, *LINE).unwrap();
    for at in &found {
        // T_7 over the length, mapped to −1…1.
        let x = 2.0 * at.x_m / LINE.length_m() - 1.0;
        assert!((7.0 * x.acos()).cos().abs() < 1e-12, "{found:?}");
    }
    assert!(found.is_sorted_by(|a, b| a.x_m < b.x_m));
    let refused = Arrangement::Chebyshev.positions(7, *PLANE);
    assert_eq!(refused, Err(ArrangementError::LineOnPlane { count: 7 }));
}

#[test]
fn the_squarest_grid_has_the_sides_of_the_plane() {
    assert_eq!(squarest(*LINE, 12), (12, 1));
    assert_eq!(squarest(*PLANE, 6), (3, 2));
    assert_eq!(squarest(*PLANE, 24), (6, 4));
}
