//! Progress of long work: on a terminal a bar with rate and time left, in a pipe nothing.

use crate::interrupt;
use indicatif::{ProgressBar, ProgressStyle};
use std::time::{Duration, Instant};

/// A bar of `length` steps on stderr.
pub fn bar(length: u64, what: &str) -> ProgressBar {
    let bar = ProgressBar::new(length);
    let template = "{msg} {wide_bar} {pos}/{len}  {prefix}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.set_message(what.to_owned());
    bar.enable_steady_tick(Duration::from_millis(250));
    bar
}

/// Watches fits of at most `rounds` rounds in all: a bar, and Ctrl-C.
pub struct FitWatch {
    bar: ProgressBar,
    rounds: u64,
    start: Instant,
}

impl FitWatch {
    /// Begins to watch.
    pub fn new(rounds: u64) -> Self {
        Self { bar: bar(rounds, "fitting"), rounds: 0, start: Instant::now() }
    }

    /// Counts a round; false once somebody pressed Ctrl-C.
    pub fn keep_going(&mut self) -> bool {
        // Often enough for the eye, seldom enough to cost nothing.
        const EVERY: u64 = 64;
        self.rounds += 1;
        if self.rounds.is_multiple_of(EVERY) {
            self.bar.set_position(self.rounds);
            let rate = self.rounds as f64 / self.start.elapsed().as_secs_f64();
            let most = duration(self.bar.length().unwrap_or(0).saturating_sub(self.rounds) as f64 / rate);
            self.bar.set_prefix(format!("{rate:.0} epochs/s, at most {most} left"));
        }
        !interrupt::asked()
    }
}

impl Drop for FitWatch {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Steps of the bar of a whole stage.
const STAGE_STEPS: f64 = 1000.0;

/// A bar that begins anew with every stage.
pub struct StageWatch {
    bar: ProgressBar,
    stage: &'static str,
    start: Instant,
}

impl StageWatch {
    pub fn new() -> Self {
        Self { bar: bar(STAGE_STEPS as u64, "beginning"), stage: "", start: Instant::now() }
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
            self.bar.set_position((share * STAGE_STEPS) as u64);
            let left_s = self.start.elapsed().as_secs_f64() * (1.0 - share) / share;
            self.bar.set_prefix(format!("about {} left of this", duration(left_s)));
        }
        !interrupt::asked()
    }
}

impl Drop for StageWatch {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// "1 min 20 s"
pub fn duration(seconds: f64) -> String {
    let seconds = seconds.max(0.0).round() as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s} s"),
        (h, m, _) => format!("{h} h {m} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_read_well() {
        assert_eq!([0.4, 59.6, 80.0, 7265.0].map(duration), ["0 s", "1 min 0 s", "1 min 20 s", "2 h 1 min"]);
    }
}
