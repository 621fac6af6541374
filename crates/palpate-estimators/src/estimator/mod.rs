//! Where methods meet: whoever evaluates, studies, reports or listens treats every estimator alike.

mod config;
mod fitting;
mod load_sensors;
mod locator;
mod locator_file;
mod settings;
mod tracking;

pub use crate::load_profile::{
    Cells, CentreOfPressure, LoadProfile, LoadSensors, LoadSensorsError, Patch, PatchLimit, Profiler,
    Resolution, patch_limits,
};
pub use crate::method::ReadingError;
pub use crate::tracking::{Across, SmoothTracker, Swing, Track, TrackError, Tracked, Tracker, TrackerConfig};
pub use config::EstimatorConfig;
pub use fitting::{FitError, Fitting, LocatorQueue};
pub use load_sensors::bench_load_sensors;
pub use locator::{LeaveOutError, Locator, LocatorProvenance, Method};
pub use locator_file::{FORMAT_VERSION, LocatorFileError};
pub use palpate_core::{ContactEstimate, Estimate, Mode, Status, Uncertainty};
pub use settings::Setting;
pub use tracking::{NotTrackable, Tracking};
