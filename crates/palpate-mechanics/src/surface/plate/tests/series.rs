//! Plates with a series as the solution: Timoshenko and Woinowsky-Krieger, *Theory of Plates and Shells*, 2nd
//! ed.

use std::f64::consts::PI;

use super::*;

const SIDE_M: f64 = 0.3;
const CENTRE: Position = Position { x_m: SIDE_M / 2.0, y_m: SIDE_M / 2.0 };

fn square(edges: Edges, elements: usize) -> Plate {
    plate(steel(SIDE_M, SIDE_M, edges, elements))
}

fn odd(terms: usize) -> impl Iterator<Item = f64> + Clone {
    (0..terms).map(|k| (2 * k + 1) as f64)
}

/// (−1)^((m−1)/2).
fn alternating(m: f64) -> f64 {
    if m % 4.0 == 1.0 { 1.0 } else { -1.0 }
}

/// Navier's coefficient of a uniform load of one pascal on a square plate: central deflection times D/a⁴ (art. 30, eq. 131).
fn navier_uniform(terms: usize) -> f64 {
    let term = |m: f64, n: f64| alternating(m) * alternating(n) / (m * n * (m * m + n * n).powi(2));
    16.0 / PI.powi(6) * odd(terms).map(|m| odd(terms).map(|n| term(m, n)).sum::<f64>()).sum::<f64>()
}

/// Navier's coefficient of a unit force at the centre: central deflection times D/a² (art. 34, eq. 133).
fn navier_point(terms: usize) -> f64 {
    let line = |m: f64| odd(terms).map(|n| (m * m + n * n).powi(-2)).sum::<f64>();
    4.0 / PI.powi(4) * odd(terms).map(line).sum::<f64>()
}

/// Contribution of the moments along clamped edges to the central deflection (art. 44), E_i from one equation
/// for each term.
fn clamping(terms: usize, right_side: impl Fn(f64) -> f64) -> f64 {
    let alpha = |m: f64| m * PI / 2.0;
    let mixed = |i: f64, m: f64| 8.0 * i / PI / m.powi(3) / (1.0 + (i / m).powi(2)).powi(2);
    let own = |i: f64| (alpha(i).tanh() + alpha(i) / alpha(i).cosh().powi(2)) / i;
    let order: Vec<f64> = odd(terms).collect();
    let mut moments = vec![0.0; terms];
    for _ in 0..60 {
        for (r, i) in order.iter().copied().enumerate() {
            let others: f64 = (0..terms).filter(|c| *c != r).map(|c| mixed(i, order[c]) * moments[c]).sum();
            moments[r] = (right_side(i) - others) / (mixed(i, i) + own(i));
        }
    }
    let term = |(e, m): (&f64, &f64)| {
        e * alternating(*m) * alpha(*m) * alpha(*m).tanh() / alpha(*m).cosh() / (m * m)
    };
    moments.iter().zip(&order).map(term).sum::<f64>() / PI.powi(2)
}

fn clamped_uniform() -> f64 {
    let right_side = |i: f64| {
        let alpha = i * PI / 2.0;
        4.0 / PI.powi(3) / i.powi(4) * (alpha / alpha.cosh().powi(2) - alpha.tanh())
    };
    navier_uniform(100) + clamping(20, right_side)
}

fn clamped_point() -> f64 {
    let right_side = |i: f64| {
        let sum: f64 = odd(20_000).map(|n| n * alternating(n) / (i * i + n * n).powi(2)).sum();
        -8.0 / PI.powi(2) * alternating(i) * sum
    };
    navier_point(1000) + clamping(20, right_side)
}

/// Central deflection under a uniform load, times D/(q·a⁴), with simple edges at x = 0 and a and one
/// condition on the others (art. 41, Lévy): Σ Y_m(0)·sin(mπ/2), with Y_m = q_m/(D·α⁴)·(1 + A·cosh
/// αy + B·αy·sinh αy).
fn levy_uniform(terms: usize, others: Edge, nu: f64) -> f64 {
    let term = |m: f64| {
        let u = m * PI / 2.0;
        let (cosh, sinh) = (u.cosh(), u.sinh());
        // Two conditions at αy = u, each [of A, of B, of the load].
        let (first, second) = match others {
            Edge::Simple => ([cosh, u * sinh, -1.0], [cosh, 2.0 * cosh + u * sinh, 0.0]),
            Edge::Clamped => ([cosh, u * sinh, -1.0], [sinh, sinh + u * cosh, 0.0]),
            // M_y: Y'' − ν·α²·Y = 0; V_y: Y''' − (2 − ν)·α²·Y' = 0.
            Edge::Free => (
                [(1.0 - nu) * cosh, 2.0 * cosh + (1.0 - nu) * u * sinh, nu],
                [(nu - 1.0) * sinh, (1.0 + nu) * sinh - (1.0 - nu) * u * cosh, 0.0],
            ),
        };
        let determinant = first[0] * second[1] - first[1] * second[0];
        let a = (first[2] * second[1] - first[1] * second[2]) / determinant;
        alternating(m) * 4.0 / (m * PI) / (m * PI).powi(4) * (1.0 + a)
    };
    odd(terms).map(term).sum()
}

