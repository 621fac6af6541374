//! Properties of every plate.

use std::sync::LazyLock;

use proptest::prelude::*;

use super::*;
use crate::surface::ContactLoad;

const LENGTH_M: f64 = 0.3;
const WIDTH_M: f64 = 0.2;

/// One edge of each kind, and supports of each kind, off the nodes.
static MIXED: LazyLock<Plate> = LazyLock::new(|| {
    let edges = Edges { left: Edge::Clamped, right: Edge::Free, bottom: Edge::Simple, top: Edge::Free };
    let mut spec = steel(LENGTH_M, WIDTH_M, edges, 20);
    spec.supports = vec![simple_at(0.251, 0.173), elastic_at(0.123, 0.187, 3e3), simple_at(0.137, 0.109)];
    plate(spec)
});

/// Four point supports, one of them elastic.
static ON_POINTS: LazyLock<Plate> = LazyLock::new(|| {
    let mut spec = steel(LENGTH_M, WIDTH_M, Edges::all(Edge::Free), 20);
    spec.supports = vec![
        simple_at(0.021, 0.011),
        simple_at(0.287, 0.0),
        elastic_at(0.277, 0.191, 2e4),
        simple_at(0.043, 0.183),
    ];
    plate(spec)
});

const KINDS: [SensorKind; 3] = [SensorKind::Deflection, SensorKind::Slope, SensorKind::Strain];

prop_compose! {
    fn anywhere()(x in 0.0..=LENGTH_M, y in 0.0..=WIDTH_M) -> Position { at(x, y) }
}

/// A position with room for differences on either side.
fn inside(x: f64, y: f64) -> Position {
    at(0.01 + 0.28 * x, 0.01 + 0.18 * y)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn deflections_are_reciprocal(one in anywhere(), other in anywhere()) {
        for plate in [&*MIXED, &*ON_POINTS] {
            let (there, back) = (deflection(plate, one, other), deflection(plate, other, one));
            prop_assert!((there - back).abs() < 1e-10 * plate.full_scale(SensorKind::Deflection));
        }
    }

    #[test]
    fn supports_balance_force_and_moments(contact in anywhere()) {
        let supports = &ON_POINTS.spec().supports;
        let reactions = supports.iter().map(|s| (s.position, ON_POINTS.influence(SensorKind::Reaction, s.position, contact)));
        let (mut force, mut along, mut across) = (0.0, 0.0, 0.0);
        for (position, reaction) in reactions {
            force += reaction;
            along += reaction * position.x_m;
            across += reaction * position.y_m;
        }
        prop_assert!((force - 1.0).abs() < 1e-9, "{force}");
        prop_assert!((along - contact.x_m).abs() < 1e-9 * LENGTH_M, "{along}");
        prop_assert!((across - contact.y_m).abs() < 1e-9 * LENGTH_M, "{across}");
    }

    #[test]
    fn simple_supports_stand_still_wherever_they_are(sensor in anywhere()) {
        for support in MIXED.spec().supports.iter().filter(|support| support.kind == PointSupportKind::Simple) {
            let moved = deflection(&MIXED, sensor, support.position);
            prop_assert!(moved.abs() < 1e-12 * MIXED.full_scale(SensorKind::Deflection));
        }
    }

    #[test]
    fn gradients_are_those_of_the_influence(sensor in anywhere(), x in 0.0..=1.0f64, y in 0.0..=1.0f64) {
        const STEP_M: f64 = 1e-6;
        let contact = inside(x, y);
        for kind in KINDS {
            let influence = MIXED.influence_function(kind, sensor);
            let [along, across] = influence.gradient(contact);
            let moved = |dx, dy| influence.at(at(contact.x_m + dx, contact.y_m + dy));
            let differences = [
                (moved(STEP_M, 0.0) - moved(-STEP_M, 0.0)) / (2.0 * STEP_M),
                (moved(0.0, STEP_M) - moved(0.0, -STEP_M)) / (2.0 * STEP_M),
            ];
            let scale = MIXED.full_scale(kind) / WIDTH_M;
            prop_assert!((along - differences[0]).abs() < 1e-5 * scale, "{kind}: {along} {differences:?}");
            prop_assert!((across - differences[1]).abs() < 1e-5 * scale, "{kind}: {across} {differences:?}");
        }
    }

    #[test]
    fn slope_and_strain_are_derivatives_of_the_deflection(contact in anywhere(), x in 0.0..=1.0f64, y in 0.0..=1.0f64) {
        // Within one element, the strain's difference quotient does not cross a jump.
        let side_m = mesh_of(&MIXED).side_x_m;
        let sensor = inside(x, y);
        let sensor = at(((sensor.x_m / side_m).floor() + 0.2 + 0.6 * x) * side_m, sensor.y_m);
        let step_m = 1e-3 * side_m;
        let value = |kind, dx| MIXED.influence(kind, at(sensor.x_m + dx, sensor.y_m), contact);
        let slope = (value(SensorKind::Deflection, step_m) - value(SensorKind::Deflection, -step_m)) / (2.0 * step_m);
        let curvature = (value(SensorKind::Slope, step_m) - value(SensorKind::Slope, -step_m)) / (2.0 * step_m);
        let strain = 0.5 * MIXED.spec().thickness_m * curvature;
        let close = |kind, difference: f64| (value(kind, 0.0) - difference).abs() < 1e-5 * MIXED.full_scale(kind);
        prop_assert!(close(SensorKind::Slope, slope));
        prop_assert!(close(SensorKind::Strain, strain));
    }
}

