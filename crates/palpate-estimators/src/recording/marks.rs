//! Separators and decimal marks.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Field separator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Separator {
    /// `a,b`
    #[default]
    Comma,
    /// `a;b`
    Semicolon,
    /// Tabulator.
    Tab,
    /// `a|b`
    Pipe,
    /// Runs of blanks.
    Blanks,
}

impl Separator {
    /// All separators.
    pub const ALL: [Self; 5] = [Self::Comma, Self::Semicolon, Self::Tab, Self::Pipe, Self::Blanks];

    pub(super) const MARKS: [Self; 4] = [Self::Comma, Self::Semicolon, Self::Tab, Self::Pipe];

    /// Name in rigs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Comma => "comma",
            Self::Semicolon => "semicolon",
            Self::Tab => "tab",
            Self::Pipe => "pipe",
            Self::Blanks => "blanks",
        }
    }

    /// Character.
    pub const fn byte(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab => b'\t',
            Self::Pipe => b'|',
            Self::Blanks => b' ',
        }
    }

    /// Parses `sep=;`, by which some spreadsheets begin a file.
    pub(super) fn from_declaration(line: &str) -> Option<Self> {
        let mark = line.trim_matches([' ', '"']).strip_prefix("sep=")?;
        Self::MARKS.into_iter().find(|separator| mark.as_bytes() == [separator.byte()])
    }
}

impl fmt::Display for Separator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Comma => "commas",
            Self::Semicolon => "semicolons",
            Self::Tab => "tabs",
            Self::Pipe => "pipes",
            Self::Blanks => "blanks",
        })
    }
}

/// Decimal mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Decimal {
    /// `1.5`
    Point,
    /// `1,5`
    Comma,
}

impl Decimal {
    /// Both decimal marks.
    pub const ALL: [Self; 2] = [Self::Point, Self::Comma];

    /// Name in rigs.
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
    fn reads_the_declaration_of_a_separator() {
        assert_eq!(Separator::from_declaration("sep=;"), Some(Separator::Semicolon));
        assert_eq!(Separator::from_declaration("\"sep=\t\""), Some(Separator::Tab));
        assert_eq!(Separator::from_declaration("sep=|"), Some(Separator::Pipe));
        assert_eq!(Separator::from_declaration("sep,Pl"), None);
    }
}
