//! Rule: studies and rigs in a published crate equal those in studies or examples.

use super::Finding;
use super::project::{File, Project};

const ORIGINALS: [&str; 2] = ["studies", "examples"];

pub fn findings(project: &Project) -> Vec<Finding> {
    let copies = project.files.iter().filter(|file| is_copy(&file.path));
    copies.filter_map(|copy| of_copy(project, copy)).collect()
}

fn is_copy(path: &str) -> bool {
    path.starts_with("crates/") && path.contains("/src/") && path.ends_with(".toml")
}

fn of_copy(project: &Project, copy: &File) -> Option<Finding> {
    let name = copy.path.rsplit('/').next()?;
    let paths = ORIGINALS.map(|folder| format!("{folder}/{name}"));
    match paths.iter().find_map(|path| project.file(path)) {
        Some(original) if original.bytes == copy.bytes => None,
        Some(original) => {
            Some(Finding::new(&copy.path, 1, format!("differs from {}: copy that file here", original.path)))
        }
        None => Some(Finding::new(&copy.path, 1, format!("has no original: write {}", paths.join(" or ")))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_that_differ_or_have_no_original_are_found() {
        let files = [
            ("crates/a/src/deep/same.toml", "x"),
            ("crates/a/src/other.toml", "x"),
            ("crates/a/src/alone.toml", "x"),
            ("crates/a/Cargo.toml", ""),
            ("examples/same.toml", "x"),
            ("studies/other.toml", "y"),
        ];
        let found: Vec<_> = findings(&Project::from_files(&files))
            .into_iter()
            .map(|finding| format!("{}: {}", finding.path, finding.message))
            .collect();
        assert_eq!(
            found,
            [
                "crates/a/src/other.toml: differs from studies/other.toml: copy that file here",
                "crates/a/src/alone.toml: has no original: write studies/alone.toml or examples/alone.toml"
            ]
        );
    }
}
