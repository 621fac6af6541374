//! Surfaces without a model. `cargo bench -p palpate --bench measured`: microseconds an estimate with its uncertainty, on a plane of 15 channels and on lines of 2 and 6, each with a
//! nuisance coordinate; beside them a sum of the likelihood over every node of the same table. One core, CPU time, medians.
//!
//! `cargo bench -p palpate --bench measured -- rows`: seconds and peak memory of the fit of every estimator to 100,000 rows at 20,000
//! positions, each in a process of its own, with what was estimated before, and the error beside that of the exact fit to so few of the rows that it can be had.

use cpu_time::ThreadTime;
use palpate_core::ContactEstimate;
use palpate_estimators::estimator::{Estimator, contenders};
use palpate_estimators::fit::Fit;
use palpate_estimators::fit::{FitTask, Locate};
use palpate_estimators::influence::measured::{MeasuredInfluence, MeasuredLocator, Scale};
use palpate_estimators::influence::{Influence, Structure};
use palpate_estimators::recording::{Recording, Row};
use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_numerics::median;
use palpate_testing::figure::figure;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const ROUNDS: usize = 3;
const READINGS: usize = 100;

/// Bench: what its channels read of a contact at a position, in metres, and a depth, in millimetres, or a force, in newtons.
struct Bench {
    name: &'static str,
    extent: Extent,
    channels: usize,
    clean: fn(Position, f64, usize) -> f64,
    /// Positions along and across, and depths.
    presses: [usize; 3],
    noise: f64,
    second: Second,
}

/// Column of a press beside its position.
#[derive(Clone, Copy)]
enum Second {
    DepthMm,
    ForceN,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["rows", ..] => return every_estimator_with_many_rows(),
        ["fit", kind, ..] => return fit_many_rows(kind),
        _ => {}
    }
    let plane = Extent::plane(0.03, 0.03).expect("it has sides");
    let line = Extent::line(0.1).expect("it has a length");
    let benches = [
        Bench {
            name: "plane, 15 channels",
            extent: plane,
            channels: 15,
            clean: field,
            presses: [20, 15, 5],
            noise: 0.02,
            second: Second::DepthMm,
        },
        Bench {
            name: "plane, 15 channels, little noise",
            extent: plane,
            channels: 15,
            clean: field,
            presses: [20, 15, 5],
            noise: 0.002,
            second: Second::DepthMm,
        },
        Bench {
            name: "line, 2 channels",
            extent: line,
            channels: 2,
            clean: pressure,
            presses: [41, 1, 8],
            noise: 0.02,
            second: Second::DepthMm,
        },
        Bench {
            name: "line, 6 channels",
            extent: line,
            channels: 6,
            clean: pressure,
            presses: [41, 1, 8],
            noise: 0.02,
            second: Second::DepthMm,
        },
        Bench {
            name: "line, 6 channels, little noise",
            extent: line,
            channels: 6,
            clean: pressure,
            presses: [41, 1, 8],
            noise: 0.001,
            second: Second::DepthMm,
        },
    ];
    let only = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    for bench in benches.iter().filter(|bench| only.as_ref().is_none_or(|only| bench.name.starts_with(only)))
    {
        report(bench);
    }
}

/// Field of a magnetised layer that is dented over five magnetometers of three axes: of a dipole, more the deeper.
fn field(at: Position, depth_mm: f64, channel: usize) -> f64 {
    let magnetometers = [[7.5, 7.5], [22.5, 7.5], [15.0, 15.0], [7.5, 22.5], [22.5, 22.5]];
    let [x, y] = magnetometers[channel / 3];
    let r = [1e3 * at.x_m - x, 1e3 * at.y_m - y, 8.0 - depth_mm];
    let square: f64 = r.iter().map(|r| r * r).sum();
    let axis = channel % 3;
    let own = if axis == 2 { square } else { 0.0 };
    300.0 * depth_mm.powf(1.3) * (3.0 * r[2] * r[axis] - own) / square.powf(2.5)
}

/// Offset and force times influence of an elastic pad over the same magnetometers.
fn elastic(at: Position, force_n: f64, channel: usize) -> f64 {
    0.3 * channel as f64 + force_n * field(at, 1.5, channel)
}

/// Pressure at places along a channel, that rises with the depth faster than it does.
fn pressure(at: Position, depth_mm: f64, channel: usize) -> f64 {
    let u = at.x_m / 0.1 - [0.0, 1.0, 0.2, 0.4, 0.6, 0.8][channel];
    depth_mm.powf(1.2 + 0.05 * channel as f64) / (0.3 + u * u) + 0.3
}

