//! Tests of the report of dead areas.

use crate::dead_areas_report;
use palpate_numerics::watch::Watch;
use palpate_rig::Rig;
use palpate_studies::dead_areas::{DeadAreas, RIG_TOML};

#[test]
fn dead_areas_have_their_page() {
    let study = DeadAreas {
        rig: Rig::from_toml(RIG_TOML).unwrap(),
        counts: vec![2, 4],
        calibrations: 1,
        tolerance_m: 2e-3,
        excluded: vec!["network", "network-lm", "gaussian-process", "influence"],
        seed: 0,
    };
    let findings = study.run(Watch::NONE).unwrap();
    let files = dead_areas_report(&study, &findings);
    let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names, ["report.html", "figure-1.svg", "figure-2.svg", "figure-3.svg"]);
    let page = std::str::from_utf8(&files[0].bytes).unwrap();
    for what in
        ["neighbours", "array, spread 10 mm, centroid", "array, spread 0.5 pitch, centroid", "table-2"]
    {
        assert!(page.contains(what), "{what}");
    }
}
