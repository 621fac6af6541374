//! Forces of contacts and distributed loads.

use super::*;

#[test]
fn a_bad_load_is_refused_with_a_caret() {
    let loaded = format!("{BENCH}[[load]]\nfrom = \"130 mm\"\nto = \"150 mm\"\nforce = \"2 N\"\n");
    let shown = refused(
        &loaded,
        &[
            ("from = \"130 mm\"\n", ""),
            ("to = \"150 mm\"", "to = \"130 mm\""),
            ("to = \"150 mm\"", "to = \"450 mm\""),
            ("force = \"2 N\"", "force = \"0 N\""),
            ("force = \"2 N\"", "force = \"2 N\"\npressure = 1"),
        ],
    );
    insta::assert_snapshot!(shown);
}

#[test]
fn a_range_of_forces_is_read_and_a_bad_one_refused_at_its_place() {
    let pressed = BENCH.replace("count = 10", "count = 10\nforce = '3 N'");
    let with = |contact: &str| Rig::from_toml(&pressed.replace("force = \"3 N\"", contact));
    let rig = with("force_range = [\"500 mN\", \"10 N\"]").unwrap();
    let range = rig.setup.force_range().unwrap();
    assert_eq!((range.ends_n(), rig.setup.greatest_force_n()), ((0.5, 10.0), Some(10.0)));
    for contact in [
        "force_range = [\"10 N\", \"0.5 N\"]",
        "force_range = [\"0 N\", \"10 N\"]",
        "force_range = [\"1 N\"]",
        "force_range = \"1 N\"",
        "force_range = [\"1 mm\", \"2 mm\"]",
        "force = \"3 N\"\nforce_range = [\"1 N\", \"2 N\"]",
        "greatest_force = \"3 N\"\nforce_range = [\"1 N\", \"2 N\"]",
    ] {
        let refused = with(contact).unwrap_err();
        assert!(refused.span.is_some(), "{contact}: {refused}");
    }
}
