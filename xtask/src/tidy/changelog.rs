//! Rule: CHANGELOG.md has a section for the workspace's version.

use super::Finding;
use super::project::Project;

const CHANGELOG: &str = "CHANGELOG.md";

pub fn findings(project: &Project) -> Vec<Finding> {
    let Some(file) = project.file(CHANGELOG) else {
        return vec![Finding::new(CHANGELOG, 1, "this document is missing: write it")];
    };
    let text = file.text();
    let mut versions: Vec<&str> = project.crates.iter().map(|krate| krate.version.as_str()).collect();
    versions.sort_unstable();
    versions.dedup();
    let unknown = versions.into_iter().filter(|version| !has_section(&text, version));
    unknown
        .map(|version| Finding::new(CHANGELOG, 1, format!("no section `## {version}`: describe the version")))
        .collect()
}

/// Accepts `## 0.1.0` and `## [0.1.0]`, with an optional date.
fn has_section(text: &str, version: &str) -> bool {
    let headings = text.lines().filter_map(|line| line.strip_prefix("## "));
    headings
        .filter_map(|heading| heading.split_whitespace().next())
        .any(|word| word.trim_matches(['[', ']']) == version)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::project::Crate;

    fn messages(changelog: &[(&str, &str)]) -> Vec<String> {
        let mut project = Project::from_files(changelog);
        project.crates.push(Crate { version: "0.1.0".into(), ..Crate::default() });
        findings(&project).into_iter().map(|finding| finding.message).collect()
    }

    #[test]
    fn a_silent_or_missing_changelog_is_found() {
        assert_eq!(messages(&[]), ["this document is missing: write it"]);
        assert_eq!(
            messages(&[("CHANGELOG.md", "## 0.1.00\n0.1.0\n")]),
            ["no section `## 0.1.0`: describe the version"]
        );
    }

    #[test]
    fn a_section_with_or_without_brackets_and_date_is_clean() {
        assert!(messages(&[("CHANGELOG.md", "# Changes\n\n## [0.1.0] – 2026-11-21\n")]).is_empty());
        assert!(messages(&[("CHANGELOG.md", "## 0.1.0\n")]).is_empty());
    }
}
