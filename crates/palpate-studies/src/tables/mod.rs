//! The two tables of a study's fits. Each finished fit adds a row, and a study is continued or assembled from the rows.
//!
//! `networks.csv` has a row for every fit; networks are restored from the weights in it. `evaluations.csv` has a row for every fit of another
//! estimator, with the located position of each reading. Both begin with a comment that identifies the run; only its rows may follow.

mod evaluations;
mod networks;

use std::collections::{HashMap, HashSet};

use super::run::{PreparedStudy, Trained};
use super::task::{MOST_SEEDS, Shard, Task};
use palpate_rig::Study;

/// A fit: the index of its arm in the study, and its seed.
type Fit = (usize, u64);

/// Rows of fits in the two tables, or the whole text of both: a plain value, which may be sent to another process or machine.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitRows {
    /// Rows of `networks.csv`.
    pub networks: String,
    /// Rows of `evaluations.csv`; empty if all fits are networks.
    pub evaluations: String,
}

impl FitRows {
    /// Adds further rows.
    pub fn push(&mut self, rows: &Self) {
        self.networks += &rows.networks;
        self.evaluations += &rows.evaluations;
    }
}

/// The tables of a study, or of a shard of it.
#[derive(Clone, Debug)]
pub struct StudyTables<'a> {
    study: &'a PreparedStudy,
    shard: Option<ShardTasks>,
}

/// The tasks of a shard.
#[derive(Clone, Debug)]
struct ShardTasks {
    shard: Shard,
    seeds: u64,
    tasks: Vec<Task>,
    /// Seeds of a task.
    block: u64,
    /// Arm and first seed of every task.
    beginnings: HashSet<(usize, u64)>,
}

impl ShardTasks {
    fn holds(&self, (arm, seed): Fit) -> bool {
        seed < self.seeds && self.beginnings.contains(&(arm, seed - seed % self.block))
    }
}

/// A table of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableKind {
    /// `networks.csv`.
    Networks,
    /// `evaluations.csv`.
    Evaluations,
}

impl TableKind {
    /// The name of its file.
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Networks => "networks.csv",
            Self::Evaluations => "evaluations.csv",
        }
    }

    /// The text of this table in `texts`.
    pub fn text(self, texts: &FitRows) -> &str {
        match self {
            Self::Networks => &texts.networks,
            Self::Evaluations => &texts.evaluations,
        }
    }
}

/// Fits read from tables.
#[derive(Clone, Debug, Default)]
pub struct Checkpoint {
    /// The fits; they may include further seeds of an earlier run.
    pub done: Vec<Trained>,
    /// Number of fits in `networks.csv` that cannot be restored, because `evaluations.csv` has no row for them.
    pub without_evaluation: usize,
    /// The tables with an incomplete last line, as a crash leaves it; that line was skipped.
    pub cut_off: Vec<TableKind>,
}

/// Error of reading a table of an earlier run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// The table is of another study, another version of the study file or of palpate, or another shard.
    #[error("line 1 belongs to another run: it is `{found}`; this study writes `{wanted}`")]
    Heading {
        /// The table.
        table: TableKind,
        /// The file's first line.
        found: String,
        /// The line that this study writes.
        wanted: String,
    },
    /// A row that this study does not write.
    #[error("line {line}: {problem}")]
    Row {
        /// The table.
        table: TableKind,
        /// The line, from 1.
        line: usize,
        /// The problem.
        problem: RowProblem,
    },
}

impl CheckpointError {
    /// The table that could not be read.
    pub fn table(&self) -> TableKind {
        match self {
            Self::Heading { table, .. } | Self::Row { table, .. } => *table,
        }
    }
}

/// Problem of a row.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RowProblem {
    /// Too few cells, or too many.
    #[error("the row has {found} cells; it must have {wanted}")]
    Cells {
        /// Number of cells.
        found: usize,
        /// Number of columns.
        wanted: usize,
    },
    /// An arm that the study does not have.
    #[error("the study has no arm `{arm}`")]
    Arm {
        /// The arm.
        arm: String,
    },
    /// A cell with an invalid value.
    #[error("{column}: `{found}` is not {wanted}")]
    Cell {
        /// The column.
        column: &'static str,
        /// The cell, or the invalid part of it.
        found: String,
        /// The expected value.
        wanted: &'static str,
    },
    /// Weights for another network.
    #[error("weights: found {found}, which is not the network's number")]
    Weights {
        /// Number of weights.
        found: usize,
    },
    /// Values for another number of readings.
    #[error("{column}: found {found} values; the arm is evaluated with {wanted} readings")]
    Readings {
        /// The column.
        column: &'static str,
        /// Number of values.
        found: usize,
        /// Number of readings.
        wanted: usize,
    },
    /// A row of a network in `evaluations.csv`, which has none.
    #[error("arm `{arm}` consists of networks, and networks.csv contains them")]
    Network {
        /// The arm.
        arm: String,
    },
    /// A second row for a fit.
    #[error("the fit of arm `{arm}` from seed {seed} is in line {first} already; take one of the two away")]
    Twice {
        /// The arm.
        arm: String,
        /// The seed.
        seed: u64,
        /// Line of the first row.
        first: usize,
    },
    /// A fit of another shard.
    #[error("the fit of arm `{arm}` from seed {seed} is not of shard {shard}")]
    OtherShard {
        /// The arm.
        arm: String,
        /// The seed.
        seed: u64,
        /// The shard of the table.
        shard: String,
    },
}

