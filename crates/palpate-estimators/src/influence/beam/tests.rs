mod batch;
mod gauges;
mod offsets;
mod reference;

use super::*;
use crate::fit::Locate;
use crate::fixtures::{faulty_paper, paper};
use crate::influence::{InfluenceSource, LoadChannel};
use crate::recording::Recording;
use crate::setup::Setup;
use crate::simulate::{clean_reading, displaced};
use ndarray::Array2;
use palpate_core::{ContactEstimate, Status};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::{ChannelErrors, ChannelModel, measure};
use palpate_mechanics::surface::Surface;
use palpate_numerics::Cholesky;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

const SOURCES: [InfluenceSource; 2] = [InfluenceSource::Recording, InfluenceSource::Corrected];

fn fit(config: Influence, setup: &Setup, recording: &Recording) -> BeamLocator {
    config.fit_beam(FitTask::new(setup, recording)).unwrap()
}

fn clean(setup: &Setup, contacts: &[(f64, f64)]) -> Vec<f64> {
    let surface: &dyn Surface = setup.surface().model().unwrap();
    let mut sum = vec![0.0; setup.layout().len()];
    for (x_m, force_n) in contacts {
        let contact = Contact { position: Position::along(*x_m), force_n: *force_n };
        let reading = clean_reading(surface, setup.layout(), contact);
        sum.iter_mut().zip(reading).for_each(|(sum, value)| *sum += value);
    }
    sum
}

fn noisy(setup: &Setup, contacts: &[(f64, f64)], rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    measure(setup.layout(), &clean(setup, contacts), &ChannelErrors::none(setup.layout()), rng)
}

/// Cramér–Rao standard deviation of the position for 3 N at `x_m`, by finite differences.
fn limit_m(setup: &Setup, x_m: f64, force_known: bool) -> f64 {
    let (h, force_n) = (1e-7, 3.0);
    let (right, left) = (clean(setup, &[(x_m + h, force_n)]), clean(setup, &[(x_m - h, force_n)]));
    let here = clean(setup, &[(x_m, force_n)]);
    let (mut aa, mut af, mut ff) = (0.0, 0.0, 0.0);
    for (s, sensor) in setup.layout().sensors().iter().enumerate() {
        let (noise, dead) = (sensor.channel.noise_sd, sensor.channel.disabled);
        let (g, f) = ((right[s] - left[s]) / (2.0 * h * noise), here[s] / (force_n * noise));
        if !dead {
            (aa, af, ff) = (aa + g * g, af + g * f, ff + f * f);
        }
    }
    if force_known { aa.sqrt().recip() } else { (ff / (aa * ff - af * af)).sqrt() }
}

#[test]
fn clean_presses_locate_to_a_thousandth_of_a_percent() {
    for source in SOURCES {
        let rig = paper(0.0, 1);
        let recording = rig.simulate(1);
        let locator = fit(Influence { source, ..Influence::default() }, &rig.setup, &recording);
        let errors: Vec<f64> = (1..400)
            .map(|mm| {
                let x_m = f64::from(mm) / 1e3;
                let estimate = locator.locate(&clean(&rig.setup, &[(x_m, 3.0)]));
                (estimate.contact.position.x_m - x_m).abs()
            })
            .collect();
        let percent = errors.iter().sum::<f64>() / 399.0 / 0.4 * 100.0;
        eprintln!("{source:?}, clean: average error {percent:.2e} %");
        assert!(percent <= 0.001, "{source:?}: {percent} %");
        assert!(errors.iter().all(|error| *error < 2e-3), "{source:?}: effective length");
    }
}

/// Faults of the sensors, unknown to the locator except the disabled channel.
#[derive(Clone, Copy, Debug, Default)]
struct Faults {
    channel: Option<ChannelModel>,
    dead: Option<usize>,
}

