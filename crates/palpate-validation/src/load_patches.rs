use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::statistics::{Sample, Share};
use crate::surfaces::paper_beam;
use crate::table::{Column, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::estimator::{LoadProfile, patch_limits};
use palpate::prelude::{Profiler, Setup, Strain, UniformLoad, simulate_loads};
use palpate::prelude::{microstrain, mm, um};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

pub const EXPERIMENT: Experiment = Experiment {
    name: "load-patches",
    title: "Patches and totals of load profiles",
    method: "Even loads lie on the founding paper's beam over eight deflection sensors with 2 µm noise, with or without eight strain sensors with 0.5 µε; totals by distance have deflection \
             sensors with 5 µm. Figures of patches count readings with as many patches as loads, and are those of the outermost load where there are two at random.",
    seed: 1,
    run,
};

const BEAM_M: f64 = 0.4;

fn setup(deflection_um: f64, has_strain: bool) -> Result<Setup> {
    let setup = paper_beam(um(deflection_um))?;
    Ok(if has_strain { setup.sensors(Strain.evenly(8).noise(microstrain(0.5)))? } else { setup })
}

fn pad(centre_m: f64, force_n: f64) -> UniformLoad {
    UniformLoad::along(centre_m - mm(10.0), centre_m + mm(10.0), force_n)
}

fn profile(
    setup: &Setup,
    profiler: &Profiler,
    loads: &[UniformLoad],
    rng: &mut Xoshiro256PlusPlus,
) -> Result<LoadProfile> {
    let reading = simulate_loads(setup, loads, 1, rng.random())?;
    Ok(profiler.profile(reading.first().context("one reading was simulated")?)?)
}

fn contains((low, high): (f64, f64), value: f64) -> bool {
    low <= value && value <= high
}

fn total_n(loads: &[UniformLoad]) -> f64 {
    loads.iter().map(UniformLoad::force_n).sum()
}

fn centre_m(loads: &[UniformLoad]) -> f64 {
    loads.iter().map(|load| load.force_n() * load.centre().x_m).sum::<f64>() / total_n(loads)
}

#[derive(Clone, Copy, Debug)]
enum Case {
    /// 2 N each, 120 mm apart.
    TwoPads { has_strain: bool },
    /// One load, or two at least 100 mm apart; range of the outermost centre's distance from a support.
    Patches { is_two: bool, distance_m: (f64, f64) },
    /// With 4 N.
    WholeBeam,
    /// One or two pads; distance as for `Patches`.
    Totals { distance_m: (f64, f64) },
}

const PATCH_DISTANCES_M: [(f64, f64); 6] =
    [(0.001, 0.01), (0.01, 0.02), (0.02, 0.04), (0.04, 0.06), (0.06, 0.1), (0.1, 0.2)];
const TOTAL_DISTANCES_M: [(f64, f64); 5] =
    [(0.01, 0.015), (0.015, 0.02), (0.02, 0.04), (0.04, 0.1), (0.1, 0.2)];

fn cases() -> Vec<Case> {
    let mut cases = vec![Case::WholeBeam];
    cases.extend([true, false].map(|has_strain| Case::TwoPads { has_strain }));
    for is_two in [false, true] {
        cases.extend(PATCH_DISTANCES_M.map(|distance_m| Case::Patches { is_two, distance_m }));
    }
    cases.extend(TOTAL_DISTANCES_M.map(|distance_m| Case::Totals { distance_m }));
    cases
}

fn range_mm((from_m, to_m): (f64, f64)) -> String {
    format!("{:.0}–{:.0} mm", 1e3 * from_m, 1e3 * to_m)
}

impl Case {
    fn label(self) -> String {
        match self {
            Self::TwoPads { has_strain: true } => "deflection and strain".to_owned(),
            Self::TwoPads { has_strain: false } => "deflection alone".to_owned(),
            Self::Patches { is_two, distance_m } => {
                format!("{}, {}", if is_two { "two" } else { "one" }, range_mm(distance_m))
            }
            Self::WholeBeam => "4 N on 0–400 mm".to_owned(),
            Self::Totals { distance_m } => range_mm(distance_m),
        }
    }

    const fn table(self) -> usize {
        match self {
            Self::TwoPads { .. } => 0,
            Self::Patches { .. } | Self::WholeBeam => 1,
            Self::Totals { .. } => 2,
        }
    }

    fn row(self, readings: u64) -> Result<Row> {
        match self {
            Self::TwoPads { has_strain } => self.two_pads(has_strain, readings),
            Self::Patches { is_two, distance_m } => self.patches(is_two, distance_m, readings),
            Self::WholeBeam => {
                let setup = setup(2.0, true)?;
                let profiler = Profiler::from_setup(&setup)?;
                let (mut rng, load) = (rng(), UniformLoad::along(0.0, BEAM_M, 4.0));
                let mut tally = PatchTally::default();
                for number in 0..readings {
                    tally.add(number, &profile(&setup, &profiler, &[load], &mut rng)?, &[load], 0);
                }
                Ok(tally.row(&self.label()))
            }
            Self::Totals { distance_m } => self.totals(distance_m, readings),
        }
    }

    fn two_pads(self, has_strain: bool, readings: u64) -> Result<Row> {
        let setup = setup(2.0, has_strain)?;
        let profiler = Profiler::from_setup(&setup)?;
        let loads = [pad(0.14, 2.0), pad(0.26, 2.0)];
        let limits = patch_limits(profiler.sensors(), &loads).context("the loads have no limit")?;
        let mut rng = rng();
        let [mut two, mut within_limits, mut within_percent] =
            [Share::default(), Share::default(), Share::default()];
        let [mut centres, mut forces, mut total, mut pressure] =
            [Share::default(), Share::default(), Share::default(), Share::default()];
        let mut squares = Sample::default();
        for number in 0..readings {
            let profile = profile(&setup, &profiler, &loads, &mut rng)?;
            within_percent.add(number, (profile.total_n / 4.0 - 1.0).abs() <= 0.02);
            total.add(number, contains(profile.bounds.total_95_n, 4.0));
            pressure.add(number, profile.centre.is_some_and(|centre| contains(centre.x_95_m, 0.2)));
            let [left, right] = profile.patches[..] else {
                two.add(number, false);
                within_limits.add(number, false);
                continue;
            };
            two.add(number, true);
            let mut is_within = true;
            for ((patch, load), limit) in [left, right].iter().zip(&loads).zip(&limits) {
                let deviation = (patch.centre.position.x_m - load.centre().x_m) / limit.sd_x_m;
                is_within &= deviation.abs() <= 3.0;
                squares.add(number, deviation * deviation);
                centres.add(number, contains(patch.centre.x_95_m, load.centre().x_m));
                forces.add(number, contains(patch.force_95_n, load.force_n()));
            }
            within_limits.add(number, is_within);
        }
        let shares = [&two, &within_limits, &within_percent, &centres, &forces, &total, &pressure];
        let mut figures: Vec<_> = shares.map(Share::percent).into();
        figures.push(squares.mean());
        Ok(Row::new(&[&self.label()], figures))
    }

    fn patches(self, is_two: bool, (from_m, to_m): (f64, f64), readings: u64) -> Result<Row> {
        let setups = [setup(2.0, true)?, setup(2.0, false)?];
        let profilers = [Profiler::from_setup(&setups[0])?, Profiler::from_setup(&setups[1])?];
        let (mut rng, mut tally) = (rng(), PatchTally::default());
        for number in 0..readings {
            let centre_m = rng.random_range(from_m..to_m);
            let mut loads = vec![random_load(centre_m, &mut rng)];
            if is_two {
                let other_m = rng.random_range(centre_m + 0.1..BEAM_M - f64::min(centre_m, 0.1));
                loads.push(random_load(other_m, &mut rng));
            }
            let is_mirrored = number % 4 > 1;
            if is_mirrored {
                // Beside the other support.
                let mirror = |load: &UniformLoad| {
                    UniformLoad::along(BEAM_M - load.to().x_m, BEAM_M - load.from().x_m, load.force_n())
                };
                loads = loads.iter().rev().map(mirror).collect();
            }
            let bench = (number % 2) as usize;
            let profile = profile(&setups[bench], &profilers[bench], &loads, &mut rng)?;
            tally.add(number, &profile, &loads, if is_mirrored { loads.len() - 1 } else { 0 });
        }
        Ok(tally.row(&self.label()))
    }

    fn totals(self, (from_m, to_m): (f64, f64), readings: u64) -> Result<Row> {
        let setup = setup(5.0, false)?;
        let profiler = Profiler::from_setup(&setup)?;
        let mut rng = rng();
        let [mut covered, mut beyond, mut beyond_covered] =
            [Share::default(), Share::default(), Share::default()];
        for number in 0..readings {
            let outermost_m = rng.random_range(from_m..to_m);
            let mut loads = vec![pad(outermost_m, rng.random_range(0.5..4.0))];
            if number % 2 == 1 {
                let other_m = rng.random_range(outermost_m..BEAM_M - outermost_m);
                loads.push(pad(other_m, rng.random_range(0.5..4.0)));
            }
            let bounds = profile(&setup, &profiler, &loads, &mut rng)?.bounds;
            covered.add(number, contains(bounds.total_95_n, total_n(&loads)));
            let is_beyond = loads[0].from().x_m >= bounds.margin_m;
            beyond.add(number, is_beyond);
            if is_beyond {
                beyond_covered.add(number, contains(bounds.seen_95_n, total_n(&loads)));
            }
        }
        let shares = [&covered, &beyond, &beyond_covered].map(Share::percent);
        Ok(Row::new(&[&self.label()], shares.into()))
    }
}

fn rng() -> Xoshiro256PlusPlus {
    Xoshiro256PlusPlus::seed_from_u64(EXPERIMENT.seed)
}

/// 1 to 60 mm and 0.5 to 20 N, as wide as the beam allows.
fn random_load(centre_m: f64, rng: &mut Xoshiro256PlusPlus) -> UniformLoad {
    let widest_m = f64::min(0.06, 2.0 * centre_m.min(BEAM_M - centre_m));
    let half_m = 0.5 * rng.random_range(0.001..widest_m.max(0.0011));
    let force_n = 0.5 * 40_f64.powf(rng.random_range(0.0..1.0));
    UniformLoad::along((centre_m - half_m).max(0.0), (centre_m + half_m).min(BEAM_M), force_n)
}

/// Of one load per reading.
#[derive(Default)]
struct PatchTally {
    detected: Share,
    force: Share,
    bounded: Share,
    centre: Share,
    centre_of_pressure: Share,
    total: Share,
}

impl PatchTally {
    /// Adds a profile; patch figures are those of `load`.
    fn add(&mut self, reading: u64, profile: &LoadProfile, loads: &[UniformLoad], load: usize) {
        self.total.add(reading, contains(profile.bounds.total_95_n, total_n(loads)));
        self.detected.add(reading, profile.patches.len() == loads.len());
        if profile.patches.len() != loads.len() {
            return;
        }
        if let Some(centre) = profile.centre {
            self.centre_of_pressure.add(reading, contains(centre.x_95_m, centre_m(loads)));
        }
        let (patch, load) = (&profile.patches[load], &loads[load]);
        self.force.add(reading, contains(patch.force_95_n, load.force_n()));
        self.centre.add(reading, contains(patch.centre.x_95_m, load.centre().x_m));
        self.bounded.add(reading, patch.force_95_n.1.is_finite());
    }

    fn row(&self, label: &str) -> Row {
        let shares =
            [&self.detected, &self.force, &self.bounded, &self.centre, &self.centre_of_pressure, &self.total];
        Row::new(&[label], shares.map(Share::percent).into())
    }
}

fn tables() -> [Table; 3] {
    let larger = |name: &str| Column::percent(name, Goal::Larger);
    let covered = |name: &str| Column::percent(name, Goal::COVERAGE);
    let two_pads = vec![
        larger("two patches"),
        larger("both centres within 3 limits"),
        larger("total within 2 %"),
        covered("centres covered"),
        covered("forces covered"),
        covered("total covered"),
        covered("centre of pressure covered"),
        Column::new("mean square error of the centres over the limit's", "", Goal::Smaller),
    ];
    let patches = vec![
        larger("patches detected"),
        covered("force covered"),
        Column::percent("force bounded", Goal::None),
        covered("centre covered"),
        covered("centre of pressure covered"),
        covered("total covered"),
    ];
    let totals = vec![
        covered("total covered, loads of any shape"),
        Column::percent("beyond the margin", Goal::None),
        covered("of these covered, loads beyond the margin"),
    ];
    [
        Table::new("Two pads of 20 mm and 2 N each, at 140 and 260 mm.", &["sensors"], two_pads),
        Table::new(
            "Loads of 1 to 60 mm and 0.5 to 20 N, by the distance of the outermost centre from a support; two are at least 100 mm apart.",
            &["loads"],
            patches,
        ),
        Table::new(
            "One or two pads of 20 mm and 0.5 to 4 N, by the distance of the outermost centre from a support.",
            &["centre"],
            totals,
        ),
    ]
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let readings = |case: Case| match case {
        Case::TwoPads { .. } => size.pick(200, 6),
        Case::WholeBeam => size.pick(400, 6),
        Case::Patches { .. } | Case::Totals { .. } => size.pick(500, 4),
    };
    let cases = cases();
    let rows = in_parallel(&cases, |case| case.row(readings(*case)), |case| case.label(), progress);
    let mut tables = tables();
    for (case, row) in cases.iter().zip(rows) {
        tables[case.table()].rows.push(row?);
    }
    Ok(tables.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_the_columns_of_their_tables() {
        let tables = tables();
        for case in cases() {
            let row = case.row(1).unwrap();
            assert_eq!(row.figures.len(), tables[case.table()].columns.len(), "{case:?}");
        }
    }

    #[test]
    fn two_pads_are_two_patches_with_strain() {
        let row = Case::TwoPads { has_strain: true }.row(6).unwrap();
        assert_eq!(row.figures[0].map(|figure| figure.value), Some(100.0));
        // The mean square of 12 standard normal deviations is beyond 3 in one sample of 5,000.
        assert!(row.figures[7].unwrap().value < 3.0, "{row:?}");
    }
}
