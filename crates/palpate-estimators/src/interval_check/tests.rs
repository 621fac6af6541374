use super::*;
use crate::arrangement::Training;
use crate::evaluation::{Calibration, Evaluation};
use crate::fit::Fit;
use crate::influence::Influence;
use crate::setup::Setup;
use palpate_core::{ContactEstimate, Uncertainty};
use palpate_mechanics::sensing::SensorKind::Deflection;
use palpate_mechanics::surface::Beam;
use palpate_mechanics::units::{gpa, mm, newtons, um};
use palpate_numerics::normal_interval_95;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

fn line() -> Extent {
    Extent::line(1.0).unwrap()
}

fn plane() -> Extent {
    Extent::plane(1.0, 1.0).unwrap()
}

const SD_M: f64 = 1e-3;
const SD_N: f64 = 0.1;

/// Presses with errors of a multiple of the standard deviation.
fn estimates(places: usize, presses: usize, multiple: f64, seed: u64) -> Vec<HeldOutEstimate> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut error = || -> f64 {
        let normal: f64 = StandardNormal.sample(&mut rng);
        multiple * normal
    };
    (0..places * presses)
        .map(|i| {
            let place = i % places;
            let truth = Position { x_m: 0.1 + 0.8 * place as f64 / places as f64, y_m: 0.5 };
            let position = Position { x_m: truth.x_m + SD_M * error(), y_m: truth.y_m + SD_M * error() };
            let uncertainty = Uncertainty {
                covariance: [SD_M * SD_M, 0.0, 0.0, SD_M * SD_M, 0.0, SD_N * SD_N],
                x_95_m: normal_interval_95(position.x_m, SD_M),
                y_95_m: normal_interval_95(position.y_m, SD_M),
                force_95_n: None,
            };
            let force_n = Some(2.0 + SD_N * error());
            let contact = ContactEstimate { position, force_n, uncertainty: Some(uncertainty) };
            let estimate = Estimate::of_contact(contact, Status::Located);
            HeldOutEstimate { truth, force_n: Some(2.0), estimate, fold: place % 5 }
        })
        .collect()
}

#[test]
fn intervals_that_are_too_narrow_are_widened_by_what_they_lack() {
    for extent in [line(), plane()] {
        let check = IntervalCheck::of_estimates(&estimates(200, 5, 2.0, 1), extent).unwrap();
        assert_eq!(check.places, 200);
        for coverage in [check.position, check.force.unwrap()] {
            // A half-width of 1.96 in standard deviations of 2, or an ellipse of χ² 6/4, contains 67 % or 53
            // %.
            let expected = if extent == plane() && coverage == check.position { 52.7 } else { 67.3 };
            assert!((coverage.before_percent - expected).abs() < 5.0, "{coverage:?}");
            assert!((coverage.factor - 2.0).abs() < 0.25, "{coverage:?}");
            assert!((93.0..98.0).contains(&coverage.after_percent), "{coverage:?}");
        }
    }
}

#[test]
fn right_intervals_stay_nearly_as_they_are() {
    let factors: Vec<f64> = (0..50)
        .map(|seed| {
            IntervalCheck::of_estimates(&estimates(40, 3, 1.0, seed), line()).unwrap().position.factor
        })
        .collect();
    let mean = factors.iter().sum::<f64>() / 50.0;
    assert!(factors.iter().all(|factor| *factor >= 1.0) && mean < 1.1, "{mean}");
}

#[test]
fn widened_intervals_hold_presses_of_further_places() {
    let mut covered = 0;
    for seed in 0..200 {
        let widening = IntervalCheck::of_estimates(&estimates(19, 4, 1.5, seed), line()).unwrap().widening();
        for held_out in estimates(19, 1, 1.5, 1000 + seed) {
            let wider = HeldOutEstimate { estimate: widening.widened(held_out.estimate, line()), ..held_out };
            covered += usize::from(Region::of_position(&wider, line()).unwrap().ratio(0.0) <= 1.0);
        }
    }
    let percent = 100.0 * covered as f64 / (200.0 * 19.0);
    assert!((93.5..97.0).contains(&percent), "{percent} %");
}

#[test]
fn eighteen_places_give_no_bound() {
    assert_eq!(IntervalCheck::of_estimates(&estimates(18, 10, 2.0, 1), line()), None);
}

#[test]
fn places_that_are_not_found_complete_the_number_for_a_check() {
    let mut held_out = estimates(20, 2, 2.0, 1);
    let hidden = held_out[3].truth;
    for one in held_out.iter_mut().filter(|one| one.truth == hidden || one.truth.x_m > 0.85) {
        one.estimate.status = Status::NoContact;
    }
    let check = IntervalCheck::of_estimates(&held_out, line()).unwrap();
    let found = held_out.iter().filter(|one| one.estimate.status != Status::NoContact);
    let ratios: Vec<f64> = found.map(|one| Region::of_position(one, line()).unwrap().ratio(0.0)).collect();
    let beyond = ratios.iter().filter(|ratio| **ratio > check.position.factor).count();
    assert!(check.places < FEWEST_FOR_95 && beyond <= 1 && ratios.len() == 36, "{check:?}");
}

