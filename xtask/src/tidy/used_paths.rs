//! The paths (`a::b::c`) that Rust code uses, and the modules that it declares.

/// A path with its segments, groups such as `a::{b, c}` taken apart.
#[derive(Debug, PartialEq, Eq)]
pub struct UsedPath {
    /// Counted from 1.
    pub line: usize,
    /// `*` included, a closing `self` left out.
    pub segments: Vec<String>,
    /// The name that a `use` declaration brings in by it.
    pub imported: Option<String>,
}

#[derive(Debug, PartialEq, Eq)]
enum Token {
    Word(String),
    Parting,
    Mark(char),
}

/// Every path in code without comments and literals.
pub fn used_paths(code: &str) -> Vec<UsedPath> {
    let mut reader = Reader { tokens: tokens(code), at: 0, declares: false, found: Vec::new() };
    while let Some(token) = reader.token_at(0) {
        match token {
            // `use<…>` is a bound of an opaque type.
            Token::Word(word) if word == "use" && reader.token_at(1) != Some(&Token::Mark('<')) => {
                reader.declares = true;
            }
            Token::Mark(';') => reader.declares = false,
            Token::Word(_) | Token::Parting => {
                reader.path(&[]);
                continue;
            }
            Token::Mark(_) => {}
        }
        reader.at += 1;
    }
    reader.found
}

/// The modules that code declares in files of their own: `mod name;`.
pub fn declared_modules(code: &str) -> Vec<String> {
    let tokens = tokens(code);
    let declared = tokens.windows(3).filter_map(|three| match three {
        [(_, Token::Word(word)), (_, Token::Word(name)), (_, Token::Mark(';'))] if word == "mod" => {
            Some(name.clone())
        }
        _ => None,
    });
    declared.collect()
}

struct Reader {
    tokens: Vec<(usize, Token)>,
    at: usize,
    /// Inside a `use` declaration.
    declares: bool,
    found: Vec<UsedPath>,
}

impl Reader {
    /// Reads the path that starts here, if one does, after the segments of the group that it stands in.
    fn path(&mut self, group: &[String]) {
        let mut segments = group.to_vec();
        let line = self.tokens.get(self.at).map_or(0, |(line, _)| *line);
        while let Some(token) = self.token_at(0) {
            match token {
                Token::Parting => self.at += 1,
                Token::Word(word) => {
                    // `{self, …}` names the group's own module.
                    if word != "self" || segments.is_empty() {
                        segments.push(word.clone());
                    }
                    self.at += 1;
                    if self.token_at(0) != Some(&Token::Parting) {
                        break;
                    }
                }
                Token::Mark('*') if self.follows_parting() || !group.is_empty() => {
                    segments.push("*".into());
                    self.at += 1;
                    break;
                }
                Token::Mark('{') if self.follows_parting() => return self.group(&segments),
                Token::Mark(_) => break,
            }
        }
        if !segments.is_empty() {
            let imported =
                if self.declares { self.renamed().or_else(|| segments.last().cloned()) } else { None };
            self.found.push(UsedPath { line, segments, imported });
        }
    }

    fn group(&mut self, segments: &[String]) {
        self.at += 1;
        while let Some(token) = self.token_at(0) {
            match token {
                Token::Mark('}') => {
                    self.at += 1;
                    return;
                }
                Token::Mark(',') => self.at += 1,
                _ => {
                    let before = self.at;
                    self.path(segments);
                    self.at = self.at.max(before + 1);
                }
            }
        }
    }

    /// Reads `as name`.
    fn renamed(&mut self) -> Option<String> {
        match (self.token_at(0)?, self.token_at(1)?) {
            (Token::Word(word), Token::Word(name)) if word == "as" => {
                let name = name.clone();
                self.at += 2;
                Some(name)
            }
            _ => None,
        }
    }

    fn token_at(&self, ahead: usize) -> Option<&Token> {
        self.tokens.get(self.at + ahead).map(|(_, token)| token)
    }

    fn follows_parting(&self) -> bool {
        self.at.checked_sub(1).is_some_and(|before| self.tokens[before].1 == Token::Parting)
    }
}

fn tokens(code: &str) -> Vec<(usize, Token)> {
    let mut tokens = Vec::new();
    for (line, text) in code.lines().enumerate() {
        let mut rest = text;
        while let Some(first) = rest.chars().next() {
            let is_word = |character: char| character.is_alphanumeric() || character == '_';
            let length = if is_word(first) {
                rest.find(|character| !is_word(character)).unwrap_or(rest.len())
            } else if rest.starts_with("::") {
                2
            } else {
                first.len_utf8()
            };
            let token = match first {
                _ if is_word(first) => Some(Token::Word(rest[..length].into())),
                _ if length == 2 && first == ':' => Some(Token::Parting),
                _ if first.is_whitespace() => None,
                _ => Some(Token::Mark(first)),
            };
            tokens.extend(token.map(|token| (line + 1, token)));
            rest = &rest[length..];
        }
    }
    tokens
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paths(code: &str) -> Vec<String> {
        used_paths(code)
            .iter()
            .map(|path| path.segments.join("::"))
            .filter(|path| path.contains("::"))
            .collect()
    }

    #[test]
    fn groups_are_taken_apart() {
        assert_eq!(
            paths("use std::{fs, time::{Duration, Instant}, io::*};\nuse crate::units as u;"),
            ["std::fs", "std::time::Duration", "std::time::Instant", "std::io::*", "crate::units"]
        );
    }

    #[test]
    fn paths_inside_expressions_and_types_are_found() {
        assert_eq!(
            paths(
                "let a: Vec::<crate::rig::Rig> = ::std::fs::read(x)?; match e { Kind::A { b } => b * Kind::C }"
            ),
            ["crate::rig::Rig", "std::fs::read", "Kind::A", "Kind::C"]
        );
    }

    #[test]
    fn lines_imported_names_and_declared_modules_are_told() {
        let paths = used_paths("\n\nuse a::{self, b as c, d::{e, self}};\nlet f = a::b as u8;");
        let told: Vec<_> = paths.iter().map(|path| (path.line, path.imported.as_deref())).collect();
        let (a, c, e, d) = (Some("a"), Some("c"), Some("e"), Some("d"));
        assert_eq!(told[..4], [(3, a), (3, c), (3, e), (3, d)]);
        assert!(told[4..].iter().all(|(line, imported)| *line == 4 && imported.is_none()), "{told:?}");
        assert_eq!(declared_modules("pub mod a;\nmod b { mod c; }\nlet model = d;"), ["a", "c"]);
    }

    #[test]
    fn an_open_group_ends_with_the_text() {
        assert_eq!(paths("use a::{b, c::{d"), ["a::b", "a::c::d"]);
    }
}
