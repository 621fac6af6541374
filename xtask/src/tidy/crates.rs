//! Rule: a crate of the workspace depends on those above it only.

use super::Finding;
use super::project::{Crate, Project};

/// From top to bottom.
const ORDER: [&str; 17] = [
    "palpate-core",
    "palpate-files",
    "palpate-numerics",
    "palpate-testing",
    "palpate-mechanics",
    "palpate-estimators",
    "palpate-design",
    "palpate-rig",
    "palpate-studies",
    "palpate-report",
    "palpate",
    "palpate-validation",
    "palpate-export",
    "palpate-live",
    "palpate-cli",
    "palpate-python",
    "xtask",
];

pub fn findings(project: &Project) -> Vec<Finding> {
    project.crates.iter().flat_map(|krate| of_crate(project, krate)).collect()
}

fn of_crate(project: &Project, krate: &Crate) -> Vec<Finding> {
    let place = |name: &str| ORDER.iter().position(|other| *other == name);
    let Some(own) = place(&krate.name) else {
        let message = format!(
            "crate {} is not in the table of xtask/src/tidy/crates.rs: list the crates that it may use",
            krate.name
        );
        return vec![Finding::new(&krate.manifest, 1, message)];
    };
    let below = krate.dependencies.iter().filter(|name| place(name).is_some_and(|other| other >= own));
    below
        .map(|name| {
            let message = format!(
                "{} depends on {name}; a crate uses those above it: {}",
                krate.name,
                ORDER.join(", ")
            );
            Finding::new(&krate.manifest, line_of(project, krate, name), message)
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
            manifest: format!("crates/{name}/Cargo.toml"),
            dependencies: dependencies.iter().map(|&name| name.into()).collect(),
            ..Crate::default()
        }
    }

    #[test]
    fn a_dependency_that_points_back_is_found_at_its_line() {
        let mut project = Project::from_files(&[(
            "crates/palpate-core/Cargo.toml",
            "[dependencies]\nlibm = \"0.2\"\npalpate.workspace = true\n",
        )]);
        project.crates =
            vec![krate("palpate-core", &["libm", "palpate"]), krate("palpate", &["palpate-core"])];
        let found = findings(&project);
        assert_eq!((found.len(), found[0].line), (1, 3));
        assert!(found[0].message.starts_with("palpate-core depends on palpate;"), "{}", found[0].message);
    }

    #[test]
    fn the_way_of_the_design_is_clean_and_an_unknown_crate_is_not() {
        let mut project = Project::from_files(&[]);
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
