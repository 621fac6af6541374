//! Time and memory of long work, announced before its start, with a memory limit.

use crate::failure::{Failure, UserError};
use crate::progress::duration;
use crate::remark::remark;
use palpate_estimators::estimator::{Estimator, FitCost, MemoryLimit, Size};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;

/// The memory limit of commands whose work may need much.
#[derive(clap::Args)]
pub struct MemoryOption {
    /// Refuse work with a larger estimate of memory than this, such as "2 GB"
    #[arg(long, value_name = "SIZE")]
    memory_limit: Option<MemoryLimit>,
}

/// A more expensive fit is announced.
const NOTICEABLE: FitCost = FitCost { memory_bytes: 500e6, seconds: 5.0 };

/// Other work that takes longer, in seconds, is announced.
const NOTICEABLE_WORK_S: f64 = 3.0;

impl MemoryOption {
    pub fn check(
        &self,
        estimator: &Estimator,
        cost: FitCost,
        setup: &Setup,
        recording: &Recording,
    ) -> Result<(), Failure> {
        if let Some(limit) = self.memory_limit {
            limit.check_fit(estimator, cost).map_err(|exceeded| {
                UserError::new(exceeded).help(limit.remedy(estimator, setup, recording))
            })?;
        }
        if cost.memory_bytes > NOTICEABLE.memory_bytes || cost.seconds > NOTICEABLE.seconds {
            remark!("{}: {}", estimator.kind(), in_words(cost));
        }
        Ok(())
    }

    pub fn refusal(&self, estimator: &Estimator, cost: FitCost) -> Option<String> {
        let exceeded = self.memory_limit?.check_fit(estimator, cost).err()?;
        Some(exceeded.to_string())
    }

    pub fn check_work(
        &self,
        what: &str,
        [least_s, most_s]: [f64; 2],
        bytes: f64,
        remedy: &str,
    ) -> Result<(), Failure> {
        if let Some(limit) = self.memory_limit {
            limit
                .check(what, bytes)
                .map_err(|exceeded| UserError::new(exceeded).help(format!("raise the limit, or {remedy}")))?;
        }
        if most_s > NOTICEABLE_WORK_S || bytes > NOTICEABLE.memory_bytes {
            let [least, most] = [least_s, most_s].map(duration);
            let time = if least == most { most } else { format!("{least} to {most}") };
            remark!("{what} will take some {time} and {} of memory", Size(bytes));
        }
        Ok(())
    }
}

fn in_words(cost: FitCost) -> String {
    format!(
        "the fit will take at most some {} and {} of memory",
        duration(cost.seconds),
        Size(cost.memory_bytes)
    )
}
