use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::statistics::{Sample, Share};
use crate::surfaces::{paper_beam, square_plate};
use crate::table::{Column, Figure, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::estimator::contenders;
use palpate::estimators::influence::Structure;
use palpate::estimators::simulate::CleanSensors;
use palpate::mechanics::sensing::{Layout, SensorKind};
use palpate::numerics::{NORMAL_99, normal_cdf};
use palpate::prelude::{
    Contact, Estimate, Estimator, Extent, Fit, Influence, Locator, Network, Position, Recording, Setup,
    Status, Training, newtons,
};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

pub const EXPERIMENT: Experiment = Experiment {
    name: "statuses",
    title: "Statuses of every estimator",
    method: "A beam with eight deflection sensors, the same beam as raw channels and a plate with nine sensors, all with 5 µm noise, are calibrated with 3 N (raw channels with 1.5, 3 and 6 N in \
             turn), and located contacts lie at least 5 % of a side from the edges. An estimate is rejected unless it is `located` or `ambiguous`, and covers a contact with its 95 % interval of x; \
             two contacts of one force are 50 mm apart, and their centre stands for the contact.",
    seed: 0,
    run,
};

const PRESS_N: f64 = 3.0;
const NOISE_M: f64 = 5e-6;
/// Limit; the status depends on the influence functions.
const NETWORK_EPOCHS: u32 = 4000;
/// Between two contacts.
const DISTANCE_M: f64 = 0.05;

/// Calibrations, readings per figure, and pairs for the most powerful test.
#[derive(Clone, Copy, Debug)]
struct Repetitions {
    calibrations: u64,
    readings: usize,
    pairs: usize,
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let repetitions = size.pick(
        Repetitions { calibrations: 2, readings: 1000, pairs: 2000 },
        Repetitions { calibrations: 2, readings: 100, pairs: 200 },
    );
    let benches = benches()?;
    let benches: Vec<&Bench> = benches.iter().take(size.pick(benches.len(), 2)).collect();
    let mut network = Network::default();
    network.training.max_epochs = NETWORK_EPOCHS;
    let network = Estimator::Network(network);
    let mut cases: Vec<(&Bench, Estimator)> = Vec::new();
    for bench in &benches {
        let rows = bench.presses(EXPERIMENT.seed)?.rows.len();
        let estimators = contenders(&bench.setup, &network, rows);
        let is_tried = |estimator: &Estimator| is_fast(estimator) || size == Size::Full;
        let estimators = estimators.into_iter().filter(is_linear).filter(is_tried);
        cases.extend(estimators.map(|estimator| (*bench, estimator)));
    }
    let name = |(bench, estimator): &(&Bench, Estimator)| format!("{}, {}", bench.name(), estimator.name());
    let rows = in_parallel(&cases, |(bench, estimator)| bench.row(estimator, repetitions), name, progress);
    let mut tables = [true, false].map(|is_known| {
        let force = if is_known { "a known" } else { "an unknown" };
        let title = format!("Contacts of {force} force; `network` has at most {NETWORK_EPOCHS} epochs.");
        let columns = figures(is_known).map(|figure| Column::percent(figure.name, figure.goal));
        Table::new(&title, &["surface", "estimator"], columns.into())
    });
    for ((bench, _), row) in cases.iter().zip(rows) {
        tables[usize::from(!bench.is_known())].rows.push(row?);
    }
    let [known, unknown] = tables;
    let title = "Two contacts, and the most powerful test that rejects one contact in 0.5 % of readings.";
    let columns = vec![Column::percent("two contacts rejected", Goal::None)];
    let mut powers = Table::new(title, &["surface", "force"], columns);
    // Raw channels under the beam have the readings of the beam.
    for bench in benches.iter().filter(|bench| bench.setup.surface().model().is_some()) {
        let force = if bench.is_known() { "known" } else { "unknown" };
        powers.rows.push(Row::new(&[bench.surface, force], vec![bench.greatest_power(repetitions.pairs)?]));
    }
    Ok(vec![known, unknown, powers])
}

/// False if readings are not proportional to the force.
fn is_linear(estimator: &Estimator) -> bool {
    match estimator {
        Estimator::Influence(Influence { structure, .. }) => {
            matches!(structure, Structure::Auto | Structure::ForceLinear)
        }
        _ => true,
    }
}

/// True if calibrated within a second.
fn is_fast(estimator: &Estimator) -> bool {
    matches!(
        estimator,
        Estimator::Influence(_)
            | Estimator::ClosedForm(_)
            | Estimator::Neighbours(_)
            | Estimator::Centroid(_)
    )
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Readings {
    Noise,
    /// 1.5, 3 and 6 N in turn if the force is unknown.
    Contacts,
    /// Two contacts of one force.
    Pairs,
    /// 3 N, and a channel that reads 0.
    StuckChannel,
    /// 3 N, and channels in random order.
    ShuffledChannels,
    /// Random values up to 10⁻², 1, 10⁹ and 10³⁰⁰ m in turn.
    AbsurdValues,
    /// Contact of a multiple of 3 N.
    Multiple(f64),
}

const FIGURES: usize = 11;

struct EstimateShare {
    name: &'static str,
    readings: Readings,
    has_property: fn(&Estimate, f64) -> bool,
    goal: Goal,
}

/// Figures by knowledge of the force.
fn figures(is_known: bool) -> [EstimateShare; FIGURES] {
    let rejected: fn(&Estimate, f64) -> bool = |estimate, _| is_rejected(estimate);
    let either: fn(&Estimate, f64) -> bool = |estimate, x_m| is_rejected(estimate) || covers(estimate, x_m);
    let figure = |name, readings, has_property, goal| EstimateShare { name, readings, has_property, goal };
    let multiple = |known, unknown, share| {
        let readings = Readings::Multiple(share);
        match is_known {
            true => figure(known, readings, either, Goal::Larger),
            false => figure(unknown, readings, covers, Goal::COVERAGE),
        }
    };
    [
        figure(
            "noise: `no_contact`",
            Readings::Noise,
            |estimate, _| is(estimate, Status::NoContact),
            Goal::Larger,
        ),
        figure("contact: accepted", Readings::Contacts, |estimate, _| !is_rejected(estimate), Goal::Larger),
        figure(
            "contact: `outside_model`",
            Readings::Contacts,
            |estimate, _| is(estimate, Status::OutsideModel),
            Goal::Smaller,
        ),
        figure("two contacts: rejected", Readings::Pairs, rejected, Goal::Larger),
        figure("two contacts: rejected or covered", Readings::Pairs, either, Goal::Larger),
        figure("stuck channel: rejected or covered", Readings::StuckChannel, either, Goal::Larger),
        figure("shuffled channels: rejected or covered", Readings::ShuffledChannels, either, Goal::Larger),
        figure("absurd values: rejected", Readings::AbsurdValues, rejected, Goal::Larger),
        figure("3 N: covered", Readings::Multiple(1.0), covers, Goal::COVERAGE),
        multiple("1.5 N: rejected or covered", "1.5 N: covered", 0.5),
        multiple("6 N: rejected or covered", "6 N: covered", 2.0),
    ]
}

fn is(estimate: &Estimate, status: Status) -> bool {
    estimate.status == status
}

fn is_rejected(estimate: &Estimate) -> bool {
    !matches!(estimate.status, Status::Located | Status::Ambiguous)
}

fn covers(estimate: &Estimate, x_m: f64) -> bool {
    let interval = estimate.contact.uncertainty.map(|uncertainty| uncertainty.x_95_m);
    interval.is_some_and(|(low, high)| low <= x_m && x_m <= high)
}

struct Bench {
    surface: &'static str,
    /// With model and sensors.
    physics: Setup,
    /// Of the locator.
    setup: Setup,
    training: Training,
}

fn benches() -> Result<[Bench; 5]> {
    let (beam, plate) = (paper_beam(NOISE_M)?, square_plate(NOISE_M)?);
    let extent = beam.surface().extent();
    let raw = Layout::even(SensorKind::Raw, beam.layout().len(), extent.length_m());
    let raw = Setup::new(extent).with_layout(raw)?;
    let known = |setup: &Setup| setup.clone().known_force(newtons(PRESS_N));
    let bench = |surface, physics: &Setup, setup: Setup| {
        let is_line = surface != "plate";
        let training =
            if is_line { Training::even(20).repeated(10) } else { Training::grid(10, 10).repeated(3) };
        let training = training.with_force(newtons(PRESS_N));
        Bench { surface, physics: physics.clone(), setup, training }
    };
    Ok([
        bench("beam", &beam, known(&beam)?),
        bench("beam", &beam, beam.clone()),
        bench("raw channels", &beam, raw),
        bench("plate", &plate, known(&plate)?),
        bench("plate", &plate, plate.clone()),
    ])
}

/// Reading, and x of its contact in metres, or 0.
type Reading = (Vec<f64>, f64);

impl Bench {
    fn is_known(&self) -> bool {
        self.setup.force_n().is_some()
    }

    fn name(&self) -> String {
        format!("{}, force {}", self.surface, if self.is_known() { "known" } else { "unknown" })
    }

    fn clean_sensors(&self) -> Result<CleanSensors<'_>> {
        let surface = self.physics.surface().model().context("the surface has a model")?;
        Ok(CleanSensors::new(surface, self.physics.layout()))
    }

    fn forces_n(&self) -> [f64; 3] {
        let shares = if self.is_known() { [1.0; 3] } else { [0.5, 1.0, 2.0] };
        shares.map(|share| share * PRESS_N)
    }

    fn presses(&self, seed: u64) -> Result<Recording> {
        let mut presses = self.physics.simulate(&self.training, seed)?;
        if self.setup.surface().model().is_none() {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(100 + seed);
            let sensors = self.clean_sensors()?;
            for (row, force_n) in presses.rows.iter_mut().zip(self.forces_n().into_iter().cycle()) {
                row.force_n = Some(force_n);
                row.reading = noisy(sensors.reading(Contact { position: row.position, force_n }), &mut rng);
            }
        }
        Ok(Recording::new(self.setup.layout(), "statuses", presses.rows))
    }

    fn row(&self, estimator: &Estimator, repetitions: Repetitions) -> Result<Row> {
        let figures = figures(self.is_known());
        let mut shares: [Share; FIGURES] = Default::default();
        for seed in EXPERIMENT.seed..EXPERIMENT.seed + repetitions.calibrations {
            let locator = estimator.fit(&self.setup, &self.presses(seed)?)?;
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
            let mut counted: Vec<Readings> = Vec::new();
            for EstimateShare { readings, .. } in &figures {
                if counted.contains(readings) {
                    continue;
                }
                counted.push(*readings);
                let located = self.located(&locator, *readings, repetitions.readings, &mut rng)?;
                let counting =
                    figures.iter().zip(&mut shares).filter(|(figure, _)| figure.readings == *readings);
                for (figure, share) in counting {
                    located
                        .iter()
                        .for_each(|(estimate, x_m)| share.add(seed, (figure.has_property)(estimate, *x_m)));
                }
            }
        }
        let labels = [self.surface, estimator.name()];
        Ok(Row::new(&labels, shares.iter().map(Share::percent).collect()))
    }

    /// Estimates, with x of their contacts.
    fn located(
        &self,
        locator: &Locator,
        readings: Readings,
        count: usize,
        rng: &mut Xoshiro256PlusPlus,
    ) -> Result<Vec<(Estimate, f64)>> {
        let sensors = self.clean_sensors()?;
        let located = (0..count).map(|i| {
            let (reading, x_m) = self.reading(&sensors, readings, i, rng);
            Ok((locator.locate(&reading)?, x_m))
        });
        located.collect()
    }

    fn reading(
        &self,
        sensors: &CleanSensors,
        readings: Readings,
        number: usize,
        rng: &mut Xoshiro256PlusPlus,
    ) -> Reading {
        let (extent, channels) = (self.physics.surface().extent(), self.physics.layout().len());
        let force_n = self.forces_n()[number % 3];
        let contact = |force_n: f64, rng: &mut Xoshiro256PlusPlus| {
            let position = anywhere(extent, rng);
            (noisy(sensors.reading(Contact { position, force_n }), rng), position.x_m)
        };
        match readings {
            Readings::Noise => (noisy(vec![0.0; channels], rng), 0.0),
            Readings::Contacts => contact(force_n, rng),
            Readings::Pairs => {
                let contacts = pair(extent, force_n, rng);
                let centre_m = 0.5 * (contacts[0].position.x_m + contacts[1].position.x_m);
                (noisy(sum(contacts.map(|contact| sensors.reading(contact))), rng), centre_m)
            }
            Readings::StuckChannel => {
                let (mut reading, x_m) = contact(PRESS_N, rng);
                reading[rng.random_range(0..channels)] = 0.0;
                (reading, x_m)
            }
            Readings::ShuffledChannels => {
                let (mut reading, x_m) = contact(PRESS_N, rng);
                reading.shuffle(rng);
                (reading, x_m)
            }
            Readings::AbsurdValues => {
                let size = [1e-2, 1.0, 1e9, 1e300][number % 4];
                ((0..channels).map(|_| size * rng.random_range(-1.0..1.0)).collect(), 0.0)
            }
            Readings::Multiple(share) => contact(share * PRESS_N, rng),
        }
    }

    /// Mean power of the most powerful test of two contacts against one, at a level of 0.5 %.
    ///
    /// The lemma of Neyman and Pearson gives the power Φ(√λ − 2.576) for the least squared distance λ, over the noise, between the reading of the two contacts and that of one contact.
    fn greatest_power(&self, pairs: usize) -> Result<Option<Figure>> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let (sensors, extent) = (self.clean_sensors()?, self.physics.surface().extent());
        let influence = |position| sensors.reading(Contact { position, force_n: 1.0 });
        let nodes: Vec<(Position, Vec<f64>)> =
            nodes(extent).map(|position| (position, influence(position))).collect();
        let mut powers = Sample::default();
        for i in 0..pairs {
            let contacts = pair(extent, self.forces_n()[i % 3], &mut rng);
            let reading = sum(contacts.map(|contact| sensors.reading(contact)));
            let distance = |influence: &[f64]| {
                let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                let best_n = dot(&reading, influence) / dot(influence, influence);
                let force_n = self.setup.force_n().unwrap_or(best_n);
                let residuals = reading.iter().zip(influence).map(|(r, f)| (r - force_n * f) / NOISE_M);
                residuals.map(|residual| residual.powi(2)).sum::<f64>()
            };
            let of_nodes = nodes.iter().map(|(position, influence)| (distance(influence), *position));
            let first = of_nodes.min_by(|a, b| a.0.total_cmp(&b.0)).context("a surface has nodes")?;
            let least = descend(extent, first, |position| distance(&influence(position)));
            powers.add(0, 100.0 * normal_cdf(least.sqrt() - NORMAL_99));
        }
        Ok(powers.mean())
    }
}

