//! Load profiles of random loads on the founding paper's beam: coverage and width of the intervals of total force, centre of pressure and patches.

use crate::parallel::in_parallel;
use anyhow::Result;
use palpate::estimators::estimator::{LoadProfile, Patch};
use palpate::prelude::{Beam, Deflection, Profiler, Setup, Status, Strain, UniformLoad, simulate_loads};
use palpate::prelude::{gpa, microstrain, mm, newtons, um};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::Serialize;
use std::fmt::Write;

/// Size of the experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Readings of each row; at least 1.
    pub readings: u64,
    /// Seed of loads and noise.
    pub seed: u64,
}

/// Length of the beam, in mm.
const LENGTH_MM: f64 = 400.0;
/// Range of a random load's width, in mm.
const WIDTHS_MM: (f64, f64) = (10.0, 100.0);
/// Range of a random load's force, in newtons.
const FORCES_N: (f64, f64) = (1.0, 20.0);
/// Distance of a load's nearer end from a support, in mm, below which the load is beside the support.
const BESIDE_MM: f64 = 10.0;

/// Sensors of the beam.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sensors {
    /// Eight deflection sensors with 5 µm noise.
    Deflection5,
    /// Eight deflection sensors with 2 µm noise.
    Deflection2,
    /// Eight deflection sensors with 2 µm noise, and eight strain sensors with 0.5 µε.
    DeflectionAndStrain,
}

const SENSORS: [(Sensors, &str); 3] = [
    (Sensors::Deflection5, "deflection, 5 µm"),
    (Sensors::Deflection2, "deflection, 2 µm"),
    (Sensors::DeflectionAndStrain, "deflection, 2 µm, and strain, 0.5 µε"),
];

/// Loads on the beam.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Loads {
    /// One to three disjoint loads at random.
    Random,
    /// The random loads with one load beside a support.
    BesideSupport,
    /// The random loads without a load beside a support.
    AwayFromSupports,
    /// 20 N on 370–390 mm and 2 N on 100–160 mm.
    HeavyAndLight,
    /// 2 N on 130–150 mm and 2 N on 250–270 mm.
    TwoPads,
    /// 3 N on 180–220 mm.
    OnePad,
}

const LOADS: [(Loads, &str); 6] = [
    (Loads::Random, "one to three at random"),
    (Loads::BesideSupport, "… one within 10 mm of a support"),
    (Loads::AwayFromSupports, "… none within 10 mm"),
    (Loads::HeavyAndLight, "20 N on 370–390 mm, 2 N on 100–160 mm"),
    (Loads::TwoPads, "2 N on 130–150 mm, 2 N on 250–270 mm"),
    (Loads::OnePad, "3 N on 180–220 mm"),
];

impl Sensors {
    fn setup(self) -> Result<Setup> {
        let beam = Beam::new(mm(LENGTH_MM), mm(40.0), mm(1.2), gpa(200.0))?;
        let deflection = |noise_um: f64| Deflection.evenly(8).noise(um(noise_um));
        Ok(match self {
            Self::Deflection5 => Setup::new(beam).sensors(deflection(5.0))?,
            Self::Deflection2 => Setup::new(beam).sensors(deflection(2.0))?,
            Self::DeflectionAndStrain => {
                let strain = Strain.evenly(8).noise(microstrain(0.5));
                Setup::new(beam).sensors(deflection(2.0))?.sensors(strain)?
            }
        })
    }
}

impl Loads {
    fn draw(self, rng: &mut Xoshiro256PlusPlus) -> Vec<UniformLoad> {
        let along = |from_mm, to_mm, force_n| UniformLoad::along(mm(from_mm), mm(to_mm), newtons(force_n));
        match self {
            Self::HeavyAndLight => vec![along(100.0, 160.0, 2.0), along(370.0, 390.0, 20.0)],
            Self::TwoPads => vec![along(130.0, 150.0, 2.0), along(250.0, 270.0, 2.0)],
            Self::OnePad => vec![along(180.0, 220.0, 3.0)],
            Self::Random => random_loads(rng),
            Self::BesideSupport | Self::AwayFromSupports => loop {
                let loads = random_loads(rng);
                if loads.iter().any(is_beside_support) == (self == Self::BesideSupport) {
                    return loads;
                }
            },
        }
    }
}

fn is_beside_support(load: &UniformLoad) -> bool {
    load.from().x_m.min(mm(LENGTH_MM) - load.to().x_m) < mm(BESIDE_MM)
}

/// One to three disjoint loads, in order of position.
fn random_loads(rng: &mut Xoshiro256PlusPlus) -> Vec<UniformLoad> {
    let count = rng.random_range(1..=3);
    loop {
        let mut loads: Vec<UniformLoad> = (0..count).map(|_| random_load(rng)).collect();
        loads.sort_by(|a, b| a.from().x_m.total_cmp(&b.from().x_m));
        if loads.windows(2).all(|pair| pair[0].to().x_m <= pair[1].from().x_m) {
            return loads;
        }
    }
}

