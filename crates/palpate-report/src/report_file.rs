//! What a report is made of: files that the caller writes.

use super::{BenchDrawingError, PngError};

/// A file of a report, for the caller to write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportFile {
    /// Its name in the report's folder: "report.html", "figure-2.svg", "figure-2.png".
    pub name: String,
    /// What it holds.
    pub bytes: Vec<u8>,
}

/// Why a report cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A figure did not become a picture.
    #[error("figure {number}: {error}")]
    Picture {
        /// Number of the figure.
        number: usize,
        /// Why.
        error: PngError,
    },
    /// The bench cannot be drawn.
    #[error("the bench cannot be drawn: {0}")]
    Bench(#[from] BenchDrawingError),
}
