//! Rows of an experiment as a file, and their cells in a table.

use serde::Serialize;

/// What an experiment over seeds found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Results<R> {
    /// Version of palpate.
    pub palpate: &'static str,
    /// Name of the experiment.
    pub experiment: &'static str,
    /// Seeds.
    pub seeds: Vec<u64>,
    /// Contacts of each seed, about.
    pub contacts: usize,
    /// Rigs by their names.
    pub rigs: Vec<RigText>,
    /// The rows.
    pub rows: Vec<R>,
}

/// A rig as its file has it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RigText {
    /// Name.
    pub name: &'static str,
    /// Text.
    pub toml: &'static str,
}

impl<R> Results<R> {
    /// The rows of an experiment with so many seeds, from 0 on, over rigs by name and text.
    pub(crate) fn new(
        experiment: &'static str,
        (seeds, contacts): (u64, usize),
        rigs: &[(&'static str, &'static str)],
        rows: Vec<R>,
    ) -> Self {
        let rigs = rigs.iter().map(|(name, toml)| RigText { name, toml }).collect();
        let (palpate, seeds) = (env!("CARGO_PKG_VERSION"), (0..seeds).collect());
        Self { palpate, experiment, seeds, contacts, rigs, rows }
    }

    /// Title and head of the table in Markdown.
    pub(crate) fn table_head(&self, conditions: &str, columns: &[&str]) -> String {
        let Self { palpate, seeds, contacts, .. } = self;
        format!(
            "palpate {palpate}, {} seeds, about {contacts} contacts each, {conditions}\n\n| {} |\n|{}\n",
            seeds.len(),
            columns.join(" | "),
            "---|".repeat(columns.len())
        )
    }
}

/// A share in a table.
pub(crate) fn percent(share: Option<f64>) -> String {
    share.map_or("–".to_owned(), |share| format!("{share:.1} %"))
}

/// A length in a table.
pub(crate) fn mm(length: Option<f64>) -> String {
    length.map_or("–".to_owned(), |length| format!("{length:.2}"))
}
