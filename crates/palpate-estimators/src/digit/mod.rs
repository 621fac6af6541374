//! The flexible digit's own estimator, after Ma and his colleagues: where a bending finger is touched, how hard, and what
//! shape it has.
//!
//! Strain gauges read the bending moment. Those between the clamp and the contact see it, and those beyond see nothing, so the
//! likelihood of a reading has one smooth piece for every stretch between neighbouring gauges. Each piece is searched by
//! itself: a few starts, then Gauss–Newton steps on the exact elastica that never leave the stretch. What the pieces say
//! together is a posterior of position and force, flat before the reading over the digit's length and the logarithm of
//! the force: one Gaussian a stretch, cut off at its gauges; and where one gauge alone sees a contact of unknown
//! force, which tells force times lever and no more, a curve of contacts that explain it alike.

mod fitting;
mod gauges;
mod likelihood;
mod linear_theory;
mod locator;
mod posterior;
mod refine;
mod shape;

pub use fitting::{DigitEstimator, DigitFitError, DigitTheory};
pub use linear_theory::LinearTheory;
pub use locator::DigitLocator;
pub use shape::{DigitShape, ShapePoint};

#[cfg(test)]
mod tests;
