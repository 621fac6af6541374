//! Tables of a study's finished fits, one row per fit.
//!
//! The tables grow with every finished fit, survive Ctrl-C, and are sorted at the end.

use crate::failure::{Failure, UserError};
use crate::remark::remark;
use crate::target::{EVALUATIONS_CSV, NETWORKS_CSV, RESULTS_JSON, SHARD_JSON, TargetFolder};
use crate::{input, progress, target};
use indicatif::ProgressBar;
use palpate_mechanics::units::format_count;
use palpate_studies::{
    ArmFit, Checkpoint, CheckpointError, FitRows, PreparedStudy, RunOptions, StudyTables, Task,
};
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

pub struct FitFiles {
    networks: File,
    /// `None` if all fits are networks.
    evaluations: Option<File>,
}

impl FitFiles {
    /// Starts the tables with the fits of an earlier run. The run is unfinished until its end.
    pub fn begin(out: &TargetFolder, tables: &StudyTables, done: &[ArmFit]) -> Result<Self, Failure> {
        out.remove(RESULTS_JSON)?;
        out.remove(SHARD_JSON)?;
        write(out, &tables.whole(done))?;
        let open = |name| {
            let path = out.path().join(name);
            let file = File::options().append(true).open(&path);
            file.map_err(|error| target::cannot("write", &path, &error))
        };
        let evaluations = tables.has_evaluations().then(|| open(EVALUATIONS_CSV)).transpose()?;
        Ok(Self { networks: open(NETWORKS_CSV)?, evaluations })
    }

    /// Adds each row in one write, so that rows are not interleaved. The second row finishes the
    /// fit.
    fn add(&mut self, rows: &FitRows) -> std::io::Result<()> {
        if let Some(evaluations) = &mut self.evaluations {
            evaluations.write_all(rows.evaluations.as_bytes())?;
        }
        self.networks.write_all(rows.networks.as_bytes())
    }
}

pub fn write(out: &TargetFolder, whole: &FitRows) -> Result<(), Failure> {
    match whole.evaluations.is_empty() {
        true => out.remove(EVALUATIONS_CSV)?,
        false => out.write(EVALUATIONS_CSV, whole.evaluations.as_bytes())?,
    }
    out.write(NETWORKS_CSV, whole.networks.as_bytes())
}

pub fn read_texts(folder: &Path) -> Result<FitRows, Failure> {
    let text = |name| {
        let path = folder.join(name);
        if path.exists() { input::read_text(&path) } else { Ok(String::new()) }
    };
    Ok(FitRows { networks: text(NETWORKS_CSV)?, evaluations: text(EVALUATIONS_CSV)? })
}

pub fn read(out: &TargetFolder, tables: &StudyTables) -> Result<Checkpoint, Failure> {
    let texts = read_texts(out.path())?;
    let checkpoint = tables.read(&texts).map_err(|error| {
        let name = out.path().join(error.table().file_name()).display().to_string();
        let user_error = UserError::new(format!("{name}: {error}"));
        match &error {
            CheckpointError::Heading { .. } => {
                user_error.help("--overwrite starts again, --out names another folder")
            }
            CheckpointError::Row { .. } => at_row(user_error, &name, &texts, &error),
        }
    })?;
    for table in &checkpoint.cut_off {
        let path = out.path().join(table.file_name());
        remark!("warning: the last line of {} is cut off; its fit is made again", path.display());
    }
    if checkpoint.without_evaluation > 0 {
        remark!(
            "warning: {} fits of {NETWORKS_CSV} are not in {EVALUATIONS_CSV}; they are made again",
            format_count(checkpoint.without_evaluation as u64)
        );
    }
    Ok(checkpoint)
}

pub fn at_row(user_error: UserError, name: &str, texts: &FitRows, error: &CheckpointError) -> UserError {
    let CheckpointError::Row { table, line, .. } = error else { return user_error };
    let text = table.text(texts);
    let row = text.lines().nth(line - 1).unwrap_or_default();
    user_error.at_line(name, *line, row, 0..row.find(',').unwrap_or(row.len()))
}

/// Reports surplus fits of an earlier run, which the results exclude.
pub fn print_surplus(earlier: &[ArmFit], options: RunOptions) {
    let surplus = earlier.iter().filter(|trained| trained.fit.seed >= options.seeds).count();
    if surplus > 0 {
        remark!(
            "palpate: {} fits of further seeds stay in {NETWORKS_CSV}; the results are of the first {} seeds",
            format_count(surplus as u64),
            options.seeds
        );
    }
}

pub struct Tally<'a> {
    prepared: &'a PreparedStudy,
    tables: &'a StudyTables<'a>,
    bar: ProgressBar,
    start: Instant,
    state: Mutex<State>,
}

struct State {
    files: FitFiles,
    error: Option<std::io::Error>,
    arms: Vec<ArmTally>,
    presented: u64,
    fitted: u64,
}

#[derive(Clone, Copy, Default)]
struct ArmTally {
    patterns: f64,
    left: f64,
    finished: f64,
    presentations: f64,
}

impl<'a> Tally<'a> {
    pub fn new(
        prepared: &'a PreparedStudy,
        tables: &'a StudyTables<'a>,
        files: FitFiles,
        (tasks, done): (&[Task], &[ArmFit]),
    ) -> Self {
        let arm = |arm| ArmTally { patterns: prepared.patterns(arm) as f64, ..ArmTally::default() };
        let mut arms: Vec<ArmTally> = (0..prepared.study.arms.len()).map(arm).collect();
        for task in tasks {
            // The arms of a study's own tasks exist.
            if let Ok(arm) = prepared.arm(&task.arm) {
                arms[arm].left += task.fits() as f64;
            }
        }
        let bar = progress::bar(tasks.iter().map(Task::fits).sum(), "fitting");
        let is_wanted = |trained: &&ArmFit| {
            let name = &prepared.study.arms[trained.arm].name;
            tasks.iter().any(|task| task.arm == *name && task.seeds.contains(&trained.fit.seed))
        };
        for trained in done.iter().filter(is_wanted) {
            arms[trained.arm].count(prepared.presentations(trained) as f64);
        }
        bar.set_position(arms.iter().map(|arm| arm.finished as u64).sum());
        let state = Mutex::new(State { files, error: None, arms, presented: 0, fitted: 0 });
        Self { prepared, tables, bar, start: Instant::now(), state }
    }

    pub fn note(&self, trained: &ArmFit) {
        let rows = self.tables.rows(trained);
        let presented = self.prepared.presentations(trained);
        let mut state = self.state();
        if let Err(error) = state.files.add(&rows) {
            state.error.get_or_insert(error);
        }
        state.presented += presented;
        state.fitted += 1;
        state.arms[trained.arm].count(presented as f64);
        self.bar.set_prefix(state.rate_in_words(self.start.elapsed().as_secs_f64()));
        drop(state);
        self.bar.inc(1);
    }

    pub fn failed(&self) -> bool {
        self.state().error.is_some()
    }

    /// Removes the bar, and returns the number of finished fits.
    pub fn finish(&self) -> Result<u64, Failure> {
        self.bar.finish_and_clear();
        let mut state = self.state();
        match state.error.take() {
            Some(error) => Err(UserError::new(format!("cannot write the study's tables: {error}")).into()),
            None => Ok(state.arms.iter().map(|arm| arm.finished as u64).sum()),
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
    /// Formats "12.3 M presentations/s, 40 s left", or "8.1 fits/s, 40 s left" without epochs.
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

    /// An arm's remaining networks cost as much as its finished ones. Without any, the cost of
    /// other arms is scaled by the square of the number of patterns.
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
