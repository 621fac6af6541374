//! Contact localization on an elastic surface with a few sensors: calibrate with known contacts, then locate.
//!
//! ```
//! use palpate::prelude::*;
//!
//! let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
//! let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?;
//! let training = Training::even(10).repeated(10).with_force(newtons(3.0));
//! let presses = setup.simulate(&training, 0)?;
//! let locator = Influence::default().fit(&setup, &presses)?;
//! let estimate = locator.locate(&presses.rows[40].reading)?;
//! let (position, force_n) = (estimate.contact.position, estimate.contact.force_n.unwrap());
//! assert!((position.x_m - mm(180.0)).abs() < mm(1.0) && (force_n - newtons(3.0)).abs() < 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Common items are in [`prelude`], all items in the modules of the crates:
//!
//! | crate | purpose | modules |
//! |---|---|---|
//! | [`mechanics`] | surfaces, sensors, Cramér–Rao bound | [`contact`](mechanics::contact), [`limit`](mechanics::limit), [`sensing`](mechanics::sensing), [`surface`](mechanics::surface) with [`modal`](mechanics::surface::modal) and [`plate`](mechanics::surface::plate), [`units`](mechanics::units) |
//! | [`estimators`] | recordings, estimators, tracking, load profiles, evaluation | [`arrangement`](estimators::arrangement), [`batch`](estimators::batch), [`centroid`](estimators::centroid), [`closed_form`](estimators::closed_form), [`description`](estimators::description), [`digit`](estimators::digit), [`estimator`](estimators::estimator), [`evaluation`](estimators::evaluation), [`features`](estimators::features), [`fit`](estimators::fit), [`gaussian_process`](estimators::gaussian_process), [`imperfections`](estimators::imperfections), [`influence`](estimators::influence) with [`measured`](estimators::influence::measured), [`likelihood`](estimators::likelihood), [`load_profile`](estimators::load_profile), [`neighbours`](estimators::neighbours), [`network`](estimators::network), [`recording`](estimators::recording), [`setup`](estimators::setup), [`simulate`](estimators::simulate), [`status`](estimators::status), [`track_errors`](estimators::track_errors), [`tracking`](estimators::tracking) |
//! | [`design`] | positions of sensors and contacts | [`positions`](design::positions), [`sensors`](design::sensors) |
//! | [`rig`] | TOML file of a bench | |
//! | [`numerics`] | linear algebra, Gaussian-process regression, distributions | [`regression`](numerics::regression), [`simd`](numerics::simd), [`small`](numerics::small), [`watch`](numerics::watch) |
//!
//! Units are metres, newtons and pascals; functions such as [`mm`](prelude::mm) convert. Complete programs
//! are in the folder `examples`.
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

pub mod prelude;

/// The programs of the reference page.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/reference/rust.md")]
pub mod reference_page {}

pub use palpate_design as design;
pub use palpate_estimators as estimators;
pub use palpate_mechanics as mechanics;
pub use palpate_numerics as numerics;
pub use palpate_rig as rig;
