//! Options of all verbs with a live session.

use crate::failure::{Failure, UserError};
use crate::input;
use palpate_estimators::estimator::Locator;
use palpate_live::pipeline;
use palpate_live::session::{CreepConfig, Estimation, Session, SessionConfig};
use palpate_live::source::SourceUrl;
use std::path::Path;

/// Options of a session: the way from readings to estimates.
#[derive(clap::Args)]
pub struct SessionOptions {
    /// Filter the readings by a first-order low-pass with this cut-off frequency, such as "20 Hz"
    #[arg(long, value_name = "FREQUENCY", value_parser = input::frequency, conflicts_with = "track")]
    low_pass: Option<f64>,
    /// Track contacts over successive readings, as `palpate track` [default: locate each reading separately]
    #[arg(long)]
    track: bool,
    /// First natural frequency of a simply supported beam, such as "12 Hz", to model its inertia with 1 % of the critical damping [default: no inertia]
    #[arg(long, value_name = "FREQUENCY", value_parser = input::frequency, requires = "track")]
    frequency: Option<f64>,
    /// Correct the creep of a soft surface: its share of the first reading of a constant contact, from 0 to 1
    #[arg(long, value_name = "SHARE", value_parser = input::share, requires_all = ["track", "creep_time"])]
    creep: Option<f64>,
    /// Time constant of the creep, such as "30 s"
    #[arg(long, value_name = "TIME", value_parser = input::time, requires = "creep")]
    creep_time: Option<f64>,
}

impl SessionOptions {
    pub fn config(&self) -> SessionConfig {
        let estimation = match (self.low_pass, self.track) {
            (Some(cutoff_hz), _) => Estimation::LowPass { cutoff_hz },
            (None, true) => {
                let creep =
                    self.creep.zip(self.creep_time).map(|(share, time_s)| CreepConfig { share, time_s });
                Estimation::Track { frequency_hz: self.frequency, creep }
            }
            (None, false) => Estimation::Single,
        };
        SessionConfig { estimation, ..SessionConfig::default() }
    }

    pub fn session<'a>(&self, locator: &'a Locator, path: &Path) -> Result<Session<'a>, Failure> {
        Session::new(locator, &self.config()).map_err(|error| {
            UserError::for_path(path, error)
                .help("omit --track, --frequency or --creep, or fit another estimator")
                .into()
        })
    }

    pub fn check_source(&self, from: &SourceUrl) -> Result<(), Failure> {
        pipeline::check_pace(&self.config().estimation, from)
            .map_err(|error| UserError::new(format!("--from {from}: {error}")).into())
    }
}