impl Bench {
    fn row(&self, position: Position, depth_mm: f64, rng: &mut Xoshiro256PlusPlus) -> Row {
        let noisy = |channel| {
            let error: f64 = StandardNormal.sample(rng);
            (self.clean)(position, depth_mm, channel) + self.noise * error
        };
        Row {
            position,
            force_n: matches!(self.second, Second::ForceN).then_some(depth_mm),
            nuisances: matches!(self.second, Second::DepthMm).then_some(depth_mm).into_iter().collect(),
            time_s: None,
            reading: (0..self.channels).map(noisy).collect(),
        }
    }

    fn calibration(&self, rng: &mut Xoshiro256PlusPlus) -> Recording {
        let [along, across, depths] = self.presses;
        let at = |i: usize, count: usize, size_m: f64| (i as f64 + 0.5) / count as f64 * size_m;
        let mut rows = Vec::new();
        for (i, j, k) in
            (0..along * across * depths).map(|n| (n / depths / across, n / depths % across, n % depths))
        {
            let width_m = self.extent.width_m();
            let position = Position {
                x_m: at(i, along, self.extent.length_m()),
                y_m: width_m.map_or(0.0, |width_m| at(j, across, width_m)),
            };
            rows.push(self.row(position, 1.0 + 0.25 * k as f64, rng));
        }
        Recording::new(self.setup().layout(), "bench", rows)
    }

    fn touches(&self, rng: &mut Xoshiro256PlusPlus) -> Vec<Row> {
        let inside =
            |size_m: f64, rng: &mut Xoshiro256PlusPlus| rng.random_range(0.05 * size_m..0.95 * size_m);
        let touches = (0..READINGS).map(|_| {
            let x_m = inside(self.extent.length_m(), rng);
            let y_m = self.extent.width_m().map_or(0.0, |width_m| inside(width_m, rng));
            let depth_mm = rng.random_range(1.0..1.0 + 0.25 * (self.presses[2] - 1) as f64);
            self.row(Position { x_m, y_m }, depth_mm, rng)
        });
        touches.collect()
    }

    fn setup(&self) -> Setup {
        let layout = Layout::even(SensorKind::Raw, self.channels, self.extent.length_m());
        Setup::new(self.extent).with_layout(layout).expect("raw channels suit any surface")
    }
}

/// Rows, and positions, of a large recording.
const MANY: [usize; 3] = [160, 125, 5];

/// The estimator of surfaces that read offset + force × influence, by the name of its structure.
const FORCE_LINEAR: &str = "force-linear";
/// Rows to which Gaussian processes are fitted exactly, and presses to which influence functions of recorded forces are.
const EXACT: [usize; 2] = [4000, 1000];

fn every_estimator_with_many_rows() {
    let this = std::env::current_exe().expect("it runs");
    let kinds =
        [FORCE_LINEAR, "influence", "gaussian-process", "neighbours", "centroid", "network-lm", "network"];
    for kind in kinds {
        let status = std::process::Command::new(&this).args(["fit", kind]).status();
        assert!(status.is_ok_and(|status| status.success()), "{kind} failed");
    }
}

fn fit_many_rows(kind: &str) {
    let extent = Extent::plane(0.03, 0.03).expect("it has sides");
    let (clean, second, exact): (fn(Position, f64, usize) -> f64, _, _) = match kind {
        FORCE_LINEAR => (elastic, Second::ForceN, EXACT[1]),
        _ => (field, Second::DepthMm, EXACT[0]),
    };
    let bench = Bench { name: "", extent, channels: 15, clean, presses: MANY, noise: 0.02, second };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let (setup, recording) = (bench.setup(), bench.calibration(&mut rng));
    let touches = bench.touches(&mut rng);
    let estimator = match kind {
        FORCE_LINEAR => {
            Estimator::Influence(Influence { structure: Structure::ForceLinear, ..Influence::default() })
        }
        _ => contenders(&setup, &Estimator::default(), recording.rows.len())
            .into_iter()
            .find(|other| other.kind() == kind)
            .expect("it suits a plane"),
    };
    let cost = estimator.fit_cost(&setup, &recording);
    let fitted = |recording: &Recording| {
        let start = ThreadTime::now();
        let locator = estimator.fit(&setup, recording).expect("the presses suit");
        let seconds = start.elapsed().as_secs_f64();
        let position = |reading: &[f64]| locator.locate(reading).expect("it suits").contact.position;
        (seconds, errors_mm(&touches, position))
    };
    let (seconds, (median_mm, mean_mm)) = fitted(&recording);
    let peak_mb = peak_memory_mb();
    let mut few = recording.clone();
    // A prime apart, round and round, so that every depth is among them.
    let rows = recording.rows.len();
    few.rows = (0..exact).map(|i| recording.rows[i * 7919 % rows].clone()).collect();
    let few_cost = estimator.fit_cost(&setup, &few);
    let (few_seconds, (few_median_mm, few_mean_mm)) = fitted(&few);
    println!(
        "{kind}: {rows} rows fitted in {seconds:.1} s with {peak_mb:.0} MB at most (estimated {:.0} s, {:.0} MB), error {median_mm:.4} / {mean_mm:.4} mm; {exact} rows in {few_seconds:.1} s (estimated {:.1} s), error {few_median_mm:.4} / {few_mean_mm:.4} mm; ratio {:.3} / {:.3}",
        cost.seconds,
        cost.memory_bytes / 1e6,
        few_cost.seconds,
        median_mm / few_median_mm,
        mean_mm / few_mean_mm,
    );
}

