use super::exchange::SearchResult;
use super::*;
use crate::fixtures::{plate, sensor_design};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{ChannelModel, Layout, SensorKind};
use palpate_mechanics::surface::{
    BeamSection, BeamSupport, BeamSupportKind, SupportedBeam, SupportedBeamSpec,
};
use palpate_numerics::watch::Cancelled;
use palpate_numerics::watch::Progress;
use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

fn problem<'a>(setup: &'a Setup, design: &SensorDesign) -> SensorProblem<'a> {
    SensorProblem::new(setup, design, Watch::NONE).unwrap()
}

fn refusal(setup: &Setup, design: &SensorDesign) -> DesignError {
    SensorProblem::new(setup, design, Watch::NONE).map(|_| ()).unwrap_err()
}

fn exchanged(problem: &SensorProblem) -> AssessedLayout {
    problem.greedy_exchange(0, Watch::NONE).unwrap()
}

fn searched(problem: &SensorProblem) -> SearchResult {
    problem.search(Watch::NONE).greedy_exchange(&problem.feasible, 0).unwrap()
}

fn offer(kind: SensorKind, noise_sd: f64, cost: f64) -> SensorOffer {
    SensorOffer {
        kind,
        channel: ChannelModel { noise_sd, ..ChannelModel::default() },
        cost,
        supply: Supply::Any,
    }
}

fn four_kinds() -> Vec<SensorOffer> {
    vec![
        offer(SensorKind::Deflection, 5e-6, 3.0),
        offer(SensorKind::Slope, 20e-6, 4.0),
        offer(SensorKind::Strain, 1e-6, 1.0),
        offer(SensorKind::Reaction, 5e-3, 10.0),
    ]
}

fn places(designed: &AssessedLayout) -> Vec<f64> {
    designed.layout.sensors().iter().map(|sensor| (sensor.position.x_m * 1e3).round()).collect()
}

#[test]
fn the_papers_beam_gains_at_least_18_percent() {
    let (setup, design) = sensor_design();
    let problem = problem(&setup, &design);
    let even = problem.even().unwrap().assessment.mean_limit_m.unwrap();
    assert!((even - 2.64e-3).abs() < 5e-6, "{even}");
    let designed = exchanged(&problem);
    let limit = designed.assessment.mean_limit_m.unwrap();
    assert!(limit <= 0.82 * even && limit <= 2.15e-3, "{limit}: {:?}", places(&designed));
}

#[test]
fn scores_agree_with_the_limit() {
    let (setup, mut design) = sensor_design();
    for force in [Force::Known, Force::Unknown] {
        design.force = force;
        let problem = problem(&setup, &design);
        let even = problem.even().unwrap();
        let limit_m = even.assessment.mean_limit_m.unwrap();
        assert!(even.assessment.score < limit_m && even.assessment.score > 0.9 * limit_m, "{even:?}");
        assert!(even.assessment.score_one_dead.unwrap() > even.assessment.score);
    }
    design.count = 1;
    let problem = problem(&setup, &design);
    let one = problem.even().unwrap().assessment;
    assert_eq!((one.mean_limit_m, one.worst_limit_m, one.score_one_dead), (None, None, None));
    assert!((one.score / (0.4 / 12f64.sqrt()) - 1.0).abs() < 1e-3, "{one:?}");
}

/// C(20, 4) at random: kinds, noise, contacts, criterion, force.
fn random_problem(setup: &Setup, design: &SensorDesign, rng: &mut impl Rng) -> SensorDesign {
    let kinds = [
        offer(SensorKind::Deflection, 10f64.powf(rng.random_range(-6.0..-5.0)), 1.0),
        offer(SensorKind::Strain, 10f64.powf(rng.random_range(-6.5..-5.5)), 1.0),
        offer(SensorKind::Slope, 10f64.powf(rng.random_range(-5.0..-4.0)), 1.0),
    ];
    let offers: Vec<SensorOffer> = if rng.random::<bool>() {
        vec![kinds[0].clone()]
    } else {
        vec![kinds[0].clone(), kinds[rng.random_range(1..3)].clone()]
    };
    let length_m = setup.surface().extent().length_m();
    let sites: Vec<Position> =
        (0..20 / offers.len()).map(|_| Position::along(rng.random_range(0.01..0.99) * length_m)).collect();
    let from = rng.random_range(0.02..0.3) * length_m;
    let to = from + rng.random_range(0.3..0.68) * length_m;
    let contacts = ContactPrior {
        from: Position::along(from),
        to: Position::along(to),
        every_m: (to - from) / 40.0,
        weights: Vec::new(),
    };
    let criterion =
        if rng.random::<bool>() { DesignCriterion::MeanLimit } else { DesignCriterion::DOptimality };
    SensorDesign {
        count: 4,
        offers,
        sites: Sites::At(sites),
        contacts,
        force: if rng.random() { Force::Known } else { Force::Unknown },
        criterion,
        ..design.clone()
    }
}

