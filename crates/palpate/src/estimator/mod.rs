//! Where methods meet: whoever evaluates, studies, reports or listens treats every estimator alike.

mod config;
mod fitting;
mod locator;
mod locator_file;
mod settings;
mod tracking;

pub use crate::tracking::{SmoothTracker, Track, TrackError, Tracked, Tracker, TrackerConfig};
pub use config::EstimatorConfig;
pub use fitting::{FitError, Fitting, LocatorQueue};
pub use locator::{LeaveOutError, Locator, LocatorProvenance, Method, ReadingError};
pub use locator_file::{FORMAT_VERSION, LocatorFileError};
pub use palpate_core::{ContactEstimate, Estimate, Mode, Status, Uncertainty};
pub use settings::Setting;
pub use tracking::{NotTrackable, Tracking};
