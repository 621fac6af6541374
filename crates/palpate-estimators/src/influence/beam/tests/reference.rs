//! Comparison with an exhaustive search and with an exhaustive integration over two thousand places.

use super::{clean, fit, noisy};
use crate::arrangement::Training;
use crate::fit::Locate;
use crate::fixtures::paper;
use crate::influence::beam::gauss_newton::Minimum;
use crate::influence::beam::search::Search;
use crate::influence::config::ForceBelief;
use crate::influence::{Influence, InfluenceSource};
use crate::influence::{InfluenceTable, Scratch};
use crate::setup::Setup;
use palpate_core::Status;
use palpate_numerics::simd::Array;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Places per cell of the table.
const PARTS: usize = 16;

/// Readings that are mostly noise.
const ROUGH: [&str; 2] = ["rough", "all noise"];

type Odd = (&'static str, Vec<f64>);

/// Readings at or beyond the limits of a single contact.
fn odd_readings(setup: &Setup, rng: &mut Xoshiro256PlusPlus) -> Vec<Odd> {
    let mut place = |low: f64, high: f64| rng.random_range(low..high);
    let contacts = [
        ("one", vec![(place(0.0, 0.4), place(0.5, 8.0))]),
        ("two", vec![(place(0.0, 0.4), place(0.5, 5.0)), (place(0.0, 0.4), place(0.5, 5.0))]),
        ("three", (0..3).map(|_| (place(0.0, 0.4), place(0.5, 5.0))).collect()),
        ("near the left end", vec![(place(0.0, 2e-3), 3.0)]),
        ("near the right end", vec![(place(0.398, 0.4), 3.0)]),
        ("hardly any force", vec![(place(0.0, 0.4), place(0.0, 0.05))]),
        ("a great force", vec![(place(0.0, 0.4), place(30.0, 100.0))]),
        ("pulled", vec![(place(0.0, 0.4), -2.0)]),
        ("nothing", vec![]),
    ];
    let mut readings: Vec<Odd> =
        contacts.iter().map(|(kind, contacts)| (*kind, noisy(setup, contacts, rng))).collect();
    for (kind, size_m) in ROUGH.into_iter().zip([50e-6, 2e-3]) {
        let mut reading = clean(setup, &[(rng.random_range(0.0..0.4), 3.0)]);
        reading.iter_mut().for_each(|value| *value += size_m * rng.random_range(-1.0..1.0));
        readings.push((kind, reading));
    }
    readings
}

/// −2·ln of the likelihood without its constant, with the calibration's variance at the force; `None` means
/// the best force.
fn cost(search: &Search, whitened: &[f64], x_m: f64, force_n: Option<f64>) -> f64 {
    let (table, reference_n) = (&search.table, search.gauss_newton.variance_scale(0.0).sqrt());
    let cell = table.cell(x_m);
    let node = cell.node as usize;
    let at = |force_n: f64| {
        let (mut cost, mut score, mut norm) = (0.0, 0.0, 0.0);
        let scale = search.gauss_newton.variance_scale(force_n);
        table.for_each(cell, |s, f, _| {
            let variance = |node: usize| table.variances[node * table.sensors + s];
            let weight = 1.0 / (1.0 + scale * 0.5 * (variance(node) + variance(node + 1)));
            cost += weight * (whitened[s] - force_n * f).powi(2) - weight.ln();
            score += weight * whitened[s] * f;
            norm += weight * f * f;
        });
        (cost, score, norm)
    };
    let (mean, precision) = match search.force {
        ForceBelief::Known(known_n) => return at(known_n).0,
        belief => belief.mean_and_precision(),
    };
    let mut force = force_n.unwrap_or(reference_n);
    for _ in 0..if force_n.is_none() { 8 } else { 0 } {
        let (_, score, norm) = at(force);
        force = if norm > 0.0 { ((score + mean * precision) / (norm + precision)).max(0.0) } else { mean };
    }
    at(force).0 + precision * (force - mean).powi(2)
}

/// Lowest cost on the line and its place.
fn exhaustive(search: &Search, whitened: &[f64]) -> (f64, f64) {
    let places = (InfluenceTable::NODES - 1) * PARTS;
    let place_m = |i: usize| search.table.length_m * i as f64 / places as f64;
    let costs = (0..=places).map(|i| (cost(search, whitened, place_m(i), None), place_m(i)));
    costs.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

/// Minimum of the search, and the whitened reading.
fn found(search: &Search, reading: &[f64]) -> (Minimum, Vec<f64>) {
    let mut scratch = Scratch::default();
    let square = search.whiten::<Array<f64, 8, false>>(reading, scratch.whitened.room(search.groups()));
    let whitened = scratch.whitened.channels(search.live.len()).to_vec();
    (search.minima::<Array<f64, 8, false>>(square, &mut scratch).0[0], whitened)
}

#[test]
fn the_lowest_misfit_is_found_in_odd_readings() {
    let recording = paper(5e-6, 10).simulate(3);
    let setup = paper(5e-6, 10).setup;
    let unknown = setup.clone().unknown_force();
    let config = Influence::default();
    let believed = Influence { force_sd_n: Some(0.5), ..config };
    for (setup, config) in [(setup.clone(), config), (unknown, config), (setup, believed)] {
        for dead in [&[][..], &[3], &[0, 5, 6]] {
            let mut locator = fit(config, &setup, &recording);
            assert!(dead.iter().all(|channel| locator.leave_out(*channel)));
            let search = locator.search();
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(17);
            for (kind, reading) in (0..8).flat_map(|_| odd_readings(&setup, &mut rng)) {
                // An immense force next to a support, where the calibration is most uncertain, best explains
                // such noise; the search uses χ² of the noise alone.
                if !matches!(search.force, ForceBelief::Known(_)) && ROUGH.contains(&kind) {
                    continue;
                }
                let (minimum, whitened) = found(search, &reading);
                let (least, best_m) = exhaustive(search, &whitened);
                let cost = cost(search, &whitened, minimum.x_m, Some(minimum.force_n));
                let told = format!("{kind}, {:?}, without {dead:?}: {minimum:?}", search.force);
                assert!(cost < least + 2.0 + 1e-2 * least, "{told} costs {cost}, {best_m} m costs {least}");
            }
        }
    }
}

/// Shares of the posterior probability of places, split at the middles between `modes_m`.
fn exhaustive_shares(search: &Search, whitened: &[f64], modes_m: &[f64]) -> Vec<f64> {
    let places = (InfluenceTable::NODES - 1) * PARTS;
    let (best, _) = exhaustive(search, whitened);
    let mut shares = vec![0.0; modes_m.len()];
    for i in 0..=places {
        let x_m = search.table.length_m * i as f64 / places as f64;
        let distance = |mode: &usize| (modes_m[*mode] - x_m).abs();
        let nearest = (0..modes_m.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
        shares[nearest] += (0.5 * (best - cost(search, whitened, x_m, None))).exp();
    }
    let all: f64 = shares.iter().sum();
    shares.iter().map(|share| share / all).collect()
}

#[test]
fn modes_have_the_probabilities_of_an_exhaustive_integration() {
    // One sensor reads a force on its left as another on its right; its function is uncertain on the right.
    let bench = paper(20e-6, 1);
    let mut recording = bench.setup.simulate(&Training::even(12), 3).unwrap();
    recording.rows.retain(|row| row.position.x_m < 0.25);
    let config = Influence { source: InfluenceSource::Recording, ..Influence::default() };
    let mut locator = fit(config, &bench.setup, &recording);
    [0, 1, 2, 4, 5, 6, 7].iter().for_each(|channel| assert!(locator.leave_out(*channel)));
    let search = locator.search();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut ambiguous = 0;
    for x_m in (3..37).map(|cm| 1e-2 * f64::from(cm)) {
        let reading = noisy(&bench.setup, &[(x_m, 3.0)], &mut rng);
        let estimate = locator.locate(&reading);
        let modes = estimate.modes.as_slice();
        if estimate.status != Status::Ambiguous {
            continue;
        }
        ambiguous += 1;
        let others = modes.iter().map(|mode| mode.contact.position.x_m);
        let modes_m: Vec<f64> = std::iter::once(estimate.contact.position.x_m).chain(others).collect();
        let shares = exhaustive_shares(search, &found(search, &reading).1, &modes_m);
        let probabilities: Vec<f64> = modes.iter().map(|mode| mode.probability).collect();
        let first = 1.0 - probabilities.iter().sum::<f64>();
        // Modes near the sensor are not quite normal distributions.
        for (share, probability) in shares.iter().zip(std::iter::once(first).chain(probabilities)) {
            assert!((share - probability).abs() < 0.05, "{x_m} m: {shares:?}, {estimate:?}");
        }
        assert!(modes.iter().all(|mode| mode.probability <= first + 1e-9), "{x_m} m: {estimate:?}");
    }
    assert!(ambiguous >= 10, "{ambiguous}");
}
