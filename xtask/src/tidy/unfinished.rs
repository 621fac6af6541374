//! Rule: a marker of unfinished work has a reason.

use super::Finding;
use super::project::{File, Project};
use crate::rust;

const MARKERS: [&str; 2] = ["TODO", "FIXME"];

const TEXT: [&str; 7] = [".ts", ".py", ".css", ".sh", ".toml", ".c", ".md"];

pub fn findings(project: &Project) -> Vec<Finding> {
    let mut found = Vec::new();
    // Lexing every file takes seconds; most have no marker.
    let has_marker = |file: &&File| MARKERS.iter().any(|marker| file.text().contains(marker));
    for file in project.files.iter().filter(|file| !file.is_a_rule()).filter(has_marker) {
        if file.path.ends_with(".rs") {
            match rust::comments(&file.text()) {
                Ok(comments) => found.extend(markers(file, &comments)),
                Err(error) => {
                    found.push(Finding::new(&file.path, 1, format!("cannot read this file: {error}")));
                }
            }
        } else if TEXT.iter().any(|end| file.path.ends_with(end)) {
            found.extend(markers(file, &file.text()));
        }
    }
    found
}

fn markers(file: &File, text: &str) -> Vec<Finding> {
    let mut found = Vec::new();
    for (number, line) in text.lines().enumerate() {
        for marker in MARKERS.into_iter().filter(|marker| lacks_reason(line, marker)) {
            found.push(Finding::new(
                &file.path,
                number + 1,
                format!("{marker} without a reason: write {marker} (why)"),
            ));
        }
    }
    found
}

fn lacks_reason(line: &str, marker: &str) -> bool {
    let is_word = |character: Option<char>| character.is_some_and(|it| it.is_alphanumeric() || it == '_');
    line.match_indices(marker).any(|(at, _)| {
        let (before, after) = (&line[..at], &line[at + marker.len()..]);
        let reason = after.trim_start().strip_prefix('(').and_then(|rest| rest.split(')').next());
        let stands_alone = !is_word(before.chars().next_back()) && !is_word(after.chars().next());
        stands_alone && reason.is_none_or(|reason| reason.trim().is_empty())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(path: &str, text: &str) -> Vec<usize> {
        findings(&Project::from_files(&[(path, text)])).into_iter().map(|finding| finding.line).collect()
    }

    #[test]
    fn a_marker_without_a_reason_is_found() {
        assert_eq!(lines("crates/palpate/src/rig.rs", "// TODO later\n/* FIXME() */"), [1, 2]);
        assert_eq!(lines("web/src/main.ts", "let a; // FIXME: b"), [1]);
    }

    #[test]
    fn reasons_words_and_strings_are_clean() {
        let text = "// TODO (the paper gives no value): find one\nlet a = \"TODO\";\n// MASTODON TODOS";
        assert!(lines("crates/palpate/src/rig.rs", text).is_empty());
        assert!(lines("xtask/src/tidy/unfinished.rs", "// TODO").is_empty());
    }
}
