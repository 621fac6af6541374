//! The tally of a study as it runs: a row for every network that is kept, and a step of the bar for every fit.

use super::checkpoint::CheckpointFile;
use crate::failure::{Complaint, Failure};
use crate::progress;
use indicatif::ProgressBar;
use palpate_studies::{NetworksCsv, PreparedStudy, RunOptions, Trained, TrainedSeed};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Patterns that were presented to a network.
pub fn presentations(prepared: &PreparedStudy, arm: usize, fit: &TrainedSeed) -> u64 {
    u64::from(fit.locator.training_outcome().unwrap_or_default().epochs) * prepared.patterns(arm) as u64
}

/// Called by every training thread.
pub struct Tally<'a> {
    prepared: &'a PreparedStudy,
    table: &'a NetworksCsv<'a>,
    bar: ProgressBar,
    start: Instant,
    state: Mutex<State>,
}

struct State {
    /// `None` where no network is kept.
    file: Option<CheckpointFile>,
    error: Option<std::io::Error>,
    arms: Vec<ArmTally>,
    /// Presentations of this run.
    presented: u64,
    /// Fits of this run.
    fitted: u64,
}

/// What is known of an arm's cost.
#[derive(Clone, Copy, Default)]
struct ArmTally {
    patterns: f64,
    left: f64,
    finished: f64,
    presentations: f64,
}

impl<'a> Tally<'a> {
    /// Watches a run that has `done` behind it.
    pub fn new(
        prepared: &'a PreparedStudy,
        options: RunOptions,
        table: &'a NetworksCsv<'a>,
        file: Option<CheckpointFile>,
        done: &[Trained],
    ) -> Self {
        let mut arms: Vec<ArmTally> = (0..prepared.study.arms.len())
            .map(|arm| ArmTally {
                patterns: prepared.patterns(arm) as f64,
                left: options.seeds as f64,
                ..ArmTally::default()
            })
            .collect();
        for trained in done.iter().filter(|trained| trained.fit.seed < options.seeds) {
            arms[trained.arm].count(presentations(prepared, trained.arm, &trained.fit) as f64);
        }
        let bar = progress::bar(arms.len() as u64 * options.seeds, "fitting");
        bar.set_position(arms.iter().map(|arm| arm.finished as u64).sum());
        let state = Mutex::new(State { file, error: None, arms, presented: 0, fitted: 0 });
        Self { prepared, table, bar, start: Instant::now(), state }
    }

    /// A fit is finished: the row of a network that is kept goes to the file, and the bar goes on.
    pub fn note(&self, trained: &Trained) {
        let row = self.prepared.is_in_lanes(trained.arm).then(|| self.table.row(trained));
        let presented = presentations(self.prepared, trained.arm, &trained.fit);
        let mut state = self.state();
        if let (Some(file), Some(row)) = (&mut state.file, row)
            && let Err(error) = file.add(&row)
        {
            state.error.get_or_insert(error);
        }
        state.presented += presented;
        state.fitted += 1;
        state.arms[trained.arm].count(presented as f64);
        self.bar.set_prefix(state.rate_in_words(self.start.elapsed().as_secs_f64()));
        drop(state);
        self.bar.inc(1);
    }

    /// Whether the file could not be written.
    pub fn failed(&self) -> bool {
        self.state().error.is_some()
    }

    /// Takes the bar away, and tells how many fits of each arm are finished.
    pub fn finish(&self) -> Result<Vec<u64>, Failure> {
        self.bar.finish_and_clear();
        let mut state = self.state();
        match state.error.take() {
            Some(error) => Err(Complaint::new(format!("cannot write networks.csv: {error}")).into()),
            None => Ok(state.arms.iter().map(|arm| arm.finished as u64).collect()),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ArmTally {
    fn count(&mut self, presentations: f64) {
        self.left -= 1.0;
        self.finished += 1.0;
        self.presentations += presentations;
    }
}

impl State {
    /// "12.3 M presentations/s, 40 s left"; where no estimator is trained by epochs, "8.1 fits/s, 40 s left".
    fn rate_in_words(&self, seconds: f64) -> String {
        if self.arms.iter().any(|arm| arm.patterns > 0.0) {
            let rate = self.presented as f64 / seconds;
            let left = progress::duration(self.presentations_left() / rate);
            return format!("{:.1} M presentations/s, {left} left", rate / 1e6);
        }
        let rate = self.fitted as f64 / seconds;
        let left = self.arms.iter().map(|arm| arm.left).sum::<f64>();
        format!("{rate:.1} fits/s, {} left", progress::duration(left / rate))
    }

    /// An arm's networks cost what its finished ones did. Where none is finished, they cost what the others did, in
    /// proportion to the square of the number of patterns, which is roughly how the paper's arms grow.
    fn presentations_left(&self) -> f64 {
        let known: Vec<&ArmTally> =
            self.arms.iter().filter(|arm| arm.finished * arm.patterns > 0.0).collect();
        let per_square = known.iter().map(|arm| arm.presentations / arm.finished / arm.patterns.powi(2));
        let per_square = per_square.sum::<f64>() / known.len().max(1) as f64;
        let cost = |arm: &ArmTally| match arm.finished {
            0.0 => per_square * arm.patterns.powi(2),
            finished => arm.presentations / finished,
        };
        self.arms.iter().map(|arm| arm.left * cost(arm)).sum()
    }
}
