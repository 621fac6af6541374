//! `unsafe` only where SIMD needs it: in files under a folder `lanes`, and in no crate but `palpate`.

use super::Finding;
use super::project::{File, Project};
use super::rust_text::RustText;
use super::used_paths::words;

/// The one crate that may hold unsafe code.
const EXCEPTED: &str = "palpate";

/// `unsafe` elsewhere, and a crate that does not forbid it.
pub fn findings(project: &Project) -> Vec<Finding> {
    let outside = project.rust().filter(|file| !file.path.contains("/lanes/")).flat_map(uses);
    outside.chain(permissive_roots(project)).collect()
}

fn uses(file: &File) -> Vec<Finding> {
    let code = RustText::of(&file.text()).code;
    let found = words(&code).filter(|(_, word)| word == "unsafe");
    let message = "unsafe outside a folder `lanes`: SIMD belongs there, the rest does without";
    found.map(|(line, _)| Finding::failure(&file.path, line, message)).collect()
}

fn permissive_roots(project: &Project) -> impl Iterator<Item = Finding> {
    let roots = project.crates.iter().filter(|krate| krate.name != EXCEPTED).flat_map(|krate| &krate.roots);
    let permissive = roots.filter(|root| {
        let code = project.file(root).map(|file| RustText::of(&file.text()).code).unwrap_or_default();
        !code.contains("#![forbid(unsafe_code)]")
    });
    permissive.map(|root| Finding::failure(root, 1, "the crate's root lacks #![forbid(unsafe_code)]"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::project::Crate;

    fn with_root(name: &str, text: &str) -> Project {
        let root = format!("crates/{name}/src/lib.rs");
        let mut project = Project::of(&[(&root, text)]);
        project.crates.push(Crate {
            name: name.into(),
            version: String::new(),
            manifest: String::new(),
            roots: vec![root],
            dependencies: Vec::new(),
        });
        project
    }

    #[test]
    fn unsafe_code_is_found_outside_lanes_only() {
        let text = "// unsafe\nlet a = \"unsafe\";\nunsafe { b() }";
        let found = findings(&Project::of(&[
            ("crates/palpate/src/rig.rs", text),
            ("crates/palpate/src/network/lanes/avx2.rs", text),
        ]));
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].path.as_str(), found[0].line), ("crates/palpate/src/rig.rs", 3));
    }

    #[test]
    fn every_crate_but_one_forbids_unsafe_code() {
        assert_eq!(findings(&with_root("palpate-core", "//! Core.\n// #![forbid(unsafe_code)]")).len(), 1);
        assert_eq!(findings(&with_root("palpate-core", "//! Core.\n#![forbid(unsafe_code)]")), []);
        assert_eq!(findings(&with_root("palpate", "//! Library.")), []);
    }
}
