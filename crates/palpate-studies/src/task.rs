//! Tasks of a study, and shards of them.

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

/// Block of seeds of one arm.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Name of the arm.
    pub arm: String,
    /// Seeds.
    pub seeds: Range<u64>,
}

pub(crate) const MOST_SEEDS: u64 = 1_000_000;

impl Task {
    /// Number of fits.
    pub fn fits(&self) -> u64 {
        self.seeds.end.saturating_sub(self.seeds.start)
    }

    pub(crate) fn blocks(arm: &str, seeds: u64, block: u64) -> impl Iterator<Item = Self> {
        let block = block.max(1);
        (0..seeds.div_ceil(block)).map(move |i| {
            let first = i * block;
            Self { arm: arm.to_owned(), seeds: first..seeds.min(first.saturating_add(block)) }
        })
    }
}

/// Shard "K/N": every N-th task from the K-th on.
///
/// ```
/// use palpate_studies::Shard;
///
/// let shard: Shard = "3/16".parse()?;
/// assert_eq!((shard.number(), shard.of()), (3, 16));
/// assert_eq!("17/16".parse::<Shard>().unwrap_err().to_string(), "shard 17 of 16: it must be from 1 to 16");
/// # Ok::<(), palpate_studies::ShardError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: u64,
    of: u64,
}

/// Invalid shard.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShardError {
    /// Not of the form K/N.
    #[error("{found:?} is not a shard: it must be K/N, the K-th of N shares, as in 3/16")]
    NotAShard {
        /// Text.
        found: String,
    },
    /// Shard number out of range.
    #[error("shard {number} of {of}: it must be from 1 to {of}")]
    Number {
        /// Number.
        number: u64,
        /// Number of shards.
        of: u64,
    },
    /// Number of shards out of range.
    #[error("{of} shards: there must be from 1 to {}", Shard::MOST)]
    Of {
        /// Number of shards.
        of: u64,
    },
}

impl Shard {
    /// Largest number of shards.
    pub const MOST: u64 = 1_000_000;

    /// Creates the shard `number`, from 1, of `of`.
    ///
    /// # Errors
    /// [`ShardError`] with the number and its bound.
    pub fn new(number: u64, of: u64) -> Result<Self, ShardError> {
        if !(1..=Self::MOST).contains(&of) {
            return Err(ShardError::Of { of });
        }
        if !(1..=of).contains(&number) {
            return Err(ShardError::Number { number, of });
        }
        Ok(Self { number, of })
    }

    /// Number, from 1.
    pub fn number(self) -> u64 {
        self.number
    }

    /// Number of shards.
    pub fn of(self) -> u64 {
        self.of
    }

    /// Selects the tasks of this shard.
    pub fn share(self, tasks: Vec<Task>) -> Vec<Task> {
        // Neighbours are of one arm and have similar costs, so that every shard gets its share of the costly arms.
        let step = usize::try_from(self.of).unwrap_or(usize::MAX);
        let first = usize::try_from(self.number - 1).unwrap_or(usize::MAX);
        tasks.into_iter().skip(first).step_by(step).collect()
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let numbers = text.split_once('/').and_then(|(k, n)| Some((whole(k)?, whole(n)?)));
        let (number, of) = numbers.ok_or_else(|| ShardError::NotAShard { found: text.to_owned() })?;
        Self::new(number, of)
    }
}

fn whole(digits: &str) -> Option<u64> {
    digits.bytes().all(|byte| byte.is_ascii_digit()).then(|| digits.parse().ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_every_seed_once() {
        let blocks = |seeds, block| -> Vec<(u64, u64)> {
            Task::blocks("a", seeds, block).map(|task| (task.seeds.start, task.seeds.end)).collect()
        };
        assert_eq!(blocks(20, 8), [(0, 8), (8, 16), (16, 20)]);
        assert_eq!(blocks(8, 8), [(0, 8)]);
        assert_eq!(blocks(3, 8), [(0, 3)]);
        assert_eq!(blocks(2, 0), [(0, 1), (1, 2)]);
    }

    #[test]
    fn shards_share_all_tasks_out() {
        let tasks: Vec<Task> = Task::blocks("a", 100, 3).collect();
        for of in [1, 2, 5, 34, 50] {
            let shares = (1..=of).map(|number| Shard::new(number, of).unwrap().share(tasks.clone()));
            let mut all: Vec<Task> = shares.flatten().collect();
            all.sort_by_key(|task| task.seeds.start);
            assert_eq!(all, tasks, "{of}");
        }
    }

    #[test]
    fn shards_are_written_as_they_are_read() {
        assert_eq!("3/16".parse::<Shard>().unwrap().to_string(), "3/16");
        for text in
            ["", "3", "3/", "/16", "3/16/2", "+3/16", "-1/2", "3 /16", "a/b", "99999999999999999999/2"]
        {
            let refused = text.parse::<Shard>().unwrap_err();
            assert_eq!(refused, ShardError::NotAShard { found: text.to_owned() });
        }
        assert_eq!("0/4".parse::<Shard>(), Err(ShardError::Number { number: 0, of: 4 }));
        assert_eq!("1/0".parse::<Shard>(), Err(ShardError::Of { of: 0 }));
        assert_eq!("1/1000001".parse::<Shard>(), Err(ShardError::Of { of: 1_000_001 }));
    }
}
