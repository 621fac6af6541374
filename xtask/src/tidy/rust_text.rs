//! Rust text, split into comments, literals and code, so that a rule reads code without being misled by prose.

/// A Rust file taken apart. Each part has the file's shape: what belongs elsewhere is blank, and lines keep their numbers.
pub struct RustText {
    /// Everything but comments, strings and characters.
    pub code: String,
    /// The comments.
    pub comments: String,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Code,
    Comment,
    Literal,
}

struct Scanner {
    characters: Vec<char>,
    at: usize,
    parts: RustText,
}

impl RustText {
    /// Takes a file apart. Text that is not Rust comes out as code.
    pub fn parse(text: &str) -> Self {
        let parts = Self { code: String::with_capacity(text.len()), comments: String::new() };
        let mut scanner = Scanner { characters: text.chars().collect(), at: 0, parts };
        while scanner.at < scanner.characters.len() {
            let (kind, length) = scanner.next_piece();
            scanner.take(kind, length);
        }
        scanner.parts
    }

    /// The code without the items under `#[cfg(test)]`.
    pub fn code_without_tests(&self) -> String {
        let mut kept = String::with_capacity(self.code.len());
        let mut rest = self.code.as_str();
        while let Some((before, after)) = rest.split_once("#[cfg(test)]") {
            kept += before;
            let end = end_of_item(after);
            kept.extend(after[..end].chars().filter(|&character| character == '\n'));
            rest = &after[end..];
        }
        kept + rest
    }
}

impl Scanner {
    fn next_piece(&self) -> (Kind, usize) {
        match (self.peek(0), self.peek(1)) {
            (Some('/'), Some('/')) => {
                (Kind::Comment, self.until(|scanner, at| scanner.peek(at) == Some('\n')))
            }
            (Some('/'), Some('*')) => (Kind::Comment, self.block_comment()),
            (Some('"'), _) => (Kind::Literal, self.quoted('"')),
            (Some('\''), _) => self.quote(),
            (Some('r'), Some('"' | '#')) if self.starts_word() => self.raw_string(),
            (Some(first), _) if first.is_alphanumeric() || first == '_' => (Kind::Code, self.word()),
            _ => (Kind::Code, 1),
        }
    }

    fn peek(&self, ahead: usize) -> Option<char> {
        self.characters.get(self.at + ahead).copied()
    }

    /// The first distance at which `found` holds, or the distance to the end.
    fn until(&self, found: impl Fn(&Self, usize) -> bool) -> usize {
        let left = self.characters.len() - self.at;
        (1..left).find(|&ahead| found(self, ahead)).unwrap_or(left)
    }

    fn word(&self) -> usize {
        let is_word = |character: Option<char>| character.is_some_and(|it| it.is_alphanumeric() || it == '_');
        // `br"…"` and `cr"…"` are raw too: leave their `r` for the next piece.
        if matches!((self.peek(0), self.peek(1), self.peek(2)), (Some('b' | 'c'), Some('r'), Some('"' | '#')))
        {
            return 1;
        }
        self.until(|scanner, ahead| !is_word(scanner.peek(ahead)))
    }

    /// At an `r` that is not the tail of a longer word, but for the `b` or `c` of a byte or C string.
    fn starts_word(&self) -> bool {
        let before = self.at.checked_sub(1).map(|before| self.characters[before]);
        !before.is_some_and(|it| (it.is_alphanumeric() || it == '_') && it != 'b' && it != 'c')
    }

    fn block_comment(&self) -> usize {
        let (mut depth, mut ahead) = (0usize, 0);
        while let Some(character) = self.peek(ahead) {
            match (character, self.peek(ahead + 1)) {
                ('/', Some('*')) => (depth, ahead) = (depth + 1, ahead + 2),
                ('*', Some('/')) => (depth, ahead) = (depth - 1, ahead + 2),
                _ => ahead += 1,
            }
            if depth == 0 {
                break;
            }
        }
        ahead
    }