#[test]
fn untouched_estimates_and_known_forces_are_excluded() {
    let mut held_out = estimates(30, 1, 1.0, 1);
    for one in &mut held_out {
        one.estimate.contact.uncertainty.as_mut().unwrap().covariance[5] = 0.0;
    }
    held_out[7].estimate.status = Status::NoContact;
    held_out[8].estimate.status = Status::OutsideModel;
    let check = IntervalCheck::of_estimates(&held_out, line()).unwrap();
    assert_eq!((check.places, check.force), (29, None));
    // Noise alone puts 3 in 1,000 outside the model: 1 of 30 is possible, 5 of 30 are too many.
    assert_eq!((check.presses, check.outside_model, check.outside_model_percent()), (30, 1, None));
    held_out[10..14].iter_mut().for_each(|one| one.estimate.status = Status::OutsideModel);
    let check = IntervalCheck::of_estimates(&held_out, line()).unwrap();
    assert_eq!(check.outside_model_percent(), Some(100.0 * 5.0 / 30.0));
}

#[test]
fn a_rig_whose_noise_is_half_the_truth_gives_wider_intervals() {
    let setup = |noise_um: f64| {
        let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).unwrap();
        Setup::new(beam)
            .sensors(Deflection.evenly(8).noise(um(noise_um)))
            .unwrap()
            .known_force(newtons(3.0))
            .unwrap()
    };
    let split = Calibration::from_training(&setup(10.0), &Training::even(38).repeated(2))
        .unwrap()
        .simulate(3)
        .unwrap();
    let locator = Influence::default().fit(&setup(5.0), &split.training).unwrap();
    let check = locator.interval_check.unwrap();
    let coverage = |locator| Evaluation::new(locator, &split.held_out).unwrap().coverage_percent().unwrap();
    let unchecked = crate::fit::MethodLocator { interval_check: None, ..locator.clone() };
    assert!(check.position.factor > 1.2, "{check:?}");
    assert!(coverage(&unchecked) < 90.0, "{}", coverage(&unchecked));
    assert!(coverage(&locator) > 94.0, "{}", coverage(&locator));
}

#[test]
fn a_fit_of_few_places_has_no_check() {
    let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).unwrap();
    let setup = Setup::new(beam)
        .sensors(Deflection.evenly(8).noise(um(5.0)))
        .unwrap()
        .known_force(newtons(3.0))
        .unwrap();
    let fit = |places| {
        let presses = setup.simulate(&Training::even(places), 0).unwrap();
        Influence::default().fit(&setup, &presses).unwrap().interval_check
    };
    assert_eq!(fit(18), None);
    assert_eq!(fit(19).unwrap().places, 19);
}

/// Presses beside their positions, with intervals that do not include this error.
fn beside_their_places(places: usize, widest_m: f64, placement_sd_m: f64, seed: u64) -> Vec<HeldOutEstimate> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut held_out = estimates(places, 2, 1.0, seed);
    for (i, one) in held_out.iter_mut().enumerate() {
        let sd_m = widest_m * 0.5_f64.powi((i % 5) as i32);
        let error_m = || sd_m.hypot(placement_sd_m);
        let position =
            Position { x_m: one.truth.x_m + error_m() * normal(), y_m: one.truth.y_m + error_m() * normal() };
        let contact = &mut one.estimate.contact;
        contact.position = position;
        let uncertainty = contact.uncertainty.as_mut().unwrap();
        let variance = sd_m * sd_m;
        (uncertainty.covariance[0], uncertainty.covariance[3]) = (variance, variance);
        uncertainty.x_95_m = normal_interval_95(position.x_m, sd_m);
        uncertainty.y_95_m = normal_interval_95(position.y_m, sd_m);
    }
    held_out
}

#[test]
fn unmodelled_errors_add_a_standard_deviation() {
    for extent in [line(), plane()] {
        let found = |seed| {
            let held_out = beside_their_places(40, 4e-3, 2e-3, seed);
            IntervalCheck::of_estimates(&held_out, extent).unwrap().position
        };
        let added: Vec<f64> = (0..20).map(|seed| found(seed).added_sd).collect();
        let median = palpate_numerics::median(added.clone()).unwrap();
        assert!((1e-3..4e-3).contains(&median), "{added:?}");
        assert!((0..20).all(|seed| found(seed).factor < 2.0));
    }
}

/// Wide held-out intervals do not represent narrow intervals in use.
#[test]
fn intervals_that_are_narrower_in_use_than_at_held_out_places_contain_the_position() {
    let mut covered = 0;
    for seed in 0..100 {
        let check = IntervalCheck::of_estimates(&beside_their_places(40, 8e-3, 2e-3, seed), plane());
        let widening = check.unwrap().widening();
        for held_out in beside_their_places(40, 1e-3, 2e-3, 1000 + seed) {
            let wider =
                HeldOutEstimate { estimate: widening.widened(held_out.estimate, plane()), ..held_out };
            covered += usize::from(Region::of_position(&wider, plane()).unwrap().ratio(0.0) <= 1.0);
        }
    }
    let percent = 100.0 * covered as f64 / (100.0 * 80.0);
    assert!(percent > 90.0, "{percent} %");
}

#[test]
fn modelled_errors_add_no_standard_deviation() {
    let added = (0..40).filter(|seed| {
        let held_out = beside_their_places(40, 4e-3, 0.0, *seed);
        IntervalCheck::of_estimates(&held_out, plane()).unwrap().position.added_sd > 0.0
    });
    // An unneeded parameter raises the log-likelihood by more than 1 in 8 % of cases (half of χ²₁ beyond 2).
    assert!(added.count() <= 8);
}
