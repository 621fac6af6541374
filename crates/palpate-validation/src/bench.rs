//! Simulated benches, calibrated and then used.

use crate::tally::Tally;
use anyhow::{Context, Result, ensure};
use palpate::estimators::arrangement::cells;
use palpate::estimators::estimator::Locator;
use palpate::estimators::evaluation::Calibration;
use palpate::estimators::imperfections::Imperfections;
use palpate::estimators::simulate::{simulate_presses_watched, simulate_use_watched};
use palpate::mechanics::sensing::SensorKind;
use palpate::numerics::random_order;
use palpate::prelude::{
    Contact, Estimator, Evaluation, Extent, Fit, FitTask, Influence, Position, Recording, Rig, Row, Setup,
    Watch,
};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum World {
    /// Noise and resolution alone.
    Clean,
    /// With the imperfections of the rig, and errors of gain, offset and place of its sensors.
    Imperfect,
}

/// Locator's knowledge of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knowledge {
    Model,
    /// Raw channels, pressed with several forces.
    Measured,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Zero {
    /// Untouched rows before the first contact.
    Once,
    /// Untouched rows before each contact.
    Each,
}

/// Multiples of the rig's force, in turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forces {
    /// Of presses on raw channels; with a model all presses have the rig's force.
    pub pressed: &'static [f64],
    pub touched: &'static [f64],
}

impl Forces {
    pub const UNKNOWN: Self =
        Self { pressed: &Calibration::UNKNOWN_FORCES, touched: &Calibration::UNKNOWN_FORCES };
}

pub struct Bench<'a> {
    pub rig: &'a Rig,
    pub world: World,
    pub knowledge: Knowledge,
    pub forces: Forces,
}

/// As many as a person tares with.
const UNTOUCHED_ROWS: u32 = 10;
/// Multiple of the smallest detectable force.
const LIGHT: f64 = 5.0;
/// Contacts per light repetition.
const LIGHT_EACH: usize = 4;

pub struct Recordings {
    /// Setup of the locator.
    pub known: Setup,
    pub calibration: Recording,
    /// Contacts in use, with untouched rows between.
    pub touches: Recording,
    places: Vec<Position>,
    used: Setup,
    seed: u64,
}

impl Bench<'_> {
    /// Calibrates the bench, and touches it at about `contacts` places.
    pub fn record(&self, contacts: usize, seed: u64) -> Result<Recordings> {
        let setup = self.setup()?;
        let mut training = self.rig.training()?.clone();
        if self.world == World::Clean {
            training.placement_sd_m = None;
        }
        let force_n = training.force_n.or(setup.force_n()).context("the rig has no force of its presses")?;
        let calibration = match self.knowledge {
            Knowledge::Model => setup.simulate(&training, seed)?,
            Knowledge::Measured => {
                let places = training.positions(setup.surface().extent())?;
                let (pressed, presses) =
                    (setup.with_training_force(&training)?, in_turn(&places, force_n, self.forces.pressed));
                let (repeats, placement_sd_m) = (training.repeats, training.placement_sd_m);
                simulate_presses_watched(&pressed, &presses, repeats, placement_sd_m, seed, Watch::NONE)?
            }
        };
        let places = shuffled(&all_over(setup.surface().extent(), contacts), seed);
        let touched = in_turn(&places, force_n, self.forces.touched);
        let provenance = &calibration.provenance;
        let used = setup.clone().with_imperfections(with_many_untouched_rows(&setup)?)?;
        // Streams of noise of their own.
        let touches = simulate_use_watched(&used, provenance, &touched, seed.wrapping_add(1), Watch::NONE)?;
        let known = self.known(&setup)?;
        let known_by = |recording: Recording| Recording { kinds: known.layout().kinds(), ..recording };
        Ok(Recordings {
            calibration: known_by(calibration),
            touches: known_by(touches),
            places,
            used,
            seed,
            known,
        })
    }

    fn setup(&self) -> Result<Setup> {
        let mut setup = self.rig.setup.clone();
        let of_rig = setup.imperfections().copied().context("the rig has no [imperfections]")?;
        let imperfections = match self.world {
            World::Imperfect => of_rig,
            World::Clean => Imperfections { schedule: of_rig.schedule, ..Imperfections::default() },
        };
        if self.world == World::Clean {
            setup.edit_sensors(|sensors| {
                for channel in sensors.iter_mut().map(|sensor| &mut sensor.channel) {
                    (channel.gain_error, channel.offset_error, channel.position_error_m) = (0.0, 0.0, 0.0);
                }
            })?;
        }
        Ok(setup.with_imperfections(imperfections)?)
    }

    fn known(&self, setup: &Setup) -> Result<Setup> {
        if self.knowledge == Knowledge::Model {
            return Ok(setup.clone());
        }
        let names = setup.layout().names();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let extent = setup.surface().extent();
        Ok(match extent.width_m() {
            None => Setup::measured(extent.length_m(), &names)?,
            Some(width_m) => Setup::measured_plane(extent.length_m(), width_m, &names)?,
        })
    }
}

fn with_many_untouched_rows(setup: &Setup) -> Result<Imperfections> {
    let mut imperfections = setup.imperfections().copied().context("the setup has no imperfections")?;
    imperfections.schedule.untouched_rows = UNTOUCHED_ROWS;
    Ok(imperfections)
}

