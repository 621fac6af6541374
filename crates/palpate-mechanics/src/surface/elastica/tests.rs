use super::*;
use ForceDirection::{Normal, Vertical};
use proptest::prelude::*;
use std::f64::consts::PI;

/// ψ, curvature, x and drop at the end of a finger of length and stiffness 1, by Runge–Kutta steps from the
/// clamp.
fn shot(force_angle: f64, load: f64, curvature_at_clamp: f64) -> [f64; 4] {
    const STEPS: usize = 4000;
    let slope = |[angle, curvature, _, _]: [f64; 4]| {
        [curvature, -load * (angle - force_angle).cos(), angle.cos(), angle.sin()]
    };
    let along = |state: [f64; 4], by: [f64; 4], step: f64| std::array::from_fn(|i| state[i] + step * by[i]);
    let mut state = [0.0, curvature_at_clamp, 0.0, 0.0];
    let step = 1.0 / STEPS as f64;
    for _ in 0..STEPS {
        let first = slope(state);
        let second = slope(along(state, first, 0.5 * step));
        let third = slope(along(state, second, 0.5 * step));
        let fourth = slope(along(state, third, step));
        state = std::array::from_fn(|i| {
            state[i] + step / 6.0 * (first[i] + 2.0 * second[i] + 2.0 * third[i] + fourth[i])
        });
    }
    state
}

fn unit(direction: ForceDirection, load: f64) -> Elastica {
    Elastica::new(direction, 1.0, 1.0, load)
}

#[test]
fn vertical_end_load_bends_as_tabulated() {
    // Mattiasson 1981: deflection w/L, shortening u/L and rotation of the tip.
    let table = [
        (1.0, 0.30172, 0.05643, 0.46135),
        (2.0, 0.49346, 0.16064, 0.78175),
        (5.0, 0.71379, 0.38763, 1.21537),
        (10.0, 0.81061, 0.55500, 1.43029),
    ];
    for (load, deflection, shortening, turn) in table {
        let finger = unit(Vertical, load);
        let [x, y] = finger.point(1.0);
        assert!((-y - deflection).abs() < 6e-6, "{load}: {y}");
        assert!((1.0 - x - shortening).abs() < 6e-6, "{load}: {x}");
        assert!((finger.angle(1.0) - turn).abs() < 6e-6, "{load}: {}", finger.angle(1.0));
    }
}

#[test]
fn the_closed_form_solves_the_differential_equation() {
    for direction in [Normal, Vertical] {
        for load in [1e-3, 0.3, 1.0, 2.0, 5.0, 10.0, 13.0] {
            let finger = unit(direction, load);
            let turn = finger.angle(1.0);
            let force_angle = if direction == Normal { turn } else { 0.0 };
            let [angle, curvature, x, drop] = shot(force_angle, load, finger.curvature(0.0));
            let [end_x, end_y] = finger.point(1.0);
            for (found, wanted) in [(angle, turn), (curvature, 0.0), (x, end_x), (drop, -end_y)] {
                assert!((found - wanted).abs() < 1e-10, "{direction:?} {load}: {found} {wanted}");
            }
        }
    }
}

#[test]
fn a_normal_force_turns_the_contact_by_a_right_angle_at_k_squared_and_by_two_at_four_times_that() {
    // K(½), the quarter period of the lemniscate.
    let quarter: f64 = 1.854_074_677_301_371_9;
    assert!((unit(Normal, quarter.powi(2)).angle(1.0) - 0.5 * PI).abs() < 1e-13);
    assert!((unit(Normal, 4.0 * quarter.powi(2)).angle(1.0) - PI).abs() < 1e-12);
}

#[test]
fn moments_balance_for_any_load() {
    // At the clamp the moment is force times lever, independent of the curvatures.
    for load in [1e-6, 0.1, 3.0, 30.0, 300.0] {
        let finger = unit(Vertical, load);
        let [x, _] = finger.point(1.0);
        assert!((finger.curvature(0.0) / (load * x) - 1.0).abs() < 1e-12, "{load}");
    }
    for load in [1e-6, 0.1, 3.0, 10.0] {
        let finger = unit(Normal, load);
        let ([x, y], (sine, cosine)) = (finger.point(1.0), finger.angle(1.0).sin_cos());
        assert!((finger.curvature(0.0) / (load * (x * cosine - y * sine)) - 1.0).abs() < 1e-12, "{load}");
    }
}

