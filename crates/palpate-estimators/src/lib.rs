//! Setups, recordings, estimators, tracking, load profiles and evaluation.
//!
//! [`Fit`](fit::Fit) turns a [`Recording`](recording::Recording) of a [`Setup`](setup::Setup), read or
//! [simulated](simulate), into a locator ([`Locate`](fit::Locate)) for [`evaluation`], [`tracking`] and
//! [`estimator`] files.
//!
//! ```
//! use palpate_estimators::arrangement::Training;
//! use palpate_estimators::evaluation::Evaluation;
//! use palpate_estimators::{fit::Fit, influence::Influence, setup::Setup};
//! use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
//!
//! let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
//! let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
//! let locator = Influence::default().fit(&setup, &setup.simulate(&Training::even(10), 0)?)?;
//! let errors = Evaluation::new(&locator, &setup.simulate(&Training::even(50), 1)?)?;
//! assert!(errors.effective_percent(mm(2.0)) > 90.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

pub mod arrangement;
pub mod batch;
mod candidate_errors;
pub mod centroid;
pub mod closed_form;
mod confidence_region;
pub mod description;
pub mod detectable_force;
pub mod digit;
mod distributed_contact;
pub mod estimate_record;
pub mod estimator;
pub mod evaluation;
pub mod features;
pub mod fit;
mod fit_memo;
#[cfg(test)]
mod fixtures;
pub mod force_prior;
pub mod gaussian_process;
mod held_out;
pub mod imperfections;
pub mod influence;
pub mod interval_check;
pub mod likelihood;
pub mod load_profile;
mod locator_fault;
mod model_offsets;
pub mod neighbours;
pub mod network;
pub mod offset_course;
pub mod reading_check;
pub mod recording;
pub mod recording_check;
pub mod setup;
pub mod simulate;
mod split;
pub mod status;
mod thinning;
pub mod track_errors;
pub mod tracking;
pub mod untouched_drift;
pub mod untouched_scatter;
