//! Coverage near the edges of the plate of `examples/plate.toml` at unknown force: a sample of the experiment
//! `plate-edges`.

use crate::fit::{FitTask, Locate};
use crate::fixtures::{CoverageTally, Example, plate};
use crate::influence::Influence;
use crate::simulate::CleanSensors;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::{ChannelErrors, ChannelModel, measure};
use palpate_mechanics::surface::plate::PlateSpec;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::PlaneLocator;

const PRESSES_N: f64 = 5.0;
const CONTACTS_N: [f64; 2] = [2.0, 20.0];
const SIDE_M: f64 = 0.3;
const CALIBRATIONS: u64 = 2;
const READINGS: usize = 100;

fn bench() -> Example {
    let noise = ChannelModel { noise_sd: 5e-6, ..ChannelModel::default() };
    let mut bench = plate(PlateSpec::DEFAULT_ELEMENTS, noise);
    bench.training = bench.training.with_force(PRESSES_N);
    bench.setup = bench.setup.unknown_force();
    bench
}

fn fit(bench: &Example, seed: u64) -> PlaneLocator {
    Influence::default().fit_plane(FitTask::new(&bench.setup, &bench.simulate(seed))).unwrap()
}

#[derive(Clone, Copy, Debug)]
enum Place {
    /// Millimetres from the left edge; at least 60 mm from the others.
    Edge(f64),
    /// Millimetres from the left and lower edge.
    Corner(f64),
}

impl Place {
    fn draw(self, rng: &mut Xoshiro256PlusPlus) -> Position {
        match self {
            Self::Edge(mm) => Position { x_m: 1e-3 * mm, y_m: rng.random_range(0.06..SIDE_M - 0.06) },
            Self::Corner(mm) => Position { x_m: 1e-3 * mm, y_m: 1e-3 * mm },
        }
    }
}

/// Force intervals may cover more than 95 %: in a corner they include nearly all forces.
fn check(row: &CoverageTally, place: Place) {
    assert!(row.outside == 0 && row.greatest_n <= 10.0 * PRESSES_N, "{place:?}: {row:?}");
    if row.detected < 100 {
        return;
    }
    assert!(100 * row.outside_model <= 2 * row.detected, "{place:?}: {row:?}");
    // Four standard deviations around the 94.3–97.0 % of the experiment's rows with full detection.
    let margin = 400.0 * (0.95 * 0.05 / row.detected as f64).sqrt();
    let [x, y, force] = [row.x_covered, row.y_covered, row.force].map(|count| row.percent(count));
    let least = 95.0 - margin;
    assert!(x >= least && y >= least && force >= least, "{place:?}: {row:?}");
    if row.detected == row.readings {
        let most = 97.0 + 0.5 * margin;
        assert!(x <= most && y <= most, "{place:?}: {row:?}");
    }
}

#[test]
fn intervals_hold_contacts_of_unknown_force_near_edges_and_in_corners() {
    let bench = bench();
    let locators: Vec<PlaneLocator> = (0..CALIBRATIONS).map(|seed| fit(&bench, seed)).collect();
    let clean = CleanSensors::new(bench.setup.surface().model().unwrap(), bench.setup.layout());
    let errors = ChannelErrors::none(bench.setup.layout());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(15);
    let places = [Place::Edge(5.0), Place::Edge(20.0), Place::Edge(150.0), Place::Corner(15.0)];
    for force_n in CONTACTS_N {
        for place in places {
            let mut row = CoverageTally::default();
            for locator in &locators {
                for _ in 0..READINGS {
                    let contact = Contact { position: place.draw(&mut rng), force_n };
                    let truth = clean.reading(contact);
                    let reading = measure(bench.setup.layout(), &truth, &errors, &mut rng);
                    row.add(&locator.locate(&reading), contact);
                }
            }
            check(&row, place);
        }
    }
}
