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
