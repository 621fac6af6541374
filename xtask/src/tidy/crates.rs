//! Crates depend one way: core <- palpate <- live <- cli, and palpate <- python.

use super::Finding;
use super::project::{Crate, Project};

/// Each crate, and the crates of the workspace that it may depend on.
const ALLOWED: [(&str, &[&str]); 6] = [
    ("palpate-core", &[]),
    ("palpate", &["palpate-core"]),
    ("palpate-live", &["palpate-core", "palpate"]),
    ("palpate-cli", &["palpate-core", "palpate", "palpate-live"]),
    ("palpate-python", &["palpate"]),
    ("xtask", &[]),
];

/// A dependency that points the wrong way, and a crate that the table does not know.
pub fn findings(project: &Project) -> Vec<Finding> {
    project.crates.iter().flat_map(|krate| of_crate(project, krate)).collect()
}

fn of_crate(project: &Project, krate: &Crate) -> Vec<Finding> {
    let Some((_, allowed)) = ALLOWED.iter().find(|(name, _)| *name == krate.name) else {
        let message = format!(
            "crate {} is not in the table of xtask/src/tidy/crates.rs: say what it may use",
            krate.name
        );
        return vec![Finding::failure(&krate.manifest, 1, message)];
    };
    let is_ours = |name: &str| project.crates.iter().any(|other| other.name == name);
    let wrong = krate.dependencies.iter().filter(|name| is_ours(name) && !allowed.contains(&name.as_str()));
    wrong
        .map(|name| {
            let may =
                if allowed.is_empty() { "no crate of the workspace".into() } else { allowed.join(", ") };
            let message = format!("{} depends on {name}; it may use {may}", krate.name);
            Finding::failure(&krate.manifest, line_of(project, krate, name), message)
        })
        .collect()
}

fn line_of(project: &Project, krate: &Crate, dependency: &str) -> usize {
    let names =
        |line: &str| line.strip_prefix(dependency).is_some_and(|rest| rest.starts_with([' ', '=', '.']));
    let text = project.file(&krate.manifest).map(|file| file.text().into_owned()).unwrap_or_default();
    text.lines().position(names).map_or(1, |line| line + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn krate(name: &str, dependencies: &[&str]) -> Crate {
        Crate {
            name: name.into(),
            version: "0.1.0".into(),
            manifest: format!("crates/{name}/Cargo.toml"),
            roots: Vec::new(),
            dependencies: dependencies.iter().map(|&name| name.into()).collect(),
        }
    }

    #[test]
    fn a_dependency_that_points_back_is_found_at_its_line() {
        let mut project = Project::of(&[(
            "crates/palpate-core/Cargo.toml",
            "[dependencies]\nlibm = \"0.2\"\npalpate.workspace = true\n",
        )]);
        project.crates =
            vec![krate("palpate-core", &["libm", "palpate"]), krate("palpate", &["palpate-core"])];
        let expected = "palpate-core depends on palpate; it may use no crate of the workspace";
        assert_eq!(findings(&project), [Finding::failure("crates/palpate-core/Cargo.toml", 3, expected)]);
    }

    #[test]
    fn the_way_of_the_design_is_clean_and_an_unknown_crate_is_not() {
        let mut project = Project::of(&[]);
        project.crates = vec![
            krate("palpate-core", &["libm"]),
            krate("palpate", &["palpate-core", "serde"]),
            krate("palpate-live", &["palpate"]),
            krate("palpate-cli", &["palpate", "palpate-live"]),
            krate("xtask", &["clap"]),
        ];
        assert_eq!(findings(&project), []);
        project.crates.push(krate("palpate-extra", &[]));
        assert_eq!(findings(&project).len(), 1);
    }
}
