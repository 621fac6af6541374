//! The file `results.json`.

use serde::Serialize;

use super::paper::{Claim, PublishedFigure};
use super::results::{RunFacts, StudyResults};

/// Content of `results.json`.
#[derive(Clone, Debug, Serialize)]
pub struct ResultsFile<'a> {
    /// Facts of the run.
    #[serde(flatten)]
    pub run: &'a RunFacts,
    /// Results.
    #[serde(flatten)]
    pub results: &'a StudyResults,
    /// Published figures (paper study only).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub published: Option<Vec<PublishedFigure>>,
    /// Claims (paper study only).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub claims: Option<Vec<Claim>>,
}
