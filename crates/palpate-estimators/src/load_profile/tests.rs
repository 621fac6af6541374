//! Profiles of known loads over many readings.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use palpate_core::Status;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{ChannelModel, Layout, NoiseError, Sensor, SensorKind};
use palpate_mechanics::surface::{Beam, Extent, InfluenceFunction, Surface, UniformLoad};

pub(super) fn beam() -> Beam {
    Beam::new(0.4, 0.04, 1.2e-3, 200e9).unwrap()
}

/// Eight deflection sensors with 2 µm noise, and with `strain` eight strain sensors with 0.5 µε.
pub(super) fn layout(strain: bool) -> Layout {
    let mut layout = Layout::even(SensorKind::Deflection, 8, 0.4);
    layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = 2e-6)).unwrap();
    if strain {
        let mut more = Layout::even(SensorKind::Strain, 8, 0.4);
        more.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = 0.5e-6)).unwrap();
        layout.edit(|sensors| sensors.extend(more.into_sensors())).unwrap();
    }
    layout
}

fn patch(centre_m: f64, force_n: f64) -> UniformLoad {
    let (from, to) = (Position::along(centre_m - 0.01), Position::along(centre_m + 0.01));
    UniformLoad::new(from, to, force_n)
}

pub(super) fn clean(sensors: &LoadSensors, loads: &[UniformLoad]) -> Vec<f64> {
    let read = |channel: &LoadChannel| {
        loads.iter().map(|load| load.force_n() * load.mean(&*channel.influence)).sum::<f64>()
    };
    sensors.channels.iter().map(|channel| channel.as_ref().map_or(0.0, read)).collect()
}

pub(super) fn noisy(sensors: &LoadSensors, clean: &[f64], rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let noise_sd = |channel: &Option<LoadChannel>| channel.as_ref().map_or(0.0, |channel| channel.noise_sd);
    let each = sensors.channels.iter().map(noise_sd).zip(clean);
    each.map(|(sd, value)| value + sd * rng.sample::<f64, _>(StandardNormal)).collect()
}

/// Counts and errors of two patches of 2 N each, 120 mm apart, over many readings.
#[derive(Debug, Default)]
struct Tally {
    resolved: usize,
    two: usize,
    within_3_limits: usize,
    within_2_percent: usize,
    worst_force_percent: f64,
    centre_squares: f64,
    centres_covered: usize,
    forces_covered: usize,
    total_covered: usize,
    pressure_covered: usize,
}

fn tally(strain: bool, readings: usize) -> Tally {
    let beam = beam();
    let sensors = LoadSensors::new(&beam, &layout(strain)).unwrap();
    let loads = [patch(0.14, 2.0), patch(0.26, 2.0)];
    let limits = patch_limits(&sensors, &loads).unwrap();
    let clean = clean(&sensors, &loads);
    let profiler = Profiler::new(sensors.clone());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut tally = Tally::default();
    let covers = |(low, high): (f64, f64), value: f64| usize::from((low..=high).contains(&value));
    for _ in 0..readings {
        let profile = profiler.profile(&noisy(&sensors, &clean, &mut rng)).unwrap();
        assert!(matches!(profile.status, Status::Located | Status::Ambiguous), "{:?}", profile.status);
        tally.resolved += usize::from(profile.status == Status::Located);
        let percent = 100.0 * (profile.total_n / 4.0 - 1.0).abs();
        tally.worst_force_percent = tally.worst_force_percent.max(percent);
        tally.within_2_percent += usize::from(percent <= 2.0);
        tally.total_covered += covers(profile.bounds.total_95_n, 4.0);
        tally.pressure_covered += covers(profile.centre.unwrap().x_95_m, 0.2);
        let [left, right] = profile.patches[..] else { continue };
        tally.two += 1;
        let mut near = true;
        for ((patch, load), limit) in [left, right].iter().zip(&loads).zip(&limits) {
            let off = (patch.centre.position.x_m - load.centre().x_m) / limit.sd_x_m;
            near &= off.abs() <= 3.0;
            tally.centre_squares += off * off;
            tally.centres_covered += covers(patch.centre.x_95_m, load.centre().x_m);
            tally.forces_covered += covers(patch.force_95_n, load.force_n());
        }
        tally.within_3_limits += usize::from(near);
    }
    tally
}