/// Mean error relative to the limit, and coverage of the intervals, over 5–395 mm.
fn ratio_and_coverage(source: InfluenceSource, force_known: bool, faults: Faults) -> (f64, f64) {
    let (mut error_m, mut limit, mut covered, mut count) = (0.0, 0.0, 0, 0);
    for seed in 0..40 {
        let mut rig = paper(5e-6, 10);
        let known = rig.setup.clone();
        if let Some(channel) = faults.channel {
            rig = faulty_paper(channel, 10);
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
        let placed = displaced(rig.setup.layout(), rig.setup.surface().extent(), &mut rng);
        rig.setup = rig.setup.with_layout(placed).unwrap();
        let errors = ChannelErrors::draw(rig.setup.layout(), &mut rng);
        let mut recording = rig.simulate(seed);
        for row in &mut recording.rows {
            let truth = clean(&rig.setup, &[(row.position.x_m, 3.0)]);
            row.reading = measure(rig.setup.layout(), &truth, &errors, &mut rng);
        }
        let setup = known.with_force(force_known.then_some(3.0)).unwrap();
        let mut locator = fit(Influence { source, ..Influence::default() }, &setup, &recording);
        if let Some(channel) = faults.dead {
            assert!(locator.leave_out(channel));
            rig.setup.set_disabled(channel, true);
        }
        for mm in (5..=395).step_by(3) {
            let x_m = f64::from(mm) / 1e3;
            let limit_m = limit_m(&rig.setup, x_m, force_known);
            if limit_m > 2e-3 {
                continue;
            }
            for _ in 0..2 {
                let truth = clean(&rig.setup, &[(x_m, 3.0)]);
                let estimate = locator.locate(&measure(rig.setup.layout(), &truth, &errors, &mut rng));
                let (low, high) = estimate.contact.uncertainty.unwrap().x_95_m;
                error_m += (estimate.contact.position.x_m - x_m).abs();
                limit += limit_m * (2.0 / std::f64::consts::PI).sqrt();
                covered += usize::from((low..=high).contains(&x_m));
                count += 1;
            }
        }
    }
    let (ratio, coverage) = (error_m / limit, covered as f64 / f64::from(count));
    let force = if force_known { "known" } else { "unknown" };
    eprintln!("{source:?}, force {force}, {faults:?}: {ratio:.3} × limit, {:.1} % covered", 100.0 * coverage);
    (ratio, coverage)
}

#[test]
fn noisy_presses_locate_at_the_limit_and_intervals_hold_what_they_say() {
    for source in SOURCES {
        for (force_known, bound) in [(true, 1.06), (false, 1.15)] {
            for dead in [None, Some(3)] {
                let (ratio, coverage) =
                    ratio_and_coverage(source, force_known, Faults { dead, ..Faults::default() });
                assert!(ratio < bound, "{source:?}, known {force_known}, dead {dead:?}: {ratio}");
                assert!((0.93..0.97).contains(&coverage), "{source:?}, known {force_known}: {coverage}");
            }
        }
    }
}

#[test]
fn unknown_gains_offsets_and_places_cost_little() {
    let channel = ChannelModel {
        noise_sd: 5e-6,
        gain_error: 0.05,
        offset_error: 20e-6,
        position_error_m: 0.5e-3,
        ..ChannelModel::default()
    };
    let faults = Faults { channel: Some(channel), dead: None };
    for source in SOURCES {
        for force_known in [true, false] {
            let (ratio, coverage) = ratio_and_coverage(source, force_known, faults);
            assert!(ratio < 1.2, "{source:?}, known {force_known}: {ratio}");
            assert!((0.93..0.97).contains(&coverage), "{source:?}, known {force_known}: {coverage}");
        }
    }
}

#[test]
fn near_the_ends_left_and_right_are_ambiguous() {
    let rig = paper(5e-6, 10);
    let locator = fit(Influence::default(), &rig.setup, &rig.simulate(3));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let (mut flips, mut ambiguous) = (0, 0);
    for _ in 0..400 {
        let estimate = locator.locate(&noisy(&rig.setup, &[(1e-3, 3.0)], &mut rng));
        let flipped = estimate.contact.position.x_m > 0.2;
        flips += usize::from(flipped);
        ambiguous += usize::from(estimate.status == Status::Ambiguous);
        if flipped {
            assert_eq!(estimate.status, Status::Ambiguous, "a flip must not be confident");
            let modes = estimate.modes.as_slice();
            assert!(modes.iter().any(|mode| mode.contact.position.x_m < 0.01), "{modes:?}");
        }
    }
    eprintln!("at 1 mm: {flips} of 400 on the other side, {ambiguous} ambiguous");
    assert!((10..60).contains(&flips), "{flips} of 400");
    assert!(ambiguous > 200, "{ambiguous} of 400");
}

#[test]
fn no_contact_and_two_contacts_are_no_single_contact() {
    let rig = paper(5e-6, 10);
    let recording = rig.simulate(3);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    for force_n in [Some(3.0), None] {
        let setup = rig.setup.clone().with_force(force_n).unwrap();
        let locator = fit(Influence::default(), &setup, &recording);
        for _ in 0..100 {
            let nothing = locator.locate(&noisy(&setup, &[], &mut rng));
            assert_eq!(nothing.status, Status::NoContact, "{force_n:?}: {nothing:?}");
            let two = locator.locate(&noisy(&setup, &[(0.1, 3.0), (0.25, 2.0)], &mut rng));
            assert_eq!(two.status, Status::OutsideModel, "{force_n:?}: {two:?}");
        }
    }
}

#[test]
fn two_contacts_are_told_apart() {
    let rig = paper(5e-6, 10);
    let config = Influence { contacts: 3, ..Influence::default() };
    let setup = rig.setup.clone().unknown_force();
    let locator = fit(config, &setup, &rig.simulate(3));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    let (mut right, mut near, mut count) = (0, 0, 0u32);
    for left_mm in (50..=250).step_by(25) {
        for right_mm in ((left_mm + 100)..=350).step_by(25) {
            let truth = [(f64::from(left_mm) / 1e3, 3.0), (f64::from(right_mm) / 1e3, 2.0)];
            let estimate = locator.locate(&noisy(&setup, &truth, &mut rng));
            count += 1;
            if let [further] = estimate.further.as_slice() {
                right += 1;
                near += usize::from(both_near(&setup, truth, [estimate.contact, *further]));
            }
            let alone = locator.locate(&noisy(&setup, &truth[..1], &mut rng));
            assert!(alone.further.as_slice().is_empty(), "{truth:?}: {alone:?}");
        }
    }
    eprintln!("two contacts: number right in {right} of {count}, both within 3 × their limits in {near}");
    assert!(right as f64 >= 0.95 * f64::from(count), "{right} of {count}");
    assert!(near as f64 >= 0.95 * f64::from(count), "{near} of {count}");
}

/// True where both positions are within 3 limits for two places and two unknown forces.
fn both_near(setup: &Setup, truth: [(f64, f64); 2], found: [ContactEstimate; 2]) -> bool {
    let noise = setup.layout().sensors()[0].channel.noise_sd;
    let columns: Vec<Vec<f64>> = (0..4)
        .map(|unknown| {
            let at = |side: f64| {
                let mut contacts = truth;
                let contact = &mut contacts[unknown / 2];
                if unknown % 2 == 0 {
                    contact.0 += side * 1e-6;
                } else {
                    contact.1 += side * 1e-6;
                }
                clean(setup, &contacts)
            };
            at(1.0).iter().zip(at(-1.0)).map(|(right, left)| (right - left) / (2e-6 * noise)).collect()
        })
        .collect();
    let product = |i: usize, j: usize| columns[i].iter().zip(&columns[j]).map(|(a, b)| a * b).sum();
    let covariance =
        Cholesky::factor(Array2::from_shape_fn((4, 4), |(i, j)| product(i, j))).unwrap().inverse();
    let mut found = found.map(|contact| contact.position.x_m);
    found.sort_by(f64::total_cmp);
    (0..2).all(|i| (found[i] - truth[i].0).abs() <= 3.0 * covariance[[2 * i, 2 * i]].sqrt())
}

#[test]
fn a_locator_file_gives_the_same_locator_and_bad_numbers_are_refused() {
    let rig = paper(5e-6, 2);
    let locator = fit(Influence::default(), &rig.setup, &rig.simulate(1));
    let json = serde_json::to_string(&locator).unwrap();
    assert_eq!(serde_json::from_str::<BeamLocator>(&json).unwrap(), locator);
    for (good, bad) in [("\"contacts\":1", "\"contacts\":9"), ("\"sensors\":8", "\"sensors\":7")] {
        assert!(json.contains(good));
        assert!(serde_json::from_str::<BeamLocator>(&json.replace(good, bad)).is_err(), "{bad}");
    }
}

#[test]
fn presses_that_say_too_little_are_refused() {
    let rig = paper(5e-6, 1);
    let mut recording = rig.simulate(1);
    let refuse = |config: Influence, setup: &Setup, recording: &Recording| {
        config.fit_beam(FitTask::new(setup, recording)).unwrap_err()
    };
    let source = InfluenceSource::Recording;
    recording.rows.truncate(2);
    let error = refuse(Influence { source, ..Influence::default() }, &rig.setup, &recording);
    assert_eq!(error, InfluenceFitError::TooFewPositions { needed: 3, found: 2 });
    recording.rows[1].force_n = None;
    let error = refuse(Influence::default(), &rig.setup, &recording);
    assert_eq!(error, InfluenceFitError::NoForce { row: 2 });
}

#[test]
fn influences_at_the_nodes_leave_out_dead_channels() {
    let mut bench = paper(5e-6, 3);
    bench.setup.edit_sensors(|sensors| sensors[2].channel.disabled = true).unwrap();
    let locator = fit(Influence::default(), &bench.setup, &bench.simulate(1));
    let learnt = locator.influences_at_nodes();
    assert_eq!(learnt.channels, [0, 1, 3, 4, 5, 6, 7]);
    let of_channels: Vec<_> = locator.influences().into_iter().flatten().collect();
    for (i, position) in learnt.positions.iter().enumerate() {
        for (k, LoadChannel { influence, offset, noise_sd }) in of_channels.iter().enumerate() {
            let (value, same) = (learnt.values[7 * i + k], influence.at(*position));
            assert!((value - same).abs() < 1e-15, "{i}, {k}: {value} and {same}");
            assert_eq!((learnt.offsets[k], learnt.noise_sd[k]), (*offset, *noise_sd));
        }
    }
    assert!(learnt.sd.iter().all(|sd| *sd >= 0.0) && learnt.sd.iter().any(|sd| *sd > 0.0));
}