#[test]
fn small_load_differs_from_linear_theory_in_second_order() {
    for direction in [Normal, Vertical] {
        let beyond = |load: f64| (unit(direction, load).curvature(0.4) / (load * 0.6) - 1.0).abs();
        let deflection = |load: f64| (-unit(direction, load).point(1.0)[1] / (load / 3.0) - 1.0).abs();
        for difference in [&beyond as &dyn Fn(f64) -> f64, &deflection] {
            let order = (difference(0.02) / difference(0.01)).log2();
            assert!((order - 2.0).abs() < 0.01, "{direction:?}: {order}");
        }
        assert!(beyond(1e-5) < 1e-10);
    }
}

#[test]
fn without_force_the_finger_is_straight() {
    for direction in [Normal, Vertical] {
        let finger = Elastica::new(direction, 2.0, 0.7, 0.0);
        assert_eq!((finger.point(0.3), finger.curvature(0.1)), ([0.3, 0.0], 0.0));
        assert!(finger.angle(1.0).abs() < 1e-15);
        let [by_contact, by_force] = finger.curvature_gradient(0.1);
        assert!(by_contact == 0.0 && (by_force - 0.3).abs() < 1e-15);
    }
}

#[test]
fn no_input_panics() {
    for direction in [Normal, Vertical] {
        for force_n in [0.0, 1e-300, 1e9, f64::MAX, f64::INFINITY, f64::NAN] {
            for contact_m in [0.0, 1e-200, 1.0, f64::NAN] {
                let finger = Elastica::new(direction, 1.0, contact_m, force_n);
                let _ = (finger.curvature_gradient(0.0), finger.point(0.5), finger.angle(0.2));
            }
        }
    }
}

proptest! {
    #[test]
    fn gradients_are_the_differences(at in 0.0..0.95f64, contact in 0.2..1.0f64, load in 1e-3..12.0f64, vertical: bool) {
        let direction = if vertical { Vertical } else { Normal };
        prop_assume!(at < contact - 1e-3);
        let force = load / (contact * contact);
        let curvature = |contact: f64, force: f64| Elastica::new(direction, 1.0, contact, force).curvature(at);
        let [by_contact, by_force] = Elastica::new(direction, 1.0, contact, force).curvature_gradient(at);
        let (h, g) = (1e-5, 1e-5 * force);
        let along = (curvature(contact + h, force) - curvature(contact - h, force)) / (2.0 * h);
        let harder = (curvature(contact, force + g) - curvature(contact, force - g)) / (2.0 * g);
        prop_assert!((by_contact - along).abs() < 1e-7 * (1.0 + force), "{by_contact} {along}");
        prop_assert!((by_force - harder).abs() < 1e-7, "{by_force} {harder}");
    }

    #[test]
    fn the_shape_is_the_integral_of_its_angle_and_its_angle_of_the_curvature(
        at in 0.01..0.99f64, contact in 0.2..1.0f64, load in 1e-3..12.0f64, vertical: bool, upward: bool,
    ) {
        prop_assume!((at - contact).abs() > 1e-3);
        let direction = if vertical { Vertical } else { Normal };
        let force = if upward { -load } else { load } / (contact * contact);
        let finger = Elastica::new(direction, 1.0, contact, force);
        let h = 1e-5;
        let ([x0, y0], [x1, y1]) = (finger.point(at - h), finger.point(at + h));
        let (sine, cosine) = finger.angle(at).sin_cos();
        prop_assert!(((x1 - x0) / (2.0 * h) - cosine).abs() < 1e-8);
        prop_assert!(((y1 - y0) / (2.0 * h) + sine).abs() < 1e-8);
        let turned = (finger.angle(at + h) - finger.angle(at - h)) / (2.0 * h);
        prop_assert!((turned - finger.curvature(at)).abs() < 1e-6 * (1.0 + force.abs()));
    }
}
