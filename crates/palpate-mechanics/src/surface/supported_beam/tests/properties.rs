//! Properties of every beam on supports.

use proptest::prelude::*;

use super::*;

fn any_kind() -> impl Strategy<Value = BeamSupportKind> {
    let stiffness = (0.0..8.0f64).prop_map(|power| 10f64.powf(power));
    let turning = proptest::option::of((-1.0..4.0f64).prop_map(|power| 10f64.powf(power)));
    prop_oneof![
        3 => Just(Simple),
        2 => Just(Clamped),
        1 => Just(Guided),
        2 => (stiffness, turning).prop_map(|(k, turning)| spring(k, turning)),
    ]
}

/// Beams of one to four sections on one to five sufficient supports.
fn any_beam() -> impl Strategy<Value = SupportedBeam> {
    let sections = proptest::collection::btree_map(1..97u32, (0.5..2.0f64, 0.5..2.0f64), 0..4);
    let supports = proptest::collection::btree_map(0..=97u32, any_kind(), 1..6);
    let beam = (0.1..2.0f64, sections, supports).prop_map(|(length_m, sections, supports)| {
        let place = |i: u32| length_m * f64::from(i) / 97.0;
        let section = |(to_m, (width, thickness))| BeamSection {
            to_m,
            width_m: 0.04 * width,
            thickness_m: 0.002 * thickness,
        };
        let last = (length_m, (1.0, 1.0));
        SupportedBeam::new(SupportedBeamSpec {
            length_m,
            youngs_modulus_pa: 70e9,
            sections: sections
                .into_iter()
                .map(|(i, size)| (place(i), size))
                .chain([last])
                .map(section)
                .collect(),
            supports: supports.into_iter().map(|(i, kind)| BeamSupport { at_m: place(i), kind }).collect(),
        })
    });
    beam.prop_filter_map("a mechanism", Result::ok)
}

/// True near a node, where curvatures and slopes of strains jump.
fn near_a_node(beam: &SupportedBeam, share: f64) -> bool {
    beam.structure.nodes.iter().any(|node| (node - share).abs() < 1e-3)
}

