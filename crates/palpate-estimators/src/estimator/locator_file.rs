//! The locator file: JSON with a format version.

use super::Locator;
use crate::fit::LocatorFault;

/// The `format` of every locator file.
const FORMAT: &str = "palpate-locator";

/// The version of the format that this palpate writes and reads.
pub const FORMAT_VERSION: u32 = 1;

/// A locator file that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum LocatorFileError {
    /// Not the JSON of a locator; the error names line and column.
    #[error("this is not a locator file: {0}")]
    Json(#[from] serde_json::Error),
    /// JSON of another kind.
    #[error("the file's format is `{found}`; a locator's is `{FORMAT}`")]
    Format {
        /// Value in the file.
        found: String,
    },
    /// A locator of another format version.
    #[error(
        "the locator has format version {found}; this palpate reads version {FORMAT_VERSION}: fit it again, or use the palpate that wrote it"
    )]
    Version {
        /// Value in the file.
        found: u32,
    },
    /// Numbers that do not fit together.
    #[error(transparent)]
    Fault(#[from] LocatorFault),
}

impl LocatorFileError {
    /// Line and column, from 1, where the JSON is at fault.
    pub fn place(&self) -> Option<(usize, usize)> {
        match self {
            Self::Json(error) if error.line() > 0 => Some((error.line(), error.column().max(1))),
            _ => None,
        }
    }
}

/// Fields that every version of the file begins with.
#[derive(serde::Deserialize)]
struct Heading {
    format: String,
    format_version: u32,
}

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File<L> {
    format: String,
    format_version: u32,
    locator: L,
}

impl Locator {
    /// The locator as the text of its file.
    ///
    /// ```
    /// use palpate_estimators::{arrangement::Training, estimator::Locator, fit::Fit, influence::Influence, setup::Setup};
    /// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
    ///
    /// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
    /// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
    /// let presses = setup.simulate(&Training::even(10), 0)?;
    /// let locator = Influence::default().fit(&setup, &presses)?.into_locator();
    /// assert_eq!(Locator::from_json(&locator.to_json()?)?, locator);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`LocatorFileError::Json`] when a number has no JSON, which no fitted locator has.
    pub fn to_json(&self) -> Result<String, LocatorFileError> {
        let file = File { format: FORMAT.to_owned(), format_version: FORMAT_VERSION, locator: self };
        Ok(serde_json::to_string_pretty(&file)? + "\n")
    }

    /// Reads the text of a locator file.
    ///
    /// # Errors
    /// [`LocatorFileError`], with the place where there is one.
    pub fn from_json(text: &str) -> Result<Self, LocatorFileError> {
        let heading: Heading = serde_json::from_str(text)?;
        if heading.format != FORMAT {
            return Err(LocatorFileError::Format { found: heading.format });
        }
        if heading.format_version != FORMAT_VERSION {
            return Err(LocatorFileError::Version { found: heading.format_version });
        }
        let File::<Self> { locator, .. } = serde_json::from_str(text)?;
        locator.check()?;
        Ok(locator)
    }
}
