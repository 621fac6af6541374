//! Files stay short enough to be read in one go.

use super::Finding;
use super::project::Project;

/// Past this, a file is reported.
const LONG: usize = 400;
/// Past this, it fails.
const TOO_LONG: usize = 600;

const SOURCE: [&str; 6] = [".rs", ".ts", ".py", ".css", ".sh", ".c"];

/// Source files over 400 lines, as notes; over 600, as failures.
pub fn findings(project: &Project) -> Vec<Finding> {
    let source = project.files.iter().filter(|file| SOURCE.iter().any(|end| file.path.ends_with(end)));
    let long = source.map(|file| (file, file.text().lines().count())).filter(|(_, lines)| *lines > LONG);
    long.map(|(file, lines)| {
        if lines > TOO_LONG {
            Finding::failure(
                &file.path,
                lines,
                format!("{lines} lines; part it by concept: {TOO_LONG} is the most"),
            )
        } else {
            Finding::warning(&file.path, lines, format!("{lines} lines; {LONG} is the aim"))
        }
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::Weight;

    #[test]
    fn long_files_are_noted_and_too_long_ones_fail() {
        let weight = |path: &str, lines: usize| {
            let found = findings(&Project::of(&[(path, &"x\n".repeat(lines))]));
            found.first().map(|finding| finding.weight)
        };
        assert_eq!(weight("a.rs", 400), None);
        assert_eq!(weight("a.rs", 401), Some(Weight::Warning));
        assert_eq!(weight("a.rs", 601), Some(Weight::Failure));
        assert_eq!(weight("Cargo.lock", 900), None);
    }
}
