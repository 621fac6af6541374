//! Shared setups of tests, as in the examples.

mod coverage_tally;

pub(crate) use coverage_tally::CoverageTally;

use std::fs::File;

use palpate_core::ContactEstimate;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind::{Deflection, Strain};
use palpate_mechanics::sensing::{ChannelModel, Layout, SensorKind};
use palpate_mechanics::surface::modal::ModalBeam;
use palpate_mechanics::surface::{Beam, Digit, Extent, ForceDirection, Motion, Plate};
use palpate_mechanics::units::{Unit, gpa, microstrain, mm, newtons, um};
use palpate_testing::data;

use crate::arrangement::Training;
use crate::estimate_record::ContactRecord;
use crate::recording::{Columns, Frame, Recording, Row};
use crate::setup::Setup;

#[derive(Clone, Debug)]
pub(crate) struct Example {
    pub setup: Setup,
    pub training: Training,
}

impl Example {
    pub fn simulate(&self, seed: u64) -> Recording {
        self.setup.simulate(&self.training, seed).unwrap()
    }

    pub fn training_setup(&self) -> Setup {
        self.setup.with_training_force(&self.training).unwrap()
    }
}

pub(crate) fn beam() -> Beam {
    Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0)).unwrap()
}

/// Eight deflection sensors, ten positions, known force.
pub(crate) fn paper(noise_m: f64, repeats: usize) -> Example {
    faulty_paper(ChannelModel { noise_sd: noise_m, ..ChannelModel::default() }, repeats)
}

pub(crate) fn faulty_paper(channel: ChannelModel, repeats: usize) -> Example {
    let setup = Setup::new(beam()).sensors(Deflection.evenly(8).channel(channel));
    let setup = setup.and_then(|setup| setup.known_force(newtons(3.0))).unwrap();
    Example { setup, training: Training::even(10).repeated(repeats) }
}

/// Steel plate, pressed at 6 × 6 positions, five times each.
pub(crate) fn plate(elements: usize, channel: ChannelModel) -> Example {
    let plate = Plate::simply_supported((mm(300.0), mm(300.0)), mm(0.8), gpa(200.0), 0.3);
    let plate = plate.and_then(|plate| plate.with_elements(elements));
    let setup = Setup::new(plate.unwrap()).sensors(Deflection.grid(3, 3).channel(channel));
    let setup = setup.and_then(|setup| setup.known_force(newtons(5.0))).unwrap();
    Example { setup, training: Training::grid(6, 6).repeated(5) }
}

/// Five strain gauges, pressed at 24 positions, twice each.
pub(crate) fn digit(direction: ForceDirection, force_n: f64) -> Example {
    let digit = Digit::new(mm(120.0), mm(10.0), mm(0.5), gpa(200.0)).unwrap().with_direction(direction);
    let gauges = Strain.at_x([4.0, 20.0, 40.0, 60.0, 80.0].map(mm)).noise(microstrain(1.0));
    let setup = Setup::new(digit).sensors(gauges).unwrap();
    Example { setup, training: Training::even(24).repeated(2).with_force(force_n) }
}

pub(crate) fn to_and_fro(from: Position, to: Position) -> Motion {
    Motion::new(from, to, 0.5, mm(100.0)).and_then(|motion| motion.with_passes(4)).unwrap()
}

pub(crate) fn along_the_beam() -> Motion {
    to_and_fro(Position::along(mm(50.0)), Position::along(mm(350.0)))
}

pub(crate) fn over_the_plate() -> Motion {
    let at = |x: f64, y: f64| Position { x_m: mm(x), y_m: mm(y) };
    to_and_fro(at(50.0, 80.0), at(250.0, 210.0))
}

pub(crate) fn swinging_beam() -> ModalBeam {
    ModalBeam::new(beam(), 7850.0, 0.01).unwrap()
}

pub(crate) fn moving_beam() -> Example {
    paper(um(20.0), 50)
}

