use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::statistics::Sample;
use crate::table::{Column, Figure, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::estimator::{Creep, Drift, Locator};
use palpate::estimators::imperfections::{Amount, OffsetDrift, Relaxation};
use palpate::estimators::simulate::SimulatedBench;
use palpate::prelude::{
    Contact, Fit, FitTask, Imperfections, Position, Rig, Setup, Status, Tracker, TrackerConfig, Watch, mm,
};

pub const EXPERIMENT: Experiment = Experiment {
    name: "drift-and-creep",
    title: "Drift and creep under a resting contact",
    method: "The beam of `examples/noisy-beam.toml` is calibrated with fresh presses, tared by its first second of 100 readings, untouched for 30 s, pressed with 3 N for 60 s at one of six places, and \
             untouched again for 30 s, while its tracker has drift, creep, both or neither in its state. Errors, coverage and the share of located readings are of the contact without its first \
             second, and the release is the time from the end of the contact to the first reading without one.",
    seed: 0,
    run,
};

const RIG: &str = include_str!("../../../examples/noisy-beam.toml");
/// Offset of contact seeds from calibration seeds.
const CONTACT_SEEDS: u64 = 1000;
const RATE_HZ: f64 = 100.0;
const TARE: usize = 100;
/// Uncounted start of a contact.
const ONSET_S: f64 = 1.0;
/// Time from the onset of a press to its reading: the middle of those at rest.
const PRESSED_S: f64 = 0.2;
/// One after each calibration in turn.
const PLACES_MM: [f64; 6] = [63.0, 117.0, 160.0, 211.0, 289.0, 331.0];
const CREEP: Relaxation = Relaxation { share: 0.05, time_s: 20.0 };

#[derive(Clone, Copy, Debug, PartialEq)]
enum Fault {
    None,
    Line,
    Walk,
    Creep,
    LineAndCreep,
}

const FAULTS: [Fault; 5] = [Fault::None, Fault::Line, Fault::Walk, Fault::Creep, Fault::LineAndCreep];

/// Tracker state beside the contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Neither,
    Drift,
    Both,
}

/// In seconds.
#[derive(Clone, Copy, Debug)]
struct Durations {
    before_s: f64,
    contact_s: f64,
    after_s: f64,
}

const MINUTES: Durations = Durations { before_s: 30.0, contact_s: 60.0, after_s: 30.0 };

#[derive(Clone, Copy, Debug)]
struct Case {
    is_known: bool,
    fault: Fault,
    durations: Durations,
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let calibrations = size.pick(12, 6);
    let faults: &[Fault] = size.pick(&FAULTS, &FAULTS[4..]);
    let of_force =
        |is_known| faults.iter().map(move |fault| Case { is_known, fault: *fault, durations: MINUTES });
    let cases: Vec<Case> =
        size.pick(&[true, false][..], &[true]).iter().copied().flat_map(of_force).collect();
    let rows = in_parallel(&cases, |case| case.rows(calibrations), Case::name, progress);
    let title = "A contact of one minute.";
    let mut table = Table::new(title, &["force", "surface", "state"], Tally::columns());
    table.rows = rows.into_iter().collect::<Result<Vec<_>>>()?.concat();
    Ok(vec![table])
}

impl Fault {
    const fn label(self) -> &'static str {
        match self {
            Self::None => "no fault",
            Self::Line => "drift of 0.02 σ/s",
            Self::Walk => "walk of 0.1 σ/√s",
            Self::Creep => "creep of 5 % in 20 s",
            Self::LineAndCreep => "drift and creep",
        }
    }

    const fn creeps(self) -> bool {
        matches!(self, Self::Creep | Self::LineAndCreep)
    }

    fn imperfections(self, noise_sd: f64) -> Imperfections {
        let mut drift = OffsetDrift::default();
        match self {
            Self::Line | Self::LineAndCreep => drift.line_per_s = Amount::Value(0.02 * noise_sd),
            Self::Walk => drift.walk_per_root_s = Amount::Value(0.1 * noise_sd),
            Self::None | Self::Creep => {}
        }
        let creep = if self.creeps() { CREEP } else { Relaxation::default() };
        Imperfections { drift, creep: [creep, Relaxation::default()], ..Imperfections::default() }
    }

    const fn states(self) -> &'static [State] {
        if self.creeps() {
            &[State::Neither, State::Drift, State::Both]
        } else {
            &[State::Neither, State::Drift]
        }
    }
}

