//! A finger of steel under strain gauges with drifting offsets: a random walk on a ramp.

use super::*;
use palpate_mechanics::sensing::SensorKind::Strain;
use palpate_mechanics::surface::{
    BeamSection, BeamSupport, BeamSupportKind, SupportedBeam, SupportedBeamSpec,
};
use palpate_mechanics::units::{microstrain, mm};
use rand::RngExt;

use crate::fit::Locate;
use crate::setup::Setup;

const LENGTH_M: f64 = 0.12;
const PRESSED_N: f64 = 5.0;
const NOISE: f64 = 1e-6;
const EVERY_S: f64 = 0.02;

/// Cantilever with five gauges from 10 mm on; a contact between the clamp and the first gauge strains none of them.
fn finger() -> Setup {
    let spec = SupportedBeamSpec {
        length_m: LENGTH_M,
        youngs_modulus_pa: 200e9,
        supports: vec![BeamSupport { at_m: 0.0, kind: BeamSupportKind::Clamped }],
        sections: vec![BeamSection { to_m: LENGTH_M, width_m: 0.02, thickness_m: 2e-3 }],
    };
    let gauges = Strain.at_x([10.0, 30.0, 50.0, 70.0, 90.0].map(mm)).noise(microstrain(1.0));
    Setup::new(SupportedBeam::new(spec).unwrap()).sensors(gauges).unwrap()
}

/// Readings of the finger, one after the other.
struct Bench {
    setup: Setup,
    rng: Xoshiro256PlusPlus,
    offsets: Vec<f64>,
    ramps: Vec<f64>,
    time_s: f64,
    walk_per_root_s: f64,
}

impl Bench {
    /// Offsets with a walk of so many standard deviations of the noise in a second, and a ramp of up to a tenth of that.
    fn new(walk: f64, seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let ramps = (0..5).map(|_| 0.1 * walk * NOISE * rng.random_range(-1.0..1.0)).collect();
        Self {
            setup: finger(),
            rng,
            offsets: vec![0.0; 5],
            ramps,
            time_s: 0.0,
            walk_per_root_s: walk * NOISE,
        }
    }

    fn reading(&mut self, contact: Option<Contact>, after_s: f64) -> Vec<f64> {
        self.time_s += after_s;
        for (offset, ramp) in self.offsets.iter_mut().zip(&self.ramps) {
            let step: f64 = StandardNormal.sample(&mut self.rng);
            *offset += ramp * after_s + step * self.walk_per_root_s * after_s.sqrt();
        }
        let layout = self.setup.layout();
        let sensors = CleanSensors::new(self.setup.surface().model().unwrap(), layout);
        let clean = contact.map_or(vec![0.0; 5], |contact| sensors.reading(contact));
        let read = measure(layout, &clean, &ChannelErrors::none(layout), &mut self.rng);
        read.iter().zip(&self.offsets).map(|(value, offset)| value + offset).collect()
    }

    /// Presses at 12 places, three times each; an untouched row before each.
    fn locator(&mut self) -> Locator {
        let mut rows = Vec::new();
        for i in 0..36 {
            let position = Position::along(LENGTH_M * (f64::from(i % 12) + 0.7) / 12.7);
            for force_n in [0.0, PRESSED_N] {
                let contact = (force_n > 0.0).then_some(Contact { position, force_n });
                let before = self.offsets.clone();
                let mut reading = self.reading(contact, 5.0);
                if contact.is_some() {
                    // Pressed immediately after the untouched row that tares it.
                    reading.iter_mut().zip(&self.offsets).zip(before).for_each(|((value, now), before)| {
                        *value -= now - before;
                    });
                }
                rows.push(Row {
                    position,
                    force_n: Some(force_n),
                    nuisances: Vec::new(),
                    time_s: Some(self.time_s),
                    reading,
                });
            }
        }
        let recording = crate::recording::Recording::new(self.setup.layout(), "finger", rows);
        Influence::default().fit(&self.setup, &recording).unwrap().into_locator()
    }
}

