//! The file `results.json`, as every run of a study writes it.

use serde::Serialize;

use super::paper::{Claim, PublishedFigure};
use super::results::{RunFacts, StudyResults};

/// Content of `results.json`: results and the facts of their run; for the founding paper's study also a comparison with the paper.
#[derive(Clone, Debug, Serialize)]
pub struct ResultsFile<'a> {
    /// Facts of the run.
    #[serde(flatten)]
    pub run: &'a RunFacts,
    /// Results.
    #[serde(flatten)]
    pub results: &'a StudyResults,
    /// The paper's figures beside those of the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub published: Option<Vec<PublishedFigure>>,
    /// The paper's claims.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub claims: Option<Vec<Claim>>,
}
