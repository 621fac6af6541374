//! A flexible digit as the surface.

use super::*;

const DIGIT: &str = include_str!("../../../../examples/digit.toml");

#[test]
fn a_bad_digit_is_refused_with_a_caret() {
    let shown = refused(
        DIGIT,
        &[
            ("\"0.5 mm\"", "\"0 mm\""),
            ("\"0.5 mm\"", "\"1e-120 mm\""),
            ("\"80 mm\"", "\"121 mm\""),
            ("\"normal\"", "\"norml\""),
            ("\"normal\"", "\"sideways\""),
            ("direction = ", "supports = \"simple\"\ndirection = "),
            ("measure = \"strain\"", "measure = \"deflection\""),
            ("measure = \"strain\"", "measure = \"raw\""),
            ("\"4 N\"", "\"40 N\""),
            ("[training]", "[contact]\nforce = \"15 N\"\n[training]"),
            ("[estimator]", "[estimator]\ntheory = \"lineal\""),
            ("[estimator]", "[estimator]\nsource = \"mechanics\""),
        ],
    );
    let without = pointed(&DIGIT.replacen("direction", "#", 1));
    let on_a_beam = pointed(&BENCH.replacen("[sensors]", "direction = \"normal\"\n[sensors]", 1));
    let of_a_network = pointed(&BENCH.replacen("[estimator]", "[estimator]\ntheory = \"exact\"", 1));
    insta::assert_snapshot!([shown, without, on_a_beam, of_a_network].join("\n\n"));
}
