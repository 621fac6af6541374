//! `cargo bench -p palpate --bench statuses`: what every estimator says of readings that it should not believe, and of those that it should, as the
//! table of docs/validation/tables/statuses.md: noise alone, a second contact, a channel that is stuck, channels in another order, absurd values; and how often its
//! 95 % intervals contain contacts of half to twice the force of the presses. Five calibrations of each bench share the 2,000 readings of a figure.
//! `-- beam` takes the benches whose names begin so.

use palpate_estimators::arrangement::Training;
use palpate_estimators::estimator::{Estimate, Estimator, Locator, Status, Uncertainty, contenders};
use palpate_estimators::fit::Fit;
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;
use palpate_estimators::simulate::CleanSensors;
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::sensing::Layout;
use palpate_mechanics::sensing::SensorKind::{Deflection, Raw};
use palpate_mechanics::surface::{Beam, Extent, Plate};
use palpate_mechanics::units::{gpa, mm, newtons, um};
use palpate_numerics::normal_cdf;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Force of the presses, in newtons.
const PRESS_N: f64 = 3.0;
/// Noise of a reading, in metres.
const NOISE_M: f64 = 5e-6;

struct Bench {
    name: &'static str,
    /// The surface with its model and sensors.
    physics: Setup,
    /// Surface and sensors of the locator.
    setup: Setup,
    presses: Recording,
}

/// The benches, calibrated with a seed.
fn benches(seed: u64) -> Vec<Bench> {
    let beam = || {
        let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).expect("it is a beam");
        Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0))).expect("the sensors suit")
    };
    let plate = || {
        let plate =
            Plate::simply_supported((mm(300.0), mm(300.0)), mm(0.8), gpa(200.0), 0.3).expect("it is a plate");
        Setup::new(plate).sensors(Deflection.grid(3, 3).noise(um(5.0))).expect("the sensors suit")
    };
    let known = |setup: Setup| setup.known_force(newtons(PRESS_N)).expect("it is a force");
    let on_line = Training { force_n: Some(PRESS_N), ..Training::even(20).repeated(10) };
    let on_plane = Training { force_n: Some(PRESS_N), ..Training::grid(10, 10).repeated(3) };
    let bench = |name, physics: Setup, setup: Setup, training: &Training| {
        let presses = physics.simulate(training, seed).expect("the places suit");
        let presses = Recording::new(setup.layout(), "bench", presses.rows);
        Bench { name, physics, setup, presses }
    };
    let measured =
        bench("line without a model, force unknown", known(beam()), without_model(&beam()), &on_line);
    let measured = Bench { presses: of_several_forces(&measured, seed), ..measured };
    vec![
        bench("beam, force known", known(beam()), known(beam()), &on_line),
        bench("beam, force unknown", known(beam()), beam(), &on_line),
        measured,
        bench("plate, force known", known(plate()), known(plate()), &on_plane),
        bench("plate, force unknown", known(plate()), plate(), &on_plane),
    ]
}

/// The presses with half, once and twice the force in turn, as on a board without a model.
fn of_several_forces(Bench { physics, presses, .. }: &Bench, seed: u64) -> Recording {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(100 + seed);
    let surface = physics.surface().model().expect("every bench has one");
    let sensors = CleanSensors::new(surface, physics.layout());
    let mut presses = presses.clone();
    for (i, row) in presses.rows.iter_mut().enumerate() {
        let force_n = PRESS_N * [0.5, 1.0, 2.0][i % 3];
        row.force_n = Some(force_n);
        row.reading = with_noise(sensors.reading(Contact { position: row.position, force_n }), &mut rng);
    }
    presses
}

fn without_model(setup: &Setup) -> Setup {
    let extent = setup.surface().extent();
    let layout = Layout::even(Raw, setup.layout().len(), extent.length_m());
    Setup::new(extent).with_layout(layout).expect("raw channels suit any surface")
}

/// A reading, and the place of its contact where it has one.
type Reading = (Option<Position>, Vec<f64>);

/// Readings of a kind, with their right status.
struct Case {
    /// Head of its column.
    name: &'static str,
    readings: Vec<Reading>,
    is_right: fn(&Estimate, Option<Position>) -> bool,
}

impl Case {
    /// Share of the readings with the right status.
    fn share(&self, locator: &Locator) -> f64 {
        let is_right = |(truth, reading): &&Reading| {
            let estimate = locator.locate(reading).expect("its channels are those of the bench");
            (self.is_right)(&estimate, *truth)
        };
        self.readings.iter().filter(is_right).count() as f64 / self.readings.len() as f64
    }
}

/// Calibrations of a bench.
const CALIBRATIONS: usize = 5;
/// Readings of a figure.
const READINGS: usize = 2000;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let wanted = arguments.first().map_or("", String::as_str);
    let count = READINGS / CALIBRATIONS;
    let calibrated: Vec<Vec<Bench>> = (0..CALIBRATIONS as u64).map(benches).collect();
    for i in 0..calibrated[0].len() {
        let bench = &calibrated[0][i];
        if !bench.name.starts_with(wanted) {
            continue;
        }
        println!("\n{}\n", bench.name);
        println!("Two contacts: any test detects at most {:.1} %\n", 100.0 * most_told(bench, 2000));
        print_table(&calibrated.iter().map(|benches| &benches[i]).collect::<Vec<_>>(), count);
    }
}