    fn quoted(&self, quote: char) -> usize {
        let mut ahead = 1;
        while let Some(character) = self.peek(ahead) {
            ahead += if character == '\\' { 2 } else { 1 };
            if character == quote {
                break;
            }
        }
        ahead
    }

    /// A character literal, or the quote of a lifetime.
    fn quote(&self) -> (Kind, usize) {
        match (self.peek(1), self.peek(2)) {
            (Some('\\'), _) | (Some(_), Some('\'')) => (Kind::Literal, self.quoted('\'')),
            _ => (Kind::Code, 1),
        }
    }

    /// `r"…"`, `r#"…"#`, or a raw identifier such as `r#type`.
    fn raw_string(&self) -> (Kind, usize) {
        let hashes = self.until(|scanner, ahead| scanner.peek(ahead) != Some('#')) - 1;
        if self.peek(1 + hashes) != Some('"') {
            return (Kind::Code, 1);
        }
        let closes = |scanner: &Self, at: usize| {
            at > 1 + hashes
                && scanner.peek(at) == Some('"')
                && (1..=hashes).all(|hash| scanner.peek(at + hash) == Some('#'))
        };
        (Kind::Literal, self.until(closes) + 1 + hashes)
    }

    fn take(&mut self, kind: Kind, length: usize) {
        let end = (self.at + length).min(self.characters.len());
        for &character in &self.characters[self.at..end] {
            let shown = |here: bool| if here || character == '\n' { character } else { ' ' };
            self.parts.code.push(shown(kind == Kind::Code));
            self.parts.comments.push(shown(kind == Kind::Comment));
        }
        self.at = end;
    }
}

/// End of an item that starts at the head of `code`: past its closing brace or its semicolon.
fn end_of_item(code: &str) -> usize {
    let mut depth = 0usize;
    for (at, character) in code.char_indices() {
        match character {
            '{' => depth += 1,
            '}' if depth <= 1 => return at + 1,
            '}' => depth -= 1,
            ';' if depth == 0 => return at + 1,
            _ => {}
        }
    }
    code.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn comments_and_literals_leave_the_code() {
        let text = RustText::parse(
            "let a = \"one // two\"; // three\n/* four /* five */ six */ let b = 'x'; let c: &'static str = r#\"se\"ven\"#;",
        );
        assert_eq!(words(&text.code), words("let a = ; let b = ; let c: &'static str = ;").as_slice());
        assert_eq!(words(&text.comments), words("// three /* four /* five */ six */"));
    }

    #[test]
    fn lines_keep_their_numbers() {
        let source = "a\n\"x\ny\"\n// c\nb\n/* d\n e */\nz";
        let text = RustText::parse(source);
        assert_eq!(text.code.lines().count(), source.lines().count());
        assert_eq!(text.code.lines().nth(4), Some("b"));
        assert_eq!(text.comments.lines().nth(3), Some("// c"));
        assert_eq!(text.code.lines().last(), Some("z"));
    }

    #[test]
    fn quotes_escapes_and_raw_identifiers_do_not_mislead() {
        let text = RustText::parse(
            r##"let q = '"'; let e = '\''; let s = "\"in\""; let r#type = br"in"; let t: &'a u8 = b"in";"##,
        );
        assert!(!text.code.contains("in"), "{}", text.code);
        assert!(text.code.contains("r#type") && text.code.contains("&'a u8"), "{}", text.code);
    }

    #[test]
    fn an_open_end_is_taken_whole() {
        for source in ["/* open", "\"open", "r#\"open", "'", "r#", "'\\", "\"\\"] {
            assert_eq!(RustText::parse(source).code.chars().count(), source.chars().count(), "{source}");
        }
    }

    #[test]
    fn tests_can_be_left_out() {
        let source = "fn a() {}\n#[cfg(test)]\nmod tests {\n fn b() { if x { y } }\n}\nfn c() {}\n#[cfg(test)]\nuse d;\nfn e() {}";
        let kept = RustText::parse(source).code_without_tests();
        assert_eq!(words(&kept), words("fn a() {} fn c() {} fn e() {}"));
        assert_eq!(kept.lines().count(), source.lines().count());
    }
}