/// A sample of the experiment `load-profiles`.
#[test]
fn two_patches_are_resolved_at_their_limits() {
    const READINGS: usize = 24;
    let tally = tally(true, READINGS);
    assert!(tally.worst_force_percent < 2.0 && tally.two + 1 >= READINGS, "{tally:?}");
    // One of 200 readings of the experiment deviates more, so two of 24 occur in one of 150 samples.
    assert!(tally.within_3_limits + 1 >= READINGS, "{tally:?}");
    // The root mean square of 48 centres is 0.89 ± 0.1 limits in the experiment.
    assert!(tally.centre_squares < 1.3 * 1.3 * 2.0 * tally.two as f64, "{tally:?}");
    // A third load is significant at 5 % in one of twenty readings: in six of 24 with probability 0.001.
    assert!(tally.resolved + 5 >= READINGS, "{tally:?}");
    // With a coverage of 95 %, fewer than 19 of 24 or 40 of 48 intervals cover with probability 0.001.
    assert!(tally.centres_covered.min(tally.forces_covered) >= 40, "{tally:?}");
    assert!(tally.total_covered.min(tally.pressure_covered) >= 19, "{tally:?}");
}

/// A sample of the experiment `load-profiles`: 192 of its 200 readings have two patches.
#[test]
fn deflections_alone_have_wider_intervals() {
    const READINGS: usize = 24;
    let tally = tally(false, READINGS);
    // Fewer than 19 of 24 readings have two patches with probability 0.001.
    assert!(tally.worst_force_percent < 5.0 && tally.two.min(tally.within_3_limits) >= 19, "{tally:?}");
}

#[test]
fn the_same_reading_gives_the_same_profile_and_twice_the_load_twice_the_profile() {
    let beam = beam();
    let sensors = LoadSensors::new(&beam, &layout(true)).unwrap();
    let profiler = Profiler::new(sensors.clone());
    let once = clean(&sensors, &[patch(0.14, 2.0), patch(0.26, 2.0)]);
    let twice = clean(&sensors, &[patch(0.14, 4.0), patch(0.26, 4.0)]);
    let (one, two) = (profiler.profile(&once).unwrap(), profiler.profile(&twice).unwrap());
    assert_eq!(one.forces_n, profiler.profile(&once).unwrap().forces_n);
    assert!((two.total_n / one.total_n - 2.0).abs() < 0.01, "{} {}", one.total_n, two.total_n);
    // Without noise the truth is within the interval of the patch's centre, and no load is negative.
    assert!((one.patches[0].centre.position.x_m - 0.14).abs() < 2e-3);
    assert!(one.forces_n.iter().all(|force| *force >= 0.0));
    // Reading less residual is the sensors' reading of the profile.
    for ((channel, fitted), (value, residual)) in
        sensors.channels.iter().zip(&one.fitted).zip(once.iter().zip(&one.residuals))
    {
        let noise_sd = channel.as_ref().unwrap().noise_sd;
        assert!((fitted.unwrap() + residual.unwrap() * noise_sd - value).abs() < 1e-12);
    }
}

#[test]
fn an_even_load_is_smooth_and_one_patch() {
    let beam = beam();
    let sensors = LoadSensors::new(&beam, &layout(true)).unwrap();
    let load = UniformLoad::along(0.02, 0.38, 4.0);
    let reading = noisy(&sensors, &clean(&sensors, &[load]), &mut Xoshiro256PlusPlus::seed_from_u64(3));
    let profile = Profiler::new(sensors).profile(&reading).unwrap();
    // A second load is significant at 5 % in this reading, but not at 0.1 %.
    assert_eq!((profile.status, profile.patches.len()), (Status::Ambiguous, 1));
    assert!((profile.total_n - 4.0).abs() < 0.2, "{}", profile.total_n);
    // Half of the length, from 100 mm to 300 mm: sums are determined better than the shape.
    let middle: f64 = profile.forces_n[20..60].iter().sum();
    assert!((middle / (4.0 * 0.2 / 0.36) - 1.0).abs() < 0.05, "{middle}");
}

