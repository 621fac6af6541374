use crate::coverage::Coverage;
use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::table::{Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::influence::PlaneLocator;
use palpate::estimators::simulate::CleanSensors;
use palpate::mechanics::sensing::{ChannelErrors, measure};
use palpate::prelude::{Contact, FitTask, Influence, Locate, Position, Rig, Setup, Training, mm};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

pub const EXPERIMENT: Experiment = Experiment {
    name: "plate-edges",
    title: "Contacts near the edges of a plate",
    method: "The plate of `examples/plate.toml` is calibrated with five presses of 5 N at each of 36 places, and contacts of unknown force are located by each calibration. They are 60 mm or \
             more from the other edges, or as far from two edges in a corner; all but the share of detected contacts is of the detected ones.",
    seed: 15,
    run,
};

const RIG: &str = include_str!("../../../examples/plate.toml");
/// Force of presses and contacts, and side of the plate.
const PRESSES_N: f64 = 5.0;
const CONTACTS_N: [f64; 3] = [2.0, 5.0, 20.0];
const SIDE_M: f64 = 0.3;

/// In millimetres.
#[derive(Clone, Copy, Debug)]
enum Place {
    /// From the left edge.
    Edge(f64),
    /// From the left and lower edges.
    Corner(f64),
}

const PLACES: [Place; 10] = [
    Place::Edge(2.0),
    Place::Edge(5.0),
    Place::Edge(10.0),
    Place::Edge(20.0),
    Place::Edge(40.0),
    Place::Edge(150.0),
    Place::Corner(10.0),
    Place::Corner(15.0),
    Place::Corner(20.0),
    Place::Corner(40.0),
];

impl Place {
    fn name(self) -> String {
        match self {
            Self::Edge(distance_mm) => format!("{distance_mm} mm"),
            Self::Corner(distance_mm) => format!("{distance_mm} mm from both at a corner"),
        }
    }

    fn draw(self, rng: &mut Xoshiro256PlusPlus) -> Position {
        match self {
            Self::Edge(x_mm) => {
                Position { x_m: mm(x_mm), y_m: rng.random_range(mm(60.0)..SIDE_M - mm(60.0)) }
            }
            Self::Corner(distance_mm) => Position { x_m: mm(distance_mm), y_m: mm(distance_mm) },
        }
    }
}

struct Bench {
    setup: Setup,
    training: Training,
}

impl Bench {
    fn new() -> Result<Self> {
        let rig = Rig::from_toml(RIG).context("examples/plate.toml")?;
        let training = rig.training()?.clone().with_force(PRESSES_N);
        Ok(Self { setup: rig.setup.unknown_force(), training })
    }

    fn fit(&self, seed: u64) -> Result<PlaneLocator> {
        let recording = self.setup.simulate(&self.training, seed)?;
        Ok(Influence::default().fit_plane(FitTask::new(&self.setup, &recording))?)
    }
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let (calibrations, readings) = size.pick((20, 100), (4, 50));
    let bench = Bench::new()?;
    let seeds: Vec<u64> = (0..calibrations).collect();
    let fitted = in_parallel(&seeds, |seed| bench.fit(*seed), |seed| format!("calibration {seed}"), progress);
    let locators = fitted.into_iter().collect::<Result<Vec<_>>>()?;
    let mut table = Table::new(
        "Contacts at a distance from the edge.",
        &["force", "from the edge"],
        Coverage::plane_columns(),
    );
    table.rows = rows(&bench.setup, &locators, readings)?;
    Ok(vec![table])
}

fn rows(setup: &Setup, locators: &[PlaneLocator], readings: usize) -> Result<Vec<Row>> {
    let surface = setup.surface().model().context("the surface has no model")?;
    let clean = CleanSensors::new(surface, setup.layout());
    let errors = ChannelErrors::none(setup.layout());
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(EXPERIMENT.seed);
    let mut rows = Vec::new();
    for force_n in CONTACTS_N {
        for place in PLACES {
            let mut coverage = Coverage::default();
            for (calibration, locator) in (0..).zip(locators) {
                for _ in 0..readings {
                    let contact = Contact { position: place.draw(&mut rng), force_n };
                    let truth = clean.reading(contact);
                    let reading = measure(setup.layout(), &truth, &errors, &mut rng);
                    let estimate = locator.locate(&reading);
                    coverage.add(calibration, &estimate, contact, setup.surface().extent());
                }
            }
            let labels = [format!("{force_n} N"), place.name()];
            rows.push(Row::new(&labels.each_ref().map(String::as_str), coverage.plane_figures()));
        }
    }
    Ok(rows)
}