#[test]
fn greedy_and_exchange_find_the_optimum_of_small_problems() {
    const PROBLEMS: usize = 100;
    let (setup, design) = sensor_design();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut found = 0;
    for _ in 0..PROBLEMS {
        let design = random_problem(&setup, &design, &mut rng);
        let problem = problem(&setup, &design);
        assert_eq!((problem.candidates(), problem.feasible.len()), (20, 4));
        let all = exhaustive::search(&problem.search(Watch::NONE), 4).unwrap().unwrap();
        let ours = searched(&problem);
        assert!(ours.score >= all.score - 1e-9 * all.score.abs());
        found += usize::from(ours.score <= all.score + 1e-9 * all.score.abs());
    }
    println!("optimum found in {found} of {PROBLEMS}");
    assert!(found >= 95, "{found}");
}

#[test]
fn every_search_keeps_every_constraint() {
    let (setup, mut design) = sensor_design();
    design.offers = four_kinds();
    design.spacing_m = 0.02;
    design.keep_out = vec![KeepOut { from: Position::along(0.09), to: Position::along(0.13) }];
    design.must_have = vec![RequiredSensor { offer: 0, position: Position::along(0.333) }];
    design.budget = Some(24.0);
    for (symmetry, count) in [(Symmetry::Any, 6), (Symmetry::Wanted, 7), (Symmetry::Forbidden, 6)] {
        let design = SensorDesign { symmetry, count, ..design.clone() };
        let problem = problem(&setup, &design);
        let all = problem.all(3, Watch::NONE).unwrap();
        assert!(all.iter().filter(|designed| designed.method.is_search()).count() >= 3);
        for designed in &all {
            let own = matches!(designed.method, Method::Even | Method::Existing);
            let places = places(designed);
            assert_ne!(
                designed.assessment.keeps_constraints, own,
                "{symmetry:?} {:?} {places:?}",
                designed.method
            );
        }
        let score = |method| {
            let found = all.iter().find(|designed| designed.method == method);
            found.map(|designed| designed.assessment.score)
        };
        assert!(score(Method::Refined) <= score(Method::GreedyExchange));
        assert!(score(Method::GreedyExchange) <= score(Method::DOptimal));
    }
}