impl State {
    const fn label(self) -> &'static str {
        match self {
            Self::Neither => "neither",
            Self::Drift => "drift",
            Self::Both => "drift and creep",
        }
    }

    fn config(self) -> TrackerConfig {
        let drift = (self != Self::Neither).then(Drift::default);
        // Of a reading r, (1 − c)·r is immediate, and c·r creeps.
        let creep = Creep { share: CREEP.share / (1.0 - CREEP.share), time_s: CREEP.time_s };
        let creep = (self == Self::Both).then_some(creep);
        TrackerConfig { drift, creep, ..TrackerConfig::default() }
    }
}

struct Readings {
    contact: Contact,
    /// Indices of the contact's readings.
    pressed: std::ops::Range<usize>,
    tared: Vec<Vec<f64>>,
}

impl Case {
    fn name(&self) -> String {
        format!("{} force, {}", self.force(), self.fault.label())
    }

    const fn force(&self) -> &'static str {
        if self.is_known { "known" } else { "unknown" }
    }

    fn rows(&self, calibrations: u64) -> Result<Vec<Row>> {
        let rig = Rig::from_toml(RIG).context("examples/noisy-beam.toml")?;
        let states = self.fault.states();
        let mut tallies = vec![Tally::default(); states.len()];
        for (seed, place_mm) in
            (EXPERIMENT.seed..EXPERIMENT.seed + calibrations).zip(PLACES_MM.iter().cycle())
        {
            let locator = self.calibrated(&rig, seed)?;
            let contact = Contact { position: Position::along(mm(*place_mm)), force_n: force_n(&rig)? };
            let readings = self.readings(&rig.setup, &locator, contact, CONTACT_SEEDS + seed)?;
            for (state, tally) in states.iter().zip(&mut tallies) {
                tally.add(seed, &track(&locator, state.config(), &readings)?);
            }
        }
        let row = |(state, tally): (&State, &Tally)| {
            Row::new(&[self.force(), self.fault.label(), state.label()], tally.figures())
        };
        Ok(states.iter().zip(&tallies).map(row).collect())
    }

    /// Calibrates with fresh presses on the creeping surface.
    fn calibrated(&self, rig: &Rig, seed: u64) -> Result<Locator> {
        let mut recording = rig.simulate(seed)?;
        if self.fault.creeps() {
            let share = 1.0 - CREEP.share * (-PRESSED_S / CREEP.time_s).exp();
            recording.rows.iter_mut().flat_map(|row| &mut row.reading).for_each(|value| *value *= share);
        }
        let setup = rig.setup.clone().with_force(rig.setup.force_n().filter(|_| self.is_known))?;
        Ok(rig.estimator.fit_task(FitTask::new(&setup, &recording))?)
    }

    fn readings(&self, setup: &Setup, locator: &Locator, contact: Contact, seed: u64) -> Result<Readings> {
        let bench = SimulatedBench::perfect_watched(setup, seed, Watch::NONE)?;
        let noise_sd = setup.layout().sensors()[0].channel.noise_sd;
        let mut bench = bench.with_imperfections(self.fault.imperfections(noise_sd), contact.force_n);
        let Durations { before_s, contact_s, after_s } = self.durations;
        let number = |time_s: f64| (time_s * RATE_HZ).round() as usize;
        let pressed = number(before_s)..number(before_s + contact_s);
        let (untouched, touched) = (bench.clean(&[]), bench.clean(&[contact]));
        let mut tare = locator.tare()?;
        let mut tared = Vec::new();
        for i in 0..number(before_s + contact_s + after_s) {
            let clean = if pressed.contains(&i) { &touched } else { &untouched };
            let values = bench.advance(clean, 1.0 / RATE_HZ);
            let mut reading = bench.measure(&values);
            if i < TARE {
                tare.add_untouched(&reading)?;
                continue;
            }
            let raw = reading.clone();
            tare.apply(&raw, &mut reading)?;
            tared.push(reading);
        }
        Ok(Readings { contact, pressed: pressed.start - TARE..pressed.end - TARE, tared })
    }
}

