//! Assembly of a study from tasks or shards.

use std::collections::{HashMap, HashSet};

use palpate_numerics::watch::Watch;

use super::run::{ArmFit, ArmOutcome, PreparedStudy, StudyRunError};
use super::tables::{CheckpointError, FitRows, StudyTables, TableKind, shard_in};
use super::task::{Shard, Task};

/// Error of assembling a study.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AssemblyError {
    /// Invalid table or row.
    #[error("{place}: {}: {error}", error.table().file_name())]
    Table {
        /// Place of the table.
        place: String,
        /// Problem.
        error: CheckpointError,
    },
    /// Table of a whole study.
    #[error("{place}: {} is of a whole study, not of a shard", TableKind::Networks.file_name())]
    Whole {
        /// Place of the table.
        place: String,
    },
    /// Shards of different splits or numbers of seeds.
    #[error("{place} is shard {found}, and {first_place} is shard {first}: all must be of one split")]
    Split {
        /// Place of the second shard.
        place: String,
        /// Second shard and seeds.
        found: String,
        /// Place of the first shard.
        first_place: String,
        /// First shard and seeds.
        first: String,
    },
    /// Duplicate shard.
    #[error("shard {shard} is there twice: {first_place} and {place}")]
    TwoOfAShard {
        /// Shard.
        shard: String,
        /// First place.
        first_place: String,
        /// Second place.
        place: String,
    },
    /// Shard with missing fits.
    #[error("{place}: shard {shard} is not finished: it has {found} of its {wanted} fits")]
    Unfinished {
        /// Place of the shard.
        place: String,
        /// Shard.
        shard: String,
        /// Number of finished fits.
        found: u64,
        /// Number of all fits.
        wanted: u64,
    },
    /// Missing shards.
    #[error("{} of {of} shards {} missing: {}", .missing.len(), if .missing.len() == 1 { "is" } else { "are" }, join_numbers(.missing))]
    MissingShards {
        /// Shard numbers.
        missing: Vec<u64>,
        /// Number of all shards.
        of: u64,
    },
    /// Duplicate fit.
    #[error("the fit of arm `{arm}` from seed {seed} is there twice")]
    TwoOfAFit {
        /// Arm.
        arm: String,
        /// Seed.
        seed: u64,
    },
    /// Missing fits.
    #[error("{found} of {wanted} fits exist; the first that is missing is of arm `{arm}` from seed {seed}")]
    MissingFits {
        /// Number of present fits.
        found: usize,
        /// Number of all fits.
        wanted: usize,
        /// Arm of the first missing fit.
        arm: String,
        /// Seed of that fit.
        seed: u64,
    },
    /// No shards.
    #[error("expected at least 1 shard, found 0")]
    Nothing,
}

fn join_numbers(numbers: &[u64]) -> String {
    const MOST: usize = 10;
    let mut shown: Vec<String> = numbers.iter().take(MOST).map(u64::to_string).collect();
    if numbers.len() > MOST {
        shown.push("…".to_owned());
    }
    shown.join(", ")
}

/// Tables of a shard.
#[derive(Clone, Debug)]
pub struct ShardTables {
    /// Place, for messages.
    pub place: String,
    /// Whole texts with headings.
    pub texts: FitRows,
}

/// Study merged from shards.
#[derive(Clone, Debug)]
pub struct MergedStudy {
    /// All fits.
    pub fits: Vec<ArmFit>,
    /// Number of seeds of every arm.
    pub seeds: u64,
}

struct ReadShard<'t> {
    place: &'t str,
    shard: Shard,
    seeds: u64,
    fits: Vec<ArmFit>,
}

impl ReadShard<'_> {
    fn split_in_words(&self) -> String {
        format!("{} of {} seeds", self.shard, self.seeds)
    }
}

impl PreparedStudy {
    /// Runs a task and returns its rows by rising seed, independent of process and threads.
    ///
    /// ```
    /// use palpate_numerics::watch::Watch;
    /// use palpate_studies::{FitRows, PreparedStudy, Study, StudyResults, paper};
    ///
    /// let quick = paper::STUDY_TOML.replace("max_epochs = 1_000_000", "max_epochs = 20");
    /// let study = PreparedStudy::new(Study::from_toml(&quick)?, Watch::NONE)?;
    /// let mut rows = FitRows::default();
    /// // Each task may run on another machine, in any order.
    /// for task in study.tasks(2, study.lanes()).iter().rev() {
    ///     rows.push(&study.run_task(task, 1, Watch::NONE)?);
    /// }
    /// let results = StudyResults::new(&study.assemble(2, &rows)?, &study);
    /// assert_eq!(results.arms.len(), 12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`StudyRunError`], also if cancelled.
    pub fn run_task(&self, task: &Task, threads: usize, watch: Watch) -> Result<FitRows, StudyRunError> {
        let mut fits = self.fit_tasks(std::slice::from_ref(task), &[], threads, &|_| {}, watch)?;
        fits.sort_by_key(|trained| trained.fit.seed);
        let tables = StudyTables::new(self);
        let mut rows = FitRows::default();
        fits.iter().for_each(|trained| rows.push(&tables.rows(trained)));
        Ok(rows)
    }

