//! `supports` and `sections` of a beam.

use super::*;
use palpate_mechanics::surface::{BeamSection, BeamSupport, BeamSupportKind, SupportedBeamSpec};

/// A beam on supports of every kind, with a step.
const SUPPORTED: &str = r#"[surface]
kind = "beam"
length = "400 mm"
width = "40 mm"
thickness = "1.2 mm"
youngs_modulus = "200 GPa"
supports = [
  { at = "0 mm", kind = "clamped" },
  { at = "200 mm", kind = "simple" },
  { at = "300 mm", kind = "elastic", stiffness = "2 N/mm", rotational_stiffness = "0.5 N·m/rad" },
  { at = "350 mm", kind = "guided" },
  { at = "400 mm", kind = "free" },
]
sections = [{ to = "100 mm", thickness = "2 mm" }, { width = "20 mm" }]
[sensors]
measure = "strain"
positions = ["0 mm", "150 mm"]
[contact]
force = "3 N"
"#;

fn spec(text: &str) -> SupportedBeamSpec {
    match Rig::from_toml(text).unwrap().setup.surface() {
        SurfaceSpec::SupportedBeam(beam) => beam.spec().clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_support_and_section_is_accepted() {
    let elastic =
        BeamSupportKind::Elastic { stiffness_n_per_m: 2000.0, rotational_stiffness_nm_per_rad: Some(0.5) };
    let supports = [
        (0.0, BeamSupportKind::Clamped),
        (0.2, BeamSupportKind::Simple),
        (0.3, elastic),
        (0.35, BeamSupportKind::Guided),
        (0.4, BeamSupportKind::Free),
    ];
    let expected = SupportedBeamSpec {
        length_m: 0.4,
        youngs_modulus_pa: 200e9,
        sections: vec![
            BeamSection { to_m: 0.1, width_m: 0.04, thickness_m: 0.002 },
            BeamSection { to_m: 0.4, width_m: 0.02, thickness_m: 0.0012 },
        ],
        supports: supports.map(|(at_m, kind)| BeamSupport { at_m, kind }).to_vec(),
    };
    assert_eq!(spec(SUPPORTED), expected);
    // If every section has its width and thickness, the beam needs none.
    let whole = SUPPORTED
        .replace("width = \"40 mm\"\nthickness = \"1.2 mm\"\n", "")
        .replace("thickness = \"2 mm\"", "thickness = \"2 mm\", width = \"40 mm\"")
        .replace("{ width = \"20 mm\" }", "{ width = \"20 mm\", thickness = \"1.2 mm\" }");
    assert_eq!(spec(&whole), expected);
    let steps =
        BENCH.replace("[sensors]", "supports = \"simple\"\nsections = [{ to = \"40 cm\" }]\n[sensors]");
    let ends = [0.0, 0.4].map(|at_m| BeamSupport { at_m, kind: BeamSupportKind::Simple });
    assert_eq!(spec(&steps).supports, ends);
}

#[test]
fn bad_supports_and_sections_are_refused_with_a_caret() {
    let second = "{ at = \"200 mm\", kind = \"simple\" }";
    let shown = refused(
        SUPPORTED,
        &[
            (second, "{ at = \"200 mm\", kind = \"pinned\" }"),
            (second, "{ kind = \"simple\" }"),
            (second, "{ at = \"200 mm\" }"),
            (second, "{ at = \"200 N\", kind = \"simple\" }"),
            (second, "{ at = \"200 mm\", kind = \"simple\", stiffness = \"2 N/mm\" }"),
            (second, "{ at = \"200 mm\", kind = \"simple\", gap = \"1 mm\" }"),
            (second, "{ at = \"401 mm\", kind = \"simple\" }"),
            (second, "{ at = \"0 mm\", kind = \"simple\" }"),
            (second, "{ at = \"200 mm\", kind = \"free\" }"),
            (second, "7"),
            ("\"2 N/mm\"", "\"2 mm\""),
            ("\"2 N/mm\"", "\"0 N/mm\""),
            ("stiffness = \"2 N/mm\", ", ""),
            ("\"0.5 N·m/rad\"", "\"-0.5 N·m/rad\""),
            ("to = \"100 mm\", ", ""),
            ("{ width = \"20 mm\" }", "{ to = \"300 mm\" }"),
            ("{ width = \"20 mm\" }", "{ to = \"100 mm\" }, { to = \"400 mm\" }"),
            ("{ width = \"20 mm\" }", "{ to = \"500 mm\" }"),
            ("thickness = \"2 mm\"", "thickness = \"0 mm\""),
            ("thickness = \"1.2 mm\"\n", ""),
            (
                "\"strain\"\npositions = [\"0 mm\", \"150 mm\"]",
                "\"reaction\"\npositions = [\"0 mm\", \"350 mm\"]",
            ),
            (
                "\"strain\"\npositions = [\"0 mm\", \"150 mm\"]",
                "\"deflection\"\npositions = [\"150 mm\", \"200 mm\"]",
            ),
            (
                "\"strain\"\npositions = [\"0 mm\", \"150 mm\"]",
                "\"slope\"\npositions = [\"150 mm\", \"0 mm\"]",
            ),
            ("\"150 mm\"", "\"400 mm\""),
        ],
    );
    insta::assert_snapshot!(shown);
    let mechanisms = [
        "[]",
        "[{ at = \"100 mm\", kind = \"simple\" }]",
        "[{ at = \"0 mm\", kind = \"guided\" }]",
        "true",
        "\"clamped\"",
    ];
    let shown = mechanisms
        .map(|supports| pointed(&BENCH.replace("[sensors]", &format!("supports = {supports}\n[sensors]"))));
    insta::assert_snapshot!(shown.join("\n\n"));
}

#[test]
fn a_sensor_over_a_support_of_the_papers_beam_is_refused() {
    let held = BENCH.replace("count = 8", "positions = [\"200 mm\", \"400 mm\"]");
    insta::assert_snapshot!(pointed(&held));
}
