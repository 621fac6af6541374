//! The fits of a study as they are finished: a row of `networks.csv` for each, and a step of the bar.
//!
//! The file grows as fits are finished, survives Ctrl-C, and is sorted at the end.

use crate::failure::{Complaint, Failure};
use crate::remark::remark;
use crate::target::{NETWORKS_CSV, RESULTS_JSON, TargetFolder};
use crate::{input, progress, target};
use indicatif::ProgressBar;
use palpate_mechanics::units::format_count;
use palpate_studies::{
    ArmOutcome, Checkpoint, CheckpointError, FitRow, NetworksCsv, PreparedStudy, RunOptions, Trained,
    TrainedSeed,
};
use std::fs::File;
use std::io::Write;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// The file, open for more rows.
pub struct CheckpointFile {
    file: File,
}

impl CheckpointFile {
    /// Begins the file of a run with the rows that it keeps of an earlier one. From here until its end the run counts as unfinished.
    pub fn begin(
        out: &TargetFolder,
        table: &NetworksCsv,
        done: &[Trained],
        surplus: &[&FitRow],
    ) -> Result<Self, Failure> {
        let results = out.path().join(RESULTS_JSON);
        match std::fs::remove_file(&results) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                return Err(target::cannot("remove", &results, &error));
            }
            _ => {}
        }
        let is_surplus =
            |row: &Trained| surplus.iter().any(|kept| (kept.arm, kept.seed) == (row.arm, row.fit.seed));
        let mut rows = table.heading();
        done.iter().filter(|row| !is_surplus(row)).for_each(|trained| rows.push_str(&table.row(trained)));
        surplus.iter().for_each(|row| rows.push_str(&row.text));
        out.write(NETWORKS_CSV, rows.as_bytes())?;
        let path = out.path().join(NETWORKS_CSV);
        let file = File::options().append(true).open(&path);
        let file = file.map_err(|error| target::cannot("write", &path, &error))?;
        Ok(Self { file })
    }

    /// Adds a row, in one write, so that no other row comes between.
    pub fn add(&mut self, row: &str) -> std::io::Result<()> {
        self.file.write_all(row.as_bytes())
    }
}

/// The fits that an earlier run left in a folder.
pub fn read(out: &TargetFolder, table: &NetworksCsv) -> Result<Checkpoint, Failure> {
    let path = &out.path().join(NETWORKS_CSV);
    if !path.exists() {
        return Ok(Checkpoint::default());
    }
    let text = input::read_text(path)?;
    let checkpoint = table.resume(&text).map_err(|error| {
        let name = path.display().to_string();
        let complaint = Complaint::new(format!("{name}: {error}"));
        match &error {
            CheckpointError::Heading { .. } => {
                complaint.help("--overwrite starts anew, --out names another folder")
            }
            CheckpointError::Row { line, .. } => {
                let row = text.lines().nth(line - 1).unwrap_or_default();
                complaint.at_line(&name, *line, row, 0..row.find(',').unwrap_or(row.len()))
            }
        }
    })?;
    if checkpoint.cut_off {
        remark!("warning: the last line of {} is cut off; its network is trained again", path.display());
    }
    Ok(checkpoint)
}

/// Rows of an earlier run with more seeds: they stay in the file, and the results are without them.
pub fn surplus(earlier: &[FitRow], options: RunOptions) -> Vec<&FitRow> {
    let surplus: Vec<&FitRow> = earlier.iter().filter(|row| row.seed >= options.seeds).collect();
    if !surplus.is_empty() {
        remark!(
            "palpate: {} fits of further seeds stay in {NETWORKS_CSV}; the results are of the first {} seeds",
            format_count(surplus.len() as u64),
            options.seeds
        );
    }
    surplus
}

/// Replaces the file by one whose rows are in the order of the arms and seeds, whatever the threads did.
pub fn write_sorted(
    out: &TargetFolder,
    table: &NetworksCsv,
    outcomes: &[ArmOutcome],
    surplus: &[&FitRow],
) -> Result<(), Failure> {
    let mut rows = table.heading();
    for (arm, outcome) in outcomes.iter().enumerate() {
        for fit in &outcome.fits {
            rows.push_str(&table.row(&Trained { arm, fit: fit.clone() }));
        }
        surplus.iter().filter(|row| row.arm == arm).for_each(|row| rows.push_str(&row.text));
    }
    out.write(NETWORKS_CSV, rows.as_bytes())
}

/// Patterns that were presented to a network.
pub fn presentations(prepared: &PreparedStudy, arm: usize, fit: &TrainedSeed) -> u64 {
    u64::from(fit.locator.training_outcome().unwrap_or_default().epochs) * prepared.patterns(arm) as u64
}

/// Progress of a run, which every training thread notes its fits in.
pub struct Tally<'a> {
    prepared: &'a PreparedStudy,
    table: &'a NetworksCsv<'a>,
    bar: ProgressBar,
    start: Instant,
    state: Mutex<State>,
}

struct State {
    /// `None` where there is no network to go on from.
    file: Option<CheckpointFile>,
    error: Option<std::io::Error>,
    arms: Vec<ArmTally>,
    /// Presentations of this run.
    presented: u64,
    /// Fits of this run.
    fitted: u64,
}

/// Cost of an arm's fits: those that are left and those that are finished.
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

    /// A fit is finished: its row goes to the file, and the bar goes on.
    pub fn note(&self, trained: &Trained) {
        let row = self.table.row(trained);
        let presented = presentations(self.prepared, trained.arm, &trained.fit);
        let mut state = self.state();
        if let Some(file) = &mut state.file
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