/// A row an estimator, over all calibrations.
fn print_table(benches: &[&Bench], count: usize) {
    let first = benches[0];
    let names: Vec<&str> = cases(first, 0, 0).iter().map(|case| case.name).collect();
    println!("| estimator | {} |", names.join(" | "));
    println!("|{}", "---|".repeat(names.len() + 1));
    for estimator in contenders(&first.setup, &Estimator::default(), first.presses.rows.len()) {
        let mut sums = vec![0.0; names.len()];
        for (seed, bench) in benches.iter().enumerate() {
            let locator = estimator.fit(&bench.setup, &bench.presses).expect("it suits the bench");
            for (sum, case) in sums.iter_mut().zip(cases(bench, count, seed as u64)) {
                *sum += case.share(&locator) / CALIBRATIONS as f64;
            }
        }
        let cells: Vec<String> = sums.iter().map(|share| format!("{:.1}", 100.0 * share)).collect();
        println!("| {} | {} |", estimator.kind(), cells.join(" | "));
    }
}

fn cases(bench: &Bench, count: usize, seed: u64) -> Vec<Case> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
    let surface = bench.physics.surface().model().expect("every bench has one");
    let sensors = CleanSensors::new(surface, bench.physics.layout());
    let extent = bench.physics.surface().extent();
    let channels = bench.physics.layout().len();
    let forces = forces_of(bench);
    let contact = |force_n: f64, rng: &mut Xoshiro256PlusPlus| {
        let position = anywhere(extent, rng);
        (position, with_noise(sensors.reading(Contact { position, force_n }), rng))
    };
    let mut case = |name, is_right, make: &mut dyn FnMut(usize, &mut Xoshiro256PlusPlus) -> Reading| Case {
        name,
        is_right,
        readings: (0..count).map(|i| make(i, &mut rng)).collect(),
    };
    let mut cases = vec![
        case("noise: `no_contact`", is_no_contact, &mut |_, rng| {
            (None, with_noise(vec![0.0; channels], rng))
        }),
        case("contact: detected", is_told, &mut |i, rng| (None, contact(forces[i % 3], rng).1)),
        case("contact: `outside_model`", is_outside_model, &mut |i, rng| {
            (None, contact(forces[i % 3], rng).1)
        }),
        case("two contacts: doubted", is_doubted_or_held, &mut |i, rng| {
            let contacts = two_contacts(extent, forces[i % 3], rng);
            (None, with_noise(sum(contacts.map(|contact| sensors.reading(contact))), rng))
        }),
        case("… or centre covered", is_doubted_or_held, &mut |i, rng| {
            let contacts = two_contacts(extent, forces[i % 3], rng);
            let centre = Position {
                x_m: 0.5 * (contacts[0].position.x_m + contacts[1].position.x_m),
                ..contacts[0].position
            };
            (Some(centre), with_noise(sum(contacts.map(|contact| sensors.reading(contact))), rng))
        }),
        case("stuck channel", is_doubted_or_held, &mut |_, rng| {
            let (position, mut reading) = contact(PRESS_N, rng);
            reading[rng.random_range(0..channels)] = 0.0;
            (Some(position), reading)
        }),
        case("channels shuffled", is_doubted_or_held, &mut |_, rng| {
            let (position, mut reading) = contact(PRESS_N, rng);
            reading.shuffle(rng);
            (Some(position), reading)
        }),
        case("absurd values", is_doubted_or_held, &mut |i, rng| {
            let size = [1e-2, 1.0, 1e9, 1e300][i % 4];
            (None, (0..channels).map(|_| size * rng.random_range(-1.0..1.0)).collect())
        }),
    ];
    let shares: &[(&str, f64)] = match bench.setup.force_n() {
        Some(_) => &[("95 % cover", 1.0), ("… or flagged, at ½ force", 0.5), ("… at 2 × force", 2.0)],
        None => &[("95 % cover", 1.0), ("… at ½ force", 0.5), ("… at 2 × force", 2.0)],
    };
    for (name, share) in shares.iter().copied() {
        let is_right =
            if share != 1.0 && bench.setup.force_n().is_some() { is_doubted_or_held } else { is_held };
        cases.push(case(name, is_right, &mut |_, rng| {
            let (position, reading) = contact(share * PRESS_N, rng);
            (Some(position), reading)
        }));
    }
    cases
}

