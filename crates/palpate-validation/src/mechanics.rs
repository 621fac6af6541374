use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::statistics::{Ratio, Sample, Share};
use crate::table::{Column, Figure, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::estimators::influence::InfluenceSource;
use palpate::mechanics::sensing::SensorKind;
use palpate::mechanics::surface::ForceDirection;
use palpate::prelude::{
    Contact, Digit, DigitEstimator, Fit, FitTask, Force, Influence, Locate, Plate, Position, Rig, Setup,
    Status, Strain, Watch, gpa, microstrain, mm, simulate_at,
};
use std::f64::consts::{FRAC_2_PI, PI};

pub const SUPPORTED_BEAMS: Experiment = Experiment {
    name: "supported-beams",
    title: "Beams on other supports",
    method: "The cantilever of `examples/cantilever.toml` and the continuous beam of `examples/continuous-beam.toml` are calibrated with ten presses at each place, and touched at 399 places: with the force of the presses if it \
             is known, else with this force, half and twice that in turn. Ratios are the mean error over the mean of the bound's mean errors, of touches with a bound below 1/200 of the length and an end farther than 1/80.",
    seed: 0,
    run: supported_beams,
};

pub const DIGIT_LIMIT: Experiment = Experiment {
    name: "digit-limit",
    title: "Errors on a digit and the Cramér–Rao bound",
    method: "The digit of `examples/digit.toml` is touched at 400 places beyond its second gauge (20 to 120 mm) with an unknown force. Ratios are the mean error over the mean of the bound's mean errors, \
             of touches that the second gauge reads by at least five standard deviations of its noise; the centre line is that of the worst touch.",
    seed: 0,
    run: digit_limit,
};

pub const PLATE_MESH: Experiment = Experiment {
    name: "plate-mesh",
    title: "Convergence of a plate",
    method: "The deflection in the middle of a square plate on simple edges under a force there is compared with Navier's series of Timoshenko and Woinowsky-Krieger. \
             The order is log₂ of the ratio of the error with half as many elements to this error.",
    seed: 0,
    run: plate_mesh,
};

const RIGS: [(&str, &str); 2] = [
    ("cantilever", include_str!("../../../examples/cantilever.toml")),
    ("continuous beam", include_str!("../../../examples/continuous-beam.toml")),
];
const SOURCES: [(InfluenceSource, &str); 3] = [
    (InfluenceSource::Corrected, "mechanics, corrected"),
    (InfluenceSource::Mechanics, "mechanics"),
    (InfluenceSource::Recording, "recording"),
];
/// Ends and largest bound of the ratios, in lengths.
const ENDS: f64 = 1.0 / 80.0;
const LARGEST_BOUND: f64 = 1.0 / 200.0;

#[derive(Clone, Copy)]
struct BeamCase {
    rig: (&'static str, &'static str),
    force: Force,
    source: (InfluenceSource, &'static str),
}

fn supported_beams(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let calibrations = size.pick(100, 10);
    let mut cases = Vec::new();
    for rig in RIGS {
        for force in [Force::Known, Force::Unknown] {
            cases.extend(SOURCES.map(|source| BeamCase { rig, force, source }));
        }
    }
    let name = |case: &BeamCase| format!("{}, {}", case.rig.0, case.source.1);
    let rows = in_parallel(&cases, |case| case.row(calibrations), name, progress);
    let columns = vec![
        Column { decimals: 3, ..Column::new("mean error over the bound's", "", Goal::Smaller) },
        Column { decimals: 3, ..Column::mm("mean error", Goal::Smaller) },
        Column::percent("position covered", Goal::COVERAGE),
        Column::percent("detected", Goal::Larger),
    ];
    let mut table = Table::new("Beams.", &["beam", "force", "influence functions from"], columns);
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}

impl BeamCase {
    fn row(self, calibrations: u64) -> Result<Row> {
        let mut rig = Rig::from_toml(self.rig.1)?;
        let force_n = rig.setup.force_n().context("the rig has a force")?;
        if self.force == Force::Unknown {
            rig.setup = rig.setup.with_force(None)?;
        }
        rig.training = Some(rig.training()?.clone().with_force(force_n));
        let bounds = rig.setup.cramer_rao_bound()?;
        let length_m = rig.setup.surface().extent().length_m();
        let calibration = rig.calibration()?.at_forces_of_use();
        let influence = Influence { source: self.source.0, ..Influence::default() };
        let (mut ratio, mut errors_mm) = (Ratio::default(), Sample::default());
        let (mut detected, mut covered) = (Share::default(), Share::default());
        for seed in SUPPORTED_BEAMS.seed..SUPPORTED_BEAMS.seed + calibrations {
            for located in calibration.run(&influence, seed, Watch::NONE)?.evaluation.located {
                errors_mm.add(seed, 1e3 * located.error_m());
                detected.add(seed, located.status != Some(Status::NoContact));
                if let Some(coordinates) = located.covered {
                    covered.add(seed, coordinates.x);
                }
                let touch = Contact { position: located.truth, force_n: located.force_n.unwrap_or(force_n) };
                let is_inner = (ENDS..=1.0 - ENDS).contains(&(touch.position.x_m / length_m));
                if let Some(bound) = bounds.bound_at(touch, self.force)
                    && is_inner
                    && bound.sd_position_m <= LARGEST_BOUND * length_m
                {
                    ratio.add(seed, located.error_m(), bound.mean_error_m());
                }
            }
        }
        let labels = [self.rig.0, self.force.name(), self.source.1];
        Ok(Row::new(&labels, vec![ratio.figure(), errors_mm.mean(), covered.percent(), detected.percent()]))
    }
}

const DIRECTIONS: [(ForceDirection, &str); 2] =
    [(ForceDirection::Normal, "normal"), (ForceDirection::Vertical, "vertical")];
const FORCES_N: [f64; 5] = [1.0, 3.0, 5.0, 8.0, 13.0];
const TOUCHES: usize = 400;
const SECOND_GAUGE_MM: f64 = 20.0;
/// Of the second gauge, in standard deviations of its noise.
const LEAST_SIGNAL: f64 = 5.0;
const SHAPE_STEPS: usize = 40;

#[derive(Clone, Copy)]
struct DigitCase {
    direction: (ForceDirection, &'static str),
    force_n: f64,
}

fn digit_limit(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let series = size.pick(20, 1);
    let cases: Vec<DigitCase> = DIRECTIONS
        .into_iter()
        .flat_map(|direction| FORCES_N.map(|force_n| DigitCase { direction, force_n }))
        .collect();
    let rows = in_parallel(&cases, |case| case.row(series), |case| format!("{} N", case.force_n), progress);
    let columns = vec![
        Column { decimals: 0, ..Column::new("tip turned by", "°", Goal::None) },
        Column { decimals: 3, ..Column::new("position error over the bound's", "", Goal::Smaller) },
        Column { decimals: 3, ..Column::new("force error over the bound's", "", Goal::Smaller) },
        Column::percent("position covered", Goal::COVERAGE),
        Column::percent("located", Goal::Larger),
        Column::mm("largest error of the centre line", Goal::Smaller),
    ];
    let mut table = Table::new("Touches by direction and force.", &["direction", "force"], columns);
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}

impl DigitCase {
    fn row(self, series: u64) -> Result<Row> {
        let digit = Digit::new(mm(120.0), mm(10.0), mm(0.5), gpa(200.0))?.with_direction(self.direction.0);
        let gauges = Strain.at_x([4.0, SECOND_GAUGE_MM, 40.0, 60.0, 80.0].map(mm)).noise(microstrain(1.0));
        let setup = Setup::new(digit).sensors(gauges)?;
        let pressed = setup.clone().known_force(self.force_n)?;
        let (first_m, length_m) = (mm(SECOND_GAUGE_MM), digit.length_m());
        let share = |touch: usize| (touch as f64 + 0.5) / TOUCHES as f64;
        let place = |touch| Position::along(first_m + share(touch) * (length_m - first_m));
        let positions: Vec<Position> = (0..TOUCHES).map(place).collect();
        let limit = setup.cramer_rao_bound()?;
        let (mut position_ratio, mut force_ratio) = (Ratio::default(), Ratio::default());
        let (mut covered, mut is_located, mut shape_m) = (Share::default(), Share::default(), 0.0_f64);
        for seed in DIGIT_LIMIT.seed..DIGIT_LIMIT.seed + series {
            // The digit learns nothing from its presses.
            let recording = simulate_at(&pressed, &positions, 1, seed)?;
            let locator = DigitEstimator::default().fit_method(FitTask::new(&setup, &recording))?;
            for row in &recording.rows {
                let truth = Contact { position: row.position, force_n: self.force_n };
                let estimate = locator.locate(&row.reading);
                let found = &estimate.contact;
                let interval_m = found.uncertainty.map(|uncertainty| uncertainty.x_95_m);
                covered.add(
                    seed,
                    interval_m.is_some_and(|(low, high)| (low..=high).contains(&truth.position.x_m)),
                );
                shape_m = shape_m.max(locator.shape(found, SHAPE_STEPS).distance_m(&digit, truth));
                if limit.whitened_reading(truth)[1].abs() < LEAST_SIGNAL {
                    continue;
                }
                let bound = limit.bound_at(truth, Force::Unknown).context("the touch has a bound")?;
                let sd_n = bound.sd_force_n.context("the force is unknown")?;
                let found_n = found.force_n.context("the estimate has a force")?;
                position_ratio.add(seed, found.position.distance_m(truth.position), bound.mean_error_m());
                force_ratio.add(seed, (found_n - self.force_n).abs(), FRAC_2_PI.sqrt() * sd_n);
                is_located.add(seed, estimate.status == Status::Located);
            }
        }
        let tip = Contact { position: Position::along(length_m), force_n: self.force_n };
        let turn = digit.shape(tip).angle(length_m).to_degrees();
        let figures = vec![
            Some(Figure::exact(turn)),
            position_ratio.figure(),
            force_ratio.figure(),
            covered.percent(),
            is_located.percent(),
            Some(Figure::exact(1e3 * shape_m)),
        ];
        Ok(Row::new(&[self.direction.1, &format!("{} N", self.force_n)], figures))
    }
}

const SIDE_M: f64 = 0.3;

fn plate_mesh(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let elements = size.pick(&[8, 16, 32, 64, 128][..], &[8, 16, 32]);
    let errors = in_parallel(elements, |elements| plate_error(*elements), usize::to_string, progress);
    let errors: Vec<f64> = errors.into_iter().collect::<Result<_>>()?;
    let columns = vec![
        Column { decimals: 6, ..Column::new("relative error", "", Goal::Smaller) },
        Column::new("order", "", Goal::Larger),
    ];
    let mut table = Table::new("A force in the middle of the plate.", &["elements along a side"], columns);
    for (i, (elements, error)) in elements.iter().zip(&errors).enumerate() {
        let coarser = i.checked_sub(1).map(|coarser| errors[coarser]);
        let order = coarser.map(|coarser| Figure::exact((coarser / error).log2()));
        table.rows.push(Row::new(&[&elements.to_string()], vec![Some(Figure::exact(*error)), order]));
    }
    Ok(vec![table])
}

/// Relative error of the deflection under a central force.
fn plate_error(elements: usize) -> Result<f64> {
    let plate =
        Plate::simply_supported((SIDE_M, SIDE_M), mm(0.8), gpa(200.0), 0.3)?.with_elements(elements)?;
    let rigidity = plate.spec().flexural_rigidity();
    let setup = Setup::new(plate);
    let surface = setup.surface().model().context("the plate has a model")?;
    let middle = Position { x_m: 0.5 * SIDE_M, y_m: 0.5 * SIDE_M };
    let deflection_m = surface.influence_function(SensorKind::Deflection, middle).at(middle).abs();
    let exact_m = navier(3000) * SIDE_M.powi(2) / rigidity;
    Ok((deflection_m / exact_m - 1.0).abs())
}

/// Central deflection under a unit force there, times D/a²: 4/π⁴·ΣΣ (m² + n²)⁻² over odd m and n.
fn navier(terms: usize) -> f64 {
    let odd = || (0..terms).map(|k| (2 * k + 1) as f64);
    let line = |m: f64| odd().map(|n| (m * m + n * n).powi(-2)).sum::<f64>();
    4.0 / PI.powi(4) * odd().map(line).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrected_mechanics_reach_the_bound_on_a_cantilever() {
        let row = |source| BeamCase { rig: RIGS[0], force: Force::Unknown, source }.row(2).unwrap();
        let [corrected, recording] = [SOURCES[0], SOURCES[2]].map(row);
        let ratio = |row: &Row| row.figures[0].unwrap().value;
        assert!((0.9..1.1).contains(&ratio(&corrected)), "{corrected:?}");
        assert!(ratio(&recording) > ratio(&corrected), "{recording:?}");
    }

    #[test]
    fn a_digit_that_bends_far_is_located_at_the_bound() {
        let row = DigitCase { direction: DIRECTIONS[0], force_n: 5.0 }.row(1).unwrap();
        let [turn, position, force] = [0, 1, 2].map(|figure| row.figures[figure].unwrap().value);
        assert!(turn > 80.0 && position < 1.1 && force < 1.1, "{row:?}");
    }

    #[test]
    fn errors_of_a_plate_fall_with_the_second_order() {
        let [coarse, fine] = [8, 16].map(|elements| plate_error(elements).unwrap());
        assert!((1.9..2.1).contains(&(coarse / fine).log2()), "{coarse} {fine}");
    }
}