#[test]
fn silence_and_impossible_readings_have_their_status() {
    let beam = beam();
    let mut layout = layout(true);
    layout.set_disabled(3, true);
    let sensors = LoadSensors::new(&beam, &layout).unwrap();
    let profiler = Profiler::new(sensors.clone());
    let silent = profiler.profile(&[0.0; 16]).unwrap();
    assert_eq!((silent.status, silent.total_n, silent.patches.len()), (Status::NoContact, 0.0, 0));
    assert!(profiler.resolution(&silent).is_none() && silent.centre.is_none());
    let mut reading = clean(&sensors, &[patch(0.14, 2.0)]);
    // A disabled channel has no effect.
    reading[3] = 1.0;
    assert_eq!(profiler.profile(&reading).unwrap().status, Status::Located);
    // A deflection sensor with an error of 0.1 mm, which no load explains.
    reading[5] += 1e-4;
    assert_eq!(profiler.profile(&reading).unwrap().status, Status::OutsideModel);
    // A load that pulls.
    let pulled: Vec<f64> = clean(&sensors, &[patch(0.14, 2.0)]).iter().map(|value| -value).collect();
    assert_eq!(profiler.profile(&pulled).unwrap().status, Status::OutsideModel);
    assert!(profiler.profile(&[0.0; 3]).is_err() && profiler.profile(&[f64::NAN; 16]).is_err());
    // Huge values give finite results.
    let absurd = profiler.profile(&[1e300; 16]).unwrap();
    assert!(
        absurd.status == Status::OutsideModel && absurd.chi_squared.is_finite(),
        "{}",
        absurd.chi_squared
    );
    assert!(absurd.total_n.is_finite() && absurd.forces_n.iter().all(|force| force.is_finite()));
}

#[test]
fn sensors_without_noise_or_life_are_refused() {
    let beam = beam();
    let mut layout = layout(false);
    layout.edit(|sensors| sensors[1].channel.noise_sd = 0.0).unwrap();
    let Err(error) = LoadSensors::new(&beam, &layout) else { panic!("clean sensors were taken") };
    assert!(matches!(error, LoadSensorsError::Noise(NoiseError::Singular { number: 2, .. })), "{error}");
    layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.disabled = true)).unwrap();
    let Err(error) = LoadSensors::new(&beam, &layout) else { panic!("dead sensors were taken") };
    assert_eq!(error, LoadSensorsError::Noise(NoiseError::AllDead { count: 8 }));
}

#[test]
fn the_resolution_is_finer_with_strain() {
    let beam = beam();
    let median_width_m = |strain: bool| {
        let sensors = LoadSensors::new(&beam, &layout(strain)).unwrap();
        let reading = clean(&sensors, &[patch(0.14, 2.0), patch(0.26, 2.0)]);
        let profiler = Profiler::new(sensors);
        let resolution = profiler.resolution(&profiler.profile(&reading).unwrap()).unwrap();
        // The kernel of a cell away from the edges averages around that cell.
        let kernel = resolution.kernels.row(40);
        let top = (0..80).max_by(|a, b| kernel[*a].total_cmp(&kernel[*b])).unwrap();
        assert!(top.abs_diff(40) <= 4, "{top}");
        resolution.median_width_m()
    };
    let (with, without) = (median_width_m(true), median_width_m(false));
    println!("resolution {with} {without}");
    assert!(with < 0.8 * without, "{with} {without}");
}

/// A sheet of foam: a force dents it locally.
pub(super) struct Foam;

/// Standard deviation of the dent in metres, and depth in m/N.
const DENT_M: f64 = 0.03;
const DEPTH_M_PER_N: f64 = 1e-3;

struct Dent(Position);

impl InfluenceFunction for Dent {
    fn at(&self, contact: Position) -> f64 {
        let off = contact.distance_m(self.0) / DENT_M;
        -DEPTH_M_PER_N * (-0.5 * off * off).exp()
    }

    fn gradient(&self, contact: Position) -> [f64; 2] {
        let value = self.at(contact) / (DENT_M * DENT_M);
        [-(contact.x_m - self.0.x_m) * value, -(contact.y_m - self.0.y_m) * value]
    }
}

impl Surface for Foam {
    fn influence_function(&self, _: SensorKind, sensor: Position) -> Arc<dyn InfluenceFunction + '_> {
        Arc::new(Dent(sensor))
    }

    fn is_supported_at(&self, _: Position) -> bool {
        false
    }

    fn full_scale(&self, _: SensorKind) -> f64 {
        DEPTH_M_PER_N
    }

    fn extent(&self) -> Extent {
        Extent::plane(0.2, 0.1).unwrap()
    }
}

