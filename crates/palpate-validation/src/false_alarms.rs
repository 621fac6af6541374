use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::statistics::Share;
use crate::surfaces::{paper_beam, square_plate};
use crate::table::{Column, Figure, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::digit::DigitTheory;
use palpate::estimators::simulate::CleanSensors;
use palpate::estimators::status::{FalseAlarmRate, LINE_PLACES};
use palpate::mechanics::sensing::{ChannelErrors, measure};
use palpate::mechanics::surface::ForceDirection;
use palpate::numerics::{bisect, chi_squared_critical_value, normal_cdf};
use palpate::prelude::{
    ClosedForm, Contact, CramerRaoBound, Digit, DigitEstimator, Estimator, Extent, Fit, FitTask, Influence,
    Position, Setup, Status, Strain, Training, gpa, microstrain, mm, newtons, um,
};
use palpate_testing::random_field::curvatures;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

pub const EXPERIMENT: Experiment = Experiment {
    name: "false-alarms",
    title: "False alarms",
    method: "Each estimator is calibrated with 1,000 presses a place, which determine noise and influence functions, at a false-alarm rate of 1 ‰, and locates noise alone, and contacts all over \
             the surface. Noise is detected if its χ² exceeds the critical value at 0.5 ‰, or else if a contact explains it, which has the bound by the expected Euler characteristic of the readings.",
    seed: 0,
    run,
};

/// Presses per place.
const REPEATS: usize = 1000;
/// Positions per side in the Euler characteristic.
const SIDE: usize = 60;

struct Bench {
    name: &'static str,
    /// With an unknown force.
    setup: Setup,
    force_n: f64,
    training: Training,
    estimator: Estimator,
    /// Of noise, and as many of contacts.
    readings: usize,
}

struct Case<'a> {
    bench: &'a Bench,
    is_known: bool,
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let (calibrations, share) = size.pick((4, 1), (1, 50));
    let mut benches = benches()?;
    benches.iter_mut().for_each(|bench| bench.readings /= share);
    // The fit of the plate takes some seconds.
    let benches: Vec<&Bench> =
        benches.iter().filter(|bench| size == Size::Full || bench.name != "influence, plate").collect();
    let both = |bench| [true, false].map(|is_known| Case { bench, is_known });
    let cases: Vec<Case> = benches.into_iter().flat_map(both).collect();
    let rows =
        in_parallel(&cases, |case| case.row(calibrations), |case| case.bench.name.to_owned(), progress);
    let column = |name, goal| Column::new(name, "‰", goal);
    let columns = vec![
        column("noise beyond the critical value", Goal::None),
        column("noise explained by a contact", Goal::None),
        column("bound of the latter", Goal::None),
        column("noise not `no_contact`", Goal::Smaller),
        column("contacts `outside_model`", Goal::Smaller),
    ];
    let mut table = Table::new("Noise, and as many contacts.", &["estimator", "force"], columns);
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}

fn benches() -> Result<[Bench; 4]> {
    let (beam, plate) = (paper_beam(um(5.0))?, square_plate(um(5.0))?);
    let digit = Digit::new(mm(120.0), mm(10.0), mm(0.5), gpa(200.0))?.with_direction(ForceDirection::Normal);
    let gauges = Strain.at_x([4.0, 20.0, 40.0, 60.0, 80.0].map(mm)).noise(microstrain(1.0));
    let digit = Setup::new(digit).sensors(gauges)?;
    // With small deflections the linear theory equals the exact one.
    let linear = DigitEstimator::of_theory(DigitTheory::Linear);
    let influence = || Estimator::Influence(Influence::default());
    let bench = |name, setup: &Setup, force_n: f64, training: Training, estimator, readings| {
        let training = training.with_force(newtons(force_n));
        Bench { name, setup: setup.clone(), force_n, training, estimator, readings }
    };
    let even = |repeats| Training::even(10).repeated(repeats);
    let closed_form = Estimator::ClosedForm(ClosedForm::default());
    let grid = Training::grid(6, 6).repeated(REPEATS);
    Ok([
        bench("influence, beam", &beam, 3.0, even(REPEATS), influence(), 100_000),
        bench("influence, plate", &plate, 5.0, grid, influence(), 20_000),
        bench("closed form, beam", &beam, 3.0, even(1), closed_form, 100_000),
        bench("digit", &digit, 0.02, Training::even(24).repeated(2), Estimator::Digit(linear), 100_000),
    ])
}

/// Alarms of noise, and `outside_model` contacts.
#[derive(Clone, Debug, Default)]
struct Alarms {
    beyond_noise: Share,
    like_contact: Share,
    detected: Share,
    outside_model: Share,
}

