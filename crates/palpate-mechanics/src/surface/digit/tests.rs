use super::*;

/// Spring steel, 120 × 10 × 0.5 mm: E·I/l² is 1.447 N.
fn digit(direction: ForceDirection) -> Digit {
    Digit::new(0.12, 0.01, 0.0005, 200e9).unwrap().with_direction(direction)
}

fn strain(digit: &Digit, gauge_m: f64, x_m: f64, force_n: f64) -> f64 {
    let gauge = digit.response_function(SensorKind::Strain, Position::along(gauge_m));
    gauge.at(Contact { position: Position::along(x_m), force_n })
}

#[test]
fn three_newtons_at_the_tip_strain_the_clamp_by_3593_microstrain() {
    let digit = digit(ForceDirection::Vertical);
    assert_eq!(format!("{:.4}", digit.characteristic_force_n()), "1.4468");
    assert_eq!(format!("{:.0}", strain(&digit, 0.0, 0.12, 3.0) * 1e6), "-3593");
    // In the linear theory bending does not shorten the lever.
    let linear = 3.0 * digit.influence(SensorKind::Strain, Position::along(0.0), Position::along(0.12));
    assert_eq!(format!("{:.0}", linear * 1e6), "-4320");
}

#[test]
fn small_force_reads_as_the_influence_function() {
    for direction in [ForceDirection::Normal, ForceDirection::Vertical] {
        let digit = digit(direction);
        for (gauge_m, x_m) in [(0.0, 0.12), (0.02, 0.05), (0.08, 0.05), (0.05, 0.05)] {
            let influence =
                digit.influence(SensorKind::Strain, Position::along(gauge_m), Position::along(x_m));
            let read = strain(&digit, gauge_m, x_m, 1e-5) / 1e-5;
            assert!((read - influence).abs() < 1e-8 * digit.full_scale(SensorKind::Strain));
        }
    }
}

#[test]
fn gauge_beyond_the_contact_reads_zero() {
    assert_eq!(strain(&digit(ForceDirection::Normal), 0.08, 0.06, 5.0), 0.0);
}

#[test]
fn a_digit_without_size_is_refused_with_value_and_bound() {
    for bad in [
        Digit::new(0.12, 0.01, 0.0, 200e9),
        Digit::new(f64::NAN, 0.01, 0.0005, 200e9),
        Digit::new(0.12, -0.01, 0.0005, 200e9),
        Digit::new(0.12, 0.01, 0.0005, f64::INFINITY),
    ] {
        assert!(matches!(bad, Err(DigitError::NotPositive(_))), "{bad:?}");
    }
    assert!(matches!(Digit::new(0.12, 0.01, 1e-150, 200e9), Err(DigitError::Stiffness { .. })));
}

#[test]
fn a_digit_is_checked_when_it_is_read() {
    let written = serde_json::to_string(&digit(ForceDirection::Vertical)).unwrap();
    assert_eq!(
        written,
        r#"{"length_m":0.12,"width_m":0.01,"thickness_m":0.0005,"youngs_modulus_pa":200000000000.0,"direction":"vertical"}"#
    );
    assert_eq!(serde_json::from_str::<Digit>(&written).unwrap(), digit(ForceDirection::Vertical));
    assert!(serde_json::from_str::<Digit>(&written.replace("0.0005", "-1")).is_err());
}