/// The share of two contacts that a test can tell from one, which takes one contact for two once in 200 readings: by the lemma of
/// Neyman and Pearson Φ(√λ − 2.576), λ being the least squared distance, over the noise, of their reading from that of one contact.
fn most_told(bench: &Bench, count: usize) -> f64 {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let surface = bench.physics.surface().model().expect("every bench has one");
    let sensors = CleanSensors::new(surface, bench.physics.layout());
    let extent = bench.physics.surface().extent();
    let per_newton = |position| sensors.reading(Contact { position, force_n: 1.0 });
    let nodes: Vec<(Position, Vec<f64>)> = places(extent).map(|place| (place, per_newton(place))).collect();
    let forces = forces_of(bench);
    let told = (0..count).map(|i| {
        let contacts = two_contacts(extent, forces[i % 3], &mut rng);
        let reading = sum(contacts.map(|contact| sensors.reading(contact)));
        let misfit = |influence: &[f64]| {
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let force_n =
                bench.setup.force_n().unwrap_or(dot(&reading, influence) / dot(influence, influence));
            reading.iter().zip(influence).map(|(r, f)| ((r - force_n * f) / NOISE_M).powi(2)).sum::<f64>()
        };
        let of_nodes = nodes.iter().map(|(place, influence)| (misfit(influence), *place));
        let (least, place) = of_nodes.min_by(|a, b| a.0.total_cmp(&b.0)).expect("there are nodes");
        let least = descended(extent, (least, place), |place| misfit(&per_newton(place)));
        normal_cdf(least.sqrt() - 2.576)
    });
    told.sum::<f64>() / count as f64
}

/// Places all over a surface except at its edges, where some readings are zero.
fn places(extent: Extent) -> impl Iterator<Item = Position> {
    let (along, across) = if extent.width_m().is_some() { (48, 48) } else { (400, 2) };
    let width_m = extent.width_m().unwrap_or(0.0);
    (1..along).flat_map(move |i| {
        let x_m = extent.length_m() * f64::from(i) / f64::from(along);
        (1..across).map(move |j| Position { x_m, y_m: width_m * f64::from(j) / f64::from(across) })
    })
}

/// The least value near a place, by steps along and across that are halved where they lead nowhere.
fn descended(extent: Extent, (mut least, mut place): (f64, Position), at: impl Fn(Position) -> f64) -> f64 {
    let is_within = |x: f64, side: f64| x > 1e-3 * side && x < (1.0 - 1e-3) * side;
    let mut step = extent.length_m() / 48.0;
    while step > 1e-6 * extent.length_m() {
        let ways = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
        let ways = &ways[..if extent.width_m().is_some() { 4 } else { 2 }];
        let next =
            ways.iter().map(|(x, y)| Position { x_m: place.x_m + x * step, y_m: place.y_m + y * step });
        let next = next.filter(|next| {
            is_within(next.x_m, extent.length_m())
                && extent.width_m().is_none_or(|side| is_within(next.y_m, side))
        });
        match next.map(|next| (at(next), next)).min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some(better) if better.0 < least => (least, place) = better,
            _ => step *= 0.5,
        }
    }
    least
}

/// Two contacts of one force, 50 mm apart along the surface.
fn two_contacts(extent: Extent, force_n: f64, rng: &mut Xoshiro256PlusPlus) -> [Contact; 2] {
    let first = anywhere(extent, rng);
    let way = if first.x_m < 0.5 * extent.length_m() { 0.05 } else { -0.05 };
    [first, Position { x_m: first.x_m + way, ..first }].map(|position| Contact { position, force_n })
}

/// Forces of contacts in turn, as the locator may meet them.
fn forces_of(bench: &Bench) -> [f64; 3] {
    let shares = if bench.setup.force_n().is_some() { [1.0; 3] } else { [0.5, 1.0, 2.0] };
    shares.map(|share| share * PRESS_N)
}

fn sum([a, b]: [Vec<f64>; 2]) -> Vec<f64> {
    a.iter().zip(&b).map(|(a, b)| a + b).collect()
}

fn with_noise(clean: Vec<f64>, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let mut noise = || -> f64 { StandardNormal.sample(rng) };
    clean.into_iter().map(|reading| reading + NOISE_M * noise()).collect()
}

/// Anywhere but within a twentieth of a side from an edge.
fn anywhere(extent: Extent, rng: &mut Xoshiro256PlusPlus) -> Position {
    let mut along = |side_m: f64| side_m * rng.random_range(0.05..0.95);
    Position { x_m: along(extent.length_m()), y_m: extent.width_m().map_or(0.0, along) }
}

fn is_no_contact(estimate: &Estimate, _: Option<Position>) -> bool {
    estimate.status == Status::NoContact
}

fn is_outside_model(estimate: &Estimate, _: Option<Position>) -> bool {
    estimate.status == Status::OutsideModel
}

fn is_told(estimate: &Estimate, _: Option<Position>) -> bool {
    matches!(estimate.status, Status::Located | Status::Ambiguous)
}

/// True where the 95 % interval along the surface contains the contact.
fn is_held(estimate: &Estimate, truth: Option<Position>) -> bool {
    let Some((Uncertainty { x_95_m: (low, high), .. }, truth)) = estimate.contact.uncertainty.zip(truth)
    else {
        return false;
    };
    low <= truth.x_m && truth.x_m <= high
}

fn is_doubted_or_held(estimate: &Estimate, truth: Option<Position>) -> bool {
    !is_told(estimate, None) || is_held(estimate, truth)
}
