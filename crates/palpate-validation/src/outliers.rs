//! Wrong presses among right ones: how many are excluded.

use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::raw_bench::RawBench;
use crate::statistics::Share;
use crate::strips::{PRESS_ERRORS, PressErrors, record_with_errors};
use crate::table::{Column, Goal, Row as TableRow, Table};
use anyhow::{Result, bail};
use palpate::estimators::influence::{InfluenceLocator, Structure};

pub const EXPERIMENT: Experiment = Experiment {
    name: "outliers",
    title: "Excluded presses of raw strips and plates",
    method: "Benches of `raw-strips`, with errors of forces and places as in `scattered-presses`, are fitted twice. The second time one press in 50 is recorded 60 mm beside its place, and \
             another one has 100 counts more on one gauge; all others are right.",
    seed: 0,
    run,
};

/// Where a press is moved to: this far, towards the farther end.
const MOVED_M: f64 = 0.06;
/// In counts.
const MISREAD: f64 = 100.0;
/// Presses to a wrong one of each kind.
const PRESSES_TO_ONE: usize = 50;

#[derive(Clone, Copy)]
enum Bench {
    Strip {
        presses: usize,
        places: usize,
    },
    Plate,
    /// Pressed at random places.
    PlateOf(usize),
}

impl Bench {
    fn name(self) -> String {
        match self {
            Self::Strip { presses, places } => format!("strip, {presses} presses at {places} places"),
            Self::Plate => "plate, 160 presses at 80 places".to_owned(),
            Self::PlateOf(presses) => format!("plate, {presses} presses at random places"),
        }
    }

    fn raw_bench(self, seed: u64) -> Result<RawBench> {
        match self {
            Self::Strip { presses, places } => RawBench::strip(seed, presses, places),
            Self::Plate => RawBench::plate(seed),
            Self::PlateOf(presses) => {
                let mut bench = RawBench::plate(seed)?;
                bench.presses = bench.touches(presses);
                Ok(bench)
            }
        }
    }
}

struct Case {
    bench: Bench,
    errors: (PressErrors, &'static str),
    benches: u64,
}

impl Case {
    fn labels(&self) -> [String; 2] {
        [self.bench.name(), self.errors.1.to_owned()]
    }

    fn columns() -> Vec<Column> {
        vec![
            Column::percent("recordings without wrong presses that lose one", Goal::Smaller),
            Column::percent("right presses excluded beside wrong ones", Goal::Smaller),
            Column::percent("wrong places found", Goal::Larger),
            Column::percent("misread gauges found", Goal::Larger),
        ]
    }

    fn row(&self) -> Result<TableRow> {
        let [mut loses, mut right, mut moved, mut misread] = [(); 4].map(|()| Share::default());
        for seed in 0..self.benches {
            let mut bench = self.bench.raw_bench(seed)?;
            record_with_errors(&mut bench, self.errors.0);
            loses.add(seed, !excluded(&bench)?.is_empty());
            let wrong = WrongPresses::new(&mut bench);
            let excluded = excluded(&bench)?;
            for row in 0..bench.presses.len() {
                let share = match (wrong.moved.contains(&row), wrong.misread.contains(&row)) {
                    (true, _) => &mut moved,
                    (_, true) => &mut misread,
                    _ => &mut right,
                };
                share.add(seed, excluded.contains(&row));
            }
        }
        let figures = [loses, right, moved, misread].iter().map(Share::percent).collect();
        Ok(TableRow::new(&self.labels().each_ref().map(String::as_str), figures))
    }
}

struct WrongPresses {
    moved: Vec<usize>,
    misread: Vec<usize>,
}

impl WrongPresses {
    fn new(bench: &mut RawBench) -> Self {
        let rows = bench.presses.len();
        let of_kind = |first: usize| (first..rows).step_by(PRESSES_TO_ONE).collect();
        let wrong = Self { moved: of_kind(PRESSES_TO_ONE / 3), misread: of_kind(PRESSES_TO_ONE / 2 - 1) };
        let middle_m = 0.5 * bench.extent.length_m();
        for row in &wrong.moved {
            let x_m = &mut bench.presses[*row].position.x_m;
            *x_m += if *x_m < middle_m { MOVED_M } else { -MOVED_M };
        }
        for row in &wrong.misread {
            bench.presses[*row].reading[2] += MISREAD;
        }
        wrong
    }
}

/// Excluded rows, from 0.
fn excluded(bench: &RawBench) -> Result<Vec<usize>> {
    match bench.fit(Structure::ForceLinear, None)? {
        InfluenceLocator::ForceLinear(locator) => Ok(locator.set_aside().to_vec()),
        _ => bail!("the structure is force-linear"),
    }
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let strip = |presses, places| Bench::Strip { presses, places };
    let mut cases = Vec::new();
    for errors in PRESS_ERRORS {
        cases.push(Case { bench: strip(25, 9), errors, benches: size.pick(25, 2) });
        cases.push(Case { bench: strip(60, 15), errors, benches: size.pick(25, 1) });
        cases.push(Case { bench: strip(120, 30), errors, benches: size.pick(8, 1) });
    }
    let as_recorded = PRESS_ERRORS[0];
    cases.push(Case { bench: Bench::Plate, errors: as_recorded, benches: size.pick(25, 1) });
    if size == Size::Full {
        cases.push(Case { bench: Bench::PlateOf(450), errors: as_recorded, benches: 6 });
    }
    let rows = in_parallel(&cases, Case::row, |case| case.labels().join(", "), progress);
    let mut table = Table::new("Shares of all benches.", &["bench", "presses"], Case::columns());
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}