#[test]
fn a_symmetric_plate_answers_symmetrically() {
    let mut spec = steel(
        LENGTH_M,
        LENGTH_M,
        Edges { left: Edge::Free, right: Edge::Free, ..Edges::all(Edge::Clamped) },
        18,
    );
    spec.supports = vec![simple_at(0.03, 0.15), simple_at(0.27, 0.15)];
    let plate = plate(spec);
    let mirrored = |p: Position| at(LENGTH_M - p.x_m, p.y_m);
    let turned = |p: Position| at(p.x_m, LENGTH_M - p.y_m);
    for sensor in [at(0.1, 0.05), at(0.07, 0.21), at(0.15, 0.15)] {
        for contact in [at(0.11, 0.06), at(0.2, 0.13)] {
            for (kind, sign) in KINDS.into_iter().zip([1.0, -1.0, 1.0]) {
                let found = plate.influence(kind, sensor, contact);
                let across = sign * plate.influence(kind, mirrored(sensor), mirrored(contact));
                let along = plate.influence(kind, turned(sensor), turned(contact));
                let scale = 1e-9 * plate.full_scale(kind);
                assert!(
                    (found - across).abs() < scale && (found - along).abs() < scale,
                    "{kind}: {found} {across} {along}"
                );
            }
        }
    }
}

#[test]
fn a_plate_on_its_side_answers_the_same() {
    let edges = Edges { left: Edge::Clamped, right: Edge::Free, bottom: Edge::Simple, top: Edge::Free };
    let lying = plate(steel(0.3, 0.2, edges, 24));
    let edges = Edges { bottom: Edge::Clamped, top: Edge::Free, left: Edge::Simple, right: Edge::Free };
    let standing = plate(steel(0.2, 0.3, edges, 24));
    for (sensor, contact) in [(at(0.2, 0.11), at(0.07, 0.17)), (at(0.31 / 3.0, 0.2), at(0.29, 0.01))] {
        let swapped = |p: Position| at(p.y_m, p.x_m);
        let difference =
            deflection(&lying, sensor, contact) - deflection(&standing, swapped(sensor), swapped(contact));
        assert!(difference.abs() < 1e-10 * lying.full_scale(SensorKind::Deflection));
    }
}

#[test]
fn a_stiff_spring_is_a_simple_support_and_a_soft_one_is_none() {
    let spec = steel(
        LENGTH_M,
        WIDTH_M,
        Edges { left: Edge::Simple, right: Edge::Simple, ..Edges::all(Edge::Free) },
        16,
    );
    let with = |supports: Vec<PointSupport>| plate(PlateSpec { supports, ..spec.clone() });
    let plates = [
        with(vec![simple_at(0.17, 0.11)]),
        with(vec![elastic_at(0.17, 0.11, 1e12)]),
        with(Vec::new()),
        with(vec![elastic_at(0.17, 0.11, 1e-3)]),
    ];
    let [rigid, stiff, none, soft] = plates.map(|plate| deflection(&plate, at(0.1, 0.1), at(0.21, 0.05)));
    assert!(off(stiff, rigid) < 1e-6 && off(soft, none) < 1e-6 && off(rigid, none) > 0.1);
}

#[test]
fn a_force_on_a_plate_lowers_it_stretches_its_lower_face_and_loads_its_supports() {
    let plate = plate(steel(LENGTH_M, WIDTH_M, Edges::all(Edge::Simple), 12));
    let (sensor, contact) = (at(0.14, 0.1), at(0.15, 0.1));
    assert!(deflection(&plate, sensor, contact) < 0.0);
    assert!(plate.influence(SensorKind::Strain, sensor, contact) > 0.0);
    assert!(plate.influence(SensorKind::Slope, at(0.0, 0.1), contact) < 0.0);
    let support = ON_POINTS.spec().supports[2].position;
    assert!(ON_POINTS.influence(SensorKind::Reaction, support, support) > 0.5);
    assert_eq!(ON_POINTS.influence(SensorKind::Reaction, at(0.1, 0.1), contact), 0.0);
    assert_eq!(ON_POINTS.influence(SensorKind::Raw, at(0.1, 0.1), contact), 0.0);
}

