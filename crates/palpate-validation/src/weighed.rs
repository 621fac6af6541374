use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::statistics::{Sample, Share};
use crate::surfaces::paper_beam;
use crate::table::{Column, Goal, Row as TableRow, Table};
use anyhow::{Context, Result};
use palpate::estimators::simulate::clean_reading;
use palpate::prelude::{
    Contact, Fit, FitTask, Influence, Locate, Position, Recording, Row, Setup, Status, mm, newtons, um,
};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

pub const EXPERIMENT: Experiment = Experiment {
    name: "weight-without-untouched-rows",
    title: "Raw channels pressed with a weight, never untouched",
    method: "The founding paper's beam as eight raw channels with the noise of 5 µm is pressed with a weight of 3 N several times at each of some even places, without a column of forces or \
             untouched rows. The weight is located at five places by five boards in turn; a place counts as covered if its interval contains it or the reading is `outside_model`.",
    seed: 16,
    run,
};

const BOARDS: u64 = 5;
const CONTACTS_MM: [f64; 5] = [30.0, 50.0, 80.0, 120.0, 200.0];
/// Places, times at each, and outermost distance from the ends in mm; quick ones first.
const CASES: [(usize, usize, f64); 6] =
    [(6, 5, 40.0), (8, 4, 30.0), (12, 2, 20.0), (12, 3, 16.7), (20, 2, 20.0), (12, 10, 20.0)];

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let (cases, readings) = (&CASES[..size.pick(CASES.len(), 2)], size.pick(1000, 100));
    let rows = in_parallel(cases, |case| rows(*case, readings), |case| name(*case), progress);
    let columns = vec![
        Column::percent("covered or outside model", Goal::COVERAGE),
        Column::percent("outside model", Goal::Smaller),
        Column::mm("mean width", Goal::None),
        Column::mm("mean error", Goal::Smaller),
    ];
    let mut table = Table::new("The weight at a place.", &["places × times", "contact"], columns);
    table.rows = rows.into_iter().collect::<Result<Vec<_>>>()?.concat();
    Ok(vec![table])
}

fn name((places, times, _): (usize, usize, f64)) -> String {
    format!("{places} × {times}")
}

fn rows(case: (usize, usize, f64), readings: u64) -> Result<Vec<TableRow>> {
    let (places, times, from_mm) = case;
    let beam = paper_beam(um(5.0))?;
    let setup = Setup::measured(mm(400.0), &["a", "b", "c", "d", "e", "f", "g", "h"])?;
    let setup = setup.known_force(newtons(3.0))?;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(EXPERIMENT.seed);
    let mut locators = Vec::new();
    for _ in 0..BOARDS {
        let place = |i: usize| from_mm + (400.0 - 2.0 * from_mm) * i as f64 / (places - 1) as f64;
        let rows = (0..places * times).map(|i| weight(&beam, place(i / times), &mut rng));
        let recording = Recording::new(setup.layout(), "weighed", rows.collect::<Result<_>>()?);
        locators.push(Influence::default().fit_method(FitTask::new(&setup, &recording))?);
    }
    let mut rows = Vec::new();
    for contact_mm in CONTACTS_MM {
        let [mut covered, mut outside] = [Share::default(), Share::default()];
        let [mut widths_mm, mut errors_mm] = [Sample::default(), Sample::default()];
        for number in 0..readings {
            let board = number % BOARDS;
            let row = weight(&beam, contact_mm, &mut rng)?;
            let estimate = locators[board as usize].locate(&row.reading);
            let uncertainty = estimate.contact.uncertainty.context("the estimate has no interval")?;
            let (low_m, high_m) = uncertainty.x_95_m;
            let is_outside = estimate.status == Status::OutsideModel;
            outside.add(board, is_outside);
            covered.add(board, is_outside || (low_m..=high_m).contains(&row.position.x_m));
            widths_mm.add(board, 1e3 * (high_m - low_m));
            errors_mm.add(board, 1e3 * estimate.contact.position.distance_m(row.position));
        }
        let figures = vec![covered.percent(), outside.percent(), widths_mm.mean(), errors_mm.mean()];
        rows.push(TableRow::new(&[&name(case), &format!("{contact_mm} mm")], figures));
    }
    Ok(rows)
}

/// In units of the noise.
fn weight(beam: &Setup, contact_mm: f64, rng: &mut Xoshiro256PlusPlus) -> Result<Row> {
    let surface = beam.surface().model().context("the beam has a model")?;
    let position = Position::along(mm(contact_mm));
    let clean = clean_reading(surface, beam.layout(), Contact { position, force_n: 3.0 });
    let reading = clean.into_iter().map(|value| {
        let noise: f64 = StandardNormal.sample(rng);
        value / um(5.0) + noise
    });
    Ok(Row { position, force_n: None, nuisances: Vec::new(), time_s: None, reading: reading.collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_weight_is_located_where_it_stands() {
        let rows = rows(CASES[1], 10).unwrap();
        assert_eq!(rows.len(), CONTACTS_MM.len());
        // Near an end the deflections of the sensors differ by more than their noise.
        assert!(rows[0].figures[3].unwrap().value < 1.0, "{:?}", rows[0]);
    }
}
