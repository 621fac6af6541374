//! Numbers of tests, read from the closing lines of the test runners.

use std::fmt;
use std::ops::Add;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub passed: usize,
    /// Failed, timed out, or could not start.
    pub failed: usize,
    /// Did not run, or had no prerequisite.
    pub skipped: usize,
}

impl Counts {
    /// Sums the closing lines; `None` without one, as after a failed build.
    pub fn read(lines: &[String]) -> Option<Self> {
        let sum =
            |read: fn(&str) -> Option<Self>| lines.iter().filter_map(|line| read(line)).reduce(Self::add);
        // nextest repeats the output of a failed test, which ends like a run of cargo test.
        sum(nextest).or_else(|| sum(cargo_test))
    }

    pub fn of_pytest(lines: &[String]) -> Option<Self> {
        lines.iter().rev().find_map(|line| pytest(line))
    }

    pub fn of_vitest(lines: &[String]) -> Option<Self> {
        lines.iter().filter_map(|line| vitest(line)).reduce(Self::add)
    }

    /// Moves tests without a prerequisite, which the runner counts as passed, to the skipped ones.
    pub fn with_skips(self, skips: usize) -> Self {
        let moved = skips.min(self.passed);
        Self { passed: self.passed - moved, skipped: self.skipped + moved, ..self }
    }

    fn count(mut self, number: usize, what: &str) -> Self {
        match what {
            "passed" => self.passed += number,
            "failed" | "timed out" | "exec failed" | "error" | "errors" => self.failed += number,
            "skipped" | "ignored" | "xfailed" | "xpassed" => self.skipped += number,
            _ => {}
        }
        self
    }
}

impl Add for Counts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            passed: self.passed + other.passed,
            failed: self.failed + other.failed,
            skipped: self.skipped + other.skipped,
        }
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} passed, {} failed, {} skipped", self.passed, self.failed, self.skipped)
    }
}

/// `Summary [   0.01s] 3/4 tests run: 2 passed (1 slow, 1 flaky), 1 failed, 1 skipped`
fn nextest(line: &str) -> Option<Counts> {
    let (_, results) = line.trim_start().strip_prefix("Summary [")?.split_once(" run: ")?;
    Some(tally(&without_asides(results), ','))
}

/// `test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.00s`
fn cargo_test(line: &str) -> Option<Counts> {
    let (_, results) = line.strip_prefix("test result: ")?.split_once(". ")?;
    Some(tally(results, ';'))
}

/// `1 failed, 45 passed, 2 skipped, 1 warning in 28.83s`
fn pytest(line: &str) -> Option<Counts> {
    let (results, took) = line.trim_matches(['=', ' ']).rsplit_once(" in ")?;
    let is_closing = took.starts_with(|first: char| first.is_ascii_digit()) && took.contains('s');
    let counts = tally(results, ',');
    (is_closing && counts != Counts::default()).then_some(counts)
}

/// `      Tests  1 failed | 32 passed | 2 skipped (35)`
fn vitest(line: &str) -> Option<Counts> {
    let (results, _) = line.trim_start().strip_prefix("Tests  ")?.rsplit_once(" (")?;
    Some(tally(results, '|'))
}

fn tally(results: &str, between: char) -> Counts {
    results.split(between).fold(Counts::default(), |counts, part| match part.trim().split_once(' ') {
        Some((number, what)) => number.parse().map_or(counts, |number| counts.count(number, what.trim())),
        None => counts,
    })
}

fn without_asides(text: &str) -> String {
    let mut depth = 0usize;
    let kept = text.chars().filter(|&character| {
        let outside = depth == 0 && character != '(';
        match character {
            '(' => depth += 1,
            ')' => depth = depth.saturating_sub(1),
            _ => {}
        }
        outside
    });
    kept.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Option<Counts> {
        Counts::read(&text.lines().map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn nextest_summaries_are_read() {
        let counts = read("     Summary [   0.005s] 3 tests run: 3 passed, 0 skipped");
        assert_eq!(counts, Some(Counts { passed: 3, failed: 0, skipped: 0 }));
        let counts = read(
            "  Summary [  5.678s] 10/20 tests run: 7 passed (1 slow, 1 flaky), 1 failed, 1 timed out, 1 exec failed, 2 skipped",
        );
        assert_eq!(counts, Some(Counts { passed: 7, failed: 3, skipped: 2 }));
        let counts = read("  Summary [   0.001s] 1 test run: 1 passed, 4 skipped");
        assert_eq!(counts, Some(Counts { passed: 1, failed: 0, skipped: 4 }));
    }

    #[test]
    fn a_failure_that_nextest_repeats_is_counted_once() {
        let counts = read(
            "test result: FAILED. 0 passed; 1 failed; 0 ignored\n Summary [ 1s] 2 tests run: 1 passed, 1 failed, 0 skipped",
        );
        assert_eq!(counts, Some(Counts { passed: 1, failed: 1, skipped: 0 }));
    }

    #[test]
    fn cargo_test_results_are_added_up() {
        let counts = read(
            "test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.00s\n\
             test result: FAILED. 1 passed; 2 failed; 0 ignored; 0 measured; 5 filtered out; finished in 0.10s",
        );
        assert_eq!(counts, Some(Counts { passed: 4, failed: 2, skipped: 1 }));
    }

    #[test]
    fn a_failed_build_has_no_counts() {
        assert_eq!(read("error: could not compile `palpate`\nSummary of nothing"), None);
    }

    #[test]
    fn the_closing_line_of_pytest_is_read() {
        let read = |line: &str| Counts::of_pytest(&["0.40s call tests/a.py".to_owned(), line.to_owned()]);
        let counts = read("1 failed, 45 passed, 2 skipped, 1 warning in 28.83s");
        assert_eq!(counts, Some(Counts { passed: 45, failed: 1, skipped: 2 }));
        let counts = read("===== 316 passed, 1 error in 131.02s (0:02:11) =====");
        assert_eq!(counts, Some(Counts { passed: 316, failed: 1, skipped: 0 }));
        assert_eq!(read("no tests ran in 0.01s"), None);
    }

    #[test]
    fn the_closing_line_of_vitest_is_read() {
        let read = |line: &str| Counts::of_vitest(&[" Test Files  1 failed (3)".to_owned(), line.to_owned()]);
        let counts = read("      Tests  1 failed | 32 passed | 2 skipped (35)");
        assert_eq!(counts, Some(Counts { passed: 32, failed: 1, skipped: 2 }));
        assert_eq!(read("      Tests  33 passed (33)"), Some(Counts { passed: 33, failed: 0, skipped: 0 }));
        assert_eq!(read("no tests"), None);
    }

    #[test]
    fn skips_are_taken_from_the_passed() {
        let counts = Counts { passed: 4, failed: 1, skipped: 1 }.with_skips(3);
        assert_eq!(counts, Counts { passed: 1, failed: 1, skipped: 4 });
        assert_eq!(counts.to_string(), "1 passed, 1 failed, 4 skipped");
        assert_eq!(Counts { passed: 1, failed: 0, skipped: 0 }.with_skips(9).skipped, 1);
    }
}
