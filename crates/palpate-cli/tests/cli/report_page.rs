//! The reports of studies and of a limit in a browser, on a phone and on a screen.

use std::fs;

use crate::support::browser::measure;
use crate::support::examples::PAPER;
use crate::support::toml::Toml;
use palpate_estimators::influence::Influence;
use palpate_mechanics::limit::{Force, LimitCurve, limit_warnings};
use palpate_numerics::watch::Watch;
use palpate_report::{LimitReport, ReportFile, StudyReport, limit_report, paper_report, study_report};
use palpate_rig::Rig;
use palpate_studies::{PreparedStudy, RunFacts, RunOptions, Study, StudyResults, paper};
use tempfile::TempDir;

/// The pages of the paper's study, cut down to a few epochs: as the paper's, and as any study's.
fn pages() -> [Vec<ReportFile>; 2] {
    let toml = Toml::parse(paper::STUDY_TOML).set("estimator.max_epochs", 50).to_string();
    let study = PreparedStudy::new(Study::from_toml(&toml).unwrap(), Watch::NONE).unwrap();
    let options = RunOptions { seeds: 2, threads: 1 };
    let outcomes = study.run(options, Vec::new(), &|_| {}, Watch::NONE).unwrap();
    let results = StudyResults::new(&outcomes, &study);
    let run = RunFacts::new(&study, options, "eight lanes".to_owned(), 1_000_000, 0.1);
    let report = StudyReport { study: &study, outcomes: &outcomes, results: &results, run: &run };
    [paper_report(&report), study_report(&report)]
}

/// The page of the limit of the paper's bench.
fn limit_page() -> Vec<ReportFile> {
    let setup = Rig::from_toml(PAPER).unwrap().setup;
    let limit = setup.cramer_rao_bound().unwrap();
    let [known, unknown] =
        [Force::Known, Force::Unknown].map(|force| LimitCurve::over_surface(&limit, 3.0, force).unwrap());
    let report = LimitReport {
        title: "The limit",
        setup: &setup,
        limit: &limit,
        known_force: &known,
        unknown_force: &unknown,
        force: Force::Unknown,
        warnings: &limit_warnings(&limit, 3.0, Force::Unknown, Watch::NONE).unwrap(),
        listed: &known.points.iter().step_by(50).map(|point| point.position).collect::<Vec<_>>(),
        touch: &Influence::default().lightest_touch(&limit),
    };
    limit_report(&report)
}

#[test]
fn a_browser_finds_no_fault_with_the_pages() {
    let folder = TempDir::new().unwrap();
    for files in pages().into_iter().chain([limit_page()]) {
        let page = folder.path().join("report.html");
        let report = files.iter().find(|file| file.name == "report.html").unwrap();
        fs::write(&page, &report.bytes).unwrap();
        for width in [390, 800, 1400] {
            let Some(seen) = measure(&page, width) else { return };
            assert_eq!(seen.width, width);
            assert!(seen.content_width <= width, "{} px at {width} px", seen.content_width);
            assert!(seen.outside_links.iter().all(|link| link.starts_with("https://doi.org/")), "{seen:?}");
            assert!(seen.errors.is_empty() && seen.dead_anchors.is_empty(), "{seen:?}");
            assert!(seen.outside_loads.is_empty() && seen.empty_pictures.is_empty(), "{seen:?}");
        }
    }
}
