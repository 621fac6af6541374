//! The cost of long work, told before it is begun, and refused where it exceeds the limit.

use crate::failure::{Complaint, Failure};
use crate::input;
use crate::progress::duration;
use crate::remark::remark;
use palpate_estimators::estimator::{Estimator, FitCost, contenders};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;

/// The limit of memory of commands whose work may need much.
#[derive(clap::Args)]
pub struct MemoryLimit {
    /// Refuse work that is estimated to need more memory than this
    #[arg(long, value_name = "SIZE", value_parser = input::memory)]
    memory_limit: Option<f64>,
}

/// A fit that takes longer, or more memory, is announced.
const NOTICEABLE: FitCost = FitCost { memory_bytes: 500e6, seconds: 5.0 };

/// The same of other work, in seconds, which is short as a rule.
const NOTICEABLE_WORK_S: f64 = 3.0;

impl MemoryLimit {
    /// Announces a fit of estimated cost that takes long, and refuses one that takes more memory than it may.
    pub fn check(
        &self,
        estimator: &Estimator,
        cost: FitCost,
        setup: &Setup,
        recording: &Recording,
    ) -> Result<(), Failure> {
        if let Some(why) = self.refusal(estimator, cost) {
            return Err(Complaint::new(why).help(self.remedy(estimator, setup, recording)).into());
        }
        if cost.memory_bytes > NOTICEABLE.memory_bytes || cost.seconds > NOTICEABLE.seconds {
            remark!("{}: {}", estimator.kind(), in_words(cost));
        }
        Ok(())
    }

    /// Advice where memory is short, with the estimators that need no more than there may be.
    fn remedy(&self, own: &Estimator, setup: &Setup, recording: &Recording) -> String {
        let others = contenders(setup, own, recording.rows.len());
        let suits = |other: &&Estimator| {
            other.kind() != own.kind() && self.refusal(other, other.fit_cost(setup, recording)).is_none()
        };
        let kinds: Vec<&str> = others.iter().filter(suits).map(Estimator::kind).collect();
        match kinds[..] {
            [] => "raise the limit, or leave rows out".into(),
            _ => format!(
                "raise the limit, leave rows out, or name an estimator that keeps less: {}",
                kinds.join(", ")
            ),
        }
    }

    /// Reason why an estimator may not be fitted; `None` where it may.
    pub fn refusal(&self, estimator: &Estimator, cost: FitCost) -> Option<String> {
        self.excess(&format!("the fit of {}", estimator.kind()), cost.memory_bytes)
    }

    /// Announces other work where it is noticeable, and refuses what needs more memory than it may.
    pub fn check_work(
        &self,
        what: &str,
        [least_s, most_s]: [f64; 2],
        bytes: f64,
        remedy: &str,
    ) -> Result<(), Failure> {
        if let Some(why) = self.excess(what, bytes) {
            return Err(Complaint::new(why).help(format!("raise the limit, or {remedy}")).into());
        }
        if most_s > NOTICEABLE_WORK_S || bytes > NOTICEABLE.memory_bytes {
            let [least, most] = [least_s, most_s].map(duration);
            let time = if least == most { most } else { format!("{least} to {most}") };
            remark!("{what} will take some {time} and {} of memory", size(bytes));
        }
        Ok(())
    }

    /// "X needs about 2.0 GB of memory; --memory-limit is 1.0 GB", where it does.
    fn excess(&self, what: &str, bytes: f64) -> Option<String> {
        let limit = self.memory_limit.filter(|limit| bytes > *limit)?;
        let (needed, limit) = (size(bytes), size(limit));
        Some(format!("{what} needs about {needed} of memory; --memory-limit is {limit}"))
    }
}

/// "about 2 min 10 s and 600 MB"
fn in_words(cost: FitCost) -> String {
    format!(
        "the fit will take at most some {} and {} of memory",
        duration(cost.seconds),
        size(cost.memory_bytes)
    )
}

/// A size of memory with its unit.
pub fn size(bytes: f64) -> String {
    match bytes {
        b if b >= 1e9 => format!("{:.1} GB", b / 1e9),
        b if b >= 1e6 => format!("{:.0} MB", b / 1e6),
        b => format!("{:.0} kB", (b / 1e3).ceil()),
    }
}
