//! The two tables of a study's fits, which grow by a row as a fit is finished, and from which a study goes on, or is put together.
//!
//! `networks.csv` has a row for every fit; networks are restored from the weights in it. `evaluations.csv` has a row for every fit of another
//! estimator: what it located, reading by reading. Both begin with a comment that names what rows may stand in one file.

mod evaluations;
mod networks;

use std::collections::{HashMap, HashSet};

use super::run::{PreparedStudy, Trained};
use super::task::{MOST_SEEDS, Shard, Task};
use palpate_rig::Study;

/// A fit: its arm, by the place in the study, and its seed.
type Fit = (usize, u64);

/// Rows of fits in the two tables, or the whole text of both: a plain value, which may be sent to another process or machine.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitRows {
    /// Of `networks.csv`.
    pub networks: String,
    /// Of `evaluations.csv`; empty where all fits are networks.
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

    /// Text among those of both.
    pub fn text(self, texts: &FitRows) -> &str {
        match self {
            Self::Networks => &texts.networks,
            Self::Evaluations => &texts.evaluations,
        }
    }
}

/// Fits that tables hold.
#[derive(Clone, Debug, Default)]
pub struct Checkpoint {
    /// The fits, with further seeds that an earlier run had.
    pub done: Vec<Trained>,
    /// Number of the fits in `networks.csv` that cannot be restored, as `evaluations.csv` has no row of them.
    pub without_evaluation: usize,
    /// The tables whose last line was cut off, as a crash leaves it; it was passed over.
    pub cut_off: Vec<TableKind>,
}

/// Error of reading a table that a run left.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// Another study, another file of it, another palpate, or another shard.
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
    /// A cell that does not read as what it must be.
    #[error("{column}: `{found}` is not {wanted}")]
    Cell {
        /// The column.
        column: &'static str,
        /// The cell, or what of it does not read.
        found: String,
        /// What it must be.
        wanted: &'static str,
    },
    /// Weights of another network.
    #[error("weights: there are {found}, which is not the network's number")]
    Weights {
        /// Number of weights.
        found: usize,
    },
    /// Values of another number of readings.
    #[error("{column}: there are {found} values; the arm is judged by {wanted} readings")]
    Readings {
        /// The column.
        column: &'static str,
        /// Number of values.
        found: usize,
        /// Number of readings.
        wanted: usize,
    },
    /// A network, of which the table has no rows.
    #[error("arm `{arm}` is of networks, of which networks.csv keeps all")]
    Network {
        /// The arm.
        arm: String,
    },
    /// A second row of a fit.
    #[error("the fit of arm `{arm}` from seed {seed} is in line {first} already; take one of the two away")]
    Twice {
        /// The arm.
        arm: String,
        /// The seed.
        seed: u64,
        /// Line of the first row.
        first: usize,
    },
    /// A fit that is of another shard.
    #[error("the fit of arm `{arm}` from seed {seed} is not of shard {shard}")]
    OtherShard {
        /// The arm.
        arm: String,
        /// The seed.
        seed: u64,
        /// The shard whose table it is.
        shard: String,
    },
}

impl<'a> StudyTables<'a> {
    /// The tables of a whole study.
    pub fn new(study: &'a PreparedStudy) -> Self {
        Self { study, shard: None }
    }

    /// The tables of a shard of so many seeds of a study.
    pub fn of_shard(study: &'a PreparedStudy, shard: Shard, seeds: u64) -> Self {
        let block = study.lanes();
        let tasks = shard.share(study.tasks(seeds, block));
        // A study's own tasks have its arms.
        let beginning = |task: &Task| Some((study.arm(&task.arm).ok()?, task.seeds.start));
        let beginnings = tasks.iter().filter_map(beginning).collect();
        Self { study, shard: Some(ShardTasks { shard, seeds, tasks, block, beginnings }) }
    }

    /// The shard with its seeds, where they are tables of one.
    pub fn shard(&self) -> Option<(Shard, u64)> {
        self.shard.as_ref().map(|shard| (shard.shard, shard.seeds))
    }

    /// The tasks whose fits the tables hold: those of the shard, or of `seeds` seeds of the whole study.
    pub fn tasks(&self, seeds: u64) -> Vec<Task> {
        self.shard
            .as_ref()
            .map_or_else(|| self.study.tasks(seeds, self.study.lanes()), |shard| shard.tasks.clone())
    }

    /// Whether there is an `evaluations.csv`: where some arm's fits are no networks.
    pub fn has_evaluations(&self) -> bool {
        (0..self.study.study.arms.len()).any(|arm| !self.study.keeps_weights(arm))
    }

    /// The comment and the header that the tables begin with; of `evaluations.csv` nothing where there is none.
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

    /// The whole tables of some fits, in the order of the arms and seeds, whatever the order that they come in.
    pub fn whole(&self, fits: &[Trained]) -> FitRows {
        let mut sorted: Vec<&Trained> = fits.iter().collect();
        sorted.sort_by_key(|trained| (trained.arm, trained.fit.seed));
        let mut whole = self.headings();
        sorted.into_iter().for_each(|trained| whole.push(&self.rows(trained)));
        whole
    }

    /// The fits that an earlier run of this very study, or shard, left in its tables; of a table that is not there the text is empty.
    ///
    /// # Errors
    /// [`CheckpointError`] when a table belongs to another run or holds a row that this study does not write.
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

    /// The networks in rows of `networks.csv`, and the other fits that there are.
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

    /// The fits in rows of `evaluations.csv`.
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

    /// Checks that a fit has one row, and is of the shard whose tables they are.
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

/// Words in a shard's comment before its number.
const SHARD: &str = ", shard ";

/// The shard that a table's first line names, with its seeds; `None` where it names none.
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

/// The rows below the heading of a table; none of an empty text.
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

/// The place of a row's arm in the study, and its seed.
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

/// A cell as long as a message can hold.
fn shortened(cell: &str) -> String {
    const MOST: usize = 40;
    let mut shown: String = cell.chars().take(MOST).collect();
    if shown.len() < cell.len() {
        shown.push('…');
    }
    shown
}