/// 32 deflection sensors under the foam, with 1 µm noise.
pub(super) fn foam_layout() -> Layout {
    let sensor = |i: usize| Sensor {
        kind: SensorKind::Deflection,
        position: Position { x_m: 0.0125 + 0.025 * (i % 8) as f64, y_m: 0.0125 + 0.025 * (i / 8) as f64 },
        name: format!("deflection_{}", i + 1),
        channel: ChannelModel { noise_sd: 1e-6, ..ChannelModel::default() },
    };
    Layout::new((0..32).map(sensor).collect()).unwrap()
}

#[test]
fn two_squares_on_a_plane_are_resolved() {
    let sensors = LoadSensors::new(&Foam, &foam_layout()).unwrap();
    let square = |x_m: f64, y_m: f64, force_n: f64| {
        let corner = |off_m: f64| Position { x_m: x_m + off_m, y_m: y_m + off_m };
        UniformLoad::new(corner(-0.01), corner(0.01), force_n)
    };
    let loads = [square(0.05, 0.03, 2.0), square(0.14, 0.07, 1.0)];
    let limits = patch_limits(&sensors, &loads).unwrap();
    assert!(limits.iter().all(|limit| limit.sd_x_m > 0.0 && limit.sd_y_m > 0.0 && limit.sd_x_m < 1e-3));
    let profiler = Profiler::new(sensors.clone());
    let clean = clean(&sensors, &loads);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    for _ in 0..3 {
        let profile = profiler.profile(&noisy(&sensors, &clean, &mut rng)).unwrap();
        assert!(matches!(profile.status, Status::Located | Status::Ambiguous), "{:?}", profile.status);
        assert_eq!(profile.patches.len(), 2);
        assert!((profile.total_n / 3.0 - 1.0).abs() < 0.02, "{}", profile.total_n);
        for (patch, load) in profile.patches.iter().zip(&loads) {
            assert!(patch.centre.position.distance_m(load.centre()) < 2e-3, "{patch:?}");
            assert!((patch.force_n / load.force_n() - 1.0).abs() < 0.05, "{patch:?}");
        }
    }
}

/// Coverage of the total by the distance of the outermost pad's centre from a support, with and without load
/// within the margin, for one or two pads of 20 mm.
fn covered_by_distance(readings: usize) -> Vec<[f64; 3]> {
    let beam = beam();
    let mut layout = layout(false);
    layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = 5e-6)).unwrap();
    let sensors = LoadSensors::new(&beam, &layout).unwrap();
    let profiler = Profiler::new(sensors.clone());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut row = |(from_m, to_m): (f64, f64)| {
        let (mut held, mut seen, mut seen_held) = (0, 0, 0);
        for i in 0..readings {
            let outermost_m = rng.random_range(from_m..to_m);
            let mut loads = vec![patch(outermost_m, rng.random_range(0.5..4.0))];
            if i % 2 == 1 {
                loads.push(patch(
                    rng.random_range(outermost_m..0.4 - outermost_m),
                    rng.random_range(0.5..4.0),
                ));
            }
            let total_n: f64 = loads.iter().map(|load| load.force_n()).sum();
            let bounds =
                profiler.profile(&noisy(&sensors, &clean(&sensors, &loads), &mut rng)).unwrap().bounds;
            let covers = |(low, high): (f64, f64)| usize::from(low <= total_n && total_n <= high);
            held += covers(bounds.total_95_n);
            if loads[0].from().x_m >= bounds.margin_m {
                seen += 1;
                seen_held += covers(bounds.seen_95_n);
            }
        }
        [held as f64 / readings as f64, seen as f64 / readings as f64, seen_held as f64 / seen.max(1) as f64]
    };
    DISTANCES_M.map(&mut row).to_vec()
}

const DISTANCES_M: [(f64, f64); 3] = [(0.01, 0.015), (0.02, 0.04), (0.1, 0.2)];

/// A sample of the experiment `load-profiles`.
#[test]
fn interval_of_the_total_covers_any_load() {
    const READINGS: usize = 20;
    for ((from_m, _), [held, seen, seen_held]) in DISTANCES_M.into_iter().zip(covered_by_distance(READINGS)) {
        // With a coverage of 95 %, fewer than 16 of 20 intervals cover with probability 0.003.
        assert!(held >= 0.8 && (seen < 0.5 || seen_held >= 0.75), "{from_m}: {held} {seen} {seen_held}");
    }
}

