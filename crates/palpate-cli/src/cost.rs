//! The cost of a fit, told before it is begun, and refused where it exceeds the limit.

use crate::failure::{Complaint, Failure};
use crate::input;
use crate::progress::duration;
use palpate_estimators::estimator::{Estimator, FitCost, contenders};
use palpate_estimators::recording::Recording;
use palpate_estimators::setup::Setup;

/// The limit of memory of commands that fit.
#[derive(clap::Args)]
pub struct MemoryLimit {
    /// Refuse a fit that is estimated to need more memory than this
    #[arg(long, value_name = "SIZE", value_parser = input::memory)]
    memory_limit: Option<f64>,
}

/// A fit that takes longer, or more memory, is announced.
const NOTICEABLE: FitCost = FitCost { memory_bytes: 500e6, seconds: 20.0 };

impl MemoryLimit {
    /// Estimates a fit, announces one that takes long, and refuses one that takes more memory than it may.
    pub fn check(&self, estimator: &Estimator, setup: &Setup, recording: &Recording) -> Result<(), Failure> {
        let cost = estimator.fit_cost(setup, recording);
        if let Some(why) = self.refusal(estimator, cost) {
            return Err(Complaint::new(why).help(self.remedy(estimator, setup, recording)).into());
        }
        if cost.memory_bytes > NOTICEABLE.memory_bytes || cost.seconds > NOTICEABLE.seconds {
            eprintln!("{}: {}", estimator.kind(), in_words(cost));
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
        let limit = self.memory_limit.filter(|limit| cost.memory_bytes > *limit)?;
        let (needed, limit) = (size(cost.memory_bytes), size(limit));
        Some(format!(
            "the fit of {} needs about {needed} of memory; --memory-limit is {limit}",
            estimator.kind()
        ))
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
