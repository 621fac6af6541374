//! Inside `crates/palpate`, a module uses those above it, and methods meet only in `estimator`.

use super::Finding;
use super::project::{File, Project};
use super::rust_text::RustText;
use super::used_paths::used_paths;

const SOURCE: &str = "crates/palpate/src/";

/// Top to bottom: a module may use those above it.
const ORDER: [&str; 29] = [
    "units",
    "numerics",
    "regression",
    "contact",
    "sensing",
    "mechanics",
    "recording",
    "bench",
    "arrangement",
    "method",
    "features",
    "network",
    "influence",
    "gaussian_process",
    "closed_form",
    "digit",
    "neighbours",
    "centroid",
    "tracking",
    "distribution",
    "estimator",
    "rig",
    "simulate",
    "limit",
    "design",
    "evaluation",
    "study",
    "report",
    "export",
];

/// The ways to interpret readings. The estimator knows them; they do not know each other.
const METHODS: [&str; 9] = [
    "network",
    "influence",
    "gaussian_process",
    "closed_form",
    "digit",
    "neighbours",
    "centroid",
    "tracking",
    "distribution",
];

/// Modules that treat every locator alike, so they see methods through `estimator` only.
const BLIND_TO_METHODS: [&str; 2] = ["evaluation", "report"];

/// A module that uses one it may not, and a module that the table does not know.
pub fn findings(project: &Project) -> Vec<Finding> {
    let source = project.rust().filter(|file| !file.is_test());
    source.flat_map(|file| of_file(project, file)).collect()
}

fn of_file(project: &Project, file: &File) -> Vec<Finding> {
    let Some(from) = module_of(file) else { return Vec::new() };
    if !ORDER.contains(&from) {
        let message =
            format!("module {from} is not in the table of xtask/src/tidy/modules.rs: say what it may use");
        return vec![Finding::failure(&file.path, 1, message)];
    }
    let depth = depth_of(file);
    let mut found = Vec::new();
    for path in used_paths(&RustText::of(&file.text()).code_without_tests()) {
        let Some(to) = from_crate(&path.segments, depth) else { continue };
        let message = if to.starts_with(char::is_uppercase) || to == "*" {
            Some(format!("crate::{to} goes through the crate's root: name the module that defines it"))
        } else if is_module(project, to) {
            why_not(from, to)
        } else {
            None
        };
        found.extend(message.map(|message| Finding::failure(&file.path, path.line, message)));
    }
    found
}

/// Why module `from` may not use module `to`.
fn why_not(from: &str, to: &str) -> Option<String> {
    let place = |module| ORDER.iter().position(|name| *name == module);
    let (from_is_method, to_is_method) = (METHODS.contains(&from), METHODS.contains(&to));
    if from == to || (from == "estimator" && to_is_method) {
        None
    } else if from_is_method && to_is_method {
        Some(format!("{from} uses {to}: methods do not know each other; they meet in estimator"))
    } else if BLIND_TO_METHODS.contains(&from) && to_is_method {
        Some(format!("{from} uses {to}: it treats every locator alike, through estimator"))
    } else if place(to) < place(from) {
        None
    } else {
        Some(format!("{from} uses {to}: a module uses those above it, and {to} is below"))
    }
}

/// The top-level module that a file of the library belongs to; none for the crate's root.
fn module_of(file: &File) -> Option<&str> {
    let inside = file.path.strip_prefix(SOURCE)?;
    let module = inside.split('/').next()?.trim_end_matches(".rs");
    (module != "lib").then_some(module)
}

/// How many modules a file lies below the crate's root.
fn depth_of(file: &File) -> usize {
    let inside = file.path.strip_prefix(SOURCE).unwrap_or_default();
    inside.split('/').filter(|part| *part != "mod.rs").count()
}

/// The segment after the crate's root: `crate::x`, or as many `super`s as the file lies deep.
fn from_crate(segments: &[String], depth: usize) -> Option<&str> {
    let supers = segments.iter().take_while(|segment| *segment == "super").count();
    match segments.first()?.as_str() {
        "crate" => segments.get(1),
        "super" if supers >= depth => segments.get(supers),
        _ => None,
    }
    .map(String::as_str)
}

/// Whether a name is a module of the crate's root, and not a macro or a function that lives there.
fn is_module(project: &Project, name: &str) -> bool {
    ORDER.contains(&name)
        || project.file(&format!("{SOURCE}{name}.rs")).is_some()
        || project.has(&format!("{SOURCE}{name}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(path: &str, text: &str) -> Vec<String> {
        let found = findings(&Project::of(&[(path, text)]));
        found.into_iter().map(|finding| format!("{}: {}", finding.line, finding.message)).collect()
    }

    #[test]
    fn methods_do_not_know_each_other() {
        let found = messages(
            "crates/palpate/src/network/train.rs",
            "use crate::units;\nuse crate::{influence::Spline, bench};",
        );
        assert_eq!(
            found,
            ["2: network uses influence: methods do not know each other; they meet in estimator"]
        );
    }

    #[test]
    fn mechanics_knows_nothing_of_recordings_or_estimators() {
        let found = messages(
            "crates/palpate/src/mechanics/beam.rs",
            "fn f(r: &crate::recording::Recording) {}\nuse super::super::estimator::Fit;",
        );
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].starts_with("1: mechanics uses recording"), "{found:?}");
        assert!(found[1].starts_with("2: mechanics uses estimator"), "{found:?}");
    }

    #[test]
    fn the_estimator_knows_the_methods_and_they_do_not_know_it() {
        assert!(messages("crates/palpate/src/estimator/mod.rs", "use crate::network::Network;").is_empty());
        assert_eq!(messages("crates/palpate/src/network.rs", "use crate::estimator::Fit;").len(), 1);
        assert_eq!(messages("crates/palpate/src/evaluation.rs", "use crate::network::Network;").len(), 1);
    }

    #[test]
    fn own_parts_tests_prose_and_the_root_are_clean() {
        let text = "use super::layout;\nuse crate::sensing::noise;\n// crate::report\n#[cfg(test)]\nmod tests { use crate::study; }";
        assert!(messages("crates/palpate/src/sensing/gain.rs", text).is_empty());
        assert!(messages("crates/palpate/src/network/tests/xor.rs", "use crate::influence;").is_empty());
        assert!(messages("crates/palpate/src/lib.rs", "pub use crate::report::Report;").is_empty());
        assert!(messages("crates/palpate-cli/src/main.rs", "use crate::report;").is_empty());
    }

    #[test]
    fn a_way_round_the_rule_and_an_unknown_module_are_found() {
        assert_eq!(messages("crates/palpate/src/units.rs", "use crate::Rig;").len(), 1);
        assert_eq!(messages("crates/palpate/src/units.rs", "use super::rig::Rig;").len(), 1);
        assert!(messages("crates/palpate/src/gadgets/mod.rs", "")[0].contains("not in the table"));
        assert!(messages("crates/palpate/src/units.rs", "crate::some_macro!()").is_empty());
    }
}
