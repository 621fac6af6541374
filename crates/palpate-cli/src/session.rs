//! Options of a live session, the same for every verb that has one.

use crate::failure::{Complaint, Failure};
use crate::input;
use palpate_estimators::estimator::Locator;
use palpate_live::pipeline;
use palpate_live::session::{Estimation, Session, SessionConfig};
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
}

impl SessionOptions {
    /// The configuration of the session.
    pub fn config(&self) -> SessionConfig {
        let estimation = match (self.low_pass, self.track) {
            (Some(cutoff_hz), _) => Estimation::LowPass { cutoff_hz },
            (None, true) => Estimation::Track { frequency_hz: self.frequency },
            (None, false) => Estimation::Single,
        };
        SessionConfig { estimation, ..SessionConfig::default() }
    }

    /// A session of a locator, which came from a file at `path`.
    pub fn session<'a>(&self, locator: &'a Locator, path: &Path) -> Result<Session<'a>, Failure> {
        Session::new(locator, &self.config()).map_err(|error| {
            Complaint::about(path, error)
                .help("leave --track or --frequency out, or fit another estimator")
                .into()
        })
    }

    /// Checks that they go with the source of the readings.
    pub fn check_source(&self, from: &SourceUrl) -> Result<(), Failure> {
        pipeline::check_pace(&self.config().estimation, from)
            .map_err(|error| Complaint::new(format!("--from {from}: {error}")).into())
    }
}
