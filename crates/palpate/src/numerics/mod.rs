//! Dense linear algebra that several modules need.

mod cholesky;

pub use cholesky::{Cholesky, NotPositiveDefinite};