impl<'a> StudyTables<'a> {
    /// The tables of a whole study.
    pub fn new(study: &'a PreparedStudy) -> Self {
        Self { study, shard: None }
    }

    /// The tables of one shard of a study with `seeds` seeds.
    pub fn of_shard(study: &'a PreparedStudy, shard: Shard, seeds: u64) -> Self {
        let block = study.lanes();
        let tasks = shard.share(study.tasks(seeds, block));
        // Every arm of a study's own tasks is one of its arms.
        let beginning = |task: &Task| Some((study.arm(&task.arm).ok()?, task.seeds.start));
        let beginnings = tasks.iter().filter_map(beginning).collect();
        Self { study, shard: Some(ShardTasks { shard, seeds, tasks, block, beginnings }) }
    }

    /// The shard with its number of seeds; `None` for the tables of a whole study.
    pub fn shard(&self) -> Option<(Shard, u64)> {
        self.shard.as_ref().map(|shard| (shard.shard, shard.seeds))
    }

    /// The tasks of the fits in the tables: those of the shard, or of `seeds` seeds of the whole study.
    pub fn tasks(&self, seeds: u64) -> Vec<Task> {
        self.shard
            .as_ref()
            .map_or_else(|| self.study.tasks(seeds, self.study.lanes()), |shard| shard.tasks.clone())
    }

    /// Whether the study has an `evaluations.csv`: some arm has an estimator that is not a network.
    pub fn has_evaluations(&self) -> bool {
        (0..self.study.study.arms.len()).any(|arm| !self.study.keeps_weights(arm))
    }

    /// The comment and the header at the beginning of each table; for `evaluations.csv` an empty text if the study has none.
    pub fn headings(&self) -> FitRows {
        let comment = self.comment();
        let evaluations = self.has_evaluations().then(|| comment.clone() + &evaluations::header());
        FitRows {
            networks: comment + &networks::header(self.study),
            evaluations: evaluations.unwrap_or_default(),
        }
    }

    fn comment(&self) -> String {
        let Study { name, digest, precision, .. } = &self.study.study;
        let precision = format!("{precision:?}").to_lowercase();
        let version = env!("CARGO_PKG_VERSION");
        let shard = self.shard().map(|(shard, seeds)| format!("{SHARD}{shard} of {seeds} seeds"));
        let shard = shard.unwrap_or_default();
        format!("# palpate {version}, study {name}, sha256 {digest}, {precision}{shard}\n")
    }

    /// The rows of a fit.
    pub fn rows(&self, trained: &Trained) -> FitRows {
        let is_kept_by_weights = self.study.keeps_weights(trained.arm);
        FitRows {
            networks: networks::row(self.study, trained),
            evaluations: if is_kept_by_weights {
                String::new()
            } else {
                evaluations::row(self.study, trained)
            },
        }
    }

    /// The whole tables of some fits, sorted by arm and seed; the order of `fits` has no effect.
    pub fn whole(&self, fits: &[Trained]) -> FitRows {
        let mut sorted: Vec<&Trained> = fits.iter().collect();
        sorted.sort_by_key(|trained| (trained.arm, trained.fit.seed));
        let mut whole = self.headings();
        sorted.into_iter().for_each(|trained| whole.push(&self.rows(trained)));
        whole
    }

    /// Reads the fits of an earlier run of this study, or shard, from its tables; the text of a missing table is empty.
    ///
    /// # Errors
    /// [`CheckpointError`] when a table belongs to another run or contains a row that this study does not write.
    pub fn read(&self, texts: &FitRows) -> Result<Checkpoint, CheckpointError> {
        let headings = self.headings();
        let mut checkpoint = Checkpoint::default();
        let mut rows = |table, text, heading| -> Result<Vec<(usize, &str)>, CheckpointError> {
            let rows = rows_below(table, text, heading)?;
            if rows.cut_off {
                checkpoint.cut_off.push(table);
            }
            Ok(rows.whole)
        };
        let networks = rows(TableKind::Networks, &texts.networks, &headings.networks)?;
        let evaluations = rows(TableKind::Evaluations, &texts.evaluations, &headings.evaluations)?;
        let (networks, refitted) = self.read_networks(&networks)?;
        let evaluated = self.read_evaluations(&evaluations)?;
        let known: HashSet<Fit> = evaluated.iter().map(|t| (t.arm, t.fit.seed)).collect();
        checkpoint.without_evaluation = refitted.iter().filter(|fit| !known.contains(fit)).count();
        checkpoint.done = networks;
        checkpoint.done.extend(evaluated);
        Ok(checkpoint)
    }

