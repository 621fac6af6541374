//! Separators of fields, and decimal marks.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Separator of the fields of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Separator {
    /// `a,b`
    #[default]
    Comma,
    /// `a;b`
    Semicolon,
    /// A tabulator.
    Tab,
}

impl Separator {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Comma, Self::Semicolon, Self::Tab];

    /// The word for it in rigs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Comma => "comma",
            Self::Semicolon => "semicolon",
            Self::Tab => "tab",
        }
    }

    /// The character.
    pub const fn byte(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab => b'\t',
        }
    }

    /// The separator in a line `sep=;`, by which some spreadsheets begin a file.
    pub(super) fn told(line: &str) -> Option<Self> {
        let told = line.trim_matches([' ', '"']).strip_prefix("sep=")?;
        Self::ALL.into_iter().find(|separator| told.as_bytes() == [separator.byte()])
    }
}

impl fmt::Display for Separator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Comma => "commas",
            Self::Semicolon => "semicolons",
            Self::Tab => "tabs",
        })
    }
}

/// Decimal mark of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Decimal {
    /// `1.5`
    Point,
    /// `1,5`
    Comma,
}

impl Decimal {
    /// Both of them.
    pub const ALL: [Self; 2] = [Self::Point, Self::Comma];

    /// The word for it in rigs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Comma => "comma",
        }
    }
}

impl fmt::Display for Decimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Point => "decimal points",
            Self::Comma => "decimal commas",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_before_the_header_may_tell_the_separator() {
        assert_eq!(Separator::told("sep=;"), Some(Separator::Semicolon));
        assert_eq!(Separator::told("\"sep=\t\""), Some(Separator::Tab));
        assert_eq!(Separator::told("sep,Pl"), None);
    }
}