fn random_load(rng: &mut Xoshiro256PlusPlus) -> UniformLoad {
    let width_mm = rng.random_range(WIDTHS_MM.0..WIDTHS_MM.1);
    let from_mm = rng.random_range(0.0..LENGTH_MM - width_mm);
    let force_n = rng.random_range(FORCES_N.0..FORCES_N.1);
    UniformLoad::along(mm(from_mm), mm(from_mm + width_mm), newtons(force_n))
}

/// Intervals of one quantity.
#[derive(Clone, Debug, Default)]
struct Intervals {
    covered: u64,
    widths: Vec<f64>,
}

impl Intervals {
    fn add(&mut self, (low, high): (f64, f64), truth: f64) {
        self.covered += u64::from((low..=high).contains(&truth));
        self.widths.push(high - low);
    }

    fn figures(mut self) -> IntervalFigures {
        self.widths.sort_by(f64::total_cmp);
        let count = self.widths.len();
        let bounded: Vec<f64> = self.widths.iter().copied().filter(|width| width.is_finite()).collect();
        let percent = |of: f64| (count > 0).then(|| 100.0 * of / count as f64);
        IntervalFigures {
            count,
            coverage: percent(self.covered as f64),
            bounded: percent(bounded.len() as f64),
            median_width: self.widths.get(count / 2).copied().filter(|width| width.is_finite()),
            mean_width: (!bounded.is_empty()).then(|| bounded.iter().sum::<f64>() / bounded.len() as f64),
        }
    }
}

/// Coverage and width of the 95 % intervals of one quantity; shares in %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct IntervalFigures {
    /// Intervals.
    pub count: usize,
    /// Share that contains the truth.
    pub coverage: Option<f64>,
    /// Share that has an upper end.
    pub bounded: Option<f64>,
    /// Median width, in N or mm, where it is finite.
    pub median_width: Option<f64>,
    /// Mean width of the bounded ones, in N or mm.
    pub mean_width: Option<f64>,
}

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableRow {
    /// The sensors.
    pub sensors: &'static str,
    /// The loads.
    pub loads: &'static str,
    /// Readings.
    pub readings: u64,
    /// Share of the readings with the status `located`, in %.
    pub located: f64,
    /// Share with as many patches as loads, in %.
    pub resolved: f64,
    /// Share with fewer patches, in %.
    pub merged: f64,
    /// Total force.
    pub total: IntervalFigures,
    /// Centre of pressure.
    pub centre_of_pressure: IntervalFigures,
    /// Force of each patch, of readings with as many patches as loads.
    pub patch_force: IntervalFigures,
    /// Centre of each patch, of the same readings.
    pub patch_centre: IntervalFigures,
    /// Share of the loads, in readings with fewer patches, with a centre in the interval of a patch's centre, in %.
    pub merged_centres: Option<f64>,
}

/// Sums of one row.
#[derive(Default)]
struct Tally {
    readings: u64,
    located: u64,
    resolved: u64,
    merged: u64,
    total: Intervals,
    centre_of_pressure: Intervals,
    patch_force: Intervals,
    patch_centre: Intervals,
    merged_centres: (u64, u64),
}

impl Tally {
    fn add(&mut self, profile: &LoadProfile, loads: &[UniformLoad]) {
        self.readings += 1;
        self.located += u64::from(profile.status == Status::Located);
        let total_n: f64 = loads.iter().map(UniformLoad::force_n).sum();
        let moment: f64 = loads.iter().map(|load| load.force_n() * load.centre().x_m).sum();
        self.total.add(profile.bounds.total_95_n, total_n);
        if let Some(centre) = profile.centre {
            self.centre_of_pressure.add(in_mm(centre.x_95_m), 1e3 * moment / total_n);
        }
        self.resolved += u64::from(profile.patches.len() == loads.len());
        if profile.patches.len() == loads.len() {
            for (patch, load) in profile.patches.iter().zip(loads) {
                self.patch_force.add(patch.force_95_n, load.force_n());
                self.patch_centre.add(in_mm(patch.centre.x_95_m), 1e3 * load.centre().x_m);
            }
        } else if profile.patches.len() < loads.len() {
            self.merged += 1;
            let contains = |patch: &Patch, load: &UniformLoad| {
                let (low_m, high_m) = patch.centre.x_95_m;
                (low_m..=high_m).contains(&load.centre().x_m)
            };
            for load in loads {
                self.merged_centres.0 += u64::from(profile.patches.iter().any(|patch| contains(patch, load)));
                self.merged_centres.1 += 1;
            }
        }
    }
}

fn in_mm((low_m, high_m): (f64, f64)) -> (f64, f64) {
    (1e3 * low_m, 1e3 * high_m)
}

/// Rows of the table, as a file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Results {
    /// Version of palpate.
    pub palpate: &'static str,
    /// Name of the experiment.
    pub experiment: &'static str,
    /// Seed.
    pub seed: u64,
    /// The rows.
    pub rows: Vec<TableRow>,
}

