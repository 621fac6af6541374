//! Tests of whole reports.

use std::collections::BTreeSet;

use crate::{
    EstimateOrigin, EvaluationReport, LimitReport, ReportFile, StudyReport, evaluation_report, limit_report,
    paper_report, study_report,
};
use palpate_estimators::estimator::Estimator;
use palpate_estimators::evaluation::{Evaluation, Portion};
use palpate_estimators::fit::Fit;
use palpate_estimators::influence::Influence;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::simulate_at;
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::{Force, LimitCurve, limit_warnings};
use palpate_mechanics::sensing::SensorGroup;
use palpate_mechanics::sensing::SensorKind::{Deflection, Reaction};
use palpate_mechanics::surface::{Beam, Extent};
use palpate_mechanics::units::{gpa, mm, newtons, um};
use palpate_numerics::watch::Watch;
use palpate_rig::Rig;
use palpate_studies::{ArmOutcome, PreparedStudy, RunFacts, RunOptions, Study, StudyResults, paper};

struct Run {
    study: PreparedStudy,
    outcomes: Vec<ArmOutcome>,
    results: StudyResults,
    facts: RunFacts,
}

fn run(toml: &str, seeds: u64) -> Run {
    let study = PreparedStudy::new(Study::from_toml(toml).unwrap(), Watch::NONE).unwrap();
    let options = RunOptions { seeds, threads: 1 };
    let outcomes = study.run(options, Vec::new(), &|_| {}, Watch::NONE).unwrap();
    let results = StudyResults::new(&outcomes, &study);
    let facts = RunFacts::new(&study, options, "portable".to_owned(), 12_345, 0.5);
    Run { study, outcomes, results, facts }
}

impl Run {
    fn report(&self) -> StudyReport<'_> {
        StudyReport { study: &self.study, outcomes: &self.outcomes, results: &self.results, run: &self.facts }
    }
}

fn quick_paper() -> String {
    let text = paper::STUDY_TOML.replace("max_epochs = 1_000_000", "max_epochs = 50");
    assert!(text.contains("max_epochs = 50"));
    text
}

fn with_arms(arms: &[(&str, &str)]) -> String {
    let text = quick_paper();
    let (head, _) = text.split_once("[[arm]]").unwrap();
    let arm =
        |(name, training): &(&str, &str)| format!("[[arm]]\nname = \"{name}\"\ntraining = {training}\n");
    head.to_owned() + &arms.iter().map(arm).collect::<String>()
}

fn page(files: &[ReportFile]) -> &str {
    let file = files.iter().find(|file| file.name == "report.html").expect("there is a page");
    std::str::from_utf8(&file.bytes).unwrap()
}

fn attributes<'a>(html: &'a str, name: &str) -> Vec<&'a str> {
    let start = format!(" {name}=\"");
    html.split(&start).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

fn shown_text(html: &str) -> String {
    let body = html.split_once("<body>").unwrap().1;
    body.split('<')
        .filter_map(|part| part.split_once('>'))
        .map(|(_, text)| text)
        .collect::<Vec<_>>()
        .join(" ")
}

fn assert_sound(files: &[ReportFile], figures: usize) {
    let html = page(files);
    assert!(html.starts_with("<!DOCTYPE html>") && html.contains("charset=\"utf-8\""));
    let ids = attributes(html, "id");
    let distinct: BTreeSet<&str> = ids.iter().copied().collect();
    assert_eq!(ids.len(), distinct.len(), "an id occurs twice in {ids:?}");
    for link in attributes(html, "href").into_iter().filter_map(|link| link.strip_prefix('#')) {
        assert!(distinct.contains(link), "#{link} leads nowhere");
    }
    let outside: Vec<&str> =
        attributes(html, "href").into_iter().filter(|link| !link.starts_with(['#', 'd'])).collect();
    assert!(outside.iter().all(|link| *link == "https://doi.org/10.5772/53567"), "{outside:?}");
    assert!(attributes(html, "src").is_empty() && !html.contains("url(") && !html.contains("@import"));
    let text = shown_text(html);
    let bare = |word: &str| word.trim_matches(|c: char| !c.is_alphanumeric()).to_owned();
    let no_number = |word: String| word == "inf" || word.contains("NaN");
    assert!(!text.split_whitespace().map(bare).any(no_number), "the page shows what is not a number");
    let mut names: Vec<String> = (1..=figures).map(|number| format!("figure-{number}.svg")).collect();
    names.insert(0, "report.html".to_owned());
    assert_eq!(files.iter().map(|file| &file.name).collect::<Vec<_>>(), names.iter().collect::<Vec<_>>());
    for number in 1..=figures {
        assert!(distinct.contains(format!("figure-{number}").as_str()), "figure {number} is not in the page");
    }
}