#[test]
fn no_influence_exceeds_its_full_scale_by_much() {
    for plate in [&*MIXED, &*ON_POINTS] {
        for kind in KINDS {
            let full_scale = plate.full_scale(kind);
            let places = (0..7).flat_map(|i| (0..7).map(move |j| inside(i as f64 / 6.0, j as f64 / 6.0)));
            let largest =
                places.map(|sensor| plate.influence(kind, sensor, sensor).abs()).fold(0.0, f64::max);
            assert!(largest < 1.1 * full_scale, "{kind}: {largest} of {full_scale}");
        }
    }
    assert!(ON_POINTS.full_scale(SensorKind::Reaction) > 0.99);
    assert_eq!(MIXED.full_scale(SensorKind::Raw), 0.0);
}

#[test]
fn plate_equality_ignores_computed_results() {
    let spec = ON_POINTS.spec().clone();
    let fresh = Plate::new(spec).unwrap();
    assert_eq!(*ON_POINTS, fresh);
    let json = serde_json::to_string(&*ON_POINTS).unwrap();
    assert_eq!(serde_json::from_str::<Plate>(&json).unwrap(), fresh);
    let broken = json.replace("\"thickness_m\":0.0008", "\"thickness_m\":0.0");
    let refused = serde_json::from_str::<Plate>(&broken).unwrap_err().to_string();
    assert!(refused.contains("thickness is 0; it must be greater than 0"), "{refused}");
    assert!(serde_json::from_str::<Plate>(&json.replace("\"edges\"", "\"edge\"")).is_err());
}

#[test]
fn positions_off_the_plate_are_answered_without_a_panic() {
    let influence = MIXED.influence_function(SensorKind::Deflection, at(f64::NAN, -3.0));
    for contact in [at(-1.0, 0.1), at(1e300, 0.1), at(0.1, f64::INFINITY), at(f64::NAN, f64::NAN)] {
        let _ = (influence.at(contact), influence.gradient(contact));
    }
}

#[test]
fn influence_functions_that_are_asked_for_again_are_the_same() {
    let fresh = || plate(MIXED.spec().clone());
    let (asked, places) = (fresh(), [at(0.041, 0.052), at(0.15, 0.1), at(0.222, 0.143)]);
    let kept = |plate: &Plate, kind: SensorKind, places: &[Position]| {
        let values = |function: &Arc<dyn InfluenceFunction + '_>| function.at(at(0.07, 0.03)).to_bits();
        plate.influence_functions(kind, places).iter().map(values).collect::<Vec<u64>>()
    };
    for kind in KINDS {
        kept(&asked, kind, &places[..2]);
        let alone: Vec<u64> = places.iter().flat_map(|place| kept(&fresh(), kind, &[*place])).collect();
        assert_eq!(kept(&asked, kind, &places), alone, "{kind}");
        assert_eq!(kept(&asked, kind, &[places[2], places[0], places[2]]), [alone[2], alone[0], alone[2]]);
    }
    let influence = || asked.influence_function(SensorKind::Strain, places[0]);
    assert!(Arc::ptr_eq(&influence(), &influence()), "it was solved for twice");
}

#[test]
fn readings_by_contact_are_those_of_the_influence_functions() {
    for plate in [&*MIXED, &*ON_POINTS] {
        let places = [(0.041, 0.052), (0.15, 0.1), (0.222, 0.143), (0.3, 0.2)];
        let mut sensors: Vec<(SensorKind, Position)> =
            KINDS.iter().flat_map(|kind| places.map(|(x_m, y_m)| (*kind, at(x_m, y_m)))).collect();
        let supports = plate.spec().supports.iter();
        sensors.extend(supports.map(|support| (SensorKind::Reaction, support.position)));
        sensors.push((SensorKind::Raw, at(0.1, 0.1)));
        let readings = plate.readings_by_contact(&sensors).unwrap();
        for contact in [at(0.07, 0.03), at(0.15, 0.1), at(0.29, 0.19)] {
            let under = readings.readings_of_loads(&ContactLoad::all(contact));
            let around = readings.degrees(contact);
            let loads: Vec<ContactLoad> =
                around.iter().map(|(degree, _)| ContactLoad::Degree(*degree)).collect();
            let nodal = readings.readings_of_loads(&loads);
            for (i, (kind, sensor)) in sensors.iter().enumerate() {
                let function = plate.influence_function(*kind, *sensor);
                let [along, across] = function.gradient(contact);
                let summed: f64 = around.iter().zip(&nodal).map(|((_, weight), of)| weight * of[i]).sum();
                let scale = plate.full_scale(*kind).max(1e-30);
                for (found, expected, scale) in [
                    (under[0][i], function.at(contact), scale),
                    (summed, function.at(contact), scale),
                    (under[1][i], along, scale / WIDTH_M),
                    (under[2][i], across, scale / WIDTH_M),
                ] {
                    assert!((found - expected).abs() < 1e-9 * scale, "{kind} {sensor:?}: {found} {expected}");
                }
            }
        }
    }
}
