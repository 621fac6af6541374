//! Where methods meet: whoever evaluates, studies, reports or listens treats every estimator alike.

mod choice;
mod config;
mod error;
mod fitting;
mod load_sensors;
mod locator;
mod locator_file;
mod settings;
mod tracking;

pub use crate::fit::LocatorProvenance;
pub use crate::fit::ReadingError;
pub use crate::load_profile::{
    Cells, CentreOfPressure, LoadProfile, LoadSensors, LoadSensorsError, Patch, PatchLimit, Profiler,
    Resolution, patch_limits,
};
pub use crate::tracking::{Across, SmoothTracker, Swing, Track, TrackError, Tracked, Tracker, TrackerConfig};
pub use choice::{CHOICE_FOLDS, Choice, Comparison, choose, contenders};
pub use config::Estimator;
pub use error::FitError;
pub use load_sensors::setup_load_sensors;
pub use locator::{LeaveOutError, Locator, Method};
pub use locator_file::{FORMAT_VERSION, LocatorFileError};
pub use palpate_core::{ContactEstimate, Estimate, Mode, Status, Uncertainty};
pub use settings::Setting;
pub use tracking::{NotTrackable, Tracking};
