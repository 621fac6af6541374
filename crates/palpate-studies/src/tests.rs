//! Arms with sensors, contacts, layouts and estimators of their own.

use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use palpate_design::sensors::DesignError;
use palpate_estimators::evaluation::{Portion, Quantiles};
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::SensorKind;
use palpate_numerics::watch::{Cancelled, Watch};

/// The paper's beam with noise and an influence locator; contacts of unknown force.
fn beam(arms: &str) -> Study {
    let text = format!(
        r#"
        name = "small"
        [surface]
        kind = "beam"
        length = "400 mm"
        width = "40 mm"
        thickness = "1.2 mm"
        youngs_modulus = "200 GPa"
        supports = "simple"
        [sensors]
        measure = "deflection"
        count = 8
        noise = "5 um"
        [training]
        count = 20
        repeats = 5
        force = "3 N"
        [estimator]
        kind = "influence"
        [design]
        sites = "10 mm"
        contacts = {{ from = "20 mm", to = "380 mm", every = "10 mm" }}
        [evaluation]
        from = "10 mm"
        to = "390 mm"
        step = "10 mm"
        readings = 20
        portions = [["60 mm", "300 mm"]]
        {arms}"#
    );
    Study::from_toml(&text).unwrap()
}

fn prepare(study: Study) -> PreparedStudy {
    PreparedStudy::new(study, Watch::NONE).unwrap()
}

fn run(study: &PreparedStudy, seeds: u64, threads: usize) -> Vec<ArmOutcome> {
    let options = RunOptions { seeds, threads };
    study.run(options, Vec::new(), &|_| {}, Watch::NONE).unwrap()
}

const THREE: &str = r#"
    [[arm]]
    name = "unknown"
    [[arm]]
    name = "known"
    contact = { force = "3 N" }
    [[arm]]
    name = "reactions"
    sensors = [{ measure = "deflection", count = 6, noise = "5 um" }, { measure = "reaction", positions = ["0 mm", "400 mm"], noise = "5 mN" }]
"#;

#[test]
fn locators_come_to_their_arms_limit() {
    let prepared = prepare(beam(THREE));
    let results = StudyResults::new(&run(&prepared, 2, 2), &prepared);
    let [unknown, known, reactions] = &results.arms[..] else { panic!("{results:?}") };
    for arm in [known, unknown, reactions] {
        let limit = arm.limit.as_ref().unwrap();
        let ratio = limit.error_over_limit.unwrap().median;
        assert!((0.9..1.25).contains(&ratio), "{}: {ratio}", arm.name);
        let covered = arm.coverage_percent.unwrap().median;
        assert!((85.0..=100.0).contains(&covered), "{}: {covered}", arm.name);
        assert_eq!((arm.epochs, arm.converged, &arm.training_span), (None, None, &None));
    }
    assert_eq!(known.set_up.as_ref().unwrap().force, Force::Known);
    assert_eq!(unknown.set_up.as_ref().unwrap().force, Force::Unknown);
    // A known force, or reactions, make the ends locatable.
    assert!(unknown.error_percent.median > 5.0 * known.error_percent.median);
    assert!(unknown.error_percent.median > 5.0 * reactions.error_percent.median);
    let places = &reactions.set_up.as_ref().unwrap().sensors;
    let at = |i: usize| (places[i].measure, places[i].position_mm);
    assert_eq!((places.len(), at(6), at(7)), (8, (SensorKind::Reaction, 0.0), (SensorKind::Reaction, 400.0)));
    let inner = known.portions[0].limit_error_percent.unwrap();
    assert!((known.portions[0].error_percent.median / inner - 1.0).abs() < 0.25, "{inner}");
}

#[test]
fn results_depend_on_seeds_and_not_on_threads() {
    let prepared = prepare(beam(THREE));
    let (one, three) = (run(&prepared, 3, 1), run(&prepared, 3, 3));
    assert_eq!(one, three);
    assert_ne!(one[0].fits[0].evaluation, one[0].fits[1].evaluation);
}