    /// Reads `networks.csv`: the networks, and the fits of other estimators.
    fn read_networks(&self, rows: &[(usize, &str)]) -> Result<(Vec<Trained>, Vec<Fit>), CheckpointError> {
        let (mut restored, mut others, mut seen) = (Vec::new(), Vec::new(), HashMap::new());
        let table = TableKind::Networks;
        for (line, row) in rows {
            let refused = |problem| CheckpointError::Row { table, line: *line, problem };
            let (fit, cells) = networks::cells(self.study, row).map_err(refused)?;
            self.check(fit, *line, &mut seen).map_err(refused)?;
            match self.study.keeps_weights(fit.0) {
                true => restored.push(networks::restore(self.study, fit, &cells).map_err(refused)?),
                false => others.push(fit),
            }
        }
        Ok((restored, others))
    }

    /// Reads the fits in `evaluations.csv`.
    fn read_evaluations(&self, rows: &[(usize, &str)]) -> Result<Vec<Trained>, CheckpointError> {
        let (mut restored, mut seen) = (Vec::new(), HashMap::new());
        let table = TableKind::Evaluations;
        for (line, row) in rows {
            let refused = |problem| CheckpointError::Row { table, line: *line, problem };
            let trained = evaluations::read(self.study, row).map_err(refused)?;
            self.check((trained.arm, trained.fit.seed), *line, &mut seen).map_err(refused)?;
            restored.push(trained);
        }
        Ok(restored)
    }

    /// Checks that a fit has one row, and that the shard of the tables includes it.
    fn check(&self, fit: Fit, line: usize, seen: &mut HashMap<Fit, usize>) -> Result<(), RowProblem> {
        let (arm, seed) = (self.study.study.arms[fit.0].name.clone(), fit.1);
        if let Some(shard) = self.shard.as_ref().filter(|shard| !shard.holds(fit)) {
            return Err(RowProblem::OtherShard { arm, seed, shard: shard.shard.to_string() });
        }
        match seen.insert(fit, line) {
            Some(first) => Err(RowProblem::Twice { arm, seed, first }),
            None => Ok(()),
        }
    }
}

/// Text before the number of a shard in a table's comment.
const SHARD: &str = ", shard ";

/// The shard in a table's first line, with its seeds; `None` without one.
pub(crate) fn shard_in(text: &str) -> Option<(Shard, u64)> {
    let (_, told) = text.lines().next()?.rsplit_once(SHARD)?;
    let (shard, seeds) = told.strip_suffix(" seeds")?.split_once(" of ")?;
    let seeds = seeds.parse().ok().filter(|seeds| (1..=MOST_SEEDS).contains(seeds))?;
    Some((shard.parse().ok()?, seeds))
}

/// Rows of a table.
struct Rows<'a> {
    /// Whole rows, each with its line from 1.
    whole: Vec<(usize, &'a str)>,
    /// Whether the last line has no end.
    cut_off: bool,
}

/// The rows below the heading of a table; empty for an empty text.
fn rows_below<'a>(table: TableKind, text: &'a str, heading: &str) -> Result<Rows<'a>, CheckpointError> {
    if text.is_empty() {
        return Ok(Rows { whole: Vec::new(), cut_off: false });
    }
    let Some(rows) = text.strip_prefix(heading).filter(|_| !heading.is_empty()) else {
        let found = text.lines().next().unwrap_or_default().chars().take(200).collect();
        let wanted = heading.lines().next().unwrap_or_default().to_owned();
        return Err(CheckpointError::Heading { table, found, wanted });
    };
    let whole = rows.rfind('\n').map_or("", |end| &rows[..end]);
    let first = heading.lines().count() + 1;
    Ok(Rows {
        whole: whole.lines().enumerate().map(|(i, row)| (first + i, row)).collect(),
        cut_off: !rows.is_empty() && !rows.ends_with('\n'),
    })
}

/// The fit of a row: the index of its arm in the study, and its seed.
fn fit_of(study: &PreparedStudy, arm: &str, seed: &str) -> Result<Fit, RowProblem> {
    let place = study.arm(arm).map_err(|_| RowProblem::Arm { arm: shortened(arm) })?;
    let seed = read_cell("seed", seed, "a whole number")?;
    Ok((place, seed))
}

fn read_cell<T: std::str::FromStr>(
    column: &'static str,
    cell: &str,
    wanted: &'static str,
) -> Result<T, RowProblem> {
    cell.parse().map_err(|_| RowProblem::Cell { column, found: shortened(cell), wanted })
}

/// A cell, shortened to the length that a message shows.
fn shortened(cell: &str) -> String {
    const MOST: usize = 40;
    let mut shown: String = cell.chars().take(MOST).collect();
    if shown.len() < cell.len() {
        shown.push('…');
    }
    shown
}