/// Runs the experiment, several rows at a time; `progress` gets the name of a finished row, the number of finished rows and of all.
///
/// # Errors
/// A beam that cannot be simulated.
pub fn run(options: Options, progress: impl Fn(&str, usize, usize) + Sync) -> Result<Results> {
    let cases: Vec<Case> =
        SENSORS.into_iter().flat_map(|sensors| LOADS.map(|loads| Case { sensors, loads })).collect();
    let rows = in_parallel(&cases, |case| case.row(options), |case| case.loads.1.to_owned(), progress);
    Ok(Results {
        palpate: env!("CARGO_PKG_VERSION"),
        experiment: "load-profiles",
        seed: options.seed,
        rows: rows.into_iter().collect::<Result<_>>()?,
    })
}

struct Case {
    sensors: (Sensors, &'static str),
    loads: (Loads, &'static str),
}

impl Case {
    fn row(&self, options: Options) -> Result<TableRow> {
        let setup = self.sensors.0.setup()?;
        let profiler = Profiler::from_setup(&setup)?;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
        let mut tally = Tally::default();
        for _ in 0..options.readings {
            let loads = self.loads.0.draw(&mut rng);
            for reading in simulate_loads(&setup, &loads, 1, rng.random())? {
                tally.add(&profiler.profile(&reading)?, &loads);
            }
        }
        let percent = |count: u64, of: u64| 100.0 * count as f64 / of.max(1) as f64;
        let (covered, of) = tally.merged_centres;
        Ok(TableRow {
            sensors: self.sensors.1,
            loads: self.loads.1,
            readings: tally.readings,
            located: percent(tally.located, tally.readings),
            resolved: percent(tally.resolved, tally.readings),
            merged: percent(tally.merged, tally.readings),
            total: tally.total.figures(),
            centre_of_pressure: tally.centre_of_pressure.figures(),
            patch_force: tally.patch_force.figures(),
            patch_centre: tally.patch_centre.figures(),
            merged_centres: (of > 0).then(|| percent(covered, of)),
        })
    }
}

impl Results {
    /// The table in Markdown.
    pub fn markdown(&self) -> String {
        let mut text = format!("palpate {}, seed {}\n", self.palpate, self.seed);
        for (_, sensors) in SENSORS {
            let _ = writeln!(text, "\n{sensors}; coverage, and median width:\n");
            text += "| loads | located | resolved | merged | total | centre of pressure | patch force | patch centre | centres of merged |\n";
            text += "|---|---|---|---|---|---|---|---|---|\n";
            for row in self.rows.iter().filter(|row| row.sensors == sensors) {
                let _ = writeln!(text, "| {} | {} |", row.loads, row.cells().join(" | "));
            }
        }
        text
    }
}

impl TableRow {
    fn cells(&self) -> Vec<String> {
        let percent = |share: f64| format!("{share:.1} %");
        let interval = |figures: &IntervalFigures, unit: &str, decimals: usize| match figures.coverage {
            None => "–".to_owned(),
            Some(coverage) => match figures.median_width {
                Some(width) => format!("{coverage:.1} %, {width:.decimals$} {unit}"),
                None => format!("{coverage:.1} %, unbounded"),
            },
        };
        vec![
            percent(self.located),
            percent(self.resolved),
            percent(self.merged),
            interval(&self.total, "N", 2),
            interval(&self.centre_of_pressure, "mm", 1),
            interval(&self.patch_force, "N", 2),
            interval(&self.patch_centre, "mm", 1),
            self.merged_centres.map_or("–".to_owned(), percent),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A heavy load beside a support hides a light one in mid-span from the profile, but not from the reading.
    #[test]
    fn resolves_a_light_load_beside_a_heavy_one_and_covers_their_centre_of_pressure() {
        let case = Case { sensors: SENSORS[2], loads: LOADS[3] };
        let row = case.row(Options { readings: 12, seed: 0 }).unwrap();
        // Of 12 intervals that cover 95 %, fewer than 9 cover with a probability of 3 in 1,000.
        let coverage = [row.total, row.centre_of_pressure, row.patch_force, row.patch_centre];
        assert!(coverage.iter().all(|figures| figures.coverage >= Some(75.0)), "{row:?}");
        assert!(row.resolved >= 75.0 && row.merged < 1.0, "{row:?}");
    }

    #[test]
    fn random_loads_are_disjoint_and_of_the_drawn_kind() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
        for (loads, _) in LOADS {
            for _ in 0..50 {
                let drawn = loads.draw(&mut rng);
                assert!(drawn.windows(2).all(|pair| pair[0].to().x_m <= pair[1].from().x_m), "{drawn:?}");
                let is_beside = drawn.iter().any(is_beside_support);
                let is_kind = match loads {
                    Loads::BesideSupport => is_beside,
                    Loads::Random => true,
                    _ => !is_beside,
                };
                assert!(is_kind, "{loads:?} {drawn:?}");
            }
        }
    }
}