    /// Assembles a study from the rows of all tasks, in any order and without headings.
    ///
    /// # Errors
    /// [`AssemblyError`] for foreign, missing or duplicate rows.
    pub fn assemble(&self, seeds: u64, rows: &FitRows) -> Result<Vec<ArmOutcome>, AssemblyError> {
        let tables = StudyTables::new(self);
        let mut texts = tables.headings();
        texts.push(rows);
        let checkpoint = tables.read(&texts);
        let checkpoint =
            checkpoint.map_err(|error| AssemblyError::Table { place: "rows".to_owned(), error })?;
        self.check_complete(&checkpoint.done, seeds)?;
        Ok(self.by_arm(checkpoint.done, seeds))
    }

    /// Merges the tables of all shards.
    ///
    /// # Errors
    /// [`AssemblyError`] for foreign, missing, unfinished or duplicate shards.
    pub fn merge(&self, shards: &[ShardTables]) -> Result<MergedStudy, AssemblyError> {
        let read = shards.iter().map(|tables| self.read_shard(tables)).collect::<Result<Vec<_>, _>>()?;
        let first = read.first().ok_or(AssemblyError::Nothing)?;
        let (of, seeds) = (first.shard.of(), first.seeds);
        let mut places: HashMap<u64, &str> = HashMap::new();
        for shard in &read {
            if (shard.shard.of(), shard.seeds) != (of, seeds) {
                return Err(AssemblyError::Split {
                    place: shard.place.to_owned(),
                    found: shard.split_in_words(),
                    first_place: first.place.to_owned(),
                    first: first.split_in_words(),
                });
            }
            if let Some(first_place) = places.insert(shard.shard.number(), shard.place) {
                return Err(AssemblyError::TwoOfAShard {
                    shard: shard.shard.to_string(),
                    first_place: first_place.to_owned(),
                    place: shard.place.to_owned(),
                });
            }
        }
        let missing: Vec<u64> = (1..=of).filter(|number| !places.contains_key(number)).collect();
        if !missing.is_empty() {
            return Err(AssemblyError::MissingShards { missing, of });
        }
        Ok(MergedStudy { fits: read.into_iter().flat_map(|shard| shard.fits).collect(), seeds })
    }

    fn read_shard<'t>(
        &self,
        ShardTables { place, texts }: &'t ShardTables,
    ) -> Result<ReadShard<'t>, AssemblyError> {
        let table = |error| AssemblyError::Table { place: place.clone(), error };
        let Some((shard, seeds)) = shard_in(&texts.networks) else {
            // The first line names no shard: the table is of a whole study, or invalid.
            StudyTables::new(self).read(texts).map_err(table)?;
            return Err(AssemblyError::Whole { place: place.clone() });
        };
        let tables = StudyTables::of_shard(self, shard, seeds);
        let fits = tables.read(texts).map_err(table)?.done;
        let wanted = tables.tasks(seeds).iter().map(Task::fits).sum();
        let found = fits.len() as u64;
        if found < wanted {
            let shard = shard.to_string();
            return Err(AssemblyError::Unfinished { place: place.clone(), shard, found, wanted });
        }
        Ok(ReadShard { place, shard, seeds, fits })
    }

    fn check_complete(&self, fits: &[ArmFit], seeds: u64) -> Result<(), AssemblyError> {
        let name = |arm: usize| self.study.arms[arm].name.clone();
        let mut there = HashSet::new();
        for ArmFit { arm, fit } in fits.iter().filter(|trained| trained.fit.seed < seeds) {
            if !there.insert((*arm, fit.seed)) {
                return Err(AssemblyError::TwoOfAFit { arm: name(*arm), seed: fit.seed });
            }
        }
        let mut all = (0..self.study.arms.len()).flat_map(|arm| (0..seeds).map(move |seed| (arm, seed)));
        match all.find(|fit| !there.contains(fit)) {
            None => Ok(()),
            Some((arm, seed)) => Err(AssemblyError::MissingFits {
                found: there.len(),
                wanted: self.study.arms.len() * seeds as usize,
                arm: name(arm),
                seed,
            }),
        }
    }
}

#[cfg(test)]
mod tests;
