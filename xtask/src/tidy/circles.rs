//! Rule: sibling files import each other without a circle, at every level of a crate's module tree.
//!
//! A child may use its parent's own items, and a parent its children. A name that the parent
//! imports from a child belongs to that child.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::Finding;
use super::project::{File, Project};
use crate::rust::{self, FileReferences, UsedPath};

type Name = Vec<String>;

/// Without modules of tests.
type Modules<'a> = BTreeMap<Name, Module<'a>>;

struct Module<'a> {
    file: &'a File,
    uses: Vec<UsedPath>,
}

struct Import<'a> {
    file: &'a File,
    line: usize,
    item: String,
}

/// By importing and by imported child of one module.
type Siblings<'a> = BTreeMap<String, BTreeMap<String, Vec<Import<'a>>>>;

/// Returns a shortest circle through each file that is in one.
pub fn findings(project: &Project) -> Vec<Finding> {
    let mut found = Vec::new();
    for root in project.crates.iter().flat_map(|krate| &krate.roots) {
        let modules = match modules(project, root) {
            Ok(modules) => modules,
            Err(unreadable) => {
                found.push(unreadable);
                continue;
            }
        };
        let source = root.rsplit_once('/').map_or("", |(folder, _)| folder);
        for siblings in by_level(&modules).values() {
            found.extend(circles(siblings).iter().map(|circle| finding(source, siblings, circle)));
        }
    }
    found
}

fn modules<'a>(project: &'a Project, root: &str) -> Result<Modules<'a>, Finding> {
    let mut modules = Modules::new();
    let folder = root.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut open = Vec::from_iter(project.file(root).map(|file| (Name::new(), folder.to_owned(), file)));
    while let Some((name, folder, file)) = open.pop() {
        let parsed = rust::parse(&file.text())
            .map_err(|error| Finding::new(&file.path, 1, format!("cannot read this file: {error}")))?;
        let FileReferences { paths, modules: declared } = FileReferences::of(&parsed);
        for child in declared {
            let inside = format!("{folder}/{child}");
            let files = [format!("{inside}.rs"), format!("{inside}/mod.rs")];
            if let Some(file) = files.iter().find_map(|path| project.file(path)) {
                open.push(([name.as_slice(), &[child]].concat(), inside, file));
            }
        }
        modules.insert(name, Module { file, uses: paths });
    }
    Ok(modules)
}

fn by_level<'a>(modules: &Modules<'a>) -> BTreeMap<Name, Siblings<'a>> {
    let mut levels = BTreeMap::<Name, Siblings>::new();
    for (from, Module { file, uses }) in modules {
        for path in uses {
            let Some((to, rest)) = resolve(modules, from, &path.segments) else { continue };
            let common = from.iter().zip(&to).take_while(|(one, other)| one == other).count();
            if let (Some(importing), Some(imported)) = (from.get(common), to.get(common)) {
                let item = rest.first().or(to.last()).cloned().unwrap_or_default();
                let siblings = levels.entry(from[..common].to_vec()).or_default();
                let imports =
                    siblings.entry(importing.clone()).or_default().entry(imported.clone()).or_default();
                imports.push(Import { file, line: path.line, item });
            }
        }
    }
    levels
}

/// Returns a module and the rest of the path; `None` outside the crate.
fn resolve<'p>(modules: &Modules, from: &[String], path: &'p [String]) -> Option<(Name, &'p [String])> {
    let (mut module, mut rest) = descend(modules, from, path)?;
    while let Some((origin, is_module)) = rest.first().and_then(|name| origin(modules, &module, name)) {
        rest = &rest[usize::from(is_module)..];
        (module, rest) = walk(modules, origin, rest);
    }
    Some((module, rest))
}

/// Resolves a path literally, as if every name were defined there.
fn descend<'p>(modules: &Modules, from: &[String], path: &'p [String]) -> Option<(Name, &'p [String])> {
    let up = path.iter().take_while(|segment| *segment == "super").count();
    let (start, rest) = match path.first()?.as_str() {
        "crate" => (Name::new(), &path[1..]),
        "self" => (from.to_vec(), &path[1..]),
        "super" => (from[..from.len().checked_sub(up)?].to_vec(), &path[up..]),
        first => (child(modules, from, first)?, &path[1..]),
    };
    Some(walk(modules, start, rest))
}

fn walk<'p>(modules: &Modules, mut module: Name, mut path: &'p [String]) -> (Name, &'p [String]) {
    while let Some(child) = path.first().and_then(|name| child(modules, &module, name)) {
        (module, path) = (child, &path[1..]);
    }
    (module, path)
}

fn child(modules: &Modules, parent: &[String], name: &str) -> Option<Name> {
    let child = [parent, &[name.to_owned()]].concat();
    modules.contains_key(&child).then_some(child)
}

/// Returns the descendant that a name is imported from, and true if it defines the name.
fn origin(modules: &Modules, module: &Name, name: &str) -> Option<(Name, bool)> {
    let mut imports = modules[module].uses.iter().filter(|path| path.imported.as_deref() == Some(name));
    imports.find_map(|path| {
        let (origin, rest) = descend(modules, module, &path.segments)?;
        (origin.len() > module.len() && origin.starts_with(module)).then_some((origin, rest.is_empty()))
    })
}

