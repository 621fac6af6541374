//! Studies: sets of arms, each fitted from many seeds.
//!
//! Networks on perfect sensors share one recording and train in lanes; the seed sets the random start. In
//! other arms each seed has a recording with fresh noise.
//!
//! ```
//! use palpate_numerics::watch::Watch;
//! use palpate_studies::{PreparedStudy, RunOptions, Study, StudyResults};
//!
//! let study = Study::from_toml(
//!     r#"
//!     name = "sensors"
//!
//!     [surface]
//!     kind = "beam"
//!     length = "400 mm"
//!     width = "40 mm"
//!     thickness = "1.2 mm"
//!     youngs_modulus = "200 GPa"
//!
//!     [contact]
//!     force = "3 N"
//!
//!     [training]
//!     count = 10
//!
//!     [estimator]
//!     kind = "influence"
//!
//!     [evaluation]
//!     from = "20 mm"
//!     to = "380 mm"
//!     step = "20 mm"
//!
//!     [[arm]]
//!     name = "four"
//!     sensors = { measure = "deflection", count = 4, noise = "5 um" }
//!
//!     [[arm]]
//!     name = "sixteen"
//!     sensors = { measure = "deflection", count = 16, noise = "5 um" }
//! "#,
//! )?;
//! let study = PreparedStudy::new(study, Watch::NONE)?;
//! let options = RunOptions { seeds: 1, threads: 1 };
//! let outcomes = study.run(options, Vec::new(), &|_| {}, Watch::NONE)?;
//! let results = StudyResults::new(&outcomes, &study);
//! assert!(results.arms[1].error_percent.median < results.arms[0].error_percent.median);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Tasks and shards run in any process: [`PreparedStudy::run_task`], [`PreparedStudy::assemble`],
//! [`PreparedStudy::merge`]. Results do not depend on the split.
//!
//! Built-in studies: [`paper`], [`dead_areas`], [`elliott`].
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(clippy::disallowed_methods, clippy::disallowed_types, clippy::print_stderr, clippy::print_stdout)
)]

mod assembly;
pub mod dead_areas;
pub mod elliott;
pub mod paper;
mod results;
mod results_file;
mod run;
mod tables;
mod task;

pub use assembly::{AssemblyError, MergedStudy, ShardTables};
pub use palpate_rig::{Arm, EvaluationSettings, RequestedLayout, Study};
pub use results::{
    ArmResults, LimitResults, PortionResults, RunFacts, SensorPlace, SetUp, StudyResults, TrainingSpanResults,
};
pub use results_file::ResultsFile;
pub use run::{ArmFit, ArmOutcome, FitCallback, PreparedStudy, RunOptions, StudyRunError, TrainedSeed};
pub use tables::{Checkpoint, CheckpointError, FitRows, RowProblem, StudyTables, TableKind};
pub use task::{Shard, ShardError, Task};

#[cfg(test)]
mod tests;