/// Deflections and strains; unknown forces.
pub(crate) fn two_moving_loads() -> (Example, [Motion; 2]) {
    let setup = Setup::new(beam())
        .sensors(Deflection.evenly(8).noise(um(20.0)))
        .and_then(|setup| setup.sensors(Strain.evenly(8).noise(microstrain(5.0))));
    let training = Training::even(10).repeated(50).with_force(newtons(3.0));
    let motion = |from_mm: f64, to_mm: f64, speed_m_per_s: f64, passes: usize| {
        let [from, to] = [from_mm, to_mm].map(|x_mm| Position::along(mm(x_mm)));
        let motion = Motion::new(from, to, speed_m_per_s, 0.2 * mm(to_mm - from_mm));
        motion.and_then(|motion| motion.with_passes(passes)).unwrap()
    };
    let second = motion(250.0, 340.0, 0.1, 3).with_lifts(0.5, 0.05).unwrap();
    (Example { setup: setup.unwrap(), training }, [motion(60.0, 150.0, 0.2, 6), second])
}

pub(crate) fn moving_plate() -> Example {
    let mut example = plate(24, ChannelModel { noise_sd: um(20.0), ..ChannelModel::default() });
    example.training = Training::grid(6, 6).repeated(50);
    example
}

/// Two pressure sensors.
pub(crate) fn strip() -> Setup {
    let depth = Unit::from_symbol("mm").unwrap();
    let columns = Columns::along("X", ["Pl", "Pr"]).force("F").nuisance("depth", depth);
    Setup::measured(mm(100.0), &["Pl", "Pr"]).unwrap().recorded_as(columns)
}

/// Fifteen channels.
pub(crate) fn pad() -> Setup {
    let names: Vec<String> = (1..=15).map(|i| format!("raw_{i}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let origin = Position { x_m: mm(274.0), y_m: mm(-115.0) };
    let columns = Columns::plane(2, 3, 2..=16usize).in_frame(Frame { origin, round_m: Some(mm(1.0)) });
    Setup::measured_plane(mm(30.0), mm(30.0), &names).unwrap().recorded_as(columns)
}

pub(crate) fn raw_setup(extent: Extent, channels: usize, force_n: Option<f64>) -> Setup {
    let layout = Layout::even(SensorKind::Raw, channels, extent.length_m());
    Setup::new(extent).with_layout(layout).unwrap().with_force(force_n).unwrap()
}

pub(crate) fn raw_recording(rows: Vec<Row>) -> Recording {
    let channels = rows.first().map_or(0, |row| row.reading.len());
    Recording::new(&Layout::even(SensorKind::Raw, channels, 1.0), "test", rows)
}

/// `None` without the folder of real recordings.
pub(crate) fn strip_recording(file: &str) -> Option<(Setup, Recording)> {
    let path = data::recording(&format!("tactile-fsi/{file}"))?;
    let setup = strip();
    let recording = setup.read_recording(file, File::open(path).unwrap()).unwrap();
    Some((setup, recording))
}

pub(crate) fn pad_recording() -> Option<(Setup, Recording)> {
    let [readings, contacts] = ["readings", "contacts"].map(|name| {
        let path = data::recording(&format!("eflesh/fixed-depth-{name}.csv"))?;
        Some((name, File::open(path).unwrap()))
    });
    let setup = pad();
    let recording = setup.read_recording_pair(readings?, contacts?).unwrap();
    assert_eq!((recording.rows.len(), recording.distinct_positions().len()), (4805, 961));
    Some((setup, recording))
}

/// Rise time and final pressure of two soft channels.
pub(crate) fn sheet_recording() -> Option<(Setup, Recording)> {
    let path = data::recording("tactile-fsi/2d-sheet-part.csv")?;
    let channels = ["Tl", "Tr", "Pl", "Pr"];
    let setup = Setup::measured_plane(mm(60.0), mm(60.0), &channels).unwrap();
    let setup = setup.recorded_as(Columns::plane("X", "Y", channels).force("F"));
    let recording = setup.read_recording("sheet", File::open(path).unwrap()).unwrap();
    Some((setup, recording))
}

pub(crate) fn force_95_n(contact: &ContactEstimate) -> (f64, f64) {
    let of_any_line = Extent::line(1.0).unwrap();
    let known_n = contact.force_n.unwrap();
    ContactRecord::new(contact, of_any_line).force_interval_95_n().map_or((known_n, known_n), Into::into)
}