fn circles(siblings: &Siblings) -> BTreeSet<Vec<String>> {
    siblings.keys().filter_map(|start| circle(siblings, start)).collect()
}

/// The circle begins with the first name in order.
fn circle(siblings: &Siblings, start: &str) -> Option<Vec<String>> {
    let mut seen = BTreeSet::new();
    let mut open = VecDeque::from([vec![start.to_owned()]]);
    while let Some(way) = open.pop_front() {
        for next in siblings.get(way.last()?).into_iter().flat_map(BTreeMap::keys) {
            if next == start {
                let first = way.iter().enumerate().min_by_key(|(_, name)| *name).map_or(0, |(at, _)| at);
                return Some([&way[first..], &way[..first]].concat());
            }
            if seen.insert(next) {
                open.push_back([way.as_slice(), std::slice::from_ref(next)].concat());
            }
        }
    }
    None
}

fn finding(source: &str, siblings: &Siblings, circle: &[String]) -> Finding {
    let next = circle.iter().cycle().skip(1);
    let steps: Vec<_> = circle.iter().zip(next).map(|(from, to)| (from, to, &siblings[from][to])).collect();
    let place = |import: &Import| {
        let file = import.file.path.strip_prefix(source).unwrap_or_default().trim_start_matches('/');
        format!("{} at {file}:{}", import.item, import.line)
    };
    let step = |&(from, to, imports): &(&String, &String, &Vec<Import>)| {
        let items = imports.iter().map(place).collect::<Vec<_>>().join(", ");
        format!("{from} imports from {to} ({items})")
    };
    let first = &steps[0].2[0];
    let message = steps.iter().map(step).collect::<Vec<_>>().join("; ");
    Finding::new(&first.file.path, first.line, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tidy::project::Crate;

    fn messages(files: &[(&str, &str)]) -> Vec<String> {
        let paths: Vec<String> = files.iter().map(|(path, _)| format!("crates/a/src/{path}")).collect();
        let files: Vec<_> = paths.iter().zip(files).map(|(path, (_, text))| (path.as_str(), *text)).collect();
        let mut project = Project::from_files(&files);
        project.crates.push(Crate { roots: vec!["crates/a/src/lib.rs".into()], ..Crate::default() });
        findings(&project).into_iter().map(|found| format!("{}: {}", found.line, found.message)).collect()
    }

    #[test]
    fn files_that_import_from_each_other_are_named_with_what_they_import() {
        let found = messages(&[
            ("lib.rs", "mod beam;\nmod plate;"),
            ("beam.rs", "\nuse crate::plate::{Plate, Mesh};"),
            ("plate.rs", "fn f() { super::beam::bend() }"),
        ]);
        let expected = "2: beam imports from plate (Plate at beam.rs:2, Mesh at beam.rs:2); \
                        plate imports from beam (bend at plate.rs:1)";
        assert_eq!(found, [expected]);
    }

    #[test]
    fn a_circle_below_the_root_and_of_folders_is_found() {
        let found = messages(&[
            ("lib.rs", "mod network;"),
            ("network/mod.rs", "mod config; mod lanes; mod train;"),
            ("network/config.rs", "use super::train;"),
            ("network/train.rs", "use super::lanes::kernel::Kernel as K;"),
            ("network/lanes.rs", "pub mod kernel;"),
            ("network/lanes/kernel.rs", "use super::super::config::Config;"),
        ]);
        let expected = "1: config imports from train (train at network/config.rs:1); \
                        train imports from lanes (Kernel at network/train.rs:1); \
                        lanes imports from config (Config at network/lanes/kernel.rs:1)";
        assert_eq!(found, [expected]);
    }

    #[test]
    fn a_name_that_the_parent_imports_belongs_to_the_child_that_defines_it() {
        let files = [
            ("lib.rs", "mod a; mod b; pub use a::deep::{Deep as D, inner};"),
            ("a/mod.rs", "pub mod deep; use crate::b::B;"),
            ("a/deep.rs", "pub mod inner;"),
            ("a/deep/inner.rs", ""),
        ];
        for user in ["use crate::D;", "use crate::inner::f;"] {
            assert_eq!(messages(&[&files[..], &[("b.rs", user)]].concat()).len(), 1, "{user}");
        }
    }

    #[test]
    fn parents_children_tests_and_other_crates_are_clean() {
        let found = messages(&[
            ("lib.rs", "mod a; mod b; pub use a::A; struct Own;"),
            ("a.rs", "mod child; use crate::Own; use b::other; use child::C;"),
            ("a/child.rs", "use super::A;"),
            ("b.rs", "use crate::A; // crate::a\n#[cfg(test)]\nmod tests;"),
            ("b/tests.rs", "use super::super::a::A;"),
            ("c.rs", "use super::super::super::a; use crate::b;"),
        ]);
        assert_eq!(found, [] as [&str; 0]);
    }
}
