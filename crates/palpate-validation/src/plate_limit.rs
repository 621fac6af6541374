use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::statistics::{Ratio, Share};
use crate::table::{Column, Figure, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::arrangement::cells;
use palpate::estimators::influence::InfluenceSource;
use palpate::estimators::simulate::CleanSensors;
use palpate::mechanics::limit::Force;
use palpate::mechanics::sensing::{ChannelErrors, measure};
use palpate::prelude::{Contact, Extent, FitTask, Influence, Locate, Position, Rig, Setup, mm};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

pub const EXPERIMENT: Experiment = Experiment {
    name: "plate-limit",
    title: "Errors on a plate and the Cramér–Rao bound",
    method: "The plate of `examples/plate.toml` is calibrated with five presses of 5 N at each of 36 places, and touched with 5 N in the middles of equal cells of the inner 90 % of its area. \
             Ratios are the mean error over the mean of the bound's mean errors, and ellipses are the 95 % ellipses of the covariance.",
    seed: 0,
    run,
};

const RIG: &str = include_str!("../../../examples/plate.toml");
const FORCE_N: f64 = 5.0;
const SOURCES: [(InfluenceSource, &str); 3] = [
    (InfluenceSource::Corrected, "mechanics, corrected"),
    (InfluenceSource::Mechanics, "mechanics"),
    (InfluenceSource::Recording, "recording"),
];
/// Of the bound's standard deviation, in mm.
const RANGES: [(f64, f64, &str); 6] = [
    (0.0, 3.0, "below 3 mm"),
    (3.0, 10.0, "3–10 mm"),
    (10.0, 15.0, "10–15 mm"),
    (15.0, f64::INFINITY, "above 15 mm"),
    (0.0, f64::INFINITY, "all"),
    (0.0, 10.0, "below 10 mm"),
];

#[derive(Clone, Copy)]
struct Case {
    source: (InfluenceSource, &'static str),
    force: Force,
}

#[derive(Clone, Copy)]
struct Repetitions {
    calibrations: u64,
    side: usize,
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let repetitions =
        size.pick(Repetitions { calibrations: 2, side: 28 }, Repetitions { calibrations: 1, side: 14 });
    let cases: Vec<Case> = SOURCES
        .into_iter()
        .flat_map(|source| [Force::Known, Force::Unknown].map(|force| Case { source, force }))
        .collect();
    let rows = in_parallel(&cases, |case| case.rows(repetitions), |case| case.source.1.to_owned(), progress);
    let columns = vec![
        Column::new("mean error over the bound's", "", Goal::Smaller),
        Column::percent("in their ellipses", Goal::COVERAGE),
        Column::new("touches", "", Goal::None),
    ];
    let labels = ["influence functions from", "force", "bound at the touch"];
    let mut table = Table::new("Touches by their bound.", &labels, columns);
    table.rows = rows.into_iter().collect::<Result<Vec<_>>>()?.concat();
    Ok(vec![table])
}

/// Middles of `side` × `side` cells of a centred rectangle with sides √0.9 times as long.
fn inner_positions(extent: Extent, side: usize) -> Result<Vec<Position>> {
    let share = 0.9f64.sqrt();
    let width_m = extent.width_m().context("the plate has a width")?;
    let inner = Extent::plane(share * extent.length_m(), share * width_m)?;
    let margin = |size_m: f64| 0.5 * (1.0 - share) * size_m;
    let moved =
        |at: Position| Position { x_m: at.x_m + margin(extent.length_m()), y_m: at.y_m + margin(width_m) };
    Ok(cells(inner, side, side).into_iter().map(moved).collect())
}

impl Case {
    fn rows(self, repetitions: Repetitions) -> Result<Vec<Row>> {
        let rig = Rig::from_toml(RIG).context("examples/plate.toml")?;
        let training = rig.training()?.clone().with_force(FORCE_N);
        let is_known = self.force == Force::Known;
        let setup: Setup = rig.setup.with_force(is_known.then_some(FORCE_N))?;
        let clean =
            CleanSensors::new(setup.surface().model().context("the plate has a model")?, setup.layout());
        let (limit, errors) = (setup.cramer_rao_bound()?, ChannelErrors::none(setup.layout()));
        let positions = inner_positions(setup.surface().extent(), repetitions.side)?;
        let mut sums: [(Ratio, Share, u32); RANGES.len()] = Default::default();
        for seed in EXPERIMENT.seed..EXPERIMENT.seed + repetitions.calibrations {
            let recording = setup.simulate(&training, seed)?;
            let influence = Influence { source: self.source.0, ..Influence::default() };
            let locator = influence.fit_plane(FitTask::new(&setup, &recording))?;
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
            for position in &positions {
                let contact = Contact { position: *position, force_n: FORCE_N };
                let reading = measure(setup.layout(), &clean.reading(contact), &errors, &mut rng);
                let Some(bound) = limit.bound_at(contact, self.force) else { continue };
                let found = locator.locate(&reading).contact;
                let (dx, dy) = (found.position.x_m - position.x_m, found.position.y_m - position.y_m);
                for ((ratio, covered, touches), (from, to, _)) in sums.iter_mut().zip(RANGES) {
                    if !(mm(from)..mm(to)).contains(&bound.sd_position_m) {
                        continue;
                    }
                    *touches += 1;
                    ratio.add(seed, dx.hypot(dy), bound.mean_error_m());
                    if let Some(uncertainty) = found.uncertainty {
                        let [xx, xy, _, yy, ..] = uncertainty.covariance;
                        let square = dx * dx * yy - 2.0 * dx * dy * xy + dy * dy * xx;
                        let is_covered = square <= palpate::numerics::ELLIPSE_95 * (xx * yy - xy * xy);
                        covered.add(seed, is_covered);
                    }
                }
            }
        }
        let force = if is_known { "known" } else { "unknown" };
        let row = |((ratio, covered, touches), (.., range)): (&(Ratio, Share, u32), (_, _, &str))| {
            let count = Figure::exact(f64::from(*touches));
            Row::new(&[self.source.1, force, range], vec![ratio.figure(), covered.percent(), Some(count)])
        };
        Ok(sums.iter().zip(RANGES).map(row).collect())
    }
}
