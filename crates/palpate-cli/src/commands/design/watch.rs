//! Progress of a design, and Ctrl-C.

use crate::{interrupt, progress};
use indicatif::ProgressBar;
use std::time::Instant;

/// Steps of the bar for a whole stage.
const STEPS: f64 = 1000.0;

/// A bar that begins anew with every stage.
pub struct Watch {
    bar: ProgressBar,
    stage: &'static str,
    start: Instant,
}

impl Watch {
    pub fn new() -> Self {
        Self { bar: progress::bar(STEPS as u64, "designing"), stage: "", start: Instant::now() }
    }

    /// Shows how far a stage, in words, has come; false once somebody pressed Ctrl-C.
    pub fn keep_going(&mut self, stage: &'static str, share: f64) -> bool {
        if self.stage != stage {
            self.stage = stage;
            self.start = Instant::now();
            self.bar.set_message(stage);
            self.bar.set_prefix("");
        }
        if share > 0.0 {
            self.bar.set_position((share * STEPS) as u64);
            let left_s = self.start.elapsed().as_secs_f64() * (1.0 - share) / share;
            self.bar.set_prefix(format!("about {} left of this", progress::duration(left_s)));
        }
        !interrupt::asked()
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
