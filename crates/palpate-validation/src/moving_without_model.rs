use crate::experiment::{Experiment, Progress, Size};
use crate::moving_contacts::{BEAM, MOVING, PLATE};
use crate::parallel::in_parallel;
use crate::statistics::{Ratio, Sample};
use crate::table::{Column, Figure, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::estimator::Track;
use palpate::estimators::recording::Row as Press;
use palpate::estimators::simulate::{CleanSensors, MovingContacts, simulate_moving};
use palpate::estimators::track_errors::{TrackErrors, track_recording};
use palpate::mechanics::sensing::{ChannelErrors, measure};
use palpate::prelude::{Contact, Fit, Position, Recording, Rig, Setup, TrackerConfig};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

pub const EXPERIMENT: Experiment = Experiment {
    name: "moving-contacts-without-model",
    title: "Tracks with and without a model",
    method: "The beam of `examples/moving-load.toml` is pressed at 40 even places and the plate of `examples/moving-plate.toml` at 12 × 12, each with one of 1 to 6 N; one influence locator of these presses has \
             the model, the other has raw channels. Both track the same contact, which moves to and fro at 0.5 m/s in static equilibrium, from the same 1,000 readings per second.",
    seed: 0,
    run,
};

/// Force range of the presses.
const FORCES_N: std::ops::Range<f64> = 1.0..6.0;
const SPEED_M_PER_S: f64 = 0.5;

#[derive(Clone, Copy, Debug)]
struct Bench {
    name: &'static str,
    toml: &'static str,
    /// Pressed cells along and across.
    cells: [usize; 2],
    repeats: usize,
    is_known: bool,
    /// The fit of a plate takes most of the time.
    calibrations: u64,
}

const LINE: Bench =
    Bench { name: "beam", toml: BEAM, cells: [40, 1], repeats: 1, is_known: true, calibrations: 4 };
const PLANE: Bench = Bench { name: "plate", toml: PLATE, cells: [12, 12], calibrations: 2, ..LINE };

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let surfaces = &[LINE, PLANE][..size.pick(2, 1)];
    let benches: Vec<Bench> = surfaces
        .iter()
        .flat_map(|bench| [1, 50].map(|repeats| Bench { repeats, ..*bench }))
        .flat_map(|bench| [true, false].map(|is_known| Bench { is_known, ..bench }))
        .collect();
    let seeds = |bench: &Bench| EXPERIMENT.seed..EXPERIMENT.seed + size.pick(bench.calibrations, 2);
    let cases: Vec<(Bench, u64)> =
        benches.iter().flat_map(|bench| seeds(bench).map(move |seed| (*bench, seed))).collect();
    let name = |(bench, seed): &(Bench, u64)| format!("{}, calibration {seed}", bench.label());
    let mut errors = in_parallel(&cases, |(bench, seed)| bench.errors(*seed), name, progress).into_iter();
    let labels = ["surface", "presses of each place", "force"];
    let title = "Eight sensors on the beam, nine under the plate, of 20 µm noise; a contact of 3 N on the beam and of 5 N on the plate.";
    let mut table = Table::new(title, &labels, Tally::columns());
    for bench in &benches {
        let mut tally = Tally::default();
        for (seed, errors) in seeds(bench).zip(errors.by_ref()) {
            tally.add(seed, errors?);
        }
        let labels = [bench.name, &bench.repeats.to_string(), bench.force()];
        table.rows.push(Row::new(&labels, tally.figures()));
    }
    Ok(vec![table])
}

/// Filter and smoother.
type Errors = [TrackErrors; 2];

impl Bench {
    fn label(&self) -> String {
        format!("{} × {}, {} force", self.name, self.repeats, self.force())
    }