fn force_n(rig: &Rig) -> Result<f64> {
    rig.setup.force_n().context("examples/noisy-beam.toml has a known force")
}

#[derive(Clone, Copy, Debug)]
struct Outcome {
    error_mm: Option<f64>,
    covered_percent: Option<f64>,
    located_percent: f64,
    release_s: f64,
}

fn track(locator: &Locator, config: TrackerConfig, readings: &Readings) -> Result<Outcome> {
    let Readings { contact: truth, pressed, tared } = readings;
    let tracking = locator.tracking(&config)?;
    let mut tracker = Tracker::new(tracking.likelihood(), config);
    let counted = pressed.start + (ONSET_S * RATE_HZ) as usize..pressed.end;
    let (mut tracked, mut located, mut covered, mut error_mm) = (0, 0, 0, 0.0);
    let mut released = tared.len();
    for (i, reading) in tared.iter().enumerate() {
        let track = tracker.update(i as f64 / RATE_HZ, reading)?;
        let first = track.contacts.first();
        if let (Some(first), true) = (first, counted.contains(&i)) {
            let x_m = truth.position.x_m;
            tracked += 1;
            located += usize::from(track.single.status != Status::OutsideModel);
            error_mm += 1e3 * (first.x_m - x_m).abs();
            covered += usize::from((first.x_95_m.0..=first.x_95_m.1).contains(&x_m));
        }
        if i >= pressed.end && first.is_none() {
            released = released.min(i);
        }
    }
    let of_tracked = |sum: f64| (tracked > 0).then(|| sum / tracked as f64);
    Ok(Outcome {
        error_mm: of_tracked(error_mm),
        covered_percent: of_tracked(100.0 * covered as f64),
        located_percent: 100.0 * located as f64 / counted.len() as f64,
        release_s: (released - pressed.end) as f64 / RATE_HZ,
    })
}

/// Each contact is one value: its readings share drift and creep.
#[derive(Clone, Debug, Default)]
struct Tally {
    error_mm: Sample,
    covered: Sample,
    located: Sample,
    release_s: Sample,
}

impl Tally {
    fn add(&mut self, calibration: u64, outcome: &Outcome) {
        if let Some(error_mm) = outcome.error_mm {
            self.error_mm.add(calibration, error_mm);
        }
        if let Some(percent) = outcome.covered_percent {
            self.covered.add(calibration, percent);
        }
        self.located.add(calibration, outcome.located_percent);
        self.release_s.add(calibration, outcome.release_s);
    }

    fn columns() -> Vec<Column> {
        vec![
            Column { decimals: 3, ..Column::mm("mean error", Goal::Smaller) },
            Column::percent("place covered", Goal::COVERAGE),
            Column::percent("located", Goal::Larger),
            Column { decimals: 1, ..Column::new("release", "s", Goal::Smaller) },
        ]
    }

    fn figures(&self) -> Vec<Option<Figure>> {
        vec![self.error_mm.mean(), self.covered.mean(), self.located.mean(), self.release_s.mean()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn creep_in_the_state_takes_creep_off_the_error() {
        let durations = Durations { before_s: 5.0, contact_s: 15.0, after_s: 5.0 };
        let case = Case { is_known: true, fault: Fault::Creep, durations };
        let rows = case.rows(1).unwrap();
        let error_mm = |row: &Row| row.figures[0].unwrap().value;
        let [neither, _, both] = &rows[..] else { panic!("{rows:?}") };
        assert!(5.0 * error_mm(both) < error_mm(neither), "{rows:?}");
        // Half a second after the contact nothing is tracked.
        assert!(both.figures[3].unwrap().value < 0.5, "{both:?}");
    }
}
