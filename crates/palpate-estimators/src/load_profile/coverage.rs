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
struct Held {
    readings: usize,
    told: usize,
    force: usize,
    centre: usize,
    pressure: usize,
    total: usize,
    bounded: usize,
}

impl Held {
    fn add(&mut self, profile: &LoadProfile, loads: &[UniformLoad]) {
        let Some(pressure) = profile.centre else { return };
        self.readings += 1;
        let total_n: f64 = loads.iter().map(UniformLoad::force_n).sum();
        let centre_m = loads.iter().map(|load| load.force_n() * load.centre().x_m).sum::<f64>() / total_n;
        self.total += usize::from(holds(profile.bounds.total_95_n, total_n));
        assert!(
            holds(profile.bounds.total_95_n, profile.total_n)
                && holds(pressure.x_95_m, pressure.position.x_m)
        );
        if profile.patches.len() != loads.len() {
            return;
        }
        self.told += 1;
        self.pressure += usize::from(holds(pressure.x_95_m, centre_m));
        let outermost = if loads[0].centre().x_m < 0.2 { 0 } else { loads.len() - 1 };
        let (patch, load) = (&profile.patches[outermost], &loads[0]);
        self.force += usize::from(holds(patch.force_95_n, load.force_n()));
        self.centre += usize::from(holds(patch.centre.x_95_m, load.centre().x_m));
        self.bounded += usize::from(patch.force_95_n.1.is_finite());
        assert!(
            holds(patch.force_95_n, patch.force_n) && holds(patch.centre.x_95_m, patch.centre.position.x_m)
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

fn held(readings: usize, two: bool, (from_m, to_m): (f64, f64), rng: &mut Xoshiro256PlusPlus) -> Held {
    let beam = beam();
    let benches = [true, false].map(|strain| LoadSensors::new(&beam, &layout(strain)).unwrap());
    let profilers = benches.clone().map(Profiler::new);
    let mut held = Held::default();
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
fn patches_are_held_wherever_they_lie() {
    const READINGS: usize = 12;
    for two in [false, true] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        for (from_m, to_m) in DISTANCES_M {
            let held = held(READINGS, two, (from_m, to_m), &mut rng);
            let counts = [(held.force, held.told), (held.centre, held.told), (held.pressure, held.told)];
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
fn the_force_of_a_load_over_the_whole_beam_is_held() {
    const READINGS: usize = 12;
    let (beam, load) = (beam(), UniformLoad::along(0.0, 0.4, 4.0));
    let sensors = LoadSensors::new(&beam, &layout(true)).unwrap();
    let profiler = Profiler::new(sensors.clone());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut held = Held::default();
    for _ in 0..READINGS {
        let reading = noisy(&sensors, &clean(&sensors, &[load]), &mut rng);
        held.add(&profiler.profile(&reading).unwrap(), &[load]);
    }
    let all = [held.told, held.force, held.centre, held.pressure, held.total];
    assert!(all.into_iter().all(|count| is_plausible(count, READINGS)), "{held:?}");
}
