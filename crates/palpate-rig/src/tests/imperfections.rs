use super::*;
use palpate_estimators::imperfections::{Amount, Imperfections, OffsetDrift, Relaxation, Schedule};

fn imperfect_rig(keys: &str) -> String {
    format!("{PAPER}\n[imperfections]\n{keys}\n")
}

#[test]
fn every_imperfection_can_be_given() {
    let text = imperfect_rig(
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
    const HOUR_S: f64 = 3600.0;
    let drift = |unit: fn(f64) -> Amount, line: f64, walk: f64| OffsetDrift {
        line_per_s: unit(1.0 / HOUR_S * line),
        walk_per_root_s: unit(1.0 / HOUR_S.sqrt() * walk),
    };
    let expected = Imperfections {
        hysteresis: 0.02,
        creep: [Relaxation { share: 0.03, time_s: 5.0 }, Relaxation { share: 0.01, time_s: 60.0 }],
        residue: Relaxation { share: 0.01, time_s: 20.0 },
        drift: drift(Amount::Share, 0.036, 0.06),
        common_drift: drift(Amount::Value, 36e-6, 60e-6),
        gain_drift_per_s: 0.036 / HOUR_S,
        common_gain_drift_per_s: -0.072 / HOUR_S,
        noise_correlation: 0.3,
        noise_freedom: Some(5.0),
        repeated_readings: 2,
        touch_width_m: 0.004,
        saturation: 0.15,
        range_force_n: Some(5.0),
        schedule: Schedule { rest_s: 3.0, untouched_rows: 5, settle_s: 1.0, rate_hz: 20.0, pause_s: 600.0 },
    };
    let read = Rig::from_toml(&text).unwrap().setup.imperfections().copied().unwrap();
    assert_eq!(read, expected);
}

#[test]
fn an_empty_section_adds_untouched_rows_alone() {
    let rig = Rig::from_toml(&imperfect_rig("")).unwrap();
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
        refused(&imperfect_rig("hysteresis = 1")),
        refused(&imperfect_rig(
            "creep = [{ share = 0.1, time = \"5 s\" }, { share = 0.1, time = \"9 s\" }, { share = 0.1, time = \"9 s\" }]",
        )),
        refused(&imperfect_rig("creep = { share = 0.1, time = \"0 s\" }")),
        refused(&imperfect_rig("creep = [{ share = 0.6, time = \"1 s\" }, { share = 0.6, time = \"9 s\" }]")),
        refused(&imperfect_rig("residue = { share = 0.1 }")),
        refused(&imperfect_rig("drift_per_hour = \"2 N\"")),
        refused(&imperfect_rig("walk_in_hour = \"-2 um\"")),
        refused(&imperfect_rig("noise_freedom = 2")),
        refused(&imperfect_rig("noise_correlation = \"100 %\"")),
        refused(&imperfect_rig("touch_width = \"400 mm\"")),
        refused(&imperfect_rig("untouched_rows = 1001")),
        refused(&imperfect_rig("histeresis = 0.1")),
        refused(&format!("{digit}\n[imperfections]\ntouch_width = \"2 mm\"\n")),
        refused(&format!("{strip}\n[imperfections]\nhysteresis = 0.1\n")),
        refused(&format!("{mixed}\n[imperfections]\ndrift_per_hour = \"2 um\"\n")),
    ];
    insta::assert_snapshot!(shown.join("\n"));
}
