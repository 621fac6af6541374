//! The founding paper's study: P. Tongpadungrod, "Neural network training techniques for improving the performance of a
//! distributive tactile sensor", Int. J. Advanced Robotic Systems, doi 10.5772/53567.

mod claims;
mod published;

pub use claims::{Claim, ClaimPart, claims};
pub use published::{Agreement, AgreementCriterion, PublishedFigure, published_figures};

/// Study file `studies/paper.toml`.
pub const STUDY_TOML: &str = include_str!("paper.toml");

/// Numbers of training positions.
pub const COUNTS: [u32; 3] = [10, 20, 30];