impl Case<'_> {
    fn row(&self, calibrations: u64) -> Result<Row> {
        let Bench { name, setup, force_n, readings, .. } = self.bench;
        let setup = setup.clone().with_force(self.is_known.then_some(*force_n))?;
        let limit = setup.cramer_rao_bound()?;
        let mut alarms = Alarms::default();
        for seed in EXPERIMENT.seed..EXPERIMENT.seed + calibrations {
            self.add(&setup, &limit, seed, readings / calibrations as usize, &mut alarms)?;
        }
        let Alarms { beyond_noise, like_contact, detected, outside_model } = alarms;
        let bound = explanation_bound(&setup, &limit);
        let per_thousand = |share: Share| {
            let percent = share.percent()?;
            let standard_error = percent.standard_error.map(|error| 10.0 * error);
            Some(Figure { value: 10.0 * percent.value, standard_error })
        };
        let figures = vec![
            per_thousand(beyond_noise),
            per_thousand(like_contact),
            Some(Figure::exact(1e3 * bound)),
            per_thousand(detected),
            per_thousand(outside_model),
        ];
        let force = if self.is_known { "known" } else { "unknown" };
        Ok(Row::new(&[name, force], figures))
    }

    fn add(
        &self,
        setup: &Setup,
        limit: &CramerRaoBound,
        seed: u64,
        readings: usize,
        alarms: &mut Alarms,
    ) -> Result<()> {
        let Bench { training, estimator, force_n, .. } = self.bench;
        let presses = setup.simulate(training, seed)?;
        let locator = estimator.fit_without_interval_check(FitTask::new(setup, &presses))?;
        let (layout, extent) = (setup.layout(), setup.surface().extent());
        let clean = CleanSensors::new(setup.surface().model().context("the surface has a model")?, layout);
        let errors = ChannelErrors::none(layout);
        let critical_value = chi_squared_critical_value(0.5 * FalseAlarmRate::DEFAULT.share(), layout.len());
        let (untouched, noise_sds) = (vec![0.0; layout.len()], limit.noise_sds());
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1000 + seed);
        for _ in 0..readings {
            let noise = measure(layout, &untouched, &errors, &mut rng);
            let is_detected = locator.locate(&noise)?.status != Status::NoContact;
            let chi_squared: f64 = noise_sds.iter().map(|(channel, sd)| (noise[*channel] / sd).powi(2)).sum();
            let is_beyond = chi_squared > critical_value;
            alarms.beyond_noise.add(seed, is_detected && is_beyond);
            alarms.like_contact.add(seed, is_detected && !is_beyond);
            alarms.detected.add(seed, is_detected);
            let contact = Contact { position: anywhere(extent, &mut rng), force_n: *force_n };
            let reading = measure(layout, &clean.reading(contact), &errors, &mut rng);
            alarms.outside_model.add(seed, locator.locate(&reading)?.status == Status::OutsideModel);
        }
        Ok(())
    }
}

fn anywhere(extent: Extent, rng: &mut Xoshiro256PlusPlus) -> Position {
    let x_m = rng.random_range(0.0..extent.length_m());
    Position { x_m, y_m: extent.width_m().map_or(0.0, |width_m| rng.random_range(0.0..width_m)) }
}

/// Bound on the probability that a contact explains noise.
///
/// A contact has the cost k·ln n + 2·ln m of the extended Bayesian information criterion, for k unknowns, n channels and m places, and u has half the tail Φ(−√cost). Noise exceeds u along the unit
/// reading of some contact with the expected Euler characteristic Φ(−u) + (L₁/2π + L₂·u/(2π)^(3/2))·e^(−u²/2) (Adler and Taylor, *Random Fields and Geometry*, 2007, section 12.4). L₁ is the
/// length of the curve of unit readings on a line, and half the boundary length on a plane; L₂ is their area (0 on a line).
fn explanation_bound(setup: &Setup, limit: &CramerRaoBound) -> f64 {
    let extent = setup.surface().extent();
    let rows = if extent.width_m().is_some() { SIDE } else { 1 };
    let unknowns = 1 + usize::from(rows > 1) + usize::from(setup.force_n().is_none());
    let cost = unknowns as f64 * (setup.layout().len() as f64).ln() + 2.0 * (LINE_PLACES as f64).ln();
    let tail = 0.5 * normal_cdf(-cost.sqrt());
    let u = bisect((0.0, 20.0), 40, |u| normal_cdf(-u) > tail);
    let reading = |row: usize, column: usize| {
        let share = |i: usize| (i as f64 + 0.5) / SIDE as f64;
        let y_m = extent.width_m().map_or(0.0, |width_m| share(row) * width_m);
        let position = Position { x_m: share(column) * extent.length_m(), y_m };
        limit.whitened_reading(Contact { position, force_n: 1e-3 })
    };
    let [half, area] = curvatures(rows, SIDE, reading);
    normal_cdf(-u) + (half / TAU + area * u / TAU.powf(1.5)) * (-0.5 * u * u).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_detects_noise_at_most_at_twice_the_rate() {
        let [.., closed_form, _] = benches().unwrap();
        let bench = Bench { readings: 2000, ..closed_form };
        for is_known in [true, false] {
            let row = Case { bench: &bench, is_known }.row(1).unwrap();
            let [beyond, like, bound, detected, outside_model] =
                [0, 1, 2, 3, 4].map(|figure| row.figures[figure].unwrap().value);
            assert!((beyond + like - detected).abs() < 1e-9, "{row:?}");
            assert!((0.1..1.5).contains(&bound), "{row:?}");
            // Of 2,000 readings with a rate of 1 ‰, more than ten are alarms with a probability of 1 in 100,000; of contacts 3 ‰ are outside the model.
            assert!(detected <= 5.0 && outside_model <= 10.0, "{row:?}");
        }
    }
}