/// Positions, upward forces and couples on the beam for a unit force downward at `contact_m`, from the jumps
/// of its shape.
fn jumps(beam: &SupportedBeam, contact_m: f64) -> Vec<(f64, f64, f64)> {
    let l = beam.spec.length_m;
    let mut bent = beam.shape(Deflection, Position::along(contact_m)).pieces;
    let air = structure::Piece {
        from: 0.0,
        to: 0.0,
        start: State::SLOPE * 0.0,
        end: State::SLOPE * 0.0,
        stiffness: 1.0,
    };
    bent.insert(0, air);
    bent.push(structure::Piece { from: 1.0, to: 1.0, ..air });
    let d = beam.stiffness_nm2;
    bent.windows(2)
        .map(|pair| {
            let jump = pair[1].start + pair[0].end * -1.0;
            (pair[0].to * l, jump.shear * d / l.powi(3), -jump.moment * d / (l * l))
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn deflections_are_reciprocal(beam in any_beam(), x in 0.0..=1.0, a in 0.0..=1.0) {
        let l = beam.length_m();
        let (here, there) = (at(&beam, Deflection, x * l, a * l), at(&beam, Deflection, a * l, x * l));
        prop_assert!((here - there).abs() <= 1e-10 * beam.full_scale(Deflection), "{here} {there}");
    }

    #[test]
    fn supports_balance_force_and_moment(beam in any_beam(), a in 0.0..=1.0) {
        let l = beam.length_m();
        let contact_m = a * l;
        let jumps = jumps(&beam, contact_m);
        let force: f64 = jumps.iter().map(|(_, force, _)| force).sum();
        let moment: f64 = jumps.iter().map(|(at_m, force, couple)| force * at_m + couple).sum();
        let size = jumps.iter().map(|(_, force, couple)| force.abs() + couple.abs() / l).sum::<f64>();
        // The load itself is one of the jumps.
        prop_assert!(force.abs() < 1e-10 * size && moment.abs() < 1e-10 * size * l, "{force} {moment} of {size}");
        for support in beam.force_supports() {
            let found = at(&beam, Reaction, support.x_m, contact_m);
            let near = |(at_m, ..): &&(f64, f64, f64)| (at_m - support.x_m).abs() < 1e-9 * l;
            let load = if (contact_m - support.x_m).abs() < 1e-9 * l { 1.0 } else { 0.0 };
            let jump: f64 = jumps.iter().filter(near).map(|(_, force, _)| force).sum::<f64>() + load;
            prop_assert!((found - jump).abs() < 1e-9 * size, "{found} {jump}");
        }
    }

    #[test]
    fn slope_is_the_derivative_of_deflection_and_strain_that_of_slope(
        beam in any_beam(), x in 0.002..0.998f64, a in 0.0..=1.0f64
    ) {
        prop_assume!(!near_a_node(&beam, x) && (x - a).abs() > 1e-3);
        let (l, h) = (beam.length_m(), 1e-5 * beam.length_m());
        let difference = |kind| (at(&beam, kind, x * l + h, a * l) - at(&beam, kind, x * l - h, a * l)) / (2.0 * h);
        let close = |found: f64, expected: f64, full_scale: f64| (found - expected).abs() < 1e-5 * full_scale;
        let slope = at(&beam, Slope, x * l, a * l);
        let reach = beam.full_scale(Slope).max(beam.full_scale(Deflection) / l);
        prop_assert!(close(slope, difference(Deflection), reach), "{slope} {}", difference(Deflection));
        let section = beam.spec.sections.iter().find(|section| section.to_m > x * l).unwrap();
        let (strain, expected) = (at(&beam, Strain, x * l, a * l), 0.5 * section.thickness_m * difference(Slope));
        let reach = beam.full_scale(Strain).max(0.5 * section.thickness_m * beam.full_scale(Slope) / l);
        prop_assert!(close(strain, expected, reach), "{strain} {expected}");
    }

    #[test]
    fn gradients_are_differences(beam in any_beam(), x in 0.0..=1.0f64, a in 0.002..0.998f64) {
        prop_assume!((x - a).abs() > 1e-3 && !near_a_node(&beam, a));
        let (l, h) = (beam.length_m(), 1e-5 * beam.length_m());
        for kind in [Deflection, Slope, Strain, Reaction] {
            let sensor = if kind == Reaction { beam.force_supports().first().copied() } else { Some(Position::along(x * l)) };
            let Some(sensor) = sensor else { continue };
            let function = beam.influence_function(kind, sensor);
            let [along, across] = function.gradient(Position::along(a * l));
            let difference =
                (function.at(Position::along(a * l + h)) - function.at(Position::along(a * l - h))) / (2.0 * h);
            prop_assert!((along - difference).abs() * l < 1e-4 * beam.full_scale(kind), "{kind} {along} {difference}");
            prop_assert_eq!(across, 0.0);
        }
    }

    /// Additional nodes at any distance do not change the beam.
    #[test]
    fn equal_sections_equal_one_section(
        supports in proptest::collection::btree_map(0..=40u32, any_kind(), 1..5),
        cuts in proptest::collection::btree_set(1..400_000u32, 1..20),
    ) {
        let supports: Vec<(f64, BeamSupportKind)> =
            supports.into_iter().map(|(i, kind)| (f64::from(i) * 0.01, kind)).collect();
        let Ok(plain) = SupportedBeam::new(paper_on(&supports)) else { return Ok(()) };
        let whole = plain.spec.sections[0];
        let cuts = cuts.into_iter().map(|i| f64::from(i) * 1e-6).chain([0.4]);
        let sections = cuts.map(|to_m| BeamSection { to_m, ..whole }).collect();
        let cut = beam(&SupportedBeamSpec { sections, ..plain.spec.clone() });
        let places: Vec<f64> = plain.force_supports().iter().map(|support| support.x_m).collect();
        let difference = largest_difference(&plain, &cut, &places);
        prop_assert!(difference < 1e-12, "{difference:e}");
    }

    #[test]
    fn no_reading_exceeds_full_scale(beam in any_beam(), x in 0.0..=1.0, a in 0.0..=1.0) {
        let l = beam.length_m();
        for kind in [Deflection, Slope, Strain] {
            let found = at(&beam, kind, x * l, a * l).abs();
            prop_assert!(found <= beam.full_scale(kind) * (1.0 + 1e-9), "{kind}: {found} beyond {}", beam.full_scale(kind));
        }
        for support in beam.force_supports() {
            prop_assert!(at(&beam, Reaction, support.x_m, a * l).abs() <= beam.full_scale(Reaction) * (1.0 + 1e-9));
        }
    }

    #[test]
    fn a_description_survives_its_file(beam in any_beam()) {
        let json = serde_json::to_string(&beam).unwrap();
        prop_assert_eq!(serde_json::from_str::<SupportedBeam>(&json).unwrap(), beam);
    }
}

#[test]
fn a_stiff_spring_is_a_rigid_support() {
    let rigid = beam(&paper_on(&[(0.0, Clamped), (0.25, Simple), (0.4, Simple)]));
    for (stiffness, bound) in [(1e9, 1e-4), (1e15, 1e-10), (1e30, 1e-13)] {
        let clamp = spring(stiffness, Some(stiffness));
        let stiff = beam(&paper_on(&[(0.0, clamp), (0.25, spring(stiffness, None)), (0.4, Simple)]));
        let difference = largest_difference(&rigid, &stiff, &[0.0, 0.25, 0.4]);
        assert!(difference < bound, "{stiffness:e}: {difference:e}");
    }
}

#[test]
fn a_full_scale_is_reached() {
    let sections = vec![
        BeamSection { to_m: 0.1, width_m: 0.04, thickness_m: 0.002 },
        BeamSection { to_m: 0.4, width_m: 0.04, thickness_m: 0.0012 },
    ];
    let supports = paper_on(&[(0.05, Simple), (0.2, spring(900.0, None)), (0.33, Clamped)]);
    let found = beam(&SupportedBeamSpec { sections, ..supports });
    for kind in [Deflection, Slope, Strain] {
        let places = || (0..=400).map(|i| f64::from(i) * 0.001);
        let largest = places().map(|x| found.shape(kind, Position::along(x)).peak()).fold(0.0, f64::max);
        let full_scale = found.full_scale(kind);
        assert!(
            largest <= full_scale * (1.0 + 1e-12) && largest > 0.99 * full_scale,
            "{kind}: {largest} {full_scale}"
        );
    }
}