/// Peak memory of this process; NaN where the system does not report it.
fn peak_memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok())
        .map_or(f64::NAN, |kb| kb / 1e3)
}

fn report(bench: &Bench) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let (setup, recording) = (bench.setup(), bench.calibration(&mut rng));
    let start = ThreadTime::now();
    let locator =
        MeasuredInfluence::default().fit_method(FitTask::new(&setup, &recording)).expect("the presses suit");
    let fit_s = start.elapsed().as_secs_f64();
    let touches = bench.touches(&mut rng);
    let ours_us = microseconds(&touches, |reading| locator.locate(reading).contact);
    figure(&format!("measured: {}, fit", bench.name), fit_s, "s");
    figure(&format!("measured: {}, estimate", bench.name), ours_us, "us");
    let every = touches.iter().step_by(10).cloned().collect::<Vec<Row>>();
    let obvious_us = microseconds(&every, |reading| of_every_node(&locator, reading));
    let (median_mm, mean_mm) = errors_mm(&touches, |reading| locator.locate(reading).contact.position);
    let table = locator.table();
    println!(
        "{}: {} presses fitted in {fit_s:.1} s, table {} x {} x {}, estimate {ours_us:.1} us, error {median_mm:.4} / {mean_mm:.4} mm; sum over every node {obvious_us:.0} us, {:.0} times as long",
        bench.name,
        recording.rows.len(),
        table.x.count,
        table.y.count,
        table.nuisance.count,
        obvious_us / ours_us
    );
}

/// Posterior mean over the nodes of a table, each as likely as any other beforehand.
fn of_every_node(locator: &MeasuredLocator, reading: &[f64]) -> ContactEstimate {
    let (table, whitening) = (locator.table(), locator.whitening());
    let scaled: Vec<f64> = reading
        .iter()
        .map(|value| if locator.readings() == Scale::Logarithm { value.ln() } else { *value })
        .collect();
    let channels = scaled.len();
    let whitened: Vec<f64> = whitening
        .matrix
        .chunks_exact(channels)
        .map(|row| row.iter().zip(&scaled).map(|(w, y)| w * y).sum())
        .collect();
    let squares: Vec<f64> = table
        .means
        .chunks_exact(channels)
        .zip(&table.variances)
        .map(|(mean, variance)| {
            let terms = whitened.iter().zip(mean).zip(&whitening.signal);
            terms.map(|((z, mean), signal)| (z - mean) * (z - mean) / (1.0 + variance * signal)).sum()
        })
        .collect();
    let least = squares.iter().copied().fold(f64::INFINITY, f64::min);
    let mut sums = [0.0; 3];
    for (node, square) in squares.iter().enumerate() {
        let place = node / table.nuisance.count;
        let weight = (-0.5 * (square - least)).exp();
        let at =
            [table.x.value((place / table.y.count) as f64), table.y.value((place % table.y.count) as f64)];
        sums[0] += weight;
        sums[1] += weight * at[0];
        sums[2] += weight * at[1];
    }
    ContactEstimate {
        position: Position { x_m: sums[1] / sums[0], y_m: sums[2] / sums[0] },
        force_n: None,
        uncertainty: None,
    }
}

/// Median time of an estimate.
fn microseconds(touches: &[Row], mut locate: impl FnMut(&[f64]) -> ContactEstimate) -> f64 {
    let times = (0..ROUNDS).map(|_| {
        let start = ThreadTime::now();
        for touch in touches {
            std::hint::black_box(locate(&touch.reading));
        }
        start.elapsed().as_secs_f64() * 1e6 / touches.len() as f64
    });
    median(times.collect()).expect("rounds")
}

fn errors_mm(touches: &[Row], locate: impl Fn(&[f64]) -> Position) -> (f64, f64) {
    let errors: Vec<f64> =
        touches.iter().map(|touch| 1e3 * touch.position.distance_m(locate(&touch.reading))).collect();
    (median(errors.clone()).expect("touches"), errors.iter().sum::<f64>() / errors.len() as f64)
}