/// Nodes except on the edges, where some readings are zero.
fn nodes(extent: Extent) -> impl Iterator<Item = Position> {
    let (along, across) = if extent.width_m().is_some() { (48, 48) } else { (400, 2) };
    let width_m = extent.width_m().unwrap_or(0.0);
    (1..along).flat_map(move |i| {
        let x_m = extent.length_m() * f64::from(i) / f64::from(along);
        (1..across).map(move |j| Position { x_m, y_m: width_m * f64::from(j) / f64::from(across) })
    })
}

/// Local minimum near a position, by steps that are halved where no neighbour is smaller.
fn descend(
    extent: Extent,
    (mut least, mut position): (f64, Position),
    value_at: impl Fn(Position) -> f64,
) -> f64 {
    let is_within = |x: f64, side: f64| x > 1e-3 * side && x < (1.0 - 1e-3) * side;
    let directions: &[(f64, f64)] = match extent.width_m() {
        Some(_) => &[(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)],
        None => &[(1.0, 0.0), (-1.0, 0.0)],
    };
    let mut step = extent.length_m() / 48.0;
    while step > 1e-6 * extent.length_m() {
        let neighbours = directions
            .iter()
            .map(|(x, y)| Position { x_m: position.x_m + x * step, y_m: position.y_m + y * step })
            .filter(|next| {
                is_within(next.x_m, extent.length_m())
                    && extent.width_m().is_none_or(|side| is_within(next.y_m, side))
            });
        match neighbours.map(|next| (value_at(next), next)).min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some(next) if next.0 < least => (least, position) = next,
            _ => step *= 0.5,
        }
    }
    least
}

