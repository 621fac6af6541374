//! Strain bridges with offsets far above their signal, and untouched rows.

use super::*;
use crate::fit::{Fit, MethodLocator};
use crate::influence::{Influence, InfluenceLocator};
use crate::recording::Row;
use crate::simulate::CleanSensors;
use palpate_mechanics::sensing::SensorKind::Strain;
use palpate_mechanics::units::microstrain;
use rand::RngExt;

/// The paper's beam with eight strain gauges and an unknown force.
fn setup() -> Setup {
    Setup::new(crate::fixtures::beam()).sensors(Strain.evenly(8).noise(microstrain(1.0))).unwrap()
}

/// Gauges with offsets of up to `offset` microstrain.
struct Bridges {
    setup: Setup,
    offsets: Vec<f64>,
    rng: Xoshiro256PlusPlus,
}

impl Bridges {
    fn new(offset: f64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let offsets = (0..8).map(|_| 1e-6 * offset * rng.random_range(-1.0..1.0)).collect();
        Self { setup: setup(), offsets, rng }
    }

    fn reading(&mut self, x_m: f64, force_n: f64) -> Vec<f64> {
        let layout = self.setup.layout();
        let contact = Contact { position: Position::along(x_m), force_n };
        let clean = CleanSensors::new(self.setup.surface().model().unwrap(), layout).reading(contact);
        let read = measure(layout, &clean, &ChannelErrors::none(layout), &mut self.rng);
        read.iter().zip(&self.offsets).map(|(value, offset)| value + offset).collect()
    }

    fn row(&mut self, x_m: f64, force_n: f64) -> Row {
        let reading = self.reading(x_m, force_n);
        let position = Position::along(x_m);
        Row { position, force_n: Some(force_n), nuisances: Vec::new(), time_s: None, reading }
    }

    /// Three rows of 3 N at each of ten places, after `untouched` rows.
    fn recording(&mut self, untouched: usize) -> Recording {
        let presses: Vec<Row> = (0..30).map(|i| self.row(0.04 * (f64::from(i % 10) + 0.5), 3.0)).collect();
        let mut rows: Vec<Row> = (0..untouched).map(|_| self.row(0.0, 0.0)).collect();
        rows.extend(presses);
        Recording::new(self.setup.layout(), "bridges", rows)
    }

    /// Mean error in mm and coverage of contacts of 1 N to 6 N.
    fn judged(&mut self, locator: &MethodLocator<InfluenceLocator>) -> [f64; 2] {
        const TOUCHES: usize = 200;
        let (mut error_mm, mut held) = (0.0, 0);
        for _ in 0..TOUCHES {
            let (x_m, force_n) = (self.rng.random_range(0.03..0.37), self.rng.random_range(1.0..6.0));
            let contact = locator.locate(&self.reading(x_m, force_n)).unwrap().contact;
            error_mm += 1e3 * (contact.position.x_m - x_m).abs() / TOUCHES as f64;
            held +=
                usize::from(contact.uncertainty.is_some_and(|u| (u.x_95_m.0..=u.x_95_m.1).contains(&x_m)));
        }
        [error_mm, held as f64 / TOUCHES as f64]
    }
}

#[test]
fn offsets_of_bridges_are_those_of_the_untouched_rows() {
    for source in [InfluenceSource::Mechanics, InfluenceSource::Corrected, InfluenceSource::Recording] {
        let influence = Influence { source, ..Influence::default() };
        let found = [0.0, 100.0, 5000.0].map(|offset| {
            let mut bridges = Bridges::new(offset);
            let recording = bridges.recording(20);
            let locator = influence.fit(&bridges.setup, &recording).unwrap();
            bridges.judged(&locator)
        });
        let [[without_mm, _], ..] = found;
        for [error_mm, held] in found {
            assert!((error_mm / without_mm - 1.0).abs() < 1e-3, "{source:?}: {found:?}");
            // A spline through ten places bends more than its variances allow.
            let least_held = if source == InfluenceSource::Recording { 0.8 } else { 0.9 };
            assert!(held >= least_held, "{source:?}: {found:?}");
        }
    }
}

#[test]
fn hundreds_of_untouched_rows_are_all_counted() {
    let mut bridges = Bridges::new(5000.0);
    let recording = bridges.recording(300);
    let setup = bridges.setup.clone();
    let locator = Influence::default().fit_beam(FitTask::new(&setup, &recording)).unwrap();
    for (found, offset) in locator.offsets().iter().zip(&bridges.offsets) {
        // 1 microstrain over the root of 300.
        assert!((found - offset).abs() < 4.0 * 0.058e-6, "{found} {offset}");
    }
}

#[test]
fn noise_is_told_by_the_untouched_rows() {
    let mut bridges = Bridges::new(0.0);
    bridges.setup = bridges.setup.with_noise("3 ue".parse().unwrap()).unwrap();
    let recording = bridges.recording(300);
    // The rig states a third of it.
    let setup = setup();
    let locator = Influence::default().fit_beam(FitTask::new(&setup, &recording)).unwrap();
    for noise in locator.influences().into_iter().flatten().map(|channel| channel.noise_sd) {
        assert!((2.6e-6..3.3e-6).contains(&noise), "{noise}");
    }
}
