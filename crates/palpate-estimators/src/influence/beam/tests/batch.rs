//! Batches equal single readings, and all instruction sets equal portable arrays.

use super::{fit, noisy};
use crate::fit::Locate;
use crate::fixtures::paper;
use crate::influence::Influence;
use crate::influence::Scratch;
use crate::influence::beam::locator::{LocateRows, Rows};
use crate::influence::config::ForceBelief;
use crate::setup::Setup;
use crate::status::NO_CONTACT;
use palpate_core::{Estimate, Status};
use palpate_numerics::simd::InstructionSet;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Readings without contact, with one contact along the beam and at the ends, with weak contacts, and with
/// two.
fn readings(setup: &Setup) -> Vec<Vec<f64>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut readings = Vec::new();
    for i in 0..600 {
        let x_m = 0.4 * f64::from(i * 7 % 600) / 599.0;
        readings.push(noisy(setup, &[(x_m, 3.0)], &mut rng));
        match i % 6 {
            0 => readings.push(noisy(setup, &[], &mut rng)),
            1 => readings.push(noisy(setup, &[(1e-3, 3.0)], &mut rng)),
            2 => readings.push(noisy(setup, &[(0.399, 3.0)], &mut rng)),
            3 => readings.push(noisy(setup, &[(x_m, 3.0), (0.4 - x_m, 2.0)], &mut rng)),
            4 => readings.push(noisy(setup, &[(x_m, 0.02)], &mut rng)),
            _ => readings.push(noisy(setup, &[(x_m, 7.0)], &mut rng)),
        }
    }
    readings
}

/// The paper's bench with several priors of the force and numbers of contacts.
fn benches() -> Vec<(Setup, Influence)> {
    let setup = paper(5e-6, 10).setup;
    let unknown = setup.clone().unknown_force();
    let config = Influence::default();
    vec![
        (setup.clone(), config),
        (unknown.clone(), config),
        (setup, Influence { force_sd_n: Some(0.5), ..config }),
        (unknown, Influence { contacts: 2, ..config }),
    ]
}

#[test]
fn a_batch_answers_as_readings_one_by_one_do() {
    let recording = paper(5e-6, 10).simulate(3);
    let mut seen = Vec::new();
    for (setup, config) in benches() {
        let locator = fit(config, &setup, &recording);
        let readings = readings(&setup);
        let single: Vec<Estimate> = readings.iter().map(|reading| locator.locate(reading)).collect();
        // The second pass overwrites estimates of other readings.
        let mut estimates = vec![NO_CONTACT; readings.len()];
        let mut scratch = Scratch::default();
        for order in [readings.iter().rev().flatten().copied().collect::<Vec<f64>>(), readings.concat()] {
            assert_eq!(locator.locate_batch_with(&order, &mut scratch, &mut estimates), readings.len());
        }
        assert_eq!(estimates, single, "{:?}", locator.force());
        seen.extend(single.iter().map(|estimate| estimate.status));
    }
    for status in [Status::Located, Status::NoContact, Status::Ambiguous, Status::OutsideModel] {
        assert!(seen.contains(&status), "{status:?}");
    }
}

#[test]
fn every_instruction_set_answers_as_plain_arrays_do() {
    let recording = paper(5e-6, 10).simulate(3);
    for (setup, config) in benches() {
        for dead in [None, Some(2)] {
            let mut locator = fit(config, &setup, &recording);
            assert!(dead.is_none_or(|channel| locator.leave_out(channel)));
            let readings = readings(&setup);
            let flat = readings.concat();
            let rows = Rows { readings: &flat, channels: 8 };
            let by = |set: InstructionSet| {
                let mut estimates = vec![NO_CONTACT; readings.len()];
                let (search, scratch) = (locator.search(), &mut Scratch::default());
                set.run(LocateRows { search, rows, scratch, estimates: &mut estimates });
                estimates
            };
            let plain = by(InstructionSet::PORTABLE);
            for set in InstructionSet::available() {
                assert_eq!(by(set), plain, "{set:?}, {:?}", locator.force());
            }
        }
    }
}

#[test]
fn a_batch_locates_as_many_as_there_are() {
    let rig = paper(5e-6, 2);
    let locator = fit(Influence::default(), &rig.setup, &rig.simulate(1));
    assert!(matches!(locator.force(), ForceBelief::Known(_)));
    let mut estimates = vec![NO_CONTACT; 3];
    let mut scratch = Scratch::default();
    assert_eq!(locator.locate_batch_with(&[0.0; 39], &mut scratch, &mut estimates), 3);
    assert_eq!(locator.locate_batch_with(&[0.0; 15], &mut scratch, &mut estimates), 1);
    assert_eq!(locator.locate_batch_with(&[], &mut scratch, &mut estimates), 0);
}
