//! Tables of a study's fits, by which a study is continued or assembled.
//!
//! `networks.csv` has a row for every fit, with network weights; `evaluations.csv` has the positions of other
//! estimators. A comment identifies the run.

mod evaluations;
mod networks;

use std::collections::{HashMap, HashSet};

use super::run::{ArmFit, PreparedStudy};
use super::task::{MOST_SEEDS, Shard, Task};
use palpate_rig::Study;

/// Index of the arm and seed.
type Fit = (usize, u64);

/// Rows of fits, or both whole tables.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitRows {
    /// Rows of `networks.csv`.
    pub networks: String,
    /// Rows of `evaluations.csv`; empty if all fits are networks.
    pub evaluations: String,
}

impl FitRows {
    /// Appends rows.
    pub fn push(&mut self, rows: &Self) {
        self.networks += &rows.networks;
        self.evaluations += &rows.evaluations;
    }
}

/// Tables of a study or shard.
#[derive(Clone, Debug)]
pub struct StudyTables<'a> {
    study: &'a PreparedStudy,
    shard: Option<ShardTasks>,
}

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

/// Table of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableKind {
    /// `networks.csv`.
    Networks,
    /// `evaluations.csv`.
    Evaluations,
}

impl TableKind {
    /// File name.
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Networks => "networks.csv",
            Self::Evaluations => "evaluations.csv",
        }
    }

    /// Text of this table.
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
    /// Fits, possibly of more seeds than requested.
    pub done: Vec<ArmFit>,
    /// Fits without their row in `evaluations.csv`.
    pub without_evaluation: usize,
    /// Tables with a skipped, incomplete last line.
    pub cut_off: Vec<TableKind>,
}

/// Error of reading a table.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CheckpointError {
    /// Table of another study, version or shard.
    #[error("line 1 belongs to another run: it is `{found}`; this study writes `{wanted}`")]
    Heading {
        /// Table.
        table: TableKind,
        /// First line.
        found: String,
        /// Expected line.
        wanted: String,
    },
    /// Invalid row.
    #[error("line {line}: {problem}")]
    Row {
        /// Table.
        table: TableKind,
        /// Line, from 1.
        line: usize,
        /// Problem.
        problem: RowProblem,
    },
}

impl CheckpointError {
    /// Table of the error.
    pub fn table(&self) -> TableKind {
        match self {
            Self::Heading { table, .. } | Self::Row { table, .. } => *table,
        }
    }
}

/// Problem of a row.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RowProblem {
    /// Wrong number of cells.
    #[error("the row has {found} cells; it must have {wanted}")]
    Cells {
        /// Number of cells.
        found: usize,
        /// Number of columns.
        wanted: usize,
    },
    /// Unknown arm.
    #[error("the study has no arm `{arm}`")]
    Arm {
        /// Arm.
        arm: String,
    },
    /// Invalid cell.
    #[error("{column}: `{found}` is not {wanted}")]
    Cell {
        /// Column.
        column: &'static str,
        /// Invalid text.
        found: String,
        /// Expected value.
        wanted: &'static str,
    },
    /// Weights of another network.
    #[error("weights: found {found}, which is not the network's number")]
    Weights {
        /// Number of weights.
        found: usize,
    },
    /// Wrong number of readings.
    #[error("{column}: found {found} values; the arm is evaluated with {wanted} readings")]
    Readings {
        /// Column.
        column: &'static str,
        /// Number of values.
        found: usize,
        /// Number of readings.
        wanted: usize,
    },
    /// A network in `evaluations.csv`.
    #[error("arm `{arm}` consists of networks, and networks.csv contains them")]
    Network {
        /// Arm.
        arm: String,
    },
    /// Duplicate fit.
    #[error("the fit of arm `{arm}` from seed {seed} is in line {first} already; take one of the two away")]
    Twice {
        /// Arm.
        arm: String,
        /// Seed.
        seed: u64,
        /// First line.
        first: usize,
    },
    /// Fit of another shard.
    #[error("the fit of arm `{arm}` from seed {seed} is not of shard {shard}")]
    OtherShard {
        /// Arm.
        arm: String,
        /// Seed.
        seed: u64,
        /// Shard of the table.
        shard: String,
    },
}

impl<'a> StudyTables<'a> {
    /// Tables of a whole study.
    pub fn new(study: &'a PreparedStudy) -> Self {
        Self { study, shard: None }
    }

    /// Tables of one shard.
    pub fn of_shard(study: &'a PreparedStudy, shard: Shard, seeds: u64) -> Self {
        let block = study.lanes();
        let tasks = shard.share(study.tasks(seeds, block));
        // Every arm of a study's own tasks is one of its arms.
        let beginning = |task: &Task| Some((study.arm(&task.arm).ok()?, task.seeds.start));
        let beginnings = tasks.iter().filter_map(beginning).collect();
        Self { study, shard: Some(ShardTasks { shard, seeds, tasks, block, beginnings }) }
    }

    /// Shard and number of seeds; `None` for a whole study.
    pub fn shard(&self) -> Option<(Shard, u64)> {
        self.shard.as_ref().map(|shard| (shard.shard, shard.seeds))
    }

    /// Lists the tasks of the shard, or of the study.
    pub fn tasks(&self, seeds: u64) -> Vec<Task> {
        self.shard
            .as_ref()
            .map_or_else(|| self.study.tasks(seeds, self.study.lanes()), |shard| shard.tasks.clone())
    }

    /// True if some arm has another estimator than a network.
    pub fn has_evaluations(&self) -> bool {
        (0..self.study.study.arms.len()).any(|arm| !self.study.keeps_weights(arm))
    }

    /// Comment and header of each table, if any.
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

    /// Formats the rows of a fit.
    pub fn rows(&self, trained: &ArmFit) -> FitRows {
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

    /// Formats whole tables, sorted by arm and seed.
    pub fn whole(&self, fits: &[ArmFit]) -> FitRows {
        let mut sorted: Vec<&ArmFit> = fits.iter().collect();
        sorted.sort_by_key(|trained| (trained.arm, trained.fit.seed));
        let mut whole = self.headings();
        sorted.into_iter().for_each(|trained| whole.push(&self.rows(trained)));
        whole
    }

    /// Reads the fits of an earlier run; a missing table is empty.
    ///
    /// # Errors
    /// [`CheckpointError`] for another run or an invalid row.
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

    /// Reads the networks, and the fits of other estimators.
    fn read_networks(&self, rows: &[(usize, &str)]) -> Result<(Vec<ArmFit>, Vec<Fit>), CheckpointError> {
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

    fn read_evaluations(&self, rows: &[(usize, &str)]) -> Result<Vec<ArmFit>, CheckpointError> {
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

const SHARD: &str = ", shard ";

pub(crate) fn shard_in(text: &str) -> Option<(Shard, u64)> {
    let (_, told) = text.lines().next()?.rsplit_once(SHARD)?;
    let (shard, seeds) = told.strip_suffix(" seeds")?.split_once(" of ")?;
    let seeds = seeds.parse().ok().filter(|seeds| (1..=MOST_SEEDS).contains(seeds))?;
    Some((shard.parse().ok()?, seeds))
}

struct Rows<'a> {
    /// Whole rows with their lines, from 1.
    whole: Vec<(usize, &'a str)>,
    /// True for an incomplete last line.
    cut_off: bool,
}

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

fn shortened(cell: &str) -> String {
    const MOST: usize = 40;
    let mut shown: String = cell.chars().take(MOST).collect();
    if shown.len() < cell.len() {
        shown.push('…');
    }
    shown
}