#[test]
fn the_papers_report_has_every_part() {
    let run = run(&quick_paper(), 2);
    let files = paper_report(&run.report());
    assert_sound(&files, 8);
    let html = page(&files);
    let ids = attributes(html, "id");
    for id in [
        "sensor",
        "training",
        "position-output",
        "output-coding",
        "arrangements",
        "errors",
        "published",
        "claims",
        "not-replicated",
        "open",
        "arms",
        "run",
    ] {
        assert!(ids.contains(&id), "section {id} is missing");
    }
    for table in 1..=8 {
        assert!(ids.contains(&format!("table-{table}").as_str()), "table {table} is missing");
    }
    let text = shown_text(html);
    for claim in 1..=8 {
        assert!(text.contains(&format!("C{claim}")));
    }
    for fact in ["24 networks", "of 16 published figures", "26,850", "3.4722 mm", "200 GPa", "E3.2"] {
        assert!(text.contains(fact), "{fact} is missing");
    }
    assert!(html.contains(&run.facts.study_sha256) && html.contains(env!("CARGO_PKG_VERSION")));
}

#[test]
fn untrained_networks_are_reported() {
    let run = run(&quick_paper(), 1);
    let text = shown_text(page(&paper_report(&run.report())));
    assert!(text.contains("12 of 12 networks did not converge"), "{text}");
    let agreement = paper::Agreement::new(&paper::published_figures(&run.results));
    assert!(agreement.agreeing < agreement.compared);
    assert_eq!(text.matches("the median found here is").count(), agreement.compared - agreement.agreeing);
}

#[test]
fn a_part_of_the_papers_arms_gives_the_figures_that_they_allow() {
    let arms = [
        ("normalized-10", "{ arrangement = \"even\", count = 10 }"),
        ("middle4-20", "{ arrangement = \"edge-dense\", middle = 4, count = 20 }"),
    ];
    let run = run(&with_arms(&arms), 1);
    let files = paper_report(&run.report());
    assert_sound(&files, 7);
}

#[test]
fn a_run_that_was_given_up_at_once_still_has_a_report() {
    let mut run = run(&with_arms(&[("only", "{ arrangement = \"even\", count = 5 }")]), 1);
    run.outcomes.iter_mut().for_each(|outcome| outcome.fits.clear());
    run.results = StudyResults::new(&run.outcomes, &run.study);
    assert_sound(&paper_report(&run.report()), 1);
    assert_sound(&study_report(&run.report()), 0);
}

#[test]
fn another_study_has_a_figure_for_each_arm() {
    let arms = [
        ("few", "{ arrangement = \"even\", count = 5 }"),
        ("listed", "{ arrangement = \"explicit\", positions = [\"50 mm\", \"200 mm\", \"350 mm\"] }"),
    ];
    let run = run(&with_arms(&arms), 3);
    let files = study_report(&run.report());
    assert_sound(&files, 2);
    let text = shown_text(page(&files));
    assert!(text.contains("6 networks") && text.contains("listed") && text.contains("2 arms"), "{text}");
}

#[test]
fn a_study_of_sensors_shows_its_layouts_and_the_limit() {
    let text = include_str!("../../../../studies/sensor-kinds.toml");
    let (base, arms) = text.split_once("[[arm]]").unwrap();
    let wanted = ["unknown-deflection-8", "unknown-reaction-2", "known-deflection-8", "known-strain-8"];
    let kept =
        arms.split("[[arm]]").filter(|arm| wanted.iter().any(|name| arm.contains(&format!("\"{name}\""))));
    let run = run(&(base.to_owned() + &kept.map(|arm| format!("[[arm]]{arm}")).collect::<String>()), 2);
    let files = study_report(&run.report());
    // All arms, their layouts, and errors with the force unknown and known.
    assert_sound(&files, 4);
    let text = shown_text(page(&files));
    for said in ["8 locators fitted", "limit's average error", "error over the limit's", "reaction 0, 400 mm"]
    {
        assert!(text.contains(said), "{said} is missing in {text}");
    }
    assert!(!text.contains("iterations") && !text.contains("did not converge"), "{text}");
}

fn quick_rig(max_epochs: u32) -> Rig {
    let mut rig = Rig::from_toml(include_str!("../../../../examples/paper.toml")).unwrap();
    let Estimator::Network(network) = &mut rig.estimator else { panic!("the paper has a network") };
    network.training.max_epochs = max_epochs;
    rig
}

