//! Rule: relative links, studies and examples in the documents exist.

use super::Finding;
use super::project::{File, Project};

const REQUIRED: [&str; 4] = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md"];

const RUNNABLE: [&str; 2] = ["studies/", "examples/"];

pub fn findings(project: &Project) -> Vec<Finding> {
    let missing = REQUIRED.into_iter().filter(|path| project.file(path).is_none());
    let missing = missing.map(|path| Finding::new(path, 1, "this document is missing: write it"));
    missing
        .chain(
            project.files.iter().filter(|file| is_document(file)).flat_map(|file| of_document(project, file)),
        )
        .collect()
}

fn is_document(file: &File) -> bool {
    REQUIRED.contains(&file.path.as_str()) || (file.path.starts_with("docs/") && file.path.ends_with(".md"))
}

fn of_document(project: &Project, file: &File) -> Vec<Finding> {
    let text = file.text();
    let mut found = Vec::new();
    let mut in_code = false;
    for (number, line) in text.lines().enumerate() {
        let mut add = |message: String| found.push(Finding::new(&file.path, number + 1, message));
        for path in runnable(line).filter(|path| !project.has(path)) {
            add(format!("{path} does not exist"));
        }
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
        } else if !in_code {
            for target in links(line).into_iter().filter(|target| is_relative(target)) {
                let path = target.split(['#', '?']).next().unwrap_or_default();
                match resolve(&file.path, path) {
                    Some(path) if project.has(&path) => {}
                    _ => add(format!("link to {target}, which does not exist")),
                }
            }
        }
    }
    found
}

fn runnable(line: &str) -> impl Iterator<Item = &str> {
    let words = line.split(|character: char| !(character.is_alphanumeric() || "._-/".contains(character)));
    words
        .map(|word| word.trim_start_matches("./").trim_end_matches('.'))
        .filter(|word| RUNNABLE.iter().any(|folder| word.starts_with(folder)) && word.ends_with(".toml"))
}

/// Targets of `[text](target "title")` and of `[label]: target`.
fn links(line: &str) -> Vec<&str> {
    let inline = line.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target);
    let defined = line.strip_prefix('[').and_then(|rest| rest.split_once("]:")).map(|(_, target)| target);
    let first_word =
        |target: &'_ str| -> usize { target.trim_start().find(char::is_whitespace).unwrap_or(usize::MAX) };
    inline
        .chain(defined)
        .map(|target| {
            let end = first_word(target);
            let target = target.trim_start();
            target.get(..end).unwrap_or(target).trim_matches(['<', '>'])
        })
        .collect()
}

fn is_relative(target: &str) -> bool {
    let has_scheme =
        target.split_once(':').is_some_and(|(scheme, _)| scheme.chars().all(char::is_alphanumeric));
    !target.is_empty() && !target.starts_with('#') && !has_scheme
}

/// Resolves a target beside `document`; `None` outside the project.
fn resolve(document: &str, target: &str) -> Option<String> {
    if target.starts_with('/') {
        return None;
    }
    let mut parts: Vec<&str> = document.split('/').collect();
    parts.pop();
    for part in target.split('/') {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            name => parts.push(name),
        }
    }
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(path: &str, text: &str) -> Vec<String> {
        let files = [
            ("README.md", ""),
            ("ARCHITECTURE.md", ""),
            ("CONTRIBUTING.md", ""),
            ("SECURITY.md", ""),
            ("examples/paper.toml", ""),
            ("docs/book/start.md", ""),
        ];
        let mut files: Vec<_> = files.into_iter().filter(|(name, _)| *name != path).collect();
        files.push((path, text));
        findings(&Project::from_files(&files))
            .into_iter()
            .map(|finding| format!("{}: {}", finding.line, finding.message))
            .collect()
    }

    #[test]
    fn a_missing_document_is_found() {
        let found = findings(&Project::from_files(&[
            ("README.md", ""),
            ("CONTRIBUTING.md", ""),
            ("SECURITY.md", ""),
        ]));
        assert_eq!(found, [Finding::new("ARCHITECTURE.md", 1, "this document is missing: write it")]);
    }

    #[test]
    fn broken_links_and_missing_examples_are_found() {
        let text = "[book](docs/book/begin.md#top)\n`palpate fit examples/none.toml`\n[out]: ../shared/x.md";
        let found = messages("README.md", text);
        assert_eq!(
            found,
            [
                "1: link to docs/book/begin.md#top, which does not exist",
                "2: examples/none.toml does not exist",
                "3: link to ../shared/x.md, which does not exist"
            ]
        );
    }

    #[test]
    fn living_links_addresses_anchors_and_code_are_clean() {
        let text = "[a](docs/book/start.md \"title\") [b](https://example.org/x) [c](#here) ![d](./docs)\n\
                    ```\nv[i](none)\npalpate fit examples/paper.toml.\n```\n[e](<examples/paper.toml>)";
        assert_eq!(messages("README.md", text), [] as [&str; 0]);
        assert_eq!(
            messages("docs/book/more.md", "[up](../../README.md) [beside](start.md)"),
            [] as [&str; 0]
        );
    }
}