    const fn force(&self) -> &'static str {
        if self.is_known { "known" } else { "unknown" }
    }

    /// With and without the model.
    fn errors(&self, seed: u64) -> Result<[Errors; 2]> {
        let rig = Rig::from_toml(self.toml).with_context(|| format!("the rig of the {}", self.name))?;
        let force_n = rig.setup.force_n().filter(|_| self.is_known);
        let presses = self.presses(&rig.setup, seed)?;
        let setups = [rig.setup.clone(), raw_setup(&rig.setup)?].map(|setup| setup.with_force(force_n));
        let mut locators = Vec::new();
        for setup in setups {
            let setup = setup?;
            let recording = Recording::new(setup.layout(), "presses", presses.clone());
            locators.push(rig.estimator.fit(&setup, &recording)?);
        }
        let extent = rig.setup.surface().extent();
        let moving = rig.motion.context("the rig has no motion")?.at_speed(SPEED_M_PER_S)?;
        let moving = MovingContacts { beam: None, ..moving };
        let recording = simulate_moving(&rig.setup, &moving, MOVING + seed)?;
        let truths = recording.truths();
        let errors_of = |tracks: &[Track]| {
            TrackErrors::new(tracks, &truths, extent).context("the contact is not tracked")
        };
        let of_locator = |i: usize| -> Result<Errors> {
            let tracks = track_recording(&locators[i], TrackerConfig::default(), &recording)?;
            Ok([errors_of(&tracks.filtered)?, errors_of(&tracks.smoothed)?])
        };
        Ok([of_locator(0)?, of_locator(1)?])
    }

    /// Presses at the middle of each cell by one force.
    fn presses(&self, setup: &Setup, seed: u64) -> Result<Vec<Press>> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (extent, layout) = (setup.surface().extent(), setup.layout());
        let sensors = CleanSensors::new(setup.surface().model().context("the rig has no model")?, layout);
        let [columns, rows] = self.cells;
        let middle = |i: usize, count: usize, side_m: f64| (i as f64 + 0.5) / count as f64 * side_m;
        let place = |i: usize| {
            let x_m = middle(i % columns, columns, extent.length_m());
            let y_m = middle(i / columns, rows, extent.width_m().unwrap_or(0.0));
            let (position, force_n) = (Position { x_m, y_m }, rng.random_range(FORCES_N));
            let clean = sensors.reading(Contact { position, force_n });
            let mut press = |_| {
                let reading = measure(layout, &clean, &ChannelErrors::none(layout), &mut rng);
                Press { position, force_n: Some(force_n), nuisances: Vec::new(), time_s: None, reading }
            };
            (0..self.repeats).map(&mut press).collect::<Vec<Press>>()
        };
        Ok((0..columns * rows).flat_map(place).collect())
    }
}

/// The surface and channels of a setup without its model.
fn raw_setup(setup: &Setup) -> Result<Setup> {
    let (extent, names) = (setup.surface().extent(), setup.layout().names());
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    Ok(match extent.width_m() {
        None => Setup::measured(extent.length_m(), &names)?,
        Some(width_m) => Setup::measured_plane(extent.length_m(), width_m, &names)?,
    })
}

/// Each recording is one value: neighbouring readings share their errors.
#[derive(Clone, Debug, Default)]
struct Tally {
    single: Pair,
    filter: Pair,
    smoother: Pair,
    covered: [Sample; 2],
}

/// Errors in mm with and without the model.
#[derive(Clone, Debug, Default)]
struct Pair {
    with: Sample,
    without: Sample,
    ratio: Ratio,
}

impl Tally {
    fn add(&mut self, calibration: u64, [with, without]: [Errors; 2]) {
        let [[filter, smoother], [raw_filter, raw_smoother]] = [with, without];
        self.single.add(calibration, filter.single_m, raw_filter.single_m);
        self.filter.add(calibration, filter.track_m, raw_filter.track_m);
        self.smoother.add(calibration, smoother.track_m, raw_smoother.track_m);
        for (covered, errors) in self.covered.iter_mut().zip(without) {
            covered.add(calibration, 100.0 * errors.track_covered);
        }
    }

    fn columns() -> Vec<Column> {
        let pair = |what: &str| {
            [
                Column { decimals: 3, ..Column::mm(&format!("{what} error with a model"), Goal::None) },
                Column { decimals: 3, ..Column::mm("without", Goal::Smaller) },
                Column::new("ratio", "×", Goal::Smaller),
            ]
        };
        let covered = ["filter covered without a model", "smoother covered without a model"]
            .map(|name| Column::percent(name, Goal::COVERAGE));
        [pair("single").to_vec(), pair("filter").to_vec(), pair("smoother").to_vec(), covered.to_vec()]
            .concat()
    }

    fn figures(&self) -> Vec<Option<Figure>> {
        let pairs = [&self.single, &self.filter, &self.smoother];
        let covered = self.covered.iter().map(Sample::mean);
        pairs.into_iter().flat_map(Pair::figures).chain(covered).collect()
    }
}

impl Pair {
    fn add(&mut self, calibration: u64, with_m: f64, without_m: f64) {
        self.with.add(calibration, 1e3 * with_m);
        self.without.add(calibration, 1e3 * without_m);
        self.ratio.add(calibration, without_m, with_m);
    }

    fn figures(&self) -> [Option<Figure>; 3] {
        [self.with.mean(), self.without.mean(), self.ratio.figure()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filter_without_a_model_is_nearer_than_single_readings() {
        let bench = Bench { repeats: 50, ..LINE };
        let [[with, _], [without, _]] = bench.errors(0).unwrap();
        assert!(2.0 * without.track_m < without.single_m, "{without:?}");
        assert!(without.track_m < 1.2 * with.track_m, "{with:?} {without:?}");
    }
}