#[test]
fn a_figure_spreads_over_the_seeds_position_by_position() {
    let prepared = prepare(beam(THREE));
    let outcome = &run(&prepared, 3, 2)[1];
    let along = outcome.by_position(|located| located.error_m());
    let positions = &prepared.evaluation_settings().positions;
    assert!(along.iter().map(|(x_m, _)| *x_m).eq(positions.iter().map(|position| position.x_m)));
    let mean_at_first = |fit: &TrainedSeed| {
        let readings = prepared.evaluation_settings().readings;
        let first = &fit.evaluation.located[..readings];
        first.iter().map(|located| located.error_m()).sum::<f64>() / readings as f64
    };
    let at_first = outcome.fits.iter().map(mean_at_first).collect();
    assert_eq!(along[0].1, Quantiles::from_values(at_first).unwrap());
}

#[test]
fn layouts_are_found_once_for_arms_that_ask_alike() {
    let arms = r#"
        [[arm]]
        name = "even"
        [[arm]]
        name = "qr"
        layout = "qr-pivoting"
        [[arm]]
        name = "qr-of-four"
        layout = "qr-pivoting"
        sensors = { measure = "deflection", count = 4, noise = "5 um" }
        [[arm]]
        name = "qr-neighbours"
        layout = "qr-pivoting"
        estimator = { kind = "neighbours" }
    "#;
    let asked = AtomicUsize::new(0);
    let count = |_| asked.fetch_add(1, Ordering::Relaxed) < usize::MAX;
    let prepared = PreparedStudy::new(beam(arms), Watch::new(&count));
    let prepared = prepared.unwrap();
    assert!(asked.load(Ordering::Relaxed) > 0);
    let layout = |arm: usize| prepared.study.arms[arm].rig.setup.layout();
    assert_ne!(layout(0), layout(1));
    assert_eq!(layout(1), layout(3));
    assert_eq!([layout(1).len(), layout(2).len()], [8, 4]);
    let stopped = PreparedStudy::new(beam(arms), Watch::new(&|_| false)).unwrap_err();
    assert_eq!(stopped, StudyRunError::Cancelled(Cancelled));
}

#[test]
fn a_layout_that_cannot_be_had_is_refused_with_its_arm_and_place() {
    let mut study = beam("[[arm]]\nname = \"tight\"\nlayout = \"genetic\"");
    study.arms[0].rig.design.as_mut().unwrap().spacing_m = 0.06;
    let span = study.arms[0].layout.as_ref().unwrap().span.clone();
    let Err(StudyRunError::Design { arm, span: said, error }) = PreparedStudy::new(study, Watch::NONE) else {
        panic!()
    };
    assert_eq!((arm.as_str(), said), ("tight", span));
    assert!(matches!(*error, DesignError::Spacing { count: 8, .. }), "{error}");
}

#[test]
fn unfittable_arm_is_named_in_the_error() {
    let few = beam(
        "[[arm]]\nname = \"few\"\ntraining = { count = 1, force = \"3 N\" }\nestimator = { kind = \"gaussian-process\" }",
    );
    let prepared = prepare(few);
    let options = RunOptions { seeds: 2, threads: 2 };
    let failed = prepared.run(options, Vec::new(), &|_| {}, Watch::NONE).unwrap_err();
    assert!(matches!(&failed, StudyRunError::Fit { arm, .. } if arm == "few"), "{failed}");
}

#[test]
fn errors_inside_and_outside_the_training_span_are_separate() {
    let text = paper::STUDY_TOML.replace("max_epochs = 1_000_000", "max_epochs = 300");
    let (head, _) = text.split_once("[[arm]]").unwrap();
    let head = head.replace("portions =", "training_span = true\nportions =");
    let arm = "[[arm]]\nname = \"inner\"\ntraining = { count = 10, portion = [0.25, 0.75] }";
    let prepared = prepare(Study::from_toml(&(head + arm)).unwrap());
    assert!(prepared.is_in_lanes(0));
    let results = StudyResults::new(&run(&prepared, 1, 1), &prepared);
    let arm = &results.arms[0];
    let span = arm.training_span.as_ref().unwrap();
    let Portion { from_m, to_m } = span.training_span;
    assert!((from_m - 0.1).abs() < 1e-12 && (to_m - 0.3).abs() < 1e-12);
    let [within, beyond] =
        [span.error_percent_within_training, span.error_percent_beyond_training].map(|s| s.unwrap().median);
    // 201 of the 399 positions lie between them.
    assert!(((201.0 * within + 198.0 * beyond) / 399.0 - arm.error_percent.median).abs() < 1e-9);
    assert!(within < beyond);
    assert_eq!((&arm.set_up, &arm.limit, arm.coverage_percent), (&None, &None, None));
}
