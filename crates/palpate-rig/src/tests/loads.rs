//! Distributed loads: `[[load]]`.

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