/// A touch slides to and fro between 45 and 100 mm for four seconds, after eight of rest.
fn contact_at(time_s: f64) -> Option<Contact> {
    let phase = time_s % 12.0;
    let x_m = 0.0725 + 0.0275 * (std::f64::consts::TAU * (phase - 8.0) / 4.0).sin();
    (phase >= 8.0).then_some(Contact { position: Position::along(x_m), force_n: 3.0 })
}

#[test]
fn a_drifting_finger_is_touched_only_when_something_touches() {
    for (walk, seed) in [(0.2, 1), (1.0, 2), (4.0, 3)] {
        let mut bench = Bench::new(walk, seed);
        let locator = bench.locator();
        assert!(locator.untouched_drift.is_some());
        let config = TrackerConfig::default();
        let likelihood = locator.tracking(&config).unwrap().likelihood();
        let (_, greatest_n) = likelihood.force_range().unwrap().ends_n();
        let mut tracker = SmoothTracker::new(likelihood, config);
        // The baseline is that of the calibration's end: readings are tared by one of its last rows.
        let tare = bench.offsets.clone();
        let (start_s, mut truths) = (bench.time_s, Vec::new());
        for _ in 0..2400 {
            let contact = contact_at(bench.time_s - start_s);
            let mut reading = bench.reading(contact, EVERY_S);
            let offsets = locator.method.offsets().unwrap();
            reading
                .iter_mut()
                .zip(tare.iter().zip(&offsets))
                .for_each(|(value, (tare, own))| *value += own - tare);
            tracker.update(bench.time_s, &reading).unwrap();
            truths.push(contact.into_iter().collect::<Vec<Contact>>());
        }
        let smoothed = tracker.smoothed(Watch::NONE).unwrap();
        for tracks in [tracker.filtered(), &smoothed] {
            let (mut rest, mut invented) = (0, 0);
            for (track, truth) in tracks.iter().zip(&truths) {
                rest += usize::from(truth.is_empty());
                invented += usize::from(truth.is_empty() && !track.contacts.is_empty());
                for contact in &track.contacts {
                    let (least_n, most_n) = contact.force_interval_95_n();
                    assert!((0.0..=greatest_n).contains(&contact.force_n), "{contact:?}");
                    assert!(
                        0.0 <= least_n && least_n <= most_n && most_n <= greatest_n * (1.0 + 1e-9),
                        "{contact:?}"
                    );
                }
            }
            assert!(invented * 100 <= rest, "walk {walk}: {invented} of {rest}");
        }
        let errors = TrackErrors::new(&smoothed, &truths, Extent::line(LENGTH_M).unwrap()).unwrap();
        assert!(errors.tracked * 100 >= errors.readings * 99, "walk {walk}: {errors:?}");
        // A drift during a touch looks like a motion, and a smoother cannot subtract it.
        let least_ratio = if walk < 0.5 { 2.0 } else { 1.2 };
        eprintln!("walk {walk}: {errors:?}");
        assert!(errors.ratio() > least_ratio, "walk {walk}: {errors:?}");
        assert!(errors.track_covered > 0.85, "walk {walk}: {errors:?}");
    }
}

#[test]
fn without_drift_in_the_state_a_drifting_finger_seems_touched() {
    let mut bench = Bench::new(4.0, 3);
    let blind = Locator { untouched_drift: None, untouched_scatter: None, ..bench.locator() };
    let config = TrackerConfig::default();
    let mut tracker = Tracker::new(blind.tracking(&config).unwrap().likelihood(), config);
    let touched = (0..1000).filter(|_| {
        let reading = bench.reading(None, EVERY_S);
        !tracker.update(bench.time_s, &reading).unwrap().contacts.is_empty()
    });
    assert!(touched.count() > 500);
}
