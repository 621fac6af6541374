//! `palpate study dead-areas`: errors between sensors, by estimator and by the number of sensors.

use super::Arguments;
use super::built_in::BuiltIn;
use crate::failure::Failure;
use crate::input;
use crate::table::table;
use palpate_numerics::watch::Watch;
use palpate_report::{ReportFile, dead_areas_report};
use palpate_studies::dead_areas::{COUNTS, DeadAreaFindings, DeadAreas, DeadAreasError, RIG_TOML};
use std::path::Path;

/// Calibrations at each count, unless `--seeds` says another number.
const CALIBRATIONS: u64 = 3;
const TOLERANCE_M: f64 = 2e-3;

/// The study as the command line asks for it.
pub fn study(arguments: &Arguments) -> Result<DeadAreas, Failure> {
    Ok(DeadAreas {
        rig: input::parse_rig(Path::new("examples/dead-areas.toml"), RIG_TOML)?,
        counts: COUNTS.to_vec(),
        calibrations: arguments.seeds.unwrap_or(CALIBRATIONS),
        tolerance_m: TOLERANCE_M,
        without: Vec::new(),
        seed: 0,
    })
}

impl BuiltIn for DeadAreas {
    const NAME: &'static str = "dead-areas";
    type Findings = DeadAreaFindings;
    type Error = DeadAreasError;

    fn seeds(&self) -> (u64, u64) {
        (self.calibrations, self.seed)
    }

    fn most_rounds(&self) -> u64 {
        self.most_rounds()
    }

    fn run(&self, watch: Watch) -> Result<DeadAreaFindings, DeadAreasError> {
        self.run(watch)
    }

    fn report(&self, findings: &DeadAreaFindings) -> Vec<ReportFile> {
        dead_areas_report(self, findings)
    }

    fn tell(findings: &DeadAreaFindings) -> String {
        let heading = [
            "sensing",
            "estimator",
            "sensors",
            "effective, %",
            "over sensors, mm",
            "between, mm",
            "dead between, %",
        ];
        let rows = findings.rows.iter().map(|row| {
            vec![
                row.sensing.clone(),
                row.estimator.to_owned(),
                row.sensors.to_string(),
                format!("{:.1}", row.effective_percent),
                format!("{:.3}", row.folded.at_sensors_m * 1e3),
                format!("{:.3}", row.folded.between_m * 1e3),
                format!("{:.1}", row.folded.dead_percent),
            ]
        });
        let mut told = table(&heading, rows);
        for (sensing, estimator, sensors, why) in &findings.left_out {
            told += &format!("\n{sensing}, {estimator}, {sensors} sensors: left out: {why}");
        }
        told
    }
}