#[test]
fn unmet_constraint_is_named() {
    let (setup, base) = sensor_design();
    let spaced = SensorDesign { spacing_m: 0.06, ..base.clone() };
    let poor = SensorDesign { budget: Some(7.5), ..base.clone() };
    let few = SensorDesign { sites: Sites::Count(5), ..base.clone() };
    let at = |x_m| RequiredSensor { offer: 0, position: Position::along(x_m) };
    let kept_out = vec![KeepOut { from: Position::along(0.1), to: Position::along(0.315) }];
    let must =
        |list: &[f64]| SensorDesign { must_have: list.iter().map(|x| at(*x)).collect(), ..base.clone() };
    let odd = SensorDesign { symmetry: Symmetry::Wanted, sites: Sites::Count(20), count: 7, ..base.clone() };
    let lopsided = Sites::At((1..30).map(|i| Position::along(f64::from(i) * 0.006)).collect());
    let cases = [
        ("spacing", spaced.clone()),
        ("budget", poor),
        ("sites", few),
        ("must-have at a support", must(&[0.0])),
        ("must-have kept out", SensorDesign { keep_out: kept_out.clone(), ..must(&[0.2]) }),
        ("must-haves too close", SensorDesign { spacing_m: 0.01, ..must(&[0.2, 0.205]) }),
        ("the same twice", must(&[0.2, 0.2])),
        ("too many must-haves", SensorDesign { count: 2, ..must(&[0.1, 0.2, 0.3]) }),
        ("mirrored must-haves", SensorDesign { count: 3, symmetry: Symmetry::Wanted, ..must(&[0.1, 0.15]) }),
        (
            "a twin kept out",
            SensorDesign { symmetry: Symmetry::Wanted, keep_out: kept_out.clone(), ..must(&[0.08, 0.09]) },
        ),
        ("an odd count", odd),
        ("no twins", SensorDesign { symmetry: Symmetry::Wanted, sites: lopsided, ..base.clone() }),
        ("must-haves that mirror", SensorDesign { symmetry: Symmetry::Forbidden, ..must(&[0.1, 0.3]) }),
        ("no noise", SensorDesign { offers: vec![offer(SensorKind::Strain, 0.0, 1.0)], ..base.clone() }),
        ("no sensors", base.clone().count(0)),
        ("a negative spacing", SensorDesign { spacing_m: -1e-3, ..base.clone() }),
        ("a site off the surface", base.clone().sites(Sites::At(vec![Position::along(0.5)]))),
        ("contacts off the surface", base.clone().contacts(ContactPrior::along(0.1, 0.5, 0.01))),
        ("contacts nowhere apart", base.clone().contacts(ContactPrior::along(0.1, 0.3, 0.0))),
        (
            "weights of nothing",
            base.clone().contacts(ContactPrior { weights: vec![0.0; 3], ..base.contacts.clone() }),
        ),
        (
            "too large",
            SensorDesign {
                sites: Sites::Count(1_000_000),
                contacts: ContactPrior { every_m: 5e-5, ..base.contacts.clone() },
                ..base.clone()
            },
        ),
    ];
    let told = cases.map(|(what, design)| format!("{what}: {}", refusal(&setup, &design)));
    insta::assert_snapshot!(told.join("\n"));
    // The largest number in the message does fit.
    assert!(matches!(refusal(&setup, &spaced), DesignError::Spacing { most: 7, .. }));
    problem(&setup, &SensorDesign { count: 7, ..spaced });
    let unknown = setup.clone().unknown_force();
    assert_eq!(refusal(&unknown, &base), DesignError::Limit(LimitError::NoForce));
}

#[test]
fn budget_buys_the_most_useful_sensors() {
    let (setup, mut design) = sensor_design();
    design.offers = four_kinds();
    design.count = 4;
    let score = |budget: Option<f64>| {
        let design = SensorDesign { budget, ..design.clone() };
        let designed = exchanged(&problem(&setup, &design));
        assert!(budget.is_none_or(|budget| designed.assessment.cost <= budget));
        designed.assessment.score
    };
    let [poor, fair, rich] = [Some(4.0), Some(12.0), None].map(score);
    assert!(poor >= fair && fair >= rich && rich < 0.99 * poor, "{poor} {fair} {rich}");
}

fn bridge() -> Setup {
    let simple = |at_m| BeamSupport { at_m, kind: BeamSupportKind::Simple };
    let spec = SupportedBeamSpec {
        length_m: 24.0,
        youngs_modulus_pa: 30e9,
        sections: vec![BeamSection { to_m: 24.0, width_m: 0.3, thickness_m: 0.3 }],
        supports: [0.0, 8.0, 16.0, 24.0].map(simple).to_vec(),
    };
    let sensors = SensorKind::Strain.evenly(6).noise(1e-6);
    let setup = Setup::new(SupportedBeam::new(spec).unwrap()).sensors(sensors);
    setup.and_then(|setup| setup.known_force(1e3)).unwrap()
}

