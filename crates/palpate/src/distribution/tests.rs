//! Profiles of loads that are known, over many readings.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::contact::Position;
use crate::mechanics::{Beam, Surface, UniformLoad};
use crate::sensing::{Layout, SensorKind};
use palpate_core::Status;

fn beam() -> Beam {
    Beam { length_m: 0.4, width_m: 0.04, thickness_m: 1.2e-3, youngs_modulus_pa: 200e9 }
}

/// Eight deflection sensors with 2 µm noise, and as many strain sensors with 0.5 µε where they are wanted.
fn layout(strain: bool) -> Layout {
    let mut layout = Layout::even(SensorKind::Deflection, 8, 0.4);
    layout.sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = 2e-6);
    if strain {
        let mut more = Layout::even(SensorKind::Strain, 8, 0.4);
        more.sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = 0.5e-6);
        layout.sensors.extend(more.sensors);
    }
    layout
}

fn patch(centre_m: f64, force_n: f64) -> UniformLoad {
    let (from, to) = (Position::along(centre_m - 0.01), Position::along(centre_m + 0.01));
    UniformLoad { from, to, force_n }
}

fn clean(sensors: &LoadSensors, loads: &[UniformLoad]) -> Vec<f64> {
    let read = |channel: &LoadChannel| {
        loads.iter().map(|load| load.force_n * load.mean(&*channel.influence)).sum::<f64>()
    };
    sensors.channels.iter().map(|channel| channel.as_ref().map_or(0.0, read)).collect()
}

fn noisy(sensors: &LoadSensors, clean: &[f64], rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let noise_sd = |channel: &Option<LoadChannel>| channel.as_ref().map_or(0.0, |channel| channel.noise_sd);
    let each = sensors.channels.iter().map(noise_sd).zip(clean);
    each.map(|(sd, value)| value + sd * rng.sample::<f64, _>(StandardNormal)).collect()
}

/// How two patches of 2 N each, 120 mm apart, were told over many readings.
#[derive(Debug, Default)]
struct Tally {
    readings: usize,
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
    println!("limits {limits:?}");
    let clean = clean(&sensors, &loads);
    let profiler = Profiler::new(sensors.clone());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut tally = Tally { readings, ..Tally::default() };
    let holds = |(low, high): (f64, f64), value: f64| usize::from((low..=high).contains(&value));
    for _ in 0..readings {
        let profile = profiler.profile(&noisy(&sensors, &clean, &mut rng));
        assert_eq!(profile.status, Status::Located);
        let percent = 100.0 * (profile.total_n / 4.0 - 1.0).abs();
        tally.worst_force_percent = tally.worst_force_percent.max(percent);
        tally.within_2_percent += usize::from(percent <= 2.0);
        tally.total_covered += holds(profile.total_95_n(), 4.0);
        tally.pressure_covered += holds(profile.centre.unwrap().x_95_m(), 0.2);
        let [left, right] = profile.patches[..] else {
            println!("{:?}", profile.patches.iter().map(|p| (p.from.x_m, p.to.x_m, p.force_n, p.force_sd_n)).collect::<Vec<_>>());
            continue;
        };
        tally.two += 1;
        let mut near = true;
        for ((patch, load), limit) in [left, right].iter().zip(&loads).zip(&limits) {
            let off = (patch.centre.position.x_m - load.centre().x_m) / limit.sd_x_m;
            near &= off.abs() <= 3.0;
            tally.centre_squares += off * off;
            tally.centres_covered += holds(patch.centre.x_95_m(), load.centre().x_m);
            tally.forces_covered += holds(patch.force_95_n(), load.force_n);
        }
        tally.within_3_limits += usize::from(near);
    }
    tally
}

#[test]
fn two_patches_are_told_at_their_limits() {
    for strain in [true, false] {
        let tally = tally(strain, 200);
        println!("strain {strain}: {tally:?} rms {}", (tally.centre_squares / (2 * tally.two) as f64).sqrt());
    }
}