/// −w·D/(q·a⁴) at the centre under a uniform load.
fn uniform(plate: &Plate) -> f64 {
    let load = under_uniform_load(plate, SensorKind::Deflection, CENTRE);
    -load * plate.spec().flexural_rigidity() / SIDE_M.powi(4)
}

/// −w·D/(P·a²) at the centre under a force there.
fn point(plate: &Plate) -> f64 {
    -deflection(plate, CENTRE, CENTRE) * plate.spec().flexural_rigidity() / SIDE_M.powi(2)
}

#[test]
fn a_uniform_load_on_simple_edges_is_naviers_series_with_fourth_order() {
    let exact = navier_uniform(200);
    let errors =
        [4, 8, 16, 32].map(|elements| off(uniform(&square(Edges::all(Edge::Simple), elements)), exact));
    println!("errors {errors:?}, orders {:.2?}", orders(&errors));
    assert!(errors[3] < 1e-6);
    assert!(orders(&errors[..3]).iter().all(|order| *order > 3.8));
}

#[test]
fn a_force_on_simple_edges_is_naviers_series_with_second_order() {
    let exact = navier_point(3000);
    let errors =
        [8, 16, 32, 64].map(|elements| off(point(&square(Edges::all(Edge::Simple), elements)), exact));
    println!("errors {errors:?}, orders {:.2?}", orders(&errors));
    assert!(errors[3] < 1e-4);
    assert!(orders(&errors).iter().all(|order| (1.9..2.1).contains(order)));
}

#[test]
fn clamped_edges_are_the_superposition_of_edge_moments() {
    let (exact_uniform, exact_point) = (clamped_uniform(), clamped_point());
    assert_eq!(format!("{exact_uniform:.5} {exact_point:.5}"), "0.00127 0.00561");
    let errors = [8, 16, 32].map(|elements| {
        let square = square(Edges::all(Edge::Clamped), elements);
        (off(uniform(&square), exact_uniform), off(point(&square), exact_point))
    });
    println!("{exact_uniform:.9} {exact_point:.9}: errors {errors:?}");
    assert!(errors[2].0 < 2e-6 && errors[2].1 < 1e-3);
    assert!(orders(&errors.map(|(uniform, _)| uniform)).iter().all(|order| *order > 3.5));
    assert!(orders(&errors.map(|(_, point)| point)).iter().all(|order| *order > 1.9));
}

#[test]
fn two_simple_edges_are_levys_series() {
    assert!(off(levy_uniform(60, Edge::Simple, 0.3), navier_uniform(200)) < 1e-7);
    for others in [Edge::Clamped, Edge::Free] {
        let exact = levy_uniform(60, others, 0.3);
        let edges = Edges { left: Edge::Simple, right: Edge::Simple, bottom: others, top: others };
        let errors = [8, 16, 32].map(|elements| off(uniform(&square(edges, elements)), exact));
        println!("{others:?} {exact:.8}: errors {errors:?}, orders {:.2?}", orders(&errors));
        assert!(errors[2] < 2e-6);
        assert!(orders(&errors).iter().all(|order| *order > 3.5));
    }
}

/// Patch test: a plate on three corners with a load at the fourth is the saddle w = −x·y/(2·D·(1 − ν)) per
/// newton (art. 11), which the elements represent exactly.
#[test]
fn a_plate_on_three_corners_is_a_saddle() {
    let (length_m, width_m) = (0.3, 0.2);
    let mut spec = steel(length_m, width_m, Edges::all(Edge::Free), 7);
    spec.supports = vec![simple_at(0.0, 0.0), simple_at(length_m, 0.0), simple_at(0.0, width_m)];
    let twist = 1.0 / (2.0 * spec.flexural_rigidity() * (1.0 - spec.poissons_ratio));
    let plate = plate(spec);
    let corner = at(length_m, width_m);
    for place in [at(0.1, 0.07), at(0.13, 0.2), at(0.29, 0.19), corner] {
        assert!(off(-deflection(&plate, place, corner), twist * place.x_m * place.y_m) < 1e-9);
        let slope = plate.influence(SensorKind::Slope, place, corner);
        assert!(off(-slope, twist * place.y_m) < 1e-9);
        let strain = plate.influence(SensorKind::Strain, place, corner);
        assert!(strain.abs() < 1e-9 * 0.5 * plate.spec().thickness_m * twist);
    }
}