#[test]
fn contacts_over_supports_are_excluded_for_an_unknown_force() {
    let setup = bridge();
    let mut design = SensorDesign::for_setup(&setup).unwrap().unknown_force();
    design.sites = Sites::Every(1.0);
    let along = ContactPrior::along(1.0, 23.0, 1.0);
    let criteria = [
        DesignCriterion::MeanLimit,
        DesignCriterion::WorstLimit,
        DesignCriterion::WithinTolerance,
        DesignCriterion::DOptimality,
    ];
    for criterion in criteria {
        let design = SensorDesign { criterion, ..design.clone() };
        let all = problem(&setup, &design.clone().contacts(along.clone()));
        assert_eq!(all.contacts_over_supports().iter().map(|at| at.x_m).collect::<Vec<_>>(), [8.0, 16.0]);
        let mut only_told = problem(&setup, &design.clone().contacts(along.clone()));
        only_told.sensitivity.contacts = WeightedContacts {
            positions: (1..=23).filter(|at| at % 8 != 0).map(|at| Position::along(f64::from(at))).collect(),
            weights: vec![1.0 / 21.0; 21],
        };
        let table = Arc::new(Vec::new());
        only_told.objective = only_told.sensitivity.objective(table, criterion, design.tolerance_m);
        for layout in [setup.layout().clone(), exchanged(&all).layout] {
            let [with, told] = [&all, &only_told].map(|problem| problem.assess(&layout).unwrap());
            assert!((with.score / told.score - 1.0).abs() < 1e-9, "{criterion:?}: {with:?}, {told:?}");
            assert!(
                (with.within_tolerance_percent - told.within_tolerance_percent).abs() < 1e-9,
                "{criterion:?}: {with:?}, {told:?}"
            );
        }
    }
    let known = problem(&setup, &SensorDesign { force: Force::Known, ..design.clone() });
    assert!(known.contacts_over_supports().is_empty());
    let over = design.contacts(ContactPrior::along(8.0, 16.0, 8.0));
    let refused = refusal(&setup, &over);
    assert_eq!(refused, DesignError::OverSupports { contacts: 2 });
}

#[test]
fn mixed_kinds_go_beyond_deflections() {
    let (setup, mut design) = sensor_design();
    let deflections = exchanged(&problem(&setup, &design)).assessment.score;
    design.offers = four_kinds();
    let designed = exchanged(&problem(&setup, &design));
    assert!(designed.assessment.score < 0.5 * deflections, "{:?}", designed.assessment);
}

#[test]
fn readings_without_principal_components_have_no_layouts_by_them() {
    for force_n in [1e-308, 1e308] {
        let setup = sensor_design().0.known_force(force_n).unwrap();
        let design = SensorDesign { count: 3, ..SensorDesign::for_setup(&setup).unwrap() };
        let designed = problem(&setup, &design).all(0, Watch::NONE).unwrap();
        let by_components = |designed: &AssessedLayout| {
            matches!(designed.method, Method::PrincipalComponents | Method::QrPivoting)
        };
        assert!(!designed.is_empty() && !designed.iter().any(by_components), "{force_n} N");
    }
}

#[test]
fn many_sites_are_searched_as_few_are() {
    let (setup, mut design) = sensor_design();
    design.sites = Sites::Count(1599);
    let few = exchanged(&problem(&setup, &design)).assessment.score;
    design.sites = Sites::Count(6399);
    let many = exchanged(&problem(&setup, &design)).assessment.score;
    assert!((many / few - 1.0).abs() < 0.005, "{many} {few}");
}

#[test]
fn no_exchange_for_one_of_very_many_matters() {
    let (setup, mut design) = sensor_design();
    design.offers = four_kinds();
    design.contacts.every_m = 0.02;
    design.spacing_m = 0.002;
    for (symmetry, sites) in [(Symmetry::Any, 1000), (Symmetry::Wanted, 1500), (Symmetry::Forbidden, 1000)] {
        let design = SensorDesign { sites: Sites::Count(sites), symmetry, count: 4, ..design.clone() };
        let problem = problem(&setup, &design);
        let pool = &problem.pool;
        assert!(pool.units.len() > 2000, "{}", pool.units.len());
        let found = searched(&problem);
        assert_eq!(pool.size(&found.selection), 4);
        for slot in 0..found.selection.len() {
            let mut others = found.selection.clone();
            let leaving = others.remove(slot);
            assert!(pool.may_join(&others, leaving), "{symmetry:?}");
            for unit in pool.joinable(&others, &pool.all(), None) {
                let selection = others.iter().copied().chain([unit]).collect();
                let other = problem.search(Watch::NONE).scored(selection);
                let whole = pool.size(&other.selection) == 4;
                assert!(
                    !whole || other.score > found.score * (1.0 - 1.1e-6),
                    "{symmetry:?}: {unit} for {leaving}"
                );
            }
        }
    }
}

#[test]
fn more_sensors_never_lower_the_information() {
    let (setup, design) = sensor_design();
    let points = problem(&setup, &design).counts(2..=6, 0, Watch::NONE).unwrap();
    assert!(points.windows(2).all(|pair| pair[1].designed.score < pair[0].designed.score));
    assert_eq!(points.iter().map(|point| point.count).collect::<Vec<_>>(), [2, 3, 4, 5, 6]);
    assert!(enough(&points).is_some_and(|count| count > 2));
    let beyond = problem(&setup, &design).counts(2..=80, 0, Watch::new(&|_| panic!("nothing is searched")));
    assert_eq!(beyond.unwrap_err(), DesignError::TooFewSites { count: 80, sites: 79 });
}

