use crate::coverage::Coverage;
use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::raw_bench::{Influences, RawBench};
use crate::surfaces::paper_beam;
use crate::table::{Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::influence::{InfluenceLocator, Structure};
use palpate::estimators::simulate::CleanSensors;
use palpate::mechanics::sensing::SensorKind;
use palpate::mechanics::surface::Surface;
use palpate::prelude::{Contact, Extent, Locate, Plate, Position, gpa, mm, um};
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::sync::Arc;

pub const BEAMS: Experiment = Experiment {
    name: "measured-beam-ends",
    title: "Contacts near the ends of a beam of raw channels",
    method: "The founding paper's beam as eight raw channels, each with the noise of 5 µm, is pressed at a few even places with 0.5 to 5 N, or with 3 N where the force is known. Contacts at fixed \
             distances from the left end are located by the boards in turn; all but the share of detected contacts is of the detected ones.",
    seed: 0,
    run: run_beams,
};

pub const PLATES: Experiment = Experiment {
    name: "measured-plate-edges",
    title: "Contacts near the edges of a plate of raw channels",
    method: "The plate of `examples/plate.toml` as nine raw channels, each with the noise of 5 µm, is pressed three times at each of 6 × 6 or 4 × 4 places with 0.5 to 5 N. Contacts at fixed \
             distances from the left edge, 60 mm or more from the others, are located by the boards in turn; all but the share of detected contacts is of the detected ones.",
    seed: 0,
    run: run_plates,
};

/// One count of a channel, in metres.
const NOISE_M: f64 = 5e-6;
const BEAM_M: f64 = 0.4;
const PLATE_SIDE_M: f64 = 0.3;

#[derive(Clone, Copy, Debug)]
struct Repetitions {
    boards: u64,
    readings: u64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Pressed {
    /// 3 N each, with an untouched row after.
    Alike,
    /// 0.5 to 5 N.
    Variously,
}

struct BeamCase {
    places: usize,
    times: usize,
    /// First and last place.
    span_mm: (f64, f64),
    pressed: Pressed,
    is_known: bool,
    forces_n: &'static [f64],
    contacts_mm: &'static [f64],
}

const NEAR_MM: [f64; 9] = [1.0, 3.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 200.0];
const BETWEEN_MM: [f64; 6] = [20.0, 45.0, 60.0, 75.0, 120.0, 200.0];

const fn unknown(places: usize, times: usize, from_mm: f64, pressed: Pressed) -> BeamCase {
    let (span_mm, forces_n) = ((from_mm, 400.0 - from_mm), &[1.0, 3.0]);
    BeamCase { places, times, span_mm, pressed, is_known: false, forces_n, contacts_mm: &NEAR_MM }
}

const fn known(places: usize, times: usize, from_mm: f64) -> BeamCase {
    let case = unknown(places, times, from_mm, Pressed::Alike);
    BeamCase { is_known: true, forces_n: &[3.0], ..case }
}

const fn few_places(times: usize) -> BeamCase {
    let case = unknown(6, times, 40.0, Pressed::Variously);
    BeamCase { forces_n: &[3.0], contacts_mm: &BETWEEN_MM, ..case }
}

/// Quick ones first.
const BEAM_CASES: [BeamCase; 10] = [
    few_places(1),
    few_places(3),
    unknown(12, 3, 16.7, Pressed::Variously),
    known(12, 3, 16.7),
    unknown(12, 3, 16.7, Pressed::Alike),
    unknown(9, 3, 60.0, Pressed::Variously),
    known(9, 3, 60.0),
    unknown(20, 3, 20.0, Pressed::Variously),
    known(20, 3, 20.0),
    // Slow, as each of a few presses is left out in turn.
    unknown(12, 1, 16.7, Pressed::Variously),
];

fn run_beams(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let repetitions =
        size.pick(Repetitions { boards: 20, readings: 400 }, Repetitions { boards: 2, readings: 40 });
    let cases = &BEAM_CASES[..size.pick(BEAM_CASES.len(), 4)];
    let rows = in_parallel(cases, |case| case.rows(repetitions), BeamCase::name, progress);
    let labels = ["pressed", "force", "from the end"];
    let mut table = Table::new("Contacts at a distance from the end.", &labels, Coverage::line_columns());
    table.rows = rows.into_iter().collect::<Result<Vec<_>>>()?.concat();
    Ok(vec![table])
}

impl BeamCase {
    fn name(&self) -> String {
        let Self { places, times, span_mm: (from_mm, _), .. } = self;
        let forces = if self.pressed == Pressed::Alike { ", 3 N" } else { "" };
        format!("{places} places × {times} from {from_mm} mm{forces}")
    }

    fn bench(&self, seed: u64) -> Result<RawBench> {
        let setup = paper_beam(um(5.0))?;
        let influences: Influences = Box::new(move |position| {
            let contact = Contact { position, force_n: 1.0 };
            let model = setup.surface().model();
            let clean = model.map(|model| CleanSensors::new(model, setup.layout()).reading(contact));
            clean.into_iter().flatten().map(|value| value / NOISE_M).collect()
        });
        let at = |i: usize| {
            let share = (i % self.places) as f64 / (self.places - 1) as f64;
            Position::along(mm(self.span_mm.0 + share * (self.span_mm.1 - self.span_mm.0)))
        };
        let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let all: Vec<Position> = (0..self.times * self.places).map(at).collect();
        let mut bench = RawBench::new(Extent::line(BEAM_M)?, 8, influences, all, rng);
        if self.pressed == Pressed::Alike {
            let positions: Vec<Position> = bench.presses.iter().map(|row| row.position).collect();
            let contacts = positions
                .into_iter()
                .flat_map(|position| [3.0, 0.0].map(|force_n| Contact { position, force_n }));
            bench.presses = contacts.map(|contact| bench.row(contact)).collect();
        }
        Ok(bench)
    }

    fn rows(&self, repetitions: Repetitions) -> Result<Vec<Row>> {
        let known_force_n = self.is_known.then_some(3.0);
        let board = |seed: u64| -> Result<(RawBench, InfluenceLocator)> {
            let bench = self.bench(seed)?;
            let locator = bench.fit(Structure::ForceLinear, known_force_n)?;
            Ok((bench, locator))
        };
        let mut boards = (0..repetitions.boards).map(board).collect::<Result<Vec<_>>>()?;
        let mut rows = Vec::new();
        for force_n in self.forces_n {
            for place_mm in self.contacts_mm {
                let contact = Contact { position: Position::along(mm(*place_mm)), force_n: *force_n };
                let coverage = cover(&mut boards, repetitions.readings, |_| contact);
                let force = format!("{force_n} N{}", if self.is_known { ", known" } else { "" });
                let labels = [self.name(), force, format!("{place_mm} mm")];
                rows.push(Row::new(&labels.each_ref().map(String::as_str), coverage.line_figures()));
            }
        }
        Ok(rows)
    }
}

/// Coverage of contacts drawn by boards in turn.
fn cover(
    boards: &mut [(RawBench, InfluenceLocator)],
    readings: u64,
    mut contact: impl FnMut(&mut Xoshiro256PlusPlus) -> Contact,
) -> Coverage {
    let mut coverage = Coverage::default();
    let count = boards.len() as u64;
    for number in 0..readings {
        let calibration = number % count;
        let (bench, locator) = &mut boards[calibration as usize];
        let contact = contact(&mut bench.rng);
        let reading = bench.reading(contact);
        coverage.add(calibration, &locator.locate(&reading), contact, bench.extent);
    }
    coverage
}

struct PlateCase {
    /// Each way.
    places: usize,
    known_force_n: Option<f64>,
    force_n: f64,
    contacts_mm: &'static [f64],
}

const NEAR_EDGE_MM: [f64; 8] = [3.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0, 150.0];

const fn near_edge(force_n: f64, known_force_n: Option<f64>) -> PlateCase {
    PlateCase { places: 6, known_force_n, force_n, contacts_mm: &NEAR_EDGE_MM }
}

/// Quick ones first.
const PLATE_CASES: [PlateCase; 5] = [
    PlateCase { places: 4, known_force_n: None, force_n: 5.0, contacts_mm: &[10.0, 60.0, 100.0, 150.0] },
    near_edge(5.0, Some(5.0)),
    near_edge(5.0, None),
    near_edge(2.0, None),
    near_edge(2.0, Some(2.0)),
];

fn run_plates(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let repetitions =
        size.pick(Repetitions { boards: 10, readings: 400 }, Repetitions { boards: 1, readings: 40 });
    let cases = &PLATE_CASES[..size.pick(PLATE_CASES.len(), 2)];
    let influences = PlateInfluences::new()?;
    let rows = in_parallel(cases, |case| case.rows(&influences, repetitions), PlateCase::name, progress);
    let labels = ["pressed", "force", "from the edge"];
    let mut table = Table::new("Contacts at a distance from the edge.", &labels, Coverage::plane_columns());
    table.rows = rows.into_iter().collect::<Result<Vec<_>>>()?.concat();
    Ok(vec![table])
}

/// Plate solution that boards share, and nine sensors.
#[derive(Clone)]
struct PlateInfluences {
    plate: Arc<Plate>,
    sensors: Vec<Position>,
}

impl PlateInfluences {
    fn new() -> Result<Self> {
        let side_m = PLATE_SIDE_M;
        let plate = Arc::new(Plate::simply_supported((side_m, side_m), mm(0.8), gpa(200.0), 0.3)?);
        let quarter = |i: usize| side_m * (i + 1) as f64 / 4.0;
        let sensors = (0..9).map(|i| Position { x_m: quarter(i % 3), y_m: quarter(i / 3) }).collect();
        Ok(Self { plate, sensors })
    }

    fn at(&self, position: Position) -> Vec<f64> {
        let influence = |sensor: &Position| self.plate.influence_function(SensorKind::Deflection, *sensor);
        self.sensors.iter().map(|sensor| influence(sensor).at(position) / NOISE_M).collect()
    }
}

impl PlateCase {
    fn name(&self) -> String {
        format!("{0} × {0} places × 3", self.places)
    }

    fn bench(&self, influences: &PlateInfluences, seed: u64) -> Result<RawBench> {
        let at = |i: usize| PLATE_SIDE_M * (i as f64 + 0.5) / self.places as f64;
        let place = |i: usize| Position { x_m: at(i % self.places), y_m: at(i / self.places % self.places) };
        let all = (0..3 * self.places * self.places).map(place).collect();
        let (rng, influences) = (Xoshiro256PlusPlus::seed_from_u64(seed), influences.clone());
        let extent = Extent::plane(PLATE_SIDE_M, PLATE_SIDE_M)?;
        let channels = influences.sensors.len();
        Ok(RawBench::new(extent, channels, Box::new(move |position| influences.at(position)), all, rng))
    }

    fn rows(&self, influences: &PlateInfluences, repetitions: Repetitions) -> Result<Vec<Row>> {
        let board = |seed: u64| -> Result<(RawBench, InfluenceLocator)> {
            let bench = self.bench(influences, seed)?;
            let locator = bench.fit(Structure::ForceLinear, self.known_force_n)?;
            Ok((bench, locator))
        };
        let boards = (0..repetitions.boards).map(board).collect::<Result<Vec<_>>>();
        let mut boards = boards.with_context(|| self.name())?;
        let force =
            format!("{} N{}", self.force_n, if self.known_force_n.is_some() { ", known" } else { "" });
        let mut row = |place_mm: &f64| {
            let coverage = cover(&mut boards, repetitions.readings, |rng| {
                let y_m = rng.random_range(mm(60.0)..PLATE_SIDE_M - mm(60.0));
                Contact { position: Position { x_m: mm(*place_mm), y_m }, force_n: self.force_n }
            });
            let labels = [self.name(), force.clone(), format!("{place_mm} mm")];
            Row::new(&labels.each_ref().map(String::as_str), coverage.plane_figures())
        };
        Ok(self.contacts_mm.iter().map(&mut row).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_have_presses_where_their_case_says() {
        let bench = BEAM_CASES[4].bench(0).unwrap();
        let forces_n: Vec<f64> = bench.presses.iter().take(4).filter_map(|row| row.force_n).collect();
        assert_eq!((bench.presses.len(), forces_n.as_slice()), (72, [3.0, 0.0, 3.0, 0.0].as_slice()));
        assert!((bench.presses[22].position.x_m - mm(383.3)).abs() < 1e-12);
        // The deflection of mid-span under 1 N there, F·l³/48EI, between the fourth and fifth sensor.
        let stiffness = 48.0 * 200e9 * (0.04 * 1.2e-3_f64.powi(3) / 12.0) / 0.4_f64.powi(3);
        let [left, right] = [3, 4].map(|c| (bench.influences)(Position::along(mm(200.0)))[c].abs());
        assert!((left - right).abs() < 1e-9 * left && (0.9..1.0).contains(&(left * NOISE_M * stiffness)));
        let plate = PLATE_CASES[0].bench(&PlateInfluences::new().unwrap(), 0).unwrap();
        assert_eq!(plate.presses.len(), 48);
        assert!((plate.presses[0].position.x_m - mm(37.5)).abs() < 1e-12);
    }
}
