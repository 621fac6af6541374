//! Equilibrium of plates on supports of any stiffness.

use super::*;

/// Unbalanced force, and moments over the longer side, under a unit force at `contact`.
fn imbalance(plate: &Plate, contact: Position) -> f64 {
    let supports = plate.spec().supports.iter().map(|support| support.position);
    let mut sums = [-1.0, -contact.x_m, -contact.y_m];
    for place in supports {
        let force = plate.influence(SensorKind::Reaction, place, contact);
        sums.iter_mut().zip([1.0, place.x_m, place.y_m]).for_each(|(sum, arm)| *sum += force * arm);
    }
    let longer_m = plate.spec().length_m.max(plate.spec().width_m);
    sums.iter()
        .zip([1.0, longer_m, longer_m])
        .map(|(sum, arm)| (sum / arm).abs())
        .fold(0.0, |a, b| if b <= a { a } else { b })
}

/// A plate on springs at four corners, the middle of an edge and a point off the nodes.
fn on_springs(stiffness_n_per_m: f64, elements: usize) -> Plate {
    let mut spec = steel(0.3, 0.2, Edges::default(), elements);
    let places = [(0.0, 0.0), (0.3, 0.0), (0.0, 0.2), (0.3, 0.2), (0.15, 0.0), (0.1234, 0.117)];
    spec.supports = places.map(|(x, y)| elastic_at(x, y, stiffness_n_per_m)).to_vec();
    plate(spec)
}

#[test]
fn springs_of_every_stiffness_balance_force_and_moments() {
    let mut most = 0.0f64;
    for elements in [16, 96] {
        for stiffness_n_per_m in [1e-3, 0.5, 200.0, 1e4, 1e7, 1e12] {
            let plate = on_springs(stiffness_n_per_m, elements);
            for contact in [at(0.15, 0.1), at(0.3, 0.2), at(0.01, 0.19), at(0.27, 0.003)] {
                let off = imbalance(&plate, contact);
                assert!(off < 1e-9, "{elements} elements on {stiffness_n_per_m} N/m: {off:e}");
                most = most.max(off);
            }
        }
    }
    println!("springs of 1e-6 to 1e9 N/mm: out of balance by {most:.1e} at most");
}

#[test]
fn a_plate_on_soft_springs_moves_as_a_rigid_one_and_bends_as_if_the_springs_were_forces() {
    // Rigid plate on springs k at its four corners: they share a force at (x, y) as products of linear
    // functions, and the deflection at (x', y') is
    // (1 + (2x/l − 1)·(2x'/l − 1) + (2y/b − 1)·(2y'/b − 1))/(4k).
    let corners = [(0.0, 0.0), (0.3, 0.0), (0.0, 0.2), (0.3, 0.2)];
    for stiffness_n_per_m in [1e-3, 0.2] {
        let mut spec = steel(0.3, 0.2, Edges::default(), 96);
        spec.supports = corners.map(|(x, y)| elastic_at(x, y, stiffness_n_per_m)).to_vec();
        let plate = plate(spec);
        let share = |p: Position| [2.0 * p.x_m / 0.3 - 1.0, 2.0 * p.y_m / 0.2 - 1.0];
        for (sensor, contact) in [(at(0.1, 0.05), at(0.22, 0.13)), (at(0.0, 0.2), at(0.05, 0.18))] {
            let ([a, b], [c, d]) = (share(sensor), share(contact));
            let rigid = -(1.0 + a * c + b * d) / (4.0 * stiffness_n_per_m);
            let found = deflection(&plate, sensor, contact);
            // Bending is of the order of l²/D = 0.01 m/N, the deflection of a spring 1/k.
            assert!((found - rigid).abs() < 0.01, "{found} {rigid}");
            for (x, y) in corners {
                let [e, f] = share(at(x, y));
                let reaction = plate.influence(SensorKind::Reaction, at(x, y), contact);
                let shared = 0.25 * (1.0 + c * e + d * f);
                assert!((reaction - shared).abs() < 0.02 * stiffness_n_per_m, "{reaction} {shared}");
            }
        }
        // Strain is independent of rigid motions: for softer springs it is closer to that of a rigid plate.
        let strain = |plate: &Plate| plate.influence(SensorKind::Strain, at(0.16, 0.11), at(0.12, 0.09));
        let stiffer = on_corners(1.0);
        assert!(off(strain(&plate), strain(&stiffer)) < 0.05, "{} {}", strain(&plate), strain(&stiffer));
    }
}

