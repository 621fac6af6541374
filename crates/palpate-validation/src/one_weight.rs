//! Calibrations with one weight, whose unit and size must not matter, nor heavier contacts.

use crate::bench::{Bench, Forces, Knowledge, World, Zero};
use crate::experiment::{Experiment, Progress, Size};
use crate::parallel::in_parallel;
use crate::real_benches::BENCHES;
use crate::statistics::Sample;
use crate::table::{Column, Goal, Row, Table};
use crate::tally::{Figures, Tally};
use anyhow::{Context, Result};
use palpate::prelude::{Estimator, Influence, Rig};

pub const EXPERIMENT: Experiment = Experiment {
    name: "one-weight",
    title: "Surfaces calibrated with one weight",
    method: "A floor, a shelf and a strip are calibrated as raw channels with one weight, and locate the same weight all over the surface, tared before each contact. After a calibration with \
             100 N they locate 500 to 900 N as well; the centre of force Σ r·x/Σ r of the load cells' readings r stands beside it.",
    seed: 0,
    run,
};

/// Load cells, and gauges under the board.
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

/// 100 N, whole and broken numbers of kilograms, and round numbers.
const WEIGHTS_N: [f64; 6] = [100.0, 98.1, 196.2, 250.0, 500.0, 1000.0];
/// Same weight in calibration and use.
const ALIKE: Forces = Forces { pressed: &[1.0], touched: &[1.0] };
/// One weight, then steps of a person.
const WALKING: Forces = Forces { pressed: &[1.0], touched: &[5.0, 6.0, 7.0, 8.0, 9.0] };

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Repetitions {
    /// Per row, from 0.
    seeds: u64,
    /// Per seed, about.
    contacts: usize,
}

struct Case {
    name: &'static str,
    rig: Rig,
    weight_n: f64,
    forces: Forces,
}

fn benches() -> [(&'static str, &'static str); 3] {
    let [strip, _, _, floor] = BENCHES;
    [floor, SHELF, strip]
}

fn run(size: Size, progress: Progress) -> Result<Vec<Table>> {
    let repetitions =
        size.pick(Repetitions { seeds: 2, contacts: 60 }, Repetitions { seeds: 1, contacts: 20 });
    let weights_n: &[f64] = size.pick(&WEIGHTS_N, &WEIGHTS_N[1..2]);
    let benches = benches();
    let mut cases = Vec::new();
    // The floor and the strip take most of the time.
    for (name, toml) in &benches[size.pick(0..3, 1..2)] {
        let case = |weight_n, forces| -> Result<Case> {
            let rig = Rig::from_toml(toml).with_context(|| (*name).to_owned())?;
            Ok(Case { name, rig, weight_n, forces })
        };
        for weight_n in weights_n {
            cases.push(case(*weight_n, ALIKE)?);
        }
        cases.push(case(100.0, WALKING)?);
    }
    let name = |case: &Case| format!("{}, {} N", case.name, case.weight_n);
    let rows = in_parallel(&cases, |case| case.row(repetitions), name, progress);
    let mut columns = Figures::columns();
    columns.push(Column::mm("mean error of the centre of force", Goal::None));
    let mut table =
        Table::new("Raw channels pressed with one weight.", &["bench", "pressed", "touched"], columns);
    table.rows = rows.into_iter().collect::<Result<_>>()?;
    Ok(vec![table])
}

impl Case {
    fn row(&self, repetitions: Repetitions) -> Result<Row> {
        let mut rig = self.rig.clone();
        rig.training.as_mut().context("the rig has no presses")?.force_n = Some(self.weight_n);
        let bench =
            Bench { rig: &rig, world: World::Imperfect, knowledge: Knowledge::Measured, forces: self.forces };
        let mut tally = [Tally::default()];
        let mut centres_mm = Sample::default();
        for seed in 0..repetitions.seeds {
            let recordings = bench.record(repetitions.contacts, seed)?;
            let estimator = Estimator::Influence(Influence::default());
            recordings.judge(&estimator, seed, &[Zero::Each], &mut tally)?;
            let errors_m = recordings.centre_of_force_errors_m();
            errors_m.into_iter().for_each(|error_m| centres_mm.add(seed, 1e3 * error_m));
        }
        let [tally] = tally;
        let mut figures = tally.figures().cells();
        figures.push(centres_mm.mean());
        let touched: Vec<String> =
            self.forces.touched.iter().map(|share| format!("{}", share * self.weight_n)).collect();
        let (pressed, touched) = (format!("{} N", self.weight_n), format!("{} N", touched.join(", ")));
        Ok(Row::new(&[self.name, &pressed, &touched], figures))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_floor_pressed_with_one_weight_is_walked_on() {
        let (name, toml) = benches()[0];
        let rig = Rig::from_toml(toml).unwrap();
        // Raw channels learn places that are off by the error of the presses.
        let placement_mm = 1e3 * rig.training().unwrap().placement_sd_m.unwrap();
        let case = Case { name, rig, weight_n: 100.0, forces: WALKING };
        let row = case.row(Repetitions { seeds: 1, contacts: 20 }).unwrap();
        let place = Figures::columns().iter().position(|column| column.name == "mean error").unwrap();
        let error_mm = row.figures[place].unwrap().value;
        assert!(error_mm < 2.0 * placement_mm, "{error_mm}");
        assert!(row.figures.last().unwrap().is_some(), "{row:?}");
        assert_eq!(row.labels, ["real-floor", "100 N", "500, 600, 700, 800, 900 N"]);
    }
}
