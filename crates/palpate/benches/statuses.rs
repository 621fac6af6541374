//! `cargo bench -p palpate --bench statuses`: what every estimator says of readings that it should not believe, and of those that it should:
//! noise alone, a second contact, a channel that is stuck, channels in another order, absurd values; and how often its 95 % intervals hold
//! contacts of half to twice the force of the presses. `-- beam` takes the benches whose names begin so; `PALPATE_CASES` is the number of readings of a row, 2,000 unless said otherwise.

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
    /// What the locator is told of it.
    setup: Setup,
    presses: Recording,
}

fn benches() -> Vec<Bench> {
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
        let presses = physics.simulate(training, 0).expect("the places suit");
        let presses = Recording::new(setup.layout(), "bench", presses.rows);
        Bench { name, physics, setup, presses }
    };
    let measured =
        bench("line without a model, force unknown", known(beam()), without_model(&beam()), &on_line);
    let measured = Bench { presses: of_several_forces(&measured), ..measured };
    vec![
        bench("beam, force known", known(beam()), known(beam()), &on_line),
        bench("beam, force unknown", known(beam()), beam(), &on_line),
        measured,
        bench("plate, force known", known(plate()), known(plate()), &on_plane),
        bench("plate, force unknown", known(plate()), plate(), &on_plane),
    ]
}

