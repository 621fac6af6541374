//! The paper's beam, in balance under a contact that moves, lets go and comes down again.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::bench::Bench;
use crate::contact::{Contact, Position};
use crate::influence::{BeamLikelihood, InfluenceConfig};
use crate::mechanics::Motion;
use crate::method::FitTask;
use crate::rig::Rig;
use crate::sensing::{ChannelErrors, measure};
use crate::simulate::{clean_reading, simulate};

const RATE_HZ: f64 = 1000.0;

fn rig() -> Rig {
    Rig::from_toml(include_str!("../../../../examples/moving-load.toml")).unwrap()
}

fn likelihood(rig: &Rig, force_n: Option<f64>) -> BeamLikelihood {
    let recording = simulate(rig, 1).unwrap();
    let bench = Bench { force_n, ..rig.bench.clone() };
    let task = FitTask { bench: &bench, recording: &recording, seed: 0 };
    BeamLikelihood::new(&InfluenceConfig::default().fit_beam(task, &mut || true).unwrap().unwrap())
}

/// Contacts along a motion with 3 N, and readings in balance.
fn readings(rig: &Rig, motion: Motion, seed: u64) -> Vec<(f64, Contact, Vec<f64>)> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let errors = ChannelErrors::none(&rig.bench.layout);
    let surface = rig.bench.surface.model().unwrap();
    let at = |i: usize| {
        let time_s = i as f64 / RATE_HZ;
        let contact = motion.contact_at(time_s, 3.0);
        let clean = clean_reading(surface, &rig.bench.layout, contact);
        (time_s, contact, measure(&rig.bench.layout, &clean, &errors, &mut rng))
    };
    (0..(motion.duration_s() * RATE_HZ) as usize).map(at).collect()
}

/// Mean errors of single readings, of the filter and of the smoother, and the shares that the latter two cover.
fn errors(likelihood: &BeamLikelihood, readings: &[(f64, Contact, Vec<f64>)]) -> ([f64; 3], [f64; 2]) {
    let mut tracker = SmoothTracker::new(likelihood, TrackerConfig::default());
    for (time_s, _, reading) in readings {
        tracker.follow(*time_s, reading).unwrap();
    }
    let (mut errors, mut covered) = ([0.0; 3], [0.0; 2]);
    let smoothed = tracker.smoothed();
    for ((track, smooth), (_, truth, _)) in tracker.filtered().iter().zip(&smoothed).zip(readings) {
        let x_m = truth.position.x_m;
        errors[0] += (track.alone.contact.position.x_m - x_m).abs();
        for (i, tracked) in [track.tracked.unwrap(), smooth.tracked.unwrap()].into_iter().enumerate() {
            errors[i + 1] += (tracked.x_m - x_m).abs();
            covered[i] += f64::from(u8::from((tracked.x_95_m.0..=tracked.x_95_m.1).contains(&x_m)));
        }
    }
    let count = readings.len() as f64;
    (errors.map(|sum| sum / count), covered.map(|sum| sum / count))
}

#[test]
fn a_track_is_several_times_closer_than_its_readings() {
    let rig = rig();
    let motion = Motion { speed_m_per_s: 0.2, passes: 2, ..rig.motion.unwrap().motion };
    let readings = readings(&rig, motion, 2);
    for (force_n, filter, smoother) in [(Some(3.0), 3.0, 5.0), (None, 4.0, 6.0)] {
        let ([single, filtered, smoothed], [covered, _]) = errors(&likelihood(&rig, force_n), &readings);
        assert!(single / filtered > filter, "{force_n:?}: {single} {filtered}");
        assert!(single / smoothed > smoother, "{force_n:?}: {single} {smoothed}");
        assert!((0.88..1.0).contains(&covered), "{force_n:?}: {covered}");
    }
}

#[test]
fn a_contact_that_lets_go_is_lost_and_found_again() {
    let rig = rig();
    let motion =
        Motion { speed_m_per_s: 1.0, passes: 2, lifted_s: 0.2, touch_s: 0.02, ..rig.motion.unwrap().motion };
    let likelihood = likelihood(&rig, None);
    let mut tracker = Tracker::new(&likelihood, TrackerConfig::default());
    let mut wrong = 0;
    for (time_s, truth, reading) in readings(&rig, motion, 3) {
        let track = tracker.follow(time_s, &reading).unwrap();
        let touching = track.tracked.is_some();
        assert_eq!(touching, track.touching > 0.5);
        wrong += usize::from(touching != (truth.force_n > 0.0));
    }
    // Only while the force is too small to be told from noise.
    assert!(wrong <= 15, "{wrong}");
}

#[test]
fn readings_out_of_order_are_refused_and_change_nothing() {
    let rig = rig();
    let likelihood = likelihood(&rig, Some(3.0));
    let surface = rig.bench.surface.model().unwrap();
    let contact = Contact { position: Position::along(0.1), force_n: 3.0 };
    let reading = clean_reading(surface, &rig.bench.layout, contact);
    let (mut one, mut other) = (
        Tracker::new(&likelihood, TrackerConfig::default()),
        Tracker::new(&likelihood, TrackerConfig::default()),
    );
    for tracker in [&mut one, &mut other] {
        tracker.follow(1.0, &reading).unwrap();
    }
    for time_s in [1.0, 0.5, f64::NAN] {
        assert!(one.follow(time_s, &reading).is_err());
    }
    let told = one.follow(0.5, &reading).unwrap_err().to_string();
    assert_eq!(told, "the reading is of 0.5 s; it must be later than the one before, of 1 s");
    assert_eq!(one.follow(2.0, &reading), other.follow(2.0, &reading));
}

#[test]
fn absurd_readings_and_gaps_leave_numbers_behind() {
    let rig = rig();
    let likelihood = likelihood(&rig, None);
    let mut tracker = Tracker::new(&likelihood, TrackerConfig::default());
    let absurd = [[0.0; 8], [1e9; 8], [-1e150; 8], [1e-3; 8], [-3e-3; 8]];
    for (i, reading) in absurd.iter().chain(&absurd).enumerate() {
        let track = tracker.follow(10f64.powi(i as i32), reading).unwrap();
        assert!(track.touching.is_finite());
        if let Some(tracked) = track.tracked {
            assert!(tracked.x_m.is_finite() && (0.0..=0.4).contains(&tracked.x_m), "{tracked:?}");
        }
    }
}
