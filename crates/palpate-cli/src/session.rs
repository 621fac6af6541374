//! Options of a live session, common to all verbs that have one.

use crate::failure::{Complaint, Failure};
use crate::input;
use palpate_estimators::estimator::Locator;
use palpate_live::pipeline;
use palpate_live::session::{CreepConfig, Estimation, Session, SessionConfig};
use palpate_live::source::SourceUrl;
use std::path::Path;

/// How the session comes from readings to estimates.
#[derive(clap::Args)]
pub struct SessionOptions {
    /// Filter the readings by a low-pass of the first order before they are located, with this cut-off, as in `--low-pass "20 Hz"`
    #[arg(long, value_name = "FREQUENCY", value_parser = input::frequency, conflicts_with = "track")]
    low_pass: Option<f64>,
    /// Follow contacts from reading to reading by the tracker of `palpate track`, instead of locating each reading by itself
    #[arg(long)]
    track: bool,
    /// The first natural frequency of a beam on two simple supports: the tracker reckons with its inertia, and 1 % of the critical damping
    #[arg(long, value_name = "FREQUENCY", value_parser = input::frequency, requires = "track")]
    frequency: Option<f64>,
    /// The creep of a soft surface, which the tracker takes off: how much a reading that is held for long grows, as a share of a fresh press
    #[arg(long, value_name = "SHARE", value_parser = input::share, requires_all = ["track", "creep_time"])]
    creep: Option<f64>,
    /// The time in which all but an e-th of the creep has come, as in `--creep-time "30 s"`
    #[arg(long, value_name = "TIME", value_parser = input::time, requires = "creep")]
    creep_time: Option<f64>,
}

impl SessionOptions {
    /// The configuration of the session.
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

    /// A session of a locator from the file at `path`.
    pub fn session<'a>(&self, locator: &'a Locator, path: &Path) -> Result<Session<'a>, Failure> {
        Session::new(locator, &self.config()).map_err(|error| {
            Complaint::about(path, error)
                .help("omit --track, --frequency or --creep, or fit another estimator")
                .into()
        })
    }

    /// Checks that the options fit the source of the readings.
    pub fn check_source(&self, from: &SourceUrl) -> Result<(), Failure> {
        pipeline::check_pace(&self.config().estimation, from)
            .map_err(|error| Complaint::new(format!("--from {from}: {error}")).into())
    }
}