#[test]
fn evaluation_names_the_origin_of_the_estimates() {
    let rig = quick_rig(50);
    let recording = rig.simulate(0).unwrap();
    let locator = rig.estimator.fit(&rig.setup, &recording).unwrap();
    let positions: Vec<_> = recording.distinct_positions();
    let other = simulate_at(&rig.setup, &positions, 3, 1).unwrap();
    let portions = [Portion { from_m: 0.02, to_m: 0.38 }];
    for (recording, judged, said) in [
        (&recording, EstimateOrigin::Locator(&locator), "this recording"),
        (&other, EstimateOrigin::Locator(&locator), "another recording"),
        (
            &other,
            EstimateOrigin::CrossValidated { rig: &rig, folds: 5, seed: 3 },
            "Cross-validated by position in 5 folds",
        ),
    ] {
        let files = evaluation_report(&EvaluationReport {
            title: "Evaluation of <paper>",
            evaluation: &Evaluation::new(&locator, recording).unwrap(),
            recording: &recording.provenance,
            origin: judged,
            portions: &portions,
            tolerance_m: 2e-3,
        });
        assert_sound(&files, 2);
        let html = page(&files);
        assert!(html.contains("Evaluation of &lt;paper&gt;"));
        let text = shown_text(html);
        for fact in [said, "50 epochs", "20–380 mm", "network", "beam, 400 mm"] {
            assert!(text.contains(fact), "{fact} is missing: {text}");
        }
    }
}

#[test]
fn empty_evaluation_has_a_report() {
    let rig = quick_rig(5);
    let recording = rig.simulate(0).unwrap();
    let locator = rig.estimator.fit(&rig.setup, &recording).unwrap();
    let files = evaluation_report(&EvaluationReport {
        title: "Nothing",
        evaluation: &Evaluation { extent: Extent::line(0.4).unwrap(), located: Vec::new() },
        recording: &recording.provenance,
        origin: EstimateOrigin::Locator(&locator),
        portions: &[],
        tolerance_m: 2e-3,
    });
    assert_sound(&files, 2);
}

fn limits(sensors: SensorGroup, force: Force) -> Vec<ReportFile> {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).unwrap();
    let setup = Setup::new(beam).sensors(sensors).unwrap();
    let limit = setup.cramer_rao_bound().unwrap();
    let curve = |force| LimitCurve::over_surface(&limit, 3.0, force).unwrap();
    limit_report(&LimitReport {
        title: "The limit of <paper>",
        setup: &setup,
        limit: &limit,
        known_force: &curve(Force::Known),
        unknown_force: &curve(Force::Unknown),
        force,
        warnings: &limit_warnings(&limit, 3.0, force, Watch::NONE).unwrap(),
        listed: &[0.0, 0.05, 0.2].map(Position::along),
        touch: &Influence::default().lightest_touch(&limit),
    })
}

#[test]
fn limit_is_drawn_and_described() {
    let deflections = |count| Deflection.evenly(count).noise(um(5.0));
    let reactions = Reaction.at_x([mm(0.0), mm(400.0)]).noise(newtons(0.01));
    let cases = [
        (deflections(8), Force::Known, "7.7 %"),
        (deflections(8), Force::Unknown, "reaction sensors at the supports"),
        (reactions, Force::Unknown, "Nothing to warn of"),
        (deflections(1), Force::Unknown, "is unidentifiable everywhere"),
    ];
    for (sensors, force, said) in cases {
        let files = limits(sensors, force);
        assert_sound(&files, 3);
        let text = shown_text(page(&files));
        for fact in [said, "3 N", "Cramér–Rao", "standard deviation"] {
            assert!(text.contains(fact), "{fact} is missing: {text}");
        }
    }
}

#[test]
fn errors_are_drawn_against_the_limit_where_there_is_one() {
    let legend = "limit: what physics allows";
    let assumed = format!("{legend} at 5 µm noise");
    let run = run(&with_arms(&[("only", "{ arrangement = \"even\", count = 5 }")]), 1);
    assert!(page(&study_report(&run.report())).contains(&assumed), "the paper's readings are clean");
    for (noise_sd, drawn) in [(um(5.0), true), (0.0, false)] {
        let mut rig = quick_rig(5);
        rig.setup
            .edit_sensors(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = noise_sd))
            .unwrap();
        let recording = rig.simulate(0).unwrap();
        let report = EvaluationReport {
            title: "Errors",
            evaluation: &Evaluation { extent: Extent::line(0.4).unwrap(), located: Vec::new() },
            recording: &recording.provenance,
            origin: EstimateOrigin::CrossValidated { rig: &rig, folds: 5, seed: 0 },
            portions: &[],
            tolerance_m: 2e-3,
        };
        assert_eq!(page(&evaluation_report(&report)).contains(legend), drawn);
    }
}
