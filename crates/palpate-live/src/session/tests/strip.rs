//! A clamped strip over six raw gauges with hysteresis, creep and drift, pressed by hand.

use palpate_core::Position;
use palpate_estimators::recording::{Recording, Row};
use palpate_estimators::setup::Setup;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::{
    BeamSection, BeamSupport, BeamSupportKind, SupportedBeam, SupportedBeamSpec, Surface,
};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::rc::Rc;

/// Counts per newton as a function of the place along the strip, in metres.
type Influence = Box<dyn Fn(f64) -> f64>;

pub const STRIP_M: f64 = 0.3;
const GAUGES: usize = 6;
const GAUGE_NAMES: [&str; GAUGES] = ["g1", "g2", "g3", "g4", "g5", "g6"];
/// Largest reading of a press of [`PRESS_N`], in counts.
const FULL_SCALE: f64 = 3455.0;
pub const PRESS_N: f64 = 2.0;
/// Time constant of the creep, in seconds.
const CREEP_S: f64 = 3.0;

/// Imperfections of the strip.
#[derive(Clone, Copy, Debug, Default)]
pub struct Imperfections {
    /// Half width of the play of each channel, as a share of its largest reading.
    pub hysteresis: f64,
    /// Share of a channel's reading that comes and goes with [`CREEP_S`].
    pub creep: f64,
    /// Counts a second.
    pub drift: f64,
}

/// The strip at an instant.
pub struct Strip {
    imperfections: Imperfections,
    pub rate_hz: f64,
    influences: Vec<Influence>,
    offsets: Vec<f64>,
    largest: Vec<f64>,
    play: Vec<f64>,
    crept: Vec<f64>,
    pub frames: u64,
    pub rng: Xoshiro256PlusPlus,
}

impl Strip {
    pub fn new(imperfections: Imperfections, seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let clamp = |at_m: f64| BeamSupport { at_m, kind: BeamSupportKind::Clamped };
        let strip = SupportedBeam::new(SupportedBeamSpec {
            length_m: STRIP_M,
            youngs_modulus_pa: 70e9,
            supports: vec![clamp(0.0), clamp(STRIP_M)],
            sections: vec![BeamSection { to_m: STRIP_M, width_m: 0.03, thickness_m: 1e-3 }],
        })
        .unwrap();
        let gauges: Vec<f64> = (0..GAUGES).map(|i| STRIP_M / GAUGES as f64 * (i as f64 + 0.5)).collect();
        let strip = Rc::new(strip);
        let functions: Vec<Influence> = gauges
            .into_iter()
            .map(|gauge_m| -> Influence {
                let strip = Rc::clone(&strip);
                Box::new(move |at_m| {
                    let gauge = Position::along(gauge_m);
                    strip.influence_function(SensorKind::Strain, gauge).at(Position::along(at_m))
                })
            })
            .collect();
        let gains: Vec<f64> = (0..GAUGES).map(|_| rng.random_range(0.7..1.3)).collect();
        let grid = || (0..=300).map(|i| STRIP_M * f64::from(i) / 300.0);
        let largest_of = |c: usize| grid().map(|at| gains[c] * functions[c](at).abs()).fold(0.0, f64::max);
        let scale = FULL_SCALE / (PRESS_N * (0..GAUGES).map(largest_of).fold(0.0, f64::max));
        let largest = (0..GAUGES).map(|c| PRESS_N * scale * largest_of(c)).collect();
        let influences = functions
            .into_iter()
            .zip(gains)
            .map(|(function, gain)| -> Influence { Box::new(move |at_m| scale * gain * function(at_m)) })
            .collect();
        Self {
            imperfections,
            rate_hz: 100.0,
            influences,
            offsets: (0..GAUGES).map(|_| rng.random_range(-20_000.0..20_000.0_f64).round()).collect(),
            largest,
            play: vec![0.0; GAUGES],
            crept: vec![0.0; GAUGES],
            frames: 0,
            rng,
        }
    }

    pub fn setup() -> Setup {
        Setup::measured(STRIP_M, &GAUGE_NAMES).unwrap()
    }

    pub fn time_s(&self) -> f64 {
        self.frames as f64 / self.rate_hz
    }

    /// The next reading, in whole counts, under a force at a place.
    pub fn read(&mut self, at_m: f64, force_n: f64) -> Vec<f64> {
        let Imperfections { hysteresis, creep, drift } = self.imperfections;
        self.frames += 1;
        let drift = drift * self.time_s();
        let share = 1.0 - (-1.0 / (CREEP_S * self.rate_hz)).exp();
        (0..GAUGES)
            .map(|c| {
                let elastic = force_n * (self.influences[c])(at_m);
                let half = hysteresis * self.largest[c];
                self.play[c] = self.play[c].clamp(elastic - half, elastic + half);
                self.crept[c] += share * (creep * elastic - self.crept[c]);
                let noise: f64 = StandardNormal.sample(&mut self.rng);
                // Each gauge drifts its own way.
                let drift = drift * if c % 2 == 0 { 1.0 } else { -0.6 };
                (self.offsets[c] + self.play[c] + self.crept[c] + drift + noise).round()
            })
            .collect()
    }

    /// A press by hand: forces that rise within `ramp_s`, stay for `hold_s` and fall within `ramp_s`.
    pub fn press(&mut self, at_m: f64, force_n: f64, (ramp_s, hold_s): (f64, f64)) -> Vec<Vec<f64>> {
        let ramp = (ramp_s * self.rate_hz) as usize;
        let hold = (hold_s * self.rate_hz) as usize;
        let share = |i: usize| (i + 1) as f64 / ramp as f64;
        let forces: Vec<f64> = (0..ramp)
            .map(share)
            .chain(std::iter::repeat_n(1.0, hold))
            .chain((0..ramp).rev().map(|i| share(i) - share(0)))
            .collect();
        forces.into_iter().map(|share| self.read(at_m, share * force_n)).collect()
    }

    pub fn rest(&mut self, seconds: f64) -> Vec<Vec<f64>> {
        (0..(seconds * self.rate_hz) as usize).map(|_| self.read(0.0, 0.0)).collect()
    }

    /// A calibration by hand: presses of weights in turn at places evenly along the strip, an untouched row before the first and after each.
    pub fn calibrate(&mut self, places: usize, weights_n: &[f64]) -> Recording {
        let mut rows = Vec::new();
        let row = |strip: &Self, at_m: f64, force_n: f64, reading: Vec<f64>| Row {
            position: Position::along(at_m),
            force_n: Some(force_n),
            nuisances: Vec::new(),
            time_s: Some(strip.time_s()),
            reading,
        };
        let first = self.rest(1.0).pop().unwrap();
        rows.push(row(self, 0.0, 0.0, first));
        for i in 0..places {
            let at_m = STRIP_M * (0.05 + 0.9 * i as f64 / (places - 1) as f64);
            let force_n = weights_n[i % weights_n.len()];
            let held = self.press(at_m, force_n, (0.4, 1.2));
            let pressed = held[(1.2 * self.rate_hz) as usize].clone();
            rows.push(row(self, at_m, force_n, pressed));
            let untouched = self.rest(1.5).pop().unwrap();
            rows.push(row(self, 0.0, 0.0, untouched));
        }
        Recording::new(Self::setup().layout(), "strip", rows)
    }
}
