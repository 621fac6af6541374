//! Python package of palpate: types of the facade as classes, readings as arrays.
//!
//! Code without need of speed is in Python (`python/palpate`): sections of a rig as data classes,
//! progress, figures, estimators of scikit-learn.
#![forbid(unsafe_code)]
#![expect(clippy::needless_pass_by_value, reason = "PyO3 extracts arguments by value")]

mod arrays;
mod bench;
mod comparison;
mod errors;
mod estimates;
mod estimator;
mod evaluation;
mod files;
mod influence;
mod inspect;
mod limit;
mod load_profile;
mod locator;
mod methods;
mod placement;
mod positions;
mod quantities;
mod rig;
mod sections;
mod study;
mod subject;
mod surface;
mod tare;
mod tracking;
mod training;
mod values;
mod work;

use pyo3::prelude::*;

/// The part of the package that is written in Rust; `palpate` exports it.
#[pymodule(gil_used = false)]
mod _palpate {
    use super::*;
    #[pymodule_export]
    use crate::{
        bench::{Recording, Setup},
        comparison::{compare, cross_validate},
        estimates::{Estimate, Estimates},
        estimator::Estimator,
        evaluation::Evaluation,
        inspect::{inspect, inspect_study, inspect_table},
        limit::limit,
        load_profile::{load_profile, simulate_loads},
        locator::Locator,
        placement::place_sensors,
        positions::{next_press, place_training},
        quantities::parse_quantity,
        rig::Rig,
        study::{PreparedStudy, paper_study, read_study},
        tracking::{Tracker, moving_csv, simulate_moving, track},
        training::Training,
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
