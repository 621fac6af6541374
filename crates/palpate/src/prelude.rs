//! Common items: `use palpate::prelude::*;`

pub use palpate_design::positions::{Advice, PositionDesign, PositionProblem, best_placed, next_press};
pub use palpate_design::sensors::{AssessedLayout, ContactPrior, SensorDesign, SensorProblem, Sites};
pub use palpate_estimators::arrangement::{Arrangement, Training, all_over};
pub use palpate_estimators::centroid::Centroid;
pub use palpate_estimators::closed_form::ClosedForm;
pub use palpate_estimators::digit::DigitEstimator;
pub use palpate_estimators::estimator::{
    ContactEstimate, Estimate, Estimator, Locator, Profiler, Status, Tracker, TrackerConfig,
};
pub use palpate_estimators::evaluation::{Calibration, Evaluation, Portion, cross_validate};
pub use palpate_estimators::fit::{Fit, FitTask, Locate, MethodLocator};
pub use palpate_estimators::gaussian_process::GaussianProcessEstimator;
pub use palpate_estimators::imperfections::Imperfections;
pub use palpate_estimators::influence::Influence;
pub use palpate_estimators::neighbours::Neighbours;
pub use palpate_estimators::network::{LevenbergMarquardt, Network};
pub use palpate_estimators::recording::{Columns, Recording, Row};
pub use palpate_estimators::setup::Setup;
pub use palpate_estimators::simulate::{simulate_at, simulate_loads};
pub use palpate_mechanics::contact::{Contact, Position};
pub use palpate_mechanics::limit::{CramerRaoBound, Force, LimitCurve};
pub use palpate_mechanics::sensing::SensorKind::{Deflection, Raw, Reaction, Slope, Strain};
pub use palpate_mechanics::surface::{Beam, Digit, Extent, Plate, SupportedBeam, UniformLoad};
pub use palpate_mechanics::units::{gpa, microstrain, mm, mpa, newtons, um};
pub use palpate_numerics::watch::{Cancelled, Progress, Watch};
pub use palpate_rig::Rig;
