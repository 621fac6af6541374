//! `palpate study elliott`: components of a plate's readings and a network, beside the influence locator and its tracker.

use super::Arguments;
use super::built_in::BuiltIn;
use crate::failure::Failure;
use crate::input;
use crate::table::table;
use palpate_estimators::evaluation::Quantiles;
use palpate_numerics::watch::Watch;
use palpate_report::{ReportFile, elliott_report};
use palpate_studies::elliott::{COMPONENTS, Elliott, ElliottError, ElliottFindings, PRESENTATIONS, RIG_TOML};
use std::path::Path;

/// Calibrations, unless `--seeds` says another number.
const CALIBRATIONS: u64 = 3;
const TOLERANCE_M: f64 = 5e-3;

/// The study as the command line asks for it.
pub fn study(arguments: &Arguments) -> Result<Elliott, Failure> {
    Ok(Elliott {
        rig: input::parse_rig(Path::new("examples/elliott.toml"), RIG_TOML)?,
        components: COMPONENTS.to_vec(),
        presentations: PRESENTATIONS,
        calibrations: arguments.seeds.unwrap_or(CALIBRATIONS),
        tolerance_m: TOLERANCE_M,
        seed: 0,
    })
}

impl BuiltIn for Elliott {
    const NAME: &'static str = "elliott";
    type Findings = ElliottFindings;
    type Error = ElliottError;

    fn seeds(&self) -> (u64, u64) {
        (self.calibrations, self.seed)
    }

    fn most_rounds(&self) -> u64 {
        self.most_rounds()
    }

    fn run(&self, watch: Watch) -> Result<ElliottFindings, ElliottError> {
        self.run(watch)
    }

    fn report(&self, findings: &ElliottFindings) -> Vec<ReportFile> {
        elliott_report(self, findings)
    }

    fn tell(findings: &ElliottFindings) -> String {
        let heading = ["chain", "error, mm", "limit, mm", "effective area, %", "moving, mm"];
        let rows = findings.rows.iter().map(|row| {
            let mm = |spread: Quantiles| format!("{:.3}", spread.median * 1e3);
            vec![
                row.chain.to_string(),
                row.error_m.map_or_else(String::new, mm),
                row.limit_m.map_or_else(String::new, |limit_m| format!("{:.3}", limit_m * 1e3)),
                row.effective_percent.map_or_else(String::new, |percent| format!("{:.1}", percent.median)),
                mm(row.moving_error_m),
            ]
        });
        table(&heading, rows)
    }
}
