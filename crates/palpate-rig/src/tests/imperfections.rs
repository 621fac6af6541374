use super::*;
use palpate_estimators::imperfections::{Amount, Imperfections, OffsetDrift, Relaxation, Schedule};

fn with(keys: &str) -> String {
    format!("{PAPER}\n[imperfections]\n{keys}\n")
}

#[test]
fn every_imperfection_can_be_given() {
    let text = with(
        r#"
        hysteresis = "2 %"
        creep = [{ share = "3 %", time = "5 s" }, { share = 0.01, time = "60 s" }]
        residue = { share = "1 %", time = "20 s" }
        drift_per_hour = "3.6 %"
        common_drift_per_hour = "36 um"
        walk_in_hour = "6 %"
        common_walk_in_hour = "60 um"
        gain_drift_per_hour = "3.6 %"
        common_gain_drift_per_hour = "-7.2 %"
        noise_correlation = 0.3
        noise_freedom = 5
        repeated_readings = 2
        touch_width = "4 mm"
        saturation = "15 %"
        range_force = "5 N"
        rest = "3 s"
        untouched_rows = 5
        settle = "1 s"
        rate = "20 Hz"
        pause = "10 min"
        "#,
    );
    let drift = |line_per_s, walk_per_root_s| OffsetDrift { line_per_s, walk_per_root_s };
    let expected = Imperfections {
        hysteresis: 0.02,
        creep: [Relaxation { share: 0.03, time_s: 5.0 }, Relaxation { share: 0.01, time_s: 60.0 }],
        residue: Relaxation { share: 0.01, time_s: 20.0 },
        drift: drift(Amount::Share(1e-5), Amount::Share(1e-3)),
        common_drift: drift(Amount::Value(1e-8), Amount::Value(1e-6)),
        gain_drift_per_s: 1e-5,
        common_gain_drift_per_s: -2e-5,
        noise_correlation: 0.3,
        noise_freedom: Some(5.0),
        repeated_readings: 2,
        touch_width_m: 0.004,
        saturation: 0.15,
        range_force_n: Some(5.0),
        schedule: Schedule { rest_s: 3.0, untouched_rows: 5, settle_s: 1.0, rate_hz: 20.0, pause_s: 600.0 },
    };
    let read = Rig::from_toml(&text).unwrap().setup.imperfections().copied().unwrap();
    let numbers = |imperfections: &Imperfections| {
        let text = format!("{imperfections:?}");
        let parts = text.split(|c: char| !(c.is_ascii_digit() || ".e-".contains(c)));
        parts.filter_map(|part| part.parse::<f64>().ok()).collect::<Vec<_>>()
    };
    let (read, expected) = (numbers(&read), numbers(&expected));
    assert_eq!(read.len(), expected.len());
    assert!(
        read.iter().zip(&expected).all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs()),
        "{read:?}\n{expected:?}"
    );
}

#[test]
fn an_empty_section_adds_untouched_rows_alone() {
    let rig = Rig::from_toml(&with("")).unwrap();
    assert_eq!(rig.setup.imperfections(), Some(&Imperfections::default()));
    assert_eq!(Rig::from_toml(PAPER).unwrap().setup.imperfections(), None);
    assert_eq!(rig.simulate(0).unwrap().rows.len(), 21);
}

#[test]
fn bad_imperfections_are_refused_with_a_caret() {
    let refused = |text: &str| {
        let error = Rig::from_toml(text).unwrap_err();
        let place = error.span.clone().map_or(String::new(), |span| text[span].to_owned());
        format!("{error} | {place}")
    };
    let digit = include_str!("../../../../examples/digit.toml");
    let strip = include_str!("../../../../examples/fsi-water.toml");
    let mixed = include_str!("../../../../examples/continuous-beam.toml");
    let shown = [
        refused(&with("hysteresis = 1")),
        refused(&with(
            "creep = [{ share = 0.1, time = \"5 s\" }, { share = 0.1, time = \"9 s\" }, { share = 0.1, time = \"9 s\" }]",
        )),
        refused(&with("creep = { share = 0.1, time = \"0 s\" }")),
        refused(&with("creep = [{ share = 0.6, time = \"1 s\" }, { share = 0.6, time = \"9 s\" }]")),
        refused(&with("residue = { share = 0.1 }")),
        refused(&with("drift_per_hour = \"2 N\"")),
        refused(&with("walk_in_hour = \"-2 um\"")),
        refused(&with("noise_freedom = 2")),
        refused(&with("noise_correlation = \"100 %\"")),
        refused(&with("touch_width = \"400 mm\"")),
        refused(&with("untouched_rows = 1001")),
        refused(&with("histeresis = 0.1")),
        refused(&format!("{digit}\n[imperfections]\ntouch_width = \"2 mm\"\n")),
        refused(&format!("{strip}\n[imperfections]\nhysteresis = 0.1\n")),
        refused(&format!("{mixed}\n[imperfections]\ndrift_per_hour = \"2 um\"\n")),
    ];
    insta::assert_snapshot!(shown.join("\n"));
}
