//! The cost of long work, announced before its start; work above the limit is refused.

use crate::failure::{Complaint, Failure};
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

/// A fit with more time or memory than this is announced.
const NOTICEABLE: FitCost = FitCost { memory_bytes: 500e6, seconds: 5.0 };

/// Other work with more time than this, in seconds, is announced; it is usually short.
const NOTICEABLE_WORK_S: f64 = 3.0;

impl MemoryOption {
    /// Announces a fit with a long estimated time, and refuses one above the memory limit.
    pub fn check(
        &self,
        estimator: &Estimator,
        cost: FitCost,
        setup: &Setup,
        recording: &Recording,
    ) -> Result<(), Failure> {
        if let Some(limit) = self.memory_limit {
            limit.check_fit(estimator, cost).map_err(|exceeded| {
                Complaint::new(exceeded).help(limit.remedy(estimator, setup, recording))
            })?;
        }
        if cost.memory_bytes > NOTICEABLE.memory_bytes || cost.seconds > NOTICEABLE.seconds {
            remark!("{}: {}", estimator.kind(), in_words(cost));
        }
        Ok(())
    }

    /// Reason why an estimator may not be fitted; `None` if it may.
    pub fn refusal(&self, estimator: &Estimator, cost: FitCost) -> Option<String> {
        let exceeded = self.memory_limit?.check_fit(estimator, cost).err()?;
        Some(exceeded.to_string())
    }

    /// Announces other work if it is long, and refuses work above the memory limit.
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
                .map_err(|exceeded| Complaint::new(exceeded).help(format!("raise the limit, or {remedy}")))?;
        }
        if most_s > NOTICEABLE_WORK_S || bytes > NOTICEABLE.memory_bytes {
            let [least, most] = [least_s, most_s].map(duration);
            let time = if least == most { most } else { format!("{least} to {most}") };
            remark!("{what} will take some {time} and {} of memory", Size(bytes));
        }
        Ok(())
    }
}

/// "about 2 min 10 s and 600 MB"
fn in_words(cost: FitCost) -> String {
    format!(
        "the fit will take at most some {} and {} of memory",
        duration(cost.seconds),
        Size(cost.memory_bytes)
    )
}
