use std::sync::LazyLock;

use proptest::prelude::*;

use super::*;

/// The founding paper's beam.
static PAPER: LazyLock<Beam> = LazyLock::new(|| Beam::new(0.4, 0.04, 0.0012, 200e9).unwrap());

fn at(kind: SensorKind, x_m: f64, a_m: f64) -> f64 {
    PAPER.influence(kind, Position::along(x_m), Position::along(a_m))
}

#[test]
fn three_newtons_at_mid_span_deflect_the_papers_beam_by_3_4722_mm() {
    let deflection_mm = 3.0 * at(SensorKind::Deflection, 0.2, 0.2) * 1e3;
    assert_eq!(format!("{deflection_mm:.4}"), "-3.4722");
}

#[test]
fn a_force_on_the_beam_lowers_it_stretches_its_lower_face_and_tilts_it_inwards() {
    assert!(at(SensorKind::Deflection, 0.1, 0.25) < 0.0);
    assert!(at(SensorKind::Strain, 0.1, 0.25) > 0.0);
    assert!(at(SensorKind::Slope, 0.0, 0.25) < 0.0);
    assert!(at(SensorKind::Slope, 0.4, 0.25) > 0.0);
}

proptest! {
    #[test]
    fn deflection_is_reciprocal(x in 0.0..=0.4, a in 0.0..=0.4) {
        let (here, there) = (at(SensorKind::Deflection, x, a), at(SensorKind::Deflection, a, x));
        prop_assert!((here - there).abs() <= 1e-12 * PAPER.full_scale(SensorKind::Deflection));
    }

    #[test]
    fn reactions_balance_force_and_moment(a in 0.0..=0.4) {
        let (left, right) = (at(SensorKind::Reaction, 0.0, a), at(SensorKind::Reaction, 0.4, a));
        prop_assert!((left + right - 1.0).abs() < 1e-12);
        prop_assert!((right * 0.4 - a).abs() < 1e-12);
        prop_assert_eq!(at(SensorKind::Reaction, 0.2, a), 0.0);
    }

    #[test]
    fn slope_is_the_derivative_of_deflection(x in 0.001..0.399, a in 0.0..=0.4) {
        let h = 1e-6;
        let difference = (at(SensorKind::Deflection, x + h, a) - at(SensorKind::Deflection, x - h, a)) / (2.0 * h);
        let slope = at(SensorKind::Slope, x, a);
        prop_assert!((difference - slope).abs() < 1e-5 * PAPER.full_scale(SensorKind::Slope));
    }

    #[test]
    fn strain_is_half_the_thickness_times_the_derivative_of_slope(x in 0.001..0.399, a in 0.0..=0.4) {
        let h = 1e-6;
        let difference = (at(SensorKind::Slope, x + h, a) - at(SensorKind::Slope, x - h, a)) / (2.0 * h);
        let strain = at(SensorKind::Strain, x, a);
        let kink = if (x - a).abs() < h { 1e-2 } else { 1e-5 };
        prop_assert!((0.5 * PAPER.thickness_m() * difference - strain).abs() < kink * PAPER.full_scale(SensorKind::Strain));
    }

    /// ∫ E·I·y″·φ″ dx = −φ(a) for φ = sin(kπx/l), which vanishes with its second derivative on the supports.
    #[test]
    fn stiffness_times_the_fourth_derivative_is_the_load_weakly(k in 1..8u32, a in 0.01..0.39) {
        let wave = f64::from(k) * std::f64::consts::PI / PAPER.length_m();
        let curvature = |x| at(SensorKind::Strain, x, a) / (0.5 * PAPER.thickness_m());
        let integrand = |x: f64| PAPER.bending_stiffness() * curvature(x) * -(wave * wave) * (wave * x).sin();
        let virtual_work = simpson(integrand, 0.0, a) + simpson(integrand, a, PAPER.length_m());
        prop_assert!((virtual_work + (wave * a).sin()).abs() < 1e-6);
    }

    #[test]
    fn full_scale_bounds_every_influence(x in 0.0..=0.4, a in 0.0..=0.4) {
        for kind in SensorKind::ALL {
            prop_assert!(at(kind, x, a).abs() <= PAPER.full_scale(kind) * (1.0 + 1e-12));
        }
    }
}

