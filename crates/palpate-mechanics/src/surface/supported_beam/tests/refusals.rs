//! Invalid beams, and insensitive sensors.

use super::*;

fn sections(ends_m: &[f64]) -> SupportedBeamSpec {
    let sections = ends_m.iter().map(|&to_m| BeamSection { to_m, width_m: 0.04, thickness_m: 0.0012 });
    SupportedBeamSpec { sections: sections.collect(), ..paper_on(&[(0.0, Clamped)]) }
}

#[test]
fn invalid_beams_are_refused_with_reason_and_remedy() {
    let cantilever = paper_on(&[(0.0, Clamped)]);
    let thin = |thickness_m| {
        let mut spec = cantilever.clone();
        spec.sections[0].thickness_m = thickness_m;
        spec
    };
    let cases = [
        SupportedBeamSpec { length_m: 0.0, ..cantilever.clone() },
        SupportedBeamSpec { youngs_modulus_pa: f64::NAN, ..cantilever.clone() },
        thin(0.0),
        thin(-0.001),
        thin(1e-120),
        sections(&[]),
        sections(&[0.1, 0.3]),
        sections(&[0.2, 0.1, 0.4]),
        sections(&[0.2, 0.2, 0.4]),
        sections(&[0.2, 0.5]),
        sections(&vec![0.4; 101]),
        paper_on(&[]),
        paper_on(&[(0.0, Free), (0.4, Free)]),
        paper_on(&[(0.1, Simple)]),
        paper_on(&[(0.1, spring(100.0, None))]),
        paper_on(&[(0.1, Guided), (0.4, Guided)]),
        paper_on(&[(0.0, Clamped), (0.0, Simple)]),
        paper_on(&[(0.0, Clamped), (0.5, Simple)]),
        paper_on(&[(0.0, Clamped), (f64::NAN, Simple)]),
        paper_on(&[(0.0, Clamped), (0.2, Free)]),
        paper_on(&[(0.0, spring(0.0, Some(1.0)))]),
        paper_on(&[(0.0, spring(1.0, Some(-1.0)))]),
        paper_on(&[(0.0, spring(1.0, Some(f64::INFINITY)))]),
        paper_on(&[(0.0, Simple); 101]),
    ];
    let words = cases.map(|spec| {
        let error = SupportedBeam::new(spec).unwrap_err();
        let help = error.help().map_or(String::new(), |help| format!("\n    {help}"));
        format!("{:?}: {error}{help}", error.part())
    });
    insta::assert_snapshot!(words.join("\n"));
}

#[test]
fn a_file_with_a_beam_that_cannot_be_is_refused() {
    let json = serde_json::to_string(&paper_on(&[(0.1, Simple)])).unwrap();
    let error = serde_json::from_str::<SupportedBeam>(&json).unwrap_err().to_string();
    assert!(error.starts_with("the beam is a mechanism"), "{error}");
}

#[test]
fn sensors_that_a_support_holds_never_move() {
    let found = beam(&paper_on(&[(0.0, Clamped), (0.2, Simple), (0.3, spring(1e4, None))]));
    let still = |kind, x_m| found.insensitive_sensor(kind, Position::along(x_m)).is_some();
    assert!(still(Deflection, 0.0) && still(Slope, 0.0) && still(Deflection, 0.2) && still(Strain, 0.4));
    assert!(!still(Strain, 0.0) && !still(Slope, 0.2) && !still(Strain, 0.2) && !still(Deflection, 0.3));
    assert!(!still(Reaction, 0.0) && !still(Deflection, 0.4) && !still(Strain, 0.25));
    let places: Vec<f64> = found.force_supports().iter().map(|place| place.x_m).collect();
    assert_eq!(places, [0.0, 0.2, 0.3]);
}

#[test]
fn beam_is_described_in_words() {
    let spec = paper_on(&[(0.4, spring(2000.0, Some(0.5))), (0.0, Clamped), (0.2, spring(50.0, None))]);
    let words = "clamped at 0 mm, elastic (50 N/m) at 200 mm, elastic (2 N/mm and 0.5 Nm/rad) at 400 mm";
    assert_eq!(spec.supports_in_words(), words);
    assert_eq!(spec.sections_in_words(), "40 mm × 1.2 mm");
    let stepped = sections(&[0.1, 0.4]);
    assert_eq!(stepped.sections_in_words(), "40 mm × 1.2 mm up to 100 mm, 40 mm × 1.2 mm up to 400 mm");
}
