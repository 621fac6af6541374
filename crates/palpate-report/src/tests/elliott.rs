//! Tests of the report of Elliott's chain.

use crate::elliott_report;
use palpate_estimators::evaluation::Quantiles;
use palpate_rig::Rig;
use palpate_studies::elliott::{Chain, ChainRow, Elliott, ElliottResults, RIG_TOML};

#[test]
fn elliotts_chain_has_its_page() {
    let study = Elliott {
        rig: Rig::from_toml(RIG_TOML).unwrap(),
        components: vec![2, 8],
        presentations: 3_000_000,
        calibrations: 3,
        tolerance_m: 5e-3,
        seed: 0,
    };
    let spread = |median: f64| Quantiles { median, p05: 0.9 * median, p95: 1.2 * median };
    let row = |chain, error_m: f64, is_single: bool| ChainRow {
        chain,
        error_m: is_single.then(|| spread(error_m)),
        effective_percent: is_single.then(|| spread(50.0)),
        moving_error_m: spread(error_m),
        limit_m: is_single.then_some(1.5e-3),
    };
    let rows = vec![
        row(Chain::Components(2), 20e-3, true),
        row(Chain::Components(8), 7.25e-3, true),
        row(Chain::Readings, 8e-3, true),
        row(Chain::Influence, 1.75e-3, true),
        row(Chain::Filter, 0.6e-3, false),
        row(Chain::Smoother, 0.3e-3, false),
    ];
    let variance_percent = (0..25).map(|i| 50.0 * 0.5f64.powi(i)).collect();
    let files = elliott_report(&study, &ElliottResults { variance_percent, rows });
    let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names, ["report.html", "figure-1.svg", "figure-2.svg", "figure-3.svg"]);
    let page = std::str::from_utf8(&files[0].bytes).unwrap();
    for what in [
        "best with <b>8 components</b>: mean error <b>7.25 mm</b>",
        "1.75 mm</b>, 1.17 times the limit, 1.50 mm",
        "network on 2 components",
        "network on all readings",
        "influence locator, smoother",
        "3,000,000 presentations",
    ] {
        assert!(page.contains(what), "{what}");
    }
}
