use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::statistics::{Sample, Share};
use crate::table::{Column, Figure, Goal, Row, Table};
use anyhow::Result;
use palpate::estimators::estimator::{LoadProfile, Patch};
use palpate::prelude::{Beam, Deflection, Profiler, Setup, Status, Strain, UniformLoad, simulate_loads};
use palpate::prelude::{gpa, microstrain, mm, newtons, um};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

pub const EXPERIMENT: Experiment = Experiment {
    name: "load-profiles",
    title: "Load profiles of random loads",
    method: "Loads on the founding paper's beam are drawn at random or stand where the row says, and a load profile is estimated from each noisy reading. Figures of patches count readings \
             with as many patches as loads; widths are those of 95 % intervals.",
    seed: 0,
    run,
};

const SEED: u64 = EXPERIMENT.seed;

const LENGTH_MM: f64 = 400.0;
/// Of random loads.
const WIDTHS_MM: (f64, f64) = (10.0, 100.0);
/// Of random loads.
const FORCES_N: (f64, f64) = (1.0, 20.0);
/// Distance of the nearer end from a support below which a load is beside it.
const BESIDE_MM: f64 = 10.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sensors {
    /// Eight, with 5 µm noise.
    Deflection5,
    /// Eight, with 2 µm noise.
    Deflection2,
    /// Eight each, with 2 µm and 0.5 µε noise.
    DeflectionAndStrain,
}

const SENSORS: [(Sensors, &str); 3] = [
    (Sensors::Deflection5, "deflection, 5 µm"),
    (Sensors::Deflection2, "deflection, 2 µm"),
    (Sensors::DeflectionAndStrain, "deflection, 2 µm, and strain, 0.5 µε"),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Loads {
    /// One to three, disjoint.
    Random,
    /// Random, with one beside a support.
    BesideSupport,
    /// Random, with none beside a support.
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

#[derive(Clone, Debug, Default)]
struct Intervals {
    covered: Share,
    bounded: Share,
    widths: Sample,
}

impl Intervals {
    fn add(&mut self, reading: u64, (low, high): (f64, f64), truth: f64) {
        self.covered.add(reading, (low..=high).contains(&truth));
        self.bounded.add(reading, high.is_finite());
        self.widths.add(reading, high - low);
    }

    /// Coverage, share with an upper end, and median width unless infinite.
    fn figures(&self) -> [Option<Figure>; 3] {
        [self.covered.percent(), self.bounded.percent(), self.widths.median()]
    }
}

#[derive(Default)]
struct Tally {
    located: Share,
    resolved: Share,
    merged: Share,
    total: Intervals,
    centre_of_pressure: Intervals,
    patch_force: Intervals,
    patch_centre: Intervals,
    /// Loads centred in a patch's interval, in readings with fewer patches than loads.
    merged_centres: Share,
}

impl Tally {
    fn add(&mut self, reading: u64, profile: &LoadProfile, loads: &[UniformLoad]) {
        self.located.add(reading, profile.status == Status::Located);
        let total_n: f64 = loads.iter().map(UniformLoad::force_n).sum();
        let moment: f64 = loads.iter().map(|load| load.force_n() * load.centre().x_m).sum();
        self.total.add(reading, profile.bounds.total_95_n, total_n);
        if let Some(centre) = profile.centre {
            self.centre_of_pressure.add(reading, in_mm(centre.x_95_m), 1e3 * moment / total_n);
        }
        self.resolved.add(reading, profile.patches.len() == loads.len());
        self.merged.add(reading, profile.patches.len() < loads.len());
        if profile.patches.len() == loads.len() {
            for (patch, load) in profile.patches.iter().zip(loads) {
                self.patch_force.add(reading, patch.force_95_n, load.force_n());
                self.patch_centre.add(reading, in_mm(patch.centre.x_95_m), 1e3 * load.centre().x_m);
            }
        } else if profile.patches.len() < loads.len() {
            let contains = |patch: &Patch, load: &UniformLoad| {
                let (low_m, high_m) = patch.centre.x_95_m;
                (low_m..=high_m).contains(&load.centre().x_m)
            };
            for load in loads {
                let is_contained = profile.patches.iter().any(|patch| contains(patch, load));
                self.merged_centres.add(reading, is_contained);
            }
        }
    }

    fn row(&self, labels: &[&str]) -> Row {
        let mut figures = vec![self.located.percent(), self.resolved.percent(), self.merged.percent()];
        for intervals in [&self.total, &self.centre_of_pressure, &self.patch_force, &self.patch_centre] {
            figures.extend(intervals.figures());
        }
        figures.push(self.merged_centres.percent());
        Row::new(labels, figures)
    }
}

fn columns() -> Vec<Column> {
    let mut columns = vec![
        Column::percent("located", Goal::Larger),
        Column::percent("as many patches as loads", Goal::Larger),
        Column::percent("fewer patches", Goal::Smaller),
    ];
    for (quantity, unit) in
        [("total", "N"), ("centre of pressure", "mm"), ("patch force", "N"), ("patch centre", "mm")]
    {
        columns.extend([
            Column::percent(&format!("{quantity} covered"), Goal::COVERAGE),
            Column::percent(&format!("{quantity} bounded"), Goal::None),
            Column::new(&format!("{quantity}, median width"), unit, Goal::None),
        ]);
    }
    columns.push(Column::percent("centres of merged loads covered", Goal::None));
    columns
}

fn in_mm((low_m, high_m): (f64, f64)) -> (f64, f64) {
    (1e3 * low_m, 1e3 * high_m)
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let readings = size.pick(200, 4);
    let cases: Vec<Case> =
        SENSORS.into_iter().flat_map(|sensors| LOADS.map(|loads| Case { sensors, loads })).collect();
    let rows = in_parallel(&cases, |case| case.row(readings), |case| case.loads.1.to_owned(), progress);
    let mut table = Table::new("Random and fixed loads.", &["sensors", "loads"], columns());
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}

struct Case {
    sensors: (Sensors, &'static str),
    loads: (Loads, &'static str),
}

impl Case {
    fn row(&self, readings: u64) -> Result<Row> {
        Ok(self.tally(readings)?.row(&[self.sensors.1, self.loads.1]))
    }

    fn tally(&self, readings: u64) -> Result<Tally> {
        let setup = self.sensors.0.setup()?;
        let profiler = Profiler::from_setup(&setup)?;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(SEED);
        let mut tally = Tally::default();
        for number in 0..readings {
            let loads = self.loads.0.draw(&mut rng);
            for reading in simulate_loads(&setup, &loads, 1, rng.random())? {
                tally.add(number, &profiler.profile(&reading)?, &loads);
            }
        }
        Ok(tally)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A heavy load beside a support hides a light one in mid-span from the profile, but not from the reading.
    #[test]
    fn resolves_a_light_load_beside_a_heavy_one_and_covers_their_centre_of_pressure() {
        let case = Case { sensors: SENSORS[2], loads: LOADS[3] };
        let tally = case.tally(12).unwrap();
        let share = |share: &Share| share.percent().unwrap().value;
        // Of 12 intervals that cover 95 %, fewer than 9 cover with a probability of 3 in 1,000.
        for intervals in [&tally.total, &tally.centre_of_pressure, &tally.patch_force, &tally.patch_centre] {
            assert!(share(&intervals.covered) >= 75.0, "{intervals:?}");
        }
        assert!(share(&tally.resolved) >= 75.0 && share(&tally.merged) < 1.0);
        assert_eq!(case.row(1).unwrap().figures.len(), columns().len());
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
