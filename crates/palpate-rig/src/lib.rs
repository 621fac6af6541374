//! Rig files and study files: TOML documents of a bench and of experiments.
//!
//! A [`Rig`] is read whole or as [`RigSections`]; a [`Study`] has arms with sections of their own. Invalid
//! text is a [`RigError`] with its place.
//!
//! ```
//! use palpate_estimators::fit::Fit;
//! use palpate_rig::Rig;
//!
//! let rig = Rig::from_toml(
//!     r#"
//!     [surface]
//!     kind = "beam"
//!     length = "400 mm"
//!     width = "40 mm"
//!     thickness = "1.2 mm"
//!     youngs_modulus = "200 GPa"
//!
//!     [sensors]
//!     measure = "deflection"
//!     count = 8
//!     noise = "5 um"
//!
//!     [contact]
//!     force = "3 N"
//!
//!     [training]
//!     count = 10
//!
//!     [estimator]
//!     kind = "influence"
//! "#,
//! )?;
//! let presses = rig.simulate(0)?;
//! let locator = rig.estimator.fit(&rig.setup, &presses)?;
//! let estimate = locator.locate(&presses.rows[3].reading)?;
//! assert!((estimate.contact.position.x_m - 0.140).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod design;
mod document;
mod error;
mod estimator;
mod first_rig;
mod imperfections;
mod in_words;
mod motion;
mod recording;
mod rig;
mod sections;
mod sensors;
mod stage;
mod study;
mod surface;
mod table_in_words;
mod training;
mod values;

pub use error::{RigError, RigProblem};
pub use first_rig::{FirstRig, FirstRigError, Hints, shell_word};
pub use rig::{Rig, RigSimulationError};
pub use sections::RigSections;
pub use stage::Stage;
pub use study::{Arm, EvaluationSettings, RequestedLayout, Study};
pub use table_in_words::table_in_words;

#[cfg(test)]
mod tests;
