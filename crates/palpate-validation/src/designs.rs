use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::table::{Column, Figure, Goal, Row, Table};
use anyhow::{Context, Result};
use palpate::design::Verification;
use palpate::design::positions::{Placement, PositionDesign, PositionProblem, VerifiedPositions};
use palpate::design::sensors::{AssessedLayout, SensorProblem, to_verify};
use palpate::prelude::{Rig, Watch};

pub const SENSOR_LAYOUTS: Experiment = Experiment {
    name: "sensor-layouts",
    title: "Sensor layouts",
    method: "`palpate design sensors` places eight deflection sensors of 5 µm noise on the founding paper's beam (`examples/sensor-design.toml`, unknown force, contacts at 20 to 380 mm) and nine of 1 µm on a plate \
             (`examples/plate-design.toml`, known force; the even layout has a sensor at the column). Limits are standard deviations at the Cramér–Rao bound; the simulated error is that of 100 calibrations on the beam and 20 \
             on the plate, of the references and the best layout.",
    seed: SEED,
    run: sensor_layouts,
};

pub const NETWORK_POSITIONS: Experiment = Experiment {
    name: "network-positions",
    title: "Presses for the founding paper's network",
    method: "`palpate design positions` places 10, 20 and 30 presses without noise for the network of `examples/training-positions.toml`; the search for the optimal positions evaluates 60, 20 and 10 arrangements. \
             Errors are those of contacts at 1 to 399 mm after 25 further trainings.",
    seed: SEED,
    run: network_positions,
};

const SEED: u64 = 0;
/// As in `palpate design positions`.
const CALIBRATIONS: usize = 8;

#[derive(Clone, Copy)]
struct LayoutCase {
    surface: &'static str,
    toml: &'static str,
    calibrations: usize,
}

fn sensor_layouts(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let cases = [
        LayoutCase {
            surface: "plate",
            toml: include_str!("../../../examples/plate-design.toml"),
            calibrations: size.pick(20, 3),
        },
        LayoutCase {
            surface: "beam",
            toml: include_str!("../../../examples/sensor-design.toml"),
            calibrations: size.pick(100, 10),
        },
    ];
    let rows = in_parallel(&cases, |case| case.rows(), |case| case.surface.to_owned(), progress);
    let limit = |name| Column { decimals: 3, ..Column::mm(name, Goal::Smaller) };
    let columns = vec![
        limit("mean limit"),
        Column::mm("largest limit", Goal::Smaller),
        limit("score with one dead sensor"),
        limit("simulated error"),
    ];
    let mut table = Table::new("Layouts by method.", &["surface", "layout"], columns);
    table.rows = rows.into_iter().rev().collect::<Result<Vec<_>>>()?.concat();
    Ok(vec![table])
}

impl LayoutCase {
    fn rows(&self) -> Result<Vec<Row>> {
        let rig = Rig::from_toml(self.toml)?;
        let design = rig.design.as_ref().context("the rig has a [design]")?;
        let problem = SensorProblem::new(&rig.setup, design, Watch::NONE)?;
        let designed = problem.all(SEED, Watch::NONE)?;
        let mut verified = Vec::new();
        for AssessedLayout { method, layout, .. } in to_verify(&designed) {
            let verification =
                problem.verify(layout, &rig.estimator, self.calibrations, SEED, Watch::NONE)?;
            verified.push((*method, verification));
        }
        let row = |designed: &AssessedLayout| {
            let assessment = &designed.assessment;
            let exact = |limit_m: Option<f64>| limit_m.map(|limit_m| Figure::exact(1e3 * limit_m));
            let verification = verified.iter().find(|(method, _)| *method == designed.method);
            let figures = vec![
                exact(assessment.mean_limit_m),
                exact(assessment.worst_limit_m),
                exact(assessment.score_one_dead),
                verification.map(|(_, verification)| error(verification)),
            ];
            Row::new(&[self.surface, designed.method.name()], figures)
        };
        Ok(designed.iter().map(row).collect())
    }
}

/// Mean error in mm.
fn error(verification: &Verification) -> Figure {
    let standard_error = Some(1e3 * verification.standard_error_m);
    Figure { value: 1e3 * verification.mean_error_m, standard_error }
}

#[derive(Clone, Copy)]
struct PositionCase {
    count: usize,
    /// Arrangements of the search.
    trials: usize,
    /// Calibrations of each arrangement.
    calibrations: usize,
}

fn network_positions(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let full = [(30, 10), (20, 20), (10, 60)].map(|(count, trials)| PositionCase {
        count,
        trials,
        calibrations: CALIBRATIONS,
    });
    // One trial leaves the search with its start, which is no row.
    let quick = [PositionCase { count: 10, trials: 1, calibrations: 1 }];
    let cases: &[PositionCase] = size.pick(&full, &quick);
    let (verifications, keeps_search) = (size.pick(25, 10), size == Size::Full);
    let placed =
        in_parallel(cases, |case| case.placed(verifications), |case| case.count.to_string(), progress);
    let columns = vec![Column { decimals: 3, ..Column::mm("mean error", Goal::Smaller) }];
    let mut table = Table::new("Errors by arrangement.", &["positions", "arrangement"], columns);
    for (case, placed) in cases.iter().zip(placed).rev() {
        for VerifiedPositions { placement, verification, .. } in placed? {
            if placement != Placement::Optimal || keeps_search {
                let labels = [&case.count.to_string(), placement.name()];
                table.rows.push(Row::new(&labels, vec![Some(error(&verification))]));
            }
        }
    }
    Ok(vec![table])
}

impl PositionCase {
    fn placed(self, verifications: usize) -> Result<Vec<VerifiedPositions>> {
        let rig = Rig::from_toml(include_str!("../../../examples/training-positions.toml"))?;
        let design = PositionDesign {
            estimator: rig.estimator.clone(),
            trials: self.trials,
            calibrations: self.calibrations,
            verifications,
            seed: SEED,
            ..PositionDesign::for_training(rig.training()?)
        };
        let problem = PositionProblem::new(&rig.setup, &design.count(self.count))?;
        Ok(problem.all(Watch::NONE)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_designed_layout_is_better_than_even_sensors_in_simulation_too() {
        let toml = include_str!("../../../examples/sensor-design.toml");
        let rows = LayoutCase { surface: "beam", toml, calibrations: 2 }.rows().unwrap();
        let row = |method: &str| rows.iter().find(|row| row.labels[1] == method).unwrap();
        let [even, refined] = ["even", "refined"].map(row);
        for figure in [0, 1, 2, 3] {
            assert!(refined.figures[figure].unwrap().value < even.figures[figure].unwrap().value, "{rows:?}");
        }
    }

    #[test]
    fn chebyshev_positions_are_better_than_even_ones() {
        let placed = PositionCase { count: 10, trials: 1, calibrations: 1 }.placed(2).unwrap();
        let error_m = |of: Placement| {
            let placed = placed.iter().find(|placed| placed.placement == of).unwrap();
            placed.verification.mean_error_m
        };
        assert!(error_m(Placement::Chebyshev) < 0.8 * error_m(Placement::Even), "{placed:?}");
    }
}
