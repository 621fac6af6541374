use super::*;
use crate::arrangement::Training;
use crate::evaluation::{Calibration, Evaluation};
use crate::fit::Fit;
use crate::influence::Influence;
use crate::setup::Setup;
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

/// Standard deviations that estimates have by themselves, in metres and newtons.
const SD_M: f64 = 1e-3;
const SD_N: f64 = 0.1;

/// Presses of some places, whose errors are a multiple of the standard deviation that the estimates have.
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
            // A half-width of 1.96 in standard deviations of 2, or an ellipse of χ² 6/4, contains 67 % or 53 %.
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
            covered += usize::from(position_ratio(&wider, line()).unwrap() <= 1.0);
        }
    }
    let percent = 100.0 * covered as f64 / (200.0 * 19.0);
    assert!((93.5..97.0).contains(&percent), "{percent} %");
}

#[test]
fn eighteen_places_bound_nothing() {
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
    let ratios: Vec<f64> = found.filter_map(|one| position_ratio(one, line())).collect();
    let beyond = ratios.iter().filter(|ratio| **ratio > check.position.factor).count();
    assert!(check.places < FEWEST_FOR_95 && beyond <= 1 && ratios.len() == 36, "{check:?}");
}

#[test]
fn untouched_estimates_and_known_forces_are_left_out() {
    let mut held_out = estimates(30, 1, 1.0, 1);
    for one in &mut held_out {
        one.estimate.contact.uncertainty.as_mut().unwrap().covariance[5] = 0.0;
    }
    held_out[7].estimate.status = Status::NoContact;
    held_out[8].estimate.status = Status::OutsideModel;
    let check = IntervalCheck::of_estimates(&held_out, line()).unwrap();
    assert_eq!((check.places, check.force), (29, None));
    // By noise alone 3 in 1,000 are outside the model: 1 of 30 may be, and 5 of 30 are too many.
    assert_eq!((check.presses, check.outside_model, check.outside_model_percent()), (30, 1, None));
    held_out[10..14].iter_mut().for_each(|one| one.estimate.status = Status::OutsideModel);
    let check = IntervalCheck::of_estimates(&held_out, line()).unwrap();
    assert_eq!(check.outside_model_percent(), Some(100.0 * 5.0 / 30.0));
}

#[test]
fn widened_intervals_end_where_the_surface_does() {
    assert_eq!(widened_interval((0.0, 0.3), 2.0, 1.0), (0.0, 0.3 + 0.15));
    assert_eq!(widened_interval((0.6, 0.95), 4.0, 1.0).1, 1.0);
    // One that went beyond an end is not made shorter.
    assert_eq!(widened_interval((-0.2, 0.2), 2.0, 1.0), (-0.2, 0.4));
    assert_eq!(widened_interval((0.3, 0.3), UNBOUNDED, 1.0), (0.3, 0.3));
}

#[test]
fn an_interval_contains_the_truth_once_lengthened_by_its_ratio() {
    for ((low, high), estimate, truth) in [
        ((0.4, 0.6), 0.5, 0.8),
        // Ends at its estimate, or does not contain it.
        ((0.4, 0.5), 0.5, 0.52),
        ((0.4, 0.5), 0.7, 0.9),
        ((0.4, 0.5), 0.45, 0.1),
    ] {
        let ratio = ratio_of((low, high), estimate, truth);
        assert!(ratio > 1.0 && ratio < 20.0, "{ratio}");
        let contains = |factor: f64| {
            let (low, high) = widened_interval((low, high), factor, 1.0);
            (low..=high).contains(&truth)
        };
        assert!(contains(1.001 * ratio) && !contains(0.999 * ratio), "{ratio}");
    }
    assert!((ratio_of((0.4, 0.6), 0.5, 0.55) - 0.5).abs() < 1e-12);
    assert_eq!((ratio_of((0.4, 0.4), 0.4, 0.5), ratio_of((0.4, 0.4), 0.4, 0.4)), (UNBOUNDED, 0.0));
}

#[test]
fn an_ellipse_without_an_area_is_judged_by_its_intervals() {
    let mut held_out = estimates(1, 1, 1.0, 1)[0];
    let uncertainty = held_out.estimate.contact.uncertainty.as_mut().unwrap();
    uncertainty.covariance[3] = 0.0;
    let ratio = position_ratio(&held_out, plane()).unwrap();
    assert!(ratio > 0.0 && ratio < 10.0, "{ratio}");
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
    let coverage = |locator| Evaluation::new(locator, &split.judged).unwrap().coverage_percent().unwrap();
    let unchecked = crate::fit::Fitted { interval_check: None, ..locator.clone() };
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