impl Recordings {
    /// Fits an estimator, and adds its estimates by each zero to a tally.
    pub fn judge(
        &self,
        estimator: &Estimator,
        seed: u64,
        zeros: &[Zero],
        tallies: &mut [Tally],
    ) -> Result<()> {
        let task = FitTask::new(&self.known, &self.calibration).seed(seed);
        let locator = estimator.fit_task(task)?;
        let light = self.light_touches(&locator)?;
        for tally in &mut *tallies {
            tally.add_interval_check(seed, locator.interval_check.as_ref());
        }
        for (zero, tally) in zeros.iter().zip(tallies) {
            let touches = tared(&locator, &self.touches, *zero)?;
            for row in touches.rows.iter().filter(|row| !row.touches()) {
                tally.add_untouched(seed, &locator.locate(&row.reading)?);
            }
            tally.add_touches(seed, &Evaluation::new(&locator, &touches)?);
            for row in tared(&locator, &light, *zero)?.rows.iter().filter(|row| row.touches()) {
                tally.add_light_touch(seed, &locator.locate(&row.reading)?);
            }
        }
        Ok(())
    }
}

impl Recordings {
    /// Errors of the centre of force Σ r·x/Σ r over load cells of known places, with readings r less the rest before them.
    pub fn centre_of_force_errors_m(&self) -> Vec<f64> {
        let sensors = self.used.layout().sensors();
        if sensors.iter().any(|sensor| sensor.kind != SensorKind::Reaction) {
            return Vec::new();
        }
        let mut runs = self.touches.rows.chunk_by(|a, b| a.touches() == b.touches());
        let mut errors_m = Vec::new();
        let mut untouched = self.touches.mean_reading(&[0]);
        for run in runs.by_ref() {
            let indices: Vec<usize> = (0..run.len()).collect();
            let mean = Recording { rows: run.to_vec(), ..self.touches.clone() }.mean_reading(&indices);
            if !run[0].touches() {
                untouched = mean;
                continue;
            }
            for row in run {
                let forces = row.reading.iter().zip(&untouched).map(|(value, zero)| value - zero);
                let [mut total, mut x_m, mut y_m] = [0.0; 3];
                for (force_n, sensor) in forces.zip(sensors) {
                    total += force_n;
                    x_m += force_n * sensor.position.x_m;
                    y_m += force_n * sensor.position.y_m;
                }
                errors_m.push(row.position.distance_m(Position { x_m: x_m / total, y_m: y_m / total }));
            }
        }
        errors_m
    }

    /// Contacts of [`LIGHT`] times the force that is detected with 95 % probability, given the noise and the scatter of untouched rows.
    fn light_touches(&self, locator: &Locator) -> Result<Recording> {
        let limit = self.used.cramer_rao_bound()?;
        let touch = locator.add_scatter(Influence::default().lightest_touch(&limit));
        let light = self.places.iter().step_by(LIGHT_EACH).filter_map(|position| {
            let [_, surely_n] = touch.forces_at(*position);
            Some(Contact { position: *position, force_n: LIGHT * surely_n? })
        });
        let (light, provenance): (Vec<Contact>, _) = (light.collect(), &self.calibration.provenance);
        // A stream of noise of its own.
        let seed = self.seed.wrapping_add(2);
        let recording = simulate_use_watched(&self.used, provenance, &light, seed, Watch::NONE)?;
        Ok(Recording { kinds: self.known.layout().kinds(), ..recording })
    }
}

/// Rows after the first rest, tared; untouched rows by the rest before them.
fn tared(locator: &Locator, recording: &Recording, zero: Zero) -> Result<Recording> {
    let mut runs = recording.rows.chunk_by(|a, b| a.touches() == b.touches());
    let rest = runs.next().filter(|rows| rows.iter().all(|row| !row.touches()));
    let mut tare = locator.tare()?;
    for row in rest.context("the recording does not begin untouched")? {
        tare.add_untouched(&row.reading)?;
    }
    let mut rows: Vec<Row> = Vec::new();
    for run in runs {
        for row in run {
            let mut reading = vec![0.0; row.reading.len()];
            tare.apply(&row.reading, &mut reading)?;
            rows.push(Row { reading, ..row.clone() });
        }
        if zero == Zero::Each && run.iter().all(|row| !row.touches()) {
            tare = locator.tare()?;
            run.iter().try_for_each(|row| tare.add_untouched(&row.reading))?;
        }
    }
    ensure!(!rows.is_empty(), "the recording has no rows after its first rest");
    Ok(Recording { rows, ..recording.clone() })
}

fn in_turn(places: &[Position], force_n: f64, shares: &[f64]) -> Vec<Contact> {
    let shares = places.iter().zip(shares.iter().cycle());
    shares.map(|(position, share)| Contact { position: *position, force_n: share * force_n }).collect()
}

/// Middles of about `count` equal cells, as square as possible on a plane.
fn all_over(extent: Extent, count: usize) -> Vec<Position> {
    let Some(width_m) = extent.width_m() else { return cells(extent, count, 1) };
    let side = |ratio: f64| (count as f64 * ratio).sqrt().round().max(1.0) as usize;
    cells(extent, side(extent.length_m() / width_m), side(width_m / extent.length_m()))
}

fn shuffled(positions: &[Position], seed: u64) -> Vec<Position> {
    random_order(positions.len(), seed).into_iter().map(|i| positions[i]).collect()
}