/// Two contacts of one force along the surface.
fn pair(extent: Extent, force_n: f64, rng: &mut Xoshiro256PlusPlus) -> [Contact; 2] {
    let first = anywhere(extent, rng);
    let distance_m = if first.x_m < 0.5 * extent.length_m() { DISTANCE_M } else { -DISTANCE_M };
    let second = Position { x_m: first.x_m + distance_m, ..first };
    [first, second].map(|position| Contact { position, force_n })
}

/// At least 5 % of a side from the edges.
fn anywhere(extent: Extent, rng: &mut Xoshiro256PlusPlus) -> Position {
    let mut along = |side_m: f64| side_m * rng.random_range(0.05..0.95);
    Position { x_m: along(extent.length_m()), y_m: extent.width_m().map_or(0.0, along) }
}

fn sum([a, b]: [Vec<f64>; 2]) -> Vec<f64> {
    a.iter().zip(&b).map(|(a, b)| a + b).collect()
}

fn noisy(clean: Vec<f64>, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let mut noise = || -> f64 { StandardNormal.sample(rng) };
    clean.into_iter().map(|reading| reading + NOISE_M * noise()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn influence_rejects_noise_and_two_contacts_and_accepts_contacts() {
        let [known, unknown, ..] = benches().unwrap();
        let estimator = Estimator::Influence(Influence::default());
        let repetitions = Repetitions { calibrations: 1, readings: 60, pairs: 60 };
        let [known, of_unknown] = [&known, &unknown].map(|bench| {
            let row = bench.row(&estimator, repetitions).unwrap();
            row.figures.iter().map(|figure| figure.unwrap().value).collect::<Vec<f64>>()
        });
        for values in [&known, &of_unknown] {
            // Of 60 readings with a rate of 0.3 %, more than three are alarms with a probability of 5 in 100,000.
            assert!(values[0] >= 95.0 && values[1] >= 95.0, "{values:?}");
            // Of 60 intervals that cover 95 %, fewer than 50 cover with a probability of 1 in 1,000.
            assert!(values[8] >= 83.0, "{values:?}");
        }
        // No test rejects more pairs than the most powerful one, but for the scatter of 60 readings and 200 pairs.
        let power = unknown.greatest_power(200).unwrap().unwrap();
        assert!((40.0..power.value + 25.0).contains(&of_unknown[3]), "{of_unknown:?} {power:?}");
        assert!(known[3] >= 98.0, "{known:?}");
    }
}
