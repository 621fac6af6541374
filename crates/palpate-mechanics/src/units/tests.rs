use proptest::prelude::*;

use super::*;

#[test]
fn quantities_are_read_as_people_write_them() {
    let written = [
        ("400 mm", 0.4, Dimension::Length),
        ("400mm", 0.4, Dimension::Length),
        ("  1.2 mm ", 0.0012, Dimension::Length),
        ("5 um", 5e-6, Dimension::Length),
        ("5 \u{b5}m", 5e-6, Dimension::Length),
        ("5 \u{3bc}m", 5e-6, Dimension::Length),
        ("1e2 nm", 1e-7, Dimension::Length),
        ("-.5 cm", -0.005, Dimension::Length),
        ("3 N", 3.0, Dimension::Force),
        ("+3. kN", 3000.0, Dimension::Force),
        ("200 GPa", 200e9, Dimension::Modulus),
        ("200GPa", 200e9, Dimension::Modulus),
        ("1 ue", 1e-6, Dimension::Strain),
        ("1 \u{b5}\u{3b5}", 1e-6, Dimension::Strain),
        ("1 \u{3bc}m/m", 1e-6, Dimension::Strain),
        ("2 mrad", 0.002, Dimension::Angle),
        ("180 deg", std::f64::consts::PI, Dimension::Angle),
        ("5 %", 0.05, Dimension::Ratio),
        ("7850 kg/m3", 7850.0, Dimension::Density),
        ("7.85 g/cm3", 7850.0, Dimension::Density),
        ("2 N/mm", 2000.0, Dimension::Stiffness),
        ("2 kN/m", 2000.0, Dimension::Stiffness),
        ("0.5 N·m/rad", 0.5, Dimension::RotationalStiffness),
        ("0.7", 0.7, Dimension::None),
    ];
    for (text, value, dimension) in written {
        assert_eq!(text.parse(), Ok(Quantity { value, dimension }), "{text}");
    }
}

#[test]
fn invalid_quantity_is_refused_with_valid_units() {
    let wanted = [
        ("", Dimension::Length),
        ("mm", Dimension::Length),
        ("400 m m", Dimension::Length),
        ("400 N", Dimension::Length),
        ("400", Dimension::Length),
        ("3 newton", Dimension::Force),
        ("200 gpa", Dimension::Modulus),
        ("1,5 mm", Dimension::Length),
        ("1e999 mm", Dimension::Length),
        ("nan mm", Dimension::Length),
        ("-inf", Dimension::None),
        ("5 %", Dimension::None),
        ("5 lots", Dimension::None),
    ];
    let messages =
        wanted.map(|(text, dimension)| Quantity::parse_as(text, dimension).unwrap_err().to_string());
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn a_ratio_may_be_a_plain_number() {
    assert_eq!(Quantity::parse_as("0.05", Dimension::Ratio), Quantity::parse_as("5 %", Dimension::Ratio));
}

#[test]
fn quantities_are_shown_with_a_readable_prefix() {
    let shown = [
        (0.4, Dimension::Length),
        (-0.0034722222, Dimension::Length),
        (5e-6, Dimension::Length),
        (25.0, Dimension::Length),
        (0.0, Dimension::Length),
        (3.0, Dimension::Force),
        (200e9, Dimension::Modulus),
        (1.5e-6, Dimension::Strain),
        (0.002, Dimension::Angle),
        (0.05, Dimension::Ratio),
        (7850.0, Dimension::Density),
        (2000.0, Dimension::Stiffness),
        (150.0, Dimension::Stiffness),
        (0.5, Dimension::RotationalStiffness),
        (0.7, Dimension::None),
    ];
    let shown = shown.map(|(value, dimension)| Quantity { value, dimension }.to_string());
    let expected = [
        "400 mm",
        "-3.47222 mm",
        "5 um",
        "25 m",
        "0 m",
        "3 N",
        "200 GPa",
        "1.5 ue",
        "2 mrad",
        "5 %",
        "7850 kg/m3",
        "2 N/mm",
        "150 N/m",
        "0.5 Nm/rad",
        "0.7",
    ];
    assert_eq!(shown, expected);
    assert_eq!([format_length_mm(0.4 / 9.0), format_length_mm(-1e-9)], ["44.4444 mm", "0 mm"]);
    assert_eq!(format_length_mm(1.7976931348623157e305), "1.7977e308 mm");
}

const SYMBOLS: [&str; 8] = ["", "nm", "um", "mm", "kN", "GPa", "ue", "%"];

proptest! {
    #[test]
    fn si_values_survive_writing_and_reading(value in proptest::num::f64::NORMAL | proptest::num::f64::ZERO, symbol in 0..8usize) {
        let unit = Unit::from_symbol(SYMBOLS[symbol]).unwrap();
        let written = unit.format_si(value);
        prop_assert_eq!(unit.parse_si(&written).unwrap().to_bits(), value.to_bits(), "{}", written);
    }

    #[test]
    fn formatted_quantity_parses_to_its_value(value in 1e-8..1e8f64) {
        for dimension in [Dimension::Length, Dimension::Force, Dimension::Angle, Dimension::Strain, Dimension::Ratio] {
            let shown = Quantity { value, dimension }.to_string();
            let read: Quantity = shown.parse().unwrap();
            prop_assert_eq!(read.dimension, dimension);
            prop_assert!((read.value - value).abs() <= 1e-5 * value, "{}", shown);
        }
    }

    #[test]
    fn no_text_panics(text in ".*") {
        let _ = text.parse::<Quantity>();
        let _ = Quantity::parse_as(&text, Dimension::Length);
        let _ = Unit::from_symbol("mm").and_then(|unit| unit.parse_si(&text));
    }

    #[test]
    fn no_text_that_looks_like_a_quantity_panics(text in "[-+]?[0-9.]{0,4}[eE]?[-+]?[0-9]{0,12} ?[a-zA-Z%µμ°/³]{0,4}") {
        if let Ok(quantity) = text.parse::<Quantity>() {
            prop_assert!(quantity.value.is_finite());
            let _ = quantity.to_string();
        }
    }
}
