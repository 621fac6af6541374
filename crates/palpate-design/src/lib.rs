//! Placement of sensors and of training presses.
//!
//! [`sensors`] minimizes the Cramér–Rao bound, [`positions`] the error after simulated calibrations.
//!
//! ```
//! use palpate_design::positions::{PositionDesign, next_press};
//! use palpate_design::sensors::{SensorDesign, SensorProblem, Sites};
//! use palpate_estimators::arrangement::Training;
//! use palpate_estimators::setup::Setup;
//! use palpate_mechanics::sensing::SensorKind::Deflection;
//! use palpate_mechanics::surface::Beam;
//! use palpate_mechanics::units::{gpa, mm, newtons, um};
//! use palpate_numerics::watch::Watch;
//!
//! let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
//! let setup = Setup::new(beam).sensors(Deflection.evenly(4).noise(um(5.0)))?.known_force(newtons(3.0))?;
//!
//! // Where the four sensors tell most.
//! let design = SensorDesign::for_setup(&setup)?.sites(Sites::Every(mm(10.0)));
//! let best = SensorProblem::new(&setup, &design, Watch::NONE)?.greedy_exchange(0, Watch::NONE)?;
//! let setup = setup.with_layout(best.layout)?;
//!
//! // Where to press next after six presses, and what that gains.
//! let presses = setup.simulate(&Training::even(6).repeated(3), 0)?;
//! let advice = next_press(&setup, &presses, &PositionDesign::default(), Watch::NONE)?;
//! assert!(advice.next[0].error_m < advice.error_m);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod contacts;
#[cfg(test)]
mod fixtures;
pub mod positions;
pub mod sensors;
mod verification;

pub use contacts::{ContactPrior, WeightedContacts};
pub use verification::Verification;