/// The same presses with half, the whole and twice the force in turn, as a board of one's own has them.
fn of_several_forces(Bench { physics, presses, .. }: &Bench) -> Recording {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
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

/// Readings of a kind.
struct Case {
    name: String,
    readings: Vec<Reading>,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let wanted = arguments.first().map_or("", String::as_str);
    let count = std::env::var("PALPATE_CASES").ok().and_then(|count| count.parse().ok()).unwrap_or(2000);
    for bench in benches().iter().filter(|bench| bench.name.starts_with(wanted)) {
        println!("\n{}\n", bench.name);
        println!(
            "| estimator | readings | located | no contact | ambiguous | outside model | outside surface | covered | told or covered |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
        let cases = cases(bench, count);
        if let Extent::Line { .. } = bench.setup.surface().extent() {
            println!("Two contacts: any test tells at most {:.1} %\n", 100.0 * most_told(bench, count));
        }
        for estimator in contenders(&bench.setup, &Estimator::default(), bench.presses.rows.len()) {
            match estimator.fit(&bench.setup, &bench.presses) {
                Ok(locator) => cases.iter().for_each(|case| report(&locator, case)),
                Err(error) => println!("| {} | {error} |", estimator.kind()),
            }
        }
    }
}

fn cases(bench: &Bench, count: usize) -> Vec<Case> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let surface = bench.physics.surface().model().expect("every bench has one");
    let sensors = CleanSensors::new(surface, bench.physics.layout());
    let extent = bench.physics.surface().extent();
    let channels = bench.physics.layout().len();
    let forces = forces_of(bench);
    let mut turn = forces.iter().copied().cycle();
    let mut case = |name: &str, make: &mut dyn FnMut(&mut Xoshiro256PlusPlus) -> Reading| {
        let readings = (0..count).map(|_| make(&mut rng)).collect();
        Case { name: name.to_owned(), readings }
    };
    let mut cases = Vec::new();
    for share in [0.5, 1.0, 2.0] {
        let force_n = share * PRESS_N;
        cases.push(case(&format!("one contact of {force_n} N"), &mut |rng| {
            let position = anywhere(extent, rng);
            (Some(position), with_noise(sensors.reading(Contact { position, force_n }), rng))
        }));
    }
    cases.push(case("noise alone", &mut |rng| (None, with_noise(vec![0.0; channels], rng))));
    cases.push(case("two contacts 50 mm apart", &mut |rng| {
        let contacts = two_contacts(extent, turn.next().unwrap_or(PRESS_N), rng);
        (None, with_noise(sum(contacts.map(|contact| sensors.reading(contact))), rng))
    }));
    cases.push(case("a channel stuck at 0", &mut |rng| {
        let position = anywhere(extent, rng);
        let mut reading = with_noise(sensors.reading(Contact { position, force_n: PRESS_N }), rng);
        reading[rng.random_range(0..channels)] = 0.0;
        (Some(position), reading)
    }));
    cases.push(case("channels in another order", &mut |rng| {
        let position = anywhere(extent, rng);
        let mut reading = with_noise(sensors.reading(Contact { position, force_n: PRESS_N }), rng);
        reading.shuffle(rng);
        (Some(position), reading)
    }));
    cases.push(case("absurd values", &mut |rng| {
        let sizes = [1e-2, 1.0, 1e9, 1e300];
        let size = sizes[rng.random_range(0..sizes.len())];
        (None, (0..channels).map(|_| size * rng.random_range(-1.0..1.0)).collect())
    }));
    cases
}

/// The share of two contacts on a line that a test can tell from one, which takes one contact for two once in 200 readings: by the lemma of
/// Neyman and Pearson Φ(√λ − 2.576), λ being the least squared distance, over the noise, of their reading from that of one contact.
fn most_told(bench: &Bench, count: usize) -> f64 {
    const NODES: usize = 1600;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let surface = bench.physics.surface().model().expect("every bench has one");
    let sensors = CleanSensors::new(surface, bench.physics.layout());
    let extent = bench.physics.surface().extent();
    let per_newton = |position| sensors.reading(Contact { position, force_n: 1.0 });
    let nodes: Vec<Vec<f64>> = (1..NODES)
        .map(|i| per_newton(Position::along(extent.length_m() * i as f64 / NODES as f64)))
        .collect();
    let forces = forces_of(bench);
    let told = (0..count).map(|i| {
        let contacts = two_contacts(extent, forces[i % 3], &mut rng);
        let reading = sum(contacts.map(|contact| sensors.reading(contact)));
        let misfit = |node: &Vec<f64>| {
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let force_n = bench.setup.force_n().unwrap_or(dot(&reading, node) / dot(node, node));
            reading.iter().zip(node).map(|(r, f)| ((r - force_n * f) / NOISE_M).powi(2)).sum::<f64>()
        };
        let least = nodes.iter().map(misfit).fold(f64::INFINITY, f64::min);
        normal_cdf(least.sqrt() - 2.576)
    });
    told.sum::<f64>() / count as f64
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

fn report(locator: &Locator, case: &Case) {
    let count = case.readings.len();
    let estimates: Vec<(Option<Position>, Estimate)> = case
        .readings
        .iter()
        .map(|(truth, reading)| {
            (*truth, locator.locate(reading).expect("its channels are those of the bench"))
        })
        .collect();
    let percent = |of: usize| 100.0 * of as f64 / count as f64;
    let share =
        |status: Status| percent(estimates.iter().filter(|(_, estimate)| estimate.status == status).count());
    let holds = |(truth, estimate): &&(Option<Position>, Estimate)| {
        truth.is_some_and(|truth| is_covered(estimate, truth))
    };
    let doubts = |(_, estimate): &&(Option<Position>, Estimate)| {
        matches!(estimate.status, Status::OutsideModel | Status::NoContact)
    };
    let covered = estimates.iter().filter(holds).count();
    let told = estimates.iter().filter(|case| holds(case) || doubts(case)).count();
    println!(
        "| {} | {} | {:.1} | {:.2} | {:.1} | {:.2} | {:.1} | {:.1} | {:.1} |",
        locator.kind(),
        case.name,
        share(Status::Located),
        share(Status::NoContact),
        share(Status::Ambiguous),
        share(Status::OutsideModel),
        share(Status::OutsideSurface),
        percent(covered),
        percent(told),
    );
}

/// True where the 95 % interval along the surface holds the contact.
fn is_covered(estimate: &Estimate, truth: Position) -> bool {
    estimate
        .contact
        .uncertainty
        .is_some_and(|Uncertainty { x_95_m: (low, high), .. }| low <= truth.x_m && truth.x_m <= high)
}