#[test]
fn load_next_to_a_support_is_not_underestimated() {
    // Two loads of 2 N, one at 5 to 25 mm from the support: the profile places it at 45 mm, with a total of
    // 2.7 N.
    let beam = beam();
    let sensors = LoadSensors::new(&beam, &layout(false)).unwrap();
    let loads = [patch(0.015, 2.0), patch(0.21, 2.0)];
    let reading = noisy(&sensors, &clean(&sensors, &loads), &mut Xoshiro256PlusPlus::seed_from_u64(2));
    let profile = Profiler::new(sensors.clone()).profile(&reading).unwrap();
    let (low, high) = profile.bounds.total_95_n;
    assert!(low < 4.0 && 4.0 < high && low > 2.0, "{low} to {high}");
    let first = profile.patches[0];
    let ((low, high), (from_m, to_m)) = (first.force_95_n, first.centre.x_95_m);
    assert!(low <= 2.0 && 2.0 <= high && from_m < 0.015 && to_m > 0.015, "{first:?}");
    let even = UniformLoad::along(0.0, 0.4, 4.0);
    let profile = Profiler::new(sensors.clone()).profile(&clean(&sensors, &[even])).unwrap();
    let (low, high) = profile.bounds.total_95_n;
    assert!(low < 4.0 && 4.0 < high, "{low} to {high}");
}

/// The smooth profile shows only 20 N on 370–390 mm, because 2 N on 100–160 mm have less than a tenth of its
/// density.
#[test]
fn finds_a_light_patch_that_a_dense_one_hides_from_the_profile() {
    let beam = beam();
    let sensors = LoadSensors::new(&beam, &layout(true)).unwrap();
    let loads = [UniformLoad::along(0.1, 0.16, 2.0), UniformLoad::along(0.37, 0.39, 20.0)];
    let clean = clean(&sensors, &loads);
    let profiler = Profiler::new(sensors.clone());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let centre_m = (2.0 * 0.13 + 20.0 * 0.38) / 22.0;
    let mut covered = 0;
    for _ in 0..3 {
        let profile = profiler.profile(&noisy(&sensors, &clean, &mut rng)).unwrap();
        // The profile splits the light patch in some readings.
        let [light, .., heavy] = profile.patches[..] else { panic!("{:?}", profile.patches) };
        assert!(light.force_95_n.0 > 0.0 && light.centre.position.x_m < 0.2, "{light:?}");
        let centre = profile.centre.unwrap();
        for ((low, high), truth) in [
            (heavy.force_95_n, 20.0),
            (heavy.centre.x_95_m, 0.38),
            (centre.x_95_m, centre_m),
            (profile.bounds.total_95_n, 22.0),
        ] {
            covered += usize::from(low <= truth && truth <= high);
        }
    }
    assert!(covered >= 10, "{covered} of 12");
}

/// If no uniform loads explain the reading, intervals are those of any shape, and contain the truth.
#[test]
fn uneven_loads_have_the_intervals_of_any_shape() {
    let beam = beam();
    let mut layout = layout(true);
    layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd *= 0.01)).unwrap();
    let sensors = LoadSensors::new(&beam, &layout).unwrap();
    // A wedge: density proportional to the distance from its left end.
    let wedge: Vec<UniformLoad> = (0..12)
        .map(|i| UniformLoad::along(0.14 + 0.01 * f64::from(i), 0.15 + 0.01 * f64::from(i), f64::from(i + 1)))
        .collect();
    let total_n: f64 = wedge.iter().map(UniformLoad::force_n).sum();
    let centre_m = wedge.iter().map(|load| load.force_n() * load.centre().x_m).sum::<f64>() / total_n;
    let reading = noisy(&sensors, &clean(&sensors, &wedge), &mut Xoshiro256PlusPlus::seed_from_u64(2));
    let profile = Profiler::new(sensors).profile(&reading).unwrap();
    let (low_m, high_m) = profile.centre.unwrap().x_95_m;
    assert!(low_m <= centre_m && centre_m <= high_m, "{centre_m}: {low_m} to {high_m}");
    assert!(contains(profile.bounds.total_95_n, total_n), "{total_n} {:?}", profile.bounds);
}
