//! The paths (`a::b::c`) and the macros that Rust code uses.

/// A path with its segments, groups such as `a::{b, c}` taken apart.
#[derive(Debug, PartialEq, Eq)]
pub struct UsedPath {
    /// Counted from 1.
    pub line: usize,
    /// `*` and `self` included.
    pub segments: Vec<String>,
}

#[derive(Debug, PartialEq, Eq)]
enum Token {
    Word(String),
    Parting,
    Mark(char),
}

/// Every path in code without comments and literals.
pub fn used_paths(code: &str) -> Vec<UsedPath> {
    let mut reader = Reader { tokens: tokens(code), at: 0, found: Vec::new() };
    while reader.at < reader.tokens.len() {
        let before = reader.at;
        reader.path(&[]);
        if reader.at == before {
            reader.at += 1;
        }
    }
    reader.found
}

/// Every macro that is called, with its line.
pub fn used_macros(code: &str) -> Vec<(usize, String)> {
    let tokens = tokens(code);
    let called = tokens.windows(3).filter_map(|three| match three {
        [(line, Token::Word(name)), (_, Token::Mark('!')), (_, Token::Mark('(' | '[' | '{'))] => {
            Some((*line, name.clone()))
        }
        _ => None,
    });
    called.collect()
}

/// Every word of the code, with its line.
pub fn words(code: &str) -> impl Iterator<Item = (usize, String)> {
    tokens(code).into_iter().filter_map(|(line, token)| match token {
        Token::Word(word) => Some((line, word)),
        _ => None,
    })
}

struct Reader {
    tokens: Vec<(usize, Token)>,
    at: usize,
    found: Vec<UsedPath>,
}

impl Reader {
    /// Reads the path that starts here, if one does, after the segments of the group that it stands in.
    fn path(&mut self, group: &[String]) {
        let mut segments = group.to_vec();
        let line = self.tokens.get(self.at).map_or(0, |(line, _)| *line);
        while let Some((_, token)) = self.tokens.get(self.at) {
            match token {
                Token::Parting => self.at += 1,
                Token::Word(word) => {
                    segments.push(word.clone());
                    self.at += 1;
                    if self.mark_here() != Some(&Token::Parting) {
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
        if segments.len() > group.len() {
            self.found.push(UsedPath { line, segments });
        }
    }

    fn group(&mut self, segments: &[String]) {
        self.at += 1;
        while let Some(token) = self.mark_here() {
            if *token == Token::Mark('}') {
                self.at += 1;
                return;
            }
            let before = self.at;
            self.path(segments);
            if self.at == before {
                self.at += 1;
            }
        }
    }

    fn mark_here(&self) -> Option<&Token> {
        self.tokens.get(self.at).map(|(_, token)| token)
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
    fn lines_and_macros_are_told() {
        assert_eq!(used_paths("\n\nuse a::b;").last().unwrap().line, 3);
        assert_eq!(
            used_macros("x != y;\nprintln!(\"\"); vec![1]"),
            [(2, "println".into()), (2, "vec".into())]
        );
    }

    #[test]
    fn an_open_group_ends_with_the_text() {
        assert_eq!(paths("use a::{b, c::{d"), ["a::b", "a::c::d"]);
    }
}