proptest! {
    #[test]
    fn the_closed_gradient_is_the_differenced_one(x in 0.0..=0.4_f64, a in 0.0..=0.4_f64) {
        const STEP_M: f64 = 4e-6;
        // The strain and the derivative of the slope have a kink over the sensor.
        prop_assume!((x - a).abs() > 2.0 * STEP_M && (STEP_M..=0.4 - STEP_M).contains(&a));
        for kind in SensorKind::ALL {
            let (sensor, contact) = (Position::along(x), Position::along(a));
            let [closed, across] = PAPER.influence_function(kind, sensor).gradient(contact);
            let differenced = (at(kind, x, a + STEP_M) - at(kind, x, a - STEP_M)) / (2.0 * STEP_M);
            let scale = PAPER.full_scale(kind) / PAPER.length_m();
            prop_assert!((closed - differenced).abs() <= 1e-8 * scale, "{kind}: {closed} against {differenced}");
            prop_assert_eq!(across, 0.0);
        }
    }
}

#[test]
fn the_gradients_of_the_reactions_are_one_over_the_length() {
    let contact = Position::along(0.1);
    let function = |x_m| PAPER.influence_function(SensorKind::Reaction, Position::along(x_m));
    let gradient = |x_m| function(x_m).gradient(contact)[0];
    assert_eq!([gradient(0.0), gradient(0.2), gradient(0.4)], [-2.5, 0.0, 2.5]);
}

fn simpson(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    const INTERVALS: u32 = 400;
    let h = (to - from) / f64::from(INTERVALS);
    let sum: f64 = (0..=INTERVALS)
        .map(|i| {
            let weight = if i == 0 || i == INTERVALS { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
            weight * f(from + f64::from(i) * h)
        })
        .sum();
    sum * h / 3.0
}

#[test]
fn full_scale_is_the_largest_influence_of_a_dense_grid() {
    let grid: Vec<f64> = (0..=400).map(|i| f64::from(i) * 1e-3).collect();
    for kind in SensorKind::ALL {
        let pairs = grid.iter().flat_map(|x| grid.iter().map(|a| at(kind, *x, *a).abs()));
        let largest = pairs.fold(0.0, f64::max);
        let full_scale = PAPER.full_scale(kind);
        assert!(
            (largest - full_scale).abs() <= 1e-5 * full_scale,
            "{kind}: {largest} instead of {full_scale}"
        );
    }
}

#[test]
fn a_beam_without_size_is_refused_with_value_and_bound() {
    let refused = [
        Beam::new(0.0, 0.04, 1.2e-3, 200e9),
        Beam::new(0.4, -0.04, 1.2e-3, 200e9),
        Beam::new(0.4, 0.04, f64::NAN, 200e9),
        Beam::new(0.4, 0.04, 1.2e-3, f64::INFINITY),
        Beam::new(0.4, 0.04, 1e-200, 200e9),
    ];
    let messages = refused.map(|beam| beam.unwrap_err().to_string());
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn a_beam_is_checked_when_it_is_read() {
    let written = serde_json::to_string(&*PAPER).unwrap();
    assert_eq!(
        written,
        r#"{"length_m":0.4,"width_m":0.04,"thickness_m":0.0012,"youngs_modulus_pa":200000000000.0}"#
    );
    assert_eq!(serde_json::from_str::<Beam>(&written).unwrap(), *PAPER);
    let negative = serde_json::from_str::<Beam>(&written.replace("0.0012", "-0.0012")).unwrap_err();
    assert_eq!(negative.to_string(), "a beam's thickness is -0.0012; it must be greater than 0 and finite");
}

#[test]
fn extent_includes_only_its_interior_and_boundary() {
    let line = PAPER.extent();
    assert!(line.contains(Position::along(0.0)) && line.contains(Position::along(0.4)));
    assert!(!line.contains(Position::along(0.401)) && !line.contains(Position { x_m: 0.2, y_m: 0.001 }));
    assert!(!line.contains(Position::along(f64::NAN)));
    let plane = Extent::plane(0.4, 0.3).unwrap();
    assert!(
        plane.contains(Position { x_m: 0.4, y_m: 0.3 }) && !plane.contains(Position { x_m: 0.4, y_m: -0.1 })
    );
}
