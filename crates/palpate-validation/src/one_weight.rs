//! Surfaces that were calibrated with one weight: the unit and the size of the weight must not matter, nor that contacts are several times as heavy.

use crate::experiment::{Bench, Forces, Knowledge, World, Zero};
use crate::parallel::in_parallel;
use crate::real_benches::BENCHES;
use crate::results::{Results, mm, percent};
use crate::tally::{Figures, Tally};
use anyhow::{Context, Result};
use palpate::prelude::{Estimator, Influence, Rig};
use serde::Serialize;
use std::fmt::Write;

/// A shelf on load cells, and gauges under its board.
const SHELF: (&str, &str) = (
    "shelf",
    r#"[surface]
kind = "beam"
length = "900 mm"
width = "250 mm"
thickness = "25 mm"
youngs_modulus = "10 GPa"

[sensors]
measure = "strain"
count = 5
noise = "0.5 ue"
gain_error = "1 %"
offset_error = "50 ue"

[training]
count = 19
repeats = 3
force = "100 N"
placement = "2 mm"

[estimator]
kind = "influence"

[imperfections]
hysteresis = "0.5 %"
residue = { share = "0.2 %", time = "30 s" }
common_drift_per_hour = "4 ue"
noise_correlation = 0.3
touch_width = "30 mm"
"#,
);

/// Weights of a calibration, in newtons: 100 N, whole and broken numbers of kilograms, and other round numbers.
const WEIGHTS_N: [f64; 6] = [100.0, 98.1, 196.2, 250.0, 500.0, 1000.0];
/// Presses and contacts with the same weight.
const ALIKE: Forces = Forces { pressed: &[1.0], touched: &[1.0] };
/// Presses with one weight, and steps of a person.
const WALKING: Forces = Forces { pressed: &[1.0], touched: &[5.0, 6.0, 7.0, 8.0, 9.0] };

/// Size of the experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Seeds of each row, from 0 on; at least 1.
    pub seeds: u64,
    /// Contacts in use of each seed, about.
    pub contacts: usize,
}

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableRow {
    /// The bench.
    pub bench: &'static str,
    /// Weight of the presses, in newtons.
    pub pressed_n: f64,
    /// Weights in use, in newtons.
    pub touched_n: Vec<f64>,
    /// Mean error of the centre of force, in mm, where the sensors are load cells.
    pub centre_of_force_mm: Option<f64>,
    /// Figures over all seeds.
    #[serde(flatten)]
    pub figures: Figures,
}

struct Case {
    name: &'static str,
    rig: Rig,
    weight_n: f64,
    forces: Forces,
}

/// The floor, the shelf and the strip.
fn benches() -> [(&'static str, &'static str); 3] {
    let [strip, _, _, floor] = BENCHES;
    [floor, SHELF, strip]
}

/// Runs the experiment; `progress` gets the name of a finished row, the number of finished rows and of all.
///
/// # Errors
/// A bench that cannot be simulated or fitted.
pub fn run(options: Options, progress: impl Fn(&str, usize, usize) + Sync) -> Result<Results<TableRow>> {
    let mut cases = Vec::new();
    for (name, toml) in benches() {
        let case = |weight_n, forces| -> Result<Case> {
            let rig = Rig::from_toml(toml).with_context(|| name.to_owned())?;
            Ok(Case { name, rig, weight_n, forces })
        };
        for weight_n in WEIGHTS_N {
            cases.push(case(weight_n, ALIKE)?);
        }
        cases.push(case(100.0, WALKING)?);
    }
    let name = |case: &Case| format!("{}, {} N", case.name, case.weight_n);
    let rows = in_parallel(&cases, |case| case.row(options), name, progress);
    let rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(Results::new("one-weight", (options.seeds, options.contacts), &benches(), rows))
}

impl Case {
    fn row(&self, options: Options) -> Result<TableRow> {
        let mut rig = self.rig.clone();
        rig.training.as_mut().context("the rig has no presses")?.force_n = Some(self.weight_n);
        let bench =
            Bench { rig: &rig, world: World::Imperfect, knowledge: Knowledge::Measured, forces: self.forces };
        let mut tally = [Tally::new(rig.setup.surface().extent())];
        let mut centres_m = Vec::new();
        for seed in 0..options.seeds {
            let recordings = bench.record(options.contacts, seed)?;
            let estimator = Estimator::Influence(Influence::default());
            recordings.judge(&estimator, seed, &[Zero::Each], &mut tally)?;
            centres_m.extend(recordings.centre_of_force_error_m());
        }
        let [tally] = tally;
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        Ok(TableRow {
            bench: self.name,
            pressed_n: self.weight_n,
            touched_n: self.forces.touched.iter().map(|share| share * self.weight_n).collect(),
            centre_of_force_mm: (!centres_m.is_empty()).then(|| 1e3 * mean(&centres_m)),
            figures: tally.figures(),
        })
    }
}

const COLUMNS: [&str; 10] = [
    "bench",
    "pressed (N)",
    "touched (N)",
    "median, mean error (mm)",
    "centre of force, mean (mm)",
    "position in 95 %",
    "force in 95 %",
    "outside model",
    "ambiguous",
    "missed",
];

impl Results<TableRow> {
    /// The table in Markdown.
    pub fn markdown(&self) -> String {
        let mut text = self.table_head("raw channels pressed with one weight", &COLUMNS);
        for TableRow { bench, pressed_n, touched_n, centre_of_force_mm, figures } in &self.rows {
            let touched: Vec<String> = touched_n.iter().map(ToString::to_string).collect();
            let shares = [
                figures.position_coverage,
                figures.force_coverage,
                figures.outside_model,
                figures.ambiguous,
                figures.missed,
            ];
            let _ = writeln!(
                text,
                "| {bench} | {pressed_n} | {} | {}, {} | {} | {} |",
                touched.join(", "),
                mm(figures.median_error_mm),
                mm(figures.mean_error_mm),
                mm(*centre_of_force_mm),
                shares.map(percent).join(" | ")
            );
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_floor_pressed_with_one_weight_is_walked_on() {
        let (name, toml) = benches()[0];
        let rig = Rig::from_toml(toml).unwrap();
        // What raw channels learn is beside its place as the presses are.
        let placement_mm = 1e3 * rig.training().unwrap().placement_sd_m.unwrap();
        let case = Case { name, rig, weight_n: 100.0, forces: WALKING };
        let error_mm = case.row(Options { seeds: 1, contacts: 20 }).unwrap().figures.mean_error_mm.unwrap();
        assert!(error_mm < 2.0 * placement_mm, "{error_mm}");
    }
}
