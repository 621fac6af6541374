//! Rule: samples in the command's package equal the project's examples.

use super::Finding;
use super::project::Project;

/// Folder of the copies: a package contains its own files only.
const SAMPLES: &str = "crates/palpate-cli/samples/";
const ORIGINALS: [&str; 2] = ["examples/", "examples/data/"];

pub fn findings(project: &Project) -> Vec<Finding> {
    let mut findings = Vec::new();
    for sample in &project.files {
        let Some(name) = sample.path.strip_prefix(SAMPLES) else { continue };
        let original = ORIGINALS.iter().find_map(|folder| project.file(&format!("{folder}{name}")));
        match original {
            None => {
                let message = "no file of this name in examples: add it there";
                findings.push(Finding::new(&sample.path, 1, message));
            }
            Some(original) if original.bytes != sample.bytes => {
                let message = format!("differs from {}: copy it again", original.path);
                findings.push(Finding::new(&sample.path, 1, message));
            }
            Some(_) => {}
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(files: &[(&str, &str)]) -> Vec<String> {
        findings(&Project::from_files(files)).into_iter().map(|finding| finding.message).collect()
    }

    #[test]
    fn copies_of_examples_are_clean() {
        let files = [
            ("examples/a.toml", "1"),
            ("examples/data/b.csv", "2"),
            ("crates/palpate-cli/samples/a.toml", "1"),
            ("crates/palpate-cli/samples/b.csv", "2"),
        ];
        assert!(messages(&files).is_empty());
    }

    #[test]
    fn changed_and_unknown_samples_are_found() {
        let files = [("examples/a.toml", "1"), ("crates/palpate-cli/samples/a.toml", "2")];
        assert_eq!(messages(&files), ["differs from examples/a.toml: copy it again"]);
        let files = [("crates/palpate-cli/samples/b.csv", "2")];
        assert_eq!(messages(&files), ["no file of this name in examples: add it there"]);
    }
}