#[test]
fn plates_are_designed_too() {
    let setup = plate(24).setup;
    let mut design = SensorDesign::for_setup(&setup).unwrap();
    design.sites = Sites::Every(0.03);
    let corner = |at_m| Position { x_m: at_m, y_m: at_m };
    design.contacts =
        ContactPrior { from: corner(0.03), to: corner(0.27), every_m: 0.03, weights: Vec::new() };
    for force in [Force::Known, Force::Unknown] {
        design.force = force;
        let problem = problem(&setup, &design);
        // 11 × 11 sites; those on the simply supported edges never move.
        assert_eq!((problem.candidates(), problem.contacts().len()), (81, 81));
        let even = problem.even().unwrap();
        assert_eq!(&even.layout, setup.layout());
        let designed = exchanged(&problem);
        assert!(designed.assessment.score < even.assessment.score);
    }
}

#[test]
fn layout_reaches_its_score() {
    let (setup, mut design) = sensor_design();
    // Nearer to the ends force and position trade off, and the error is less than the limit of unbiased estimators.
    design.contacts = ContactPrior::along(0.03, 0.37, 0.02);
    let problem = problem(&setup, &design);
    let estimator = palpate_estimators::estimator::Estimator::Influence(Default::default());
    let verify =
        |layout: &Layout| problem.verify(layout, &estimator, 2, 1, Watch::NONE).unwrap().mean_error_m;
    let (even, designed) = (problem.even().unwrap(), exchanged(&problem));
    let (before, after) = (verify(&even.layout), verify(&designed.layout));
    assert!(after < 0.9 * before, "{before} {after}");
    for (told, designed) in [(before, even), (after, designed)] {
        let expected = designed.assessment.mean_error_m.unwrap();
        assert!((0.8..1.3).contains(&(told / expected)), "{told} {expected}");
    }
}

#[test]
fn a_search_can_be_stopped() {
    let (setup, design) = sensor_design();
    let stopped = SensorProblem::new(&setup, &design, Watch::new(&|_| false)).map(|_| ());
    assert_eq!(stopped, Err(DesignError::Cancelled(Cancelled)));
    let breeds = |progress| matches!(progress, Progress::Stage { name, .. } if name == genetic::STAGE);
    let stopped = problem(&setup, &design).all(0, Watch::new(&|progress| !breeds(progress)));
    assert_eq!(stopped, Err(DesignError::Cancelled(Cancelled)));
}

#[test]
fn a_method_that_is_asked_for_gives_its_own_layout() {
    let (setup, mut design) = sensor_design();
    design.sites = Sites::Every(0.02);
    let problem = problem(&setup, &design);
    let all = problem.all(0, Watch::NONE).unwrap();
    let searches = [Method::Even, Method::GreedyExchange, Method::Genetic, Method::Refined];
    for method in
        searches.into_iter().chain([Method::DOptimal, Method::PrincipalComponents, Method::QrPivoting])
    {
        let asked = problem.by_method(method, 0, Watch::NONE).unwrap();
        let among = all.iter().find(|designed| designed.method == method).unwrap();
        if method == Method::Refined {
            // With few sites, the refined layout of all starts from the exhaustive search.
            assert!(asked.assessment.score < 1.01 * among.assessment.score, "{asked:?}");
        } else {
            assert_eq!((asked.method, &asked.layout), (method, &among.layout));
        }
    }
    design.criterion = DesignCriterion::DOptimality;
    let informed = SensorProblem::new(&setup, &design, Watch::NONE).unwrap();
    let asked = informed.by_method(Method::DOptimal, 0, Watch::NONE).unwrap();
    assert_eq!(asked.layout, all.iter().find(|d| d.method == Method::DOptimal).unwrap().layout);
    design.offers = vec![offer(SensorKind::Reaction, 5e-3, 1.0)];
    design.count = 2;
    let reactions = SensorProblem::new(&setup, &design, Watch::NONE).unwrap();
    let refused = reactions.by_method(Method::Even, 0, Watch::NONE).map(|_| ()).unwrap_err();
    assert_eq!(refused, DesignError::NoLayout { method: "even" });
}