fn on_corners(stiffness_n_per_m: f64) -> Plate {
    let mut spec = steel(0.3, 0.2, Edges::default(), 96);
    spec.supports = [(0.0, 0.0), (0.3, 0.0), (0.0, 0.2), (0.3, 0.2)]
        .map(|(x, y)| elastic_at(x, y, stiffness_n_per_m))
        .to_vec();
    plate(spec)
}

#[test]
fn deflections_on_stiff_and_soft_springs_are_reciprocal_and_linear_in_the_compliance() {
    for stiffness_n_per_m in [1e-3, 200.0, 1e12] {
        let plate = on_springs(stiffness_n_per_m, 48);
        let (one, other) = (at(0.031, 0.044), at(0.255, 0.161));
        let (there, back) = (deflection(&plate, one, other), deflection(&plate, other, one));
        assert!((there - back).abs() < 1e-10 * plate.full_scale(SensorKind::Deflection), "{there} {back}");
        for support in &plate.spec().supports {
            let moved = deflection(&plate, support.position, one);
            let reaction = plate.influence(SensorKind::Reaction, support.position, one);
            let given = -reaction / stiffness_n_per_m;
            assert!(
                (moved - given).abs() < 1e-10 * plate.full_scale(SensorKind::Deflection),
                "{moved} {given}"
            );
        }
    }
}

#[test]
fn one_simple_edge_and_a_soft_spring_balance() {
    for (edges, spring) in [
        (Edges { left: Edge::Simple, ..Edges::default() }, at(0.28, 0.03)),
        (Edges { right: Edge::Simple, ..Edges::default() }, at(0.0, 0.2)),
        (Edges { bottom: Edge::Simple, ..Edges::default() }, at(0.1, 0.2)),
        (Edges { top: Edge::Simple, ..Edges::default() }, at(0.1, 0.0)),
    ] {
        for stiffness_n_per_m in [1e-3, 1.0, 1e6] {
            let mut spec = steel(0.3, 0.2, edges, 64);
            spec.supports = vec![elastic_at(spring.x_m, spring.y_m, stiffness_n_per_m)];
            let plate = plate(spec);
            let contact = at(0.17, 0.12);
            // Moments about the edge: its distance from the contact over that from the spring.
            let arm = |p: Position| match (edges.left, edges.right, edges.bottom) {
                (Edge::Simple, ..) => p.x_m,
                (_, Edge::Simple, _) => 0.3 - p.x_m,
                (.., Edge::Simple) => p.y_m,
                _ => 0.2 - p.y_m,
            };
            let found = plate.influence(SensorKind::Reaction, spring, contact);
            assert!(off(found, arm(contact) / arm(spring)) < 1e-9, "{edges:?} {stiffness_n_per_m} {found}");
        }
    }
}

#[test]
fn supported_edges_balance_on_every_mesh() {
    for elements in [8, 64] {
        for edges in [
            Edges::all(Edge::Clamped),
            Edges::all(Edge::Simple),
            Edges { left: Edge::Clamped, ..Edges::default() },
            Edges { left: Edge::Clamped, bottom: Edge::Simple, ..Edges::default() },
            Edges { left: Edge::Simple, right: Edge::Simple, ..Edges::default() },
        ] {
            // The solution checks a grid of forces against the reactions of edges and supports.
            let mut spec = steel(0.3, 0.2, edges, elements);
            let on_edge = Plate::new(spec.clone()).unwrap().solve();
            spec.supports = vec![simple_at(0.1234, 0.0876), elastic_at(0.21, 0.123, 1e-3)];
            assert_eq!(
                (on_edge, Plate::new(spec).unwrap().solve()),
                (Ok(()), Ok(())),
                "{elements} {edges:?}"
            );
        }
    }
}
