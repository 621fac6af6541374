//! Forward models of elastic surfaces, and the Cramér–Rao bound of contact location.
//!
//! Units are SI; forces are positive downward, deflections upward.
//!
//! ```
//! use palpate_mechanics::contact::{Contact, Position};
//! use palpate_mechanics::limit::{CramerRaoBound, Force};
//! use palpate_mechanics::sensing::{Layout, SensorKind};
//! use palpate_mechanics::surface::{Beam, Surface};
//! use palpate_mechanics::units::{gpa, mm, um};
//!
//! let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
//! let middle = Position::along(mm(200.0));
//! let per_newton = beam.influence(SensorKind::Deflection, middle, middle);
//! assert!((per_newton - -1.1574e-3).abs() < 1e-7); // −l³/(48·E·I)
//!
//! // What eight sensors with 5 µm of noise tell of a contact of 3 N: 0.166 mm, one standard deviation.
//! let mut layout = Layout::even(SensorKind::Deflection, 8, mm(400.0));
//! layout.edit(|sensors| sensors.iter_mut().for_each(|sensor| sensor.channel.noise_sd = um(5.0)))?;
//! let contact = Contact { position: Position::along(mm(130.0)), force_n: 3.0 };
//! let bound = CramerRaoBound::new(&beam, &layout)?.bound_at(contact, Force::Known).unwrap();
//! assert!((bound.sd_position_m - um(166.0)).abs() < um(1.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

pub mod contact;
pub mod limit;
pub mod sensing;
pub mod surface;
pub mod units;
