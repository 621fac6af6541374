//! Interval coverage by load position: a sample of the experiment `load-profiles`.

use super::tests::{beam, clean, layout, noisy};
use super::*;
use palpate_numerics::binomial_tail;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Distances of the outermost centre from a support, in metres.
const DISTANCES_M: [(f64, f64); 3] = [(0.001, 0.01), (0.02, 0.04), (0.1, 0.2)];

/// Readings with the true number of patches.
#[derive(Debug, Default)]
struct CoverageTally {
    readings: usize,
    right_number: usize,
    force: usize,
    centre: usize,
    pressure: usize,
    total: usize,
    bounded: usize,
}

impl CoverageTally {
    fn add(&mut self, profile: &LoadProfile, loads: &[UniformLoad]) {
        let Some(pressure) = profile.centre else { return };
        self.readings += 1;
        let total_n: f64 = loads.iter().map(UniformLoad::force_n).sum();
        let centre_m = loads.iter().map(|load| load.force_n() * load.centre().x_m).sum::<f64>() / total_n;
        self.total += usize::from(contains(profile.bounds.total_95_n, total_n));
        assert!(
            contains(profile.bounds.total_95_n, profile.total_n)
                && contains(pressure.x_95_m, pressure.position.x_m)
        );
        if profile.patches.len() != loads.len() {
            return;
        }
        self.right_number += 1;
        self.pressure += usize::from(contains(pressure.x_95_m, centre_m));
        let outermost = if loads[0].centre().x_m < 0.2 { 0 } else { loads.len() - 1 };
        let (patch, load) = (&profile.patches[outermost], &loads[0]);
        self.force += usize::from(contains(patch.force_95_n, load.force_n()));
        self.centre += usize::from(contains(patch.centre.x_95_m, load.centre().x_m));
        self.bounded += usize::from(patch.force_95_n.1.is_finite());
        assert!(
            contains(patch.force_95_n, patch.force_n)
                && contains(patch.centre.x_95_m, patch.centre.position.x_m)
        );
    }
}

/// 1 to 60 mm, 0.5 to 20 N.
fn load(centre_m: f64, rng: &mut Xoshiro256PlusPlus) -> UniformLoad {
    let widest_m = f64::min(0.06, 2.0 * centre_m.min(0.4 - centre_m));
    let half_m = 0.5 * rng.random_range(0.001..widest_m.max(0.0011));
    let force_n = 0.5 * 40_f64.powf(rng.random_range(0.0..1.0));
    UniformLoad::along((centre_m - half_m).max(0.0), (centre_m + half_m).min(0.4), force_n)
}

fn tally_coverage(
    readings: usize,
    two: bool,
    (from_m, to_m): (f64, f64),
    rng: &mut Xoshiro256PlusPlus,
) -> CoverageTally {
    let beam = beam();
    let benches = [true, false].map(|strain| LoadSensors::new(&beam, &layout(strain)).unwrap());
    let profilers = benches.clone().map(Profiler::new);
    let mut held = CoverageTally::default();
    for i in 0..readings {
        let centre_m = rng.random_range(from_m..to_m);
        let mut loads = vec![load(centre_m, rng)];
        if two {
            loads.push(load(rng.random_range(centre_m + 0.1..0.4 - f64::min(centre_m, 0.1)), rng));
        }
        if i % 4 > 1 {
            // Beside the other support.
            let mirrored = |load: &UniformLoad| {
                UniformLoad::along(0.4 - load.from().x_m, 0.4 - load.to().x_m, load.force_n())
            };
            loads = loads.iter().map(mirrored).collect();
        }
        let (sensors, profiler) = (&benches[i % 2], &profilers[i % 2]);
        let reading = noisy(sensors, &clean(sensors, &loads), rng);
        held.add(&profiler.profile(&reading).unwrap(), &loads);
    }
    held
}

/// The experiment covers 93 to 100 %.
#[test]
fn intervals_of_patches_cover_them_at_any_position() {
    const READINGS: usize = 12;
    for two in [false, true] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        for (from_m, to_m) in DISTANCES_M {
            let held = tally_coverage(READINGS, two, (from_m, to_m), &mut rng);
            let counts = [
                (held.force, held.right_number),
                (held.centre, held.right_number),
                (held.pressure, held.right_number),
            ];
            for (count, of) in counts.into_iter().chain([(held.total, held.readings)]) {
                assert!(is_plausible(count, of), "{from_m}, two {two}: {held:?}");
            }
        }
    }
}

/// False below the 0.001 quantile of a coverage of 93 %.
fn is_plausible(covered: usize, of: usize) -> bool {
    binomial_tail(of, of - covered, 0.07) > 1e-3
}

/// The force is unique, so its interval also determines centre and width. The experiment covers at least 96
/// %.
#[test]
fn interval_covers_the_force_of_a_load_over_the_whole_beam() {
    const READINGS: usize = 12;
    let (beam, load) = (beam(), UniformLoad::along(0.0, 0.4, 4.0));
    let sensors = LoadSensors::new(&beam, &layout(true)).unwrap();
    let profiler = Profiler::new(sensors.clone());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut held = CoverageTally::default();
    for _ in 0..READINGS {
        let reading = noisy(&sensors, &clean(&sensors, &[load]), &mut rng);
        held.add(&profiler.profile(&reading).unwrap(), &[load]);
    }
    let all = [held.right_number, held.force, held.centre, held.pressure, held.total];
    assert!(all.into_iter().all(|count| is_plausible(count, READINGS)), "{held:?}");
}
