//! Files and crates of the project.

use std::borrow::Cow;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

/// Files that git tracks or would add, and crates of the workspace.
pub struct Project {
    /// In order of path.
    pub files: Vec<File>,
    pub crates: Vec<Crate>,
}

/// A file with a path from the root, separated by `/`.
pub struct File {
    pub path: String,
    pub bytes: Vec<u8>,
}

#[derive(Default)]
pub struct Crate {
    pub name: String,
    pub version: String,
    pub manifest: String,
    /// Root files of the library and the binaries.
    pub roots: Vec<String>,
    pub dependencies: Vec<String>,
}

impl Project {
    pub fn read(root: &Path) -> Result<Self> {
        let mut files = Vec::new();
        let listed = output(root, "git", &["ls-files", "-z", "--cached", "--others", "--exclude-standard"])?;
        for path in listed.split(|&byte| byte == 0).map(String::from_utf8_lossy) {
            let full = root.join(&*path);
            // A deleted file may still be in the index.
            if full.is_file() {
                let bytes = fs::read(&full).with_context(|| format!("cannot read {}", full.display()))?;
                files.push(File { path: path.into_owned(), bytes });
            }
        }
        files.sort_by(|one, other| one.path.cmp(&other.path));
        files.dedup_by(|one, other| one.path == other.path);
        let metadata = output(root, "cargo", &["metadata", "--format-version", "1", "--no-deps"])?;
        let metadata =
            serde_json::from_slice(&metadata).context("cannot read what `cargo metadata` printed")?;
        Ok(Self { files, crates: crates(&metadata) })
    }

    pub fn file(&self, path: &str) -> Option<&File> {
        self.files.iter().find(|file| file.path == path)
    }

    pub fn has(&self, path: &str) -> bool {
        let inside = |file: &File| file.path.strip_prefix(path).is_some_and(|rest| rest.starts_with('/'));
        path.is_empty() || self.file(path).is_some() || self.files.iter().any(inside)
    }
}

impl File {
    pub fn text(&self) -> Cow<'_, str> {
        String::from_utf8_lossy(&self.bytes)
    }

    /// The rules' own files must name the forbidden text.
    pub fn is_a_rule(&self) -> bool {
        self.path.starts_with("xtask/src/tidy/")
    }
}

fn output(root: &Path, program: &str, arguments: &[&str]) -> Result<Vec<u8>> {
    let output = Command::new(program).args(arguments).current_dir(root).output();
    let output = output.with_context(|| format!("cannot start {program}: is it on PATH?"))?;
    if !output.status.success() {
        bail!("{program} {} failed: {}", arguments.join(" "), String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(output.stdout)
}

fn crates(metadata: &Value) -> Vec<Crate> {
    let root = text(&metadata["workspace_root"]);
    let from_root =
        |path: &Value| text(path).strip_prefix(&root).unwrap_or_default().trim_start_matches('/').to_owned();
    let of = |package: &Value| Crate {
        name: text(&package["name"]),
        version: text(&package["version"]),
        manifest: from_root(&package["manifest_path"]),
        roots: list(&package["targets"])
            .filter(|target| is_shipped(target))
            .map(|it| from_root(&it["src_path"]))
            .collect(),
        dependencies: list(&package["dependencies"]).map(|dependency| text(&dependency["name"])).collect(),
    };
    list(&metadata["packages"]).map(of).collect()
}

fn is_shipped(target: &Value) -> bool {
    list(&target["kind"]).any(|kind| text(kind).ends_with("lib") || text(kind) == "bin")
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}

#[cfg(test)]
impl Project {
    pub fn from_files(files: &[(&str, &str)]) -> Self {
        let file = |&(path, text): &(&str, &str)| File { path: path.into(), bytes: text.into() };
        Self { files: files.iter().map(file).collect(), crates: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metadata_gives_names_roots_and_dependencies() {
        let metadata = serde_json::json!({
            "workspace_root": "/usr/w",
            "packages": [{
                "name": "palpate-cli", "version": "0.1.0", "manifest_path": "/usr/w/crates/palpate-cli/Cargo.toml",
                "targets": [
                    {"kind": ["bin"], "src_path": "/usr/w/crates/palpate-cli/src/main.rs"},
                    {"kind": ["test"], "src_path": "/usr/w/crates/palpate-cli/tests/browser.rs"},
                ],
                "dependencies": [{"name": "palpate"}],
            }],
        });
        let crates = crates(&metadata);
        assert_eq!(crates[0].manifest, "crates/palpate-cli/Cargo.toml");
        assert_eq!(crates[0].roots, ["crates/palpate-cli/src/main.rs"]);
        assert_eq!(crates[0].dependencies, ["palpate"]);
    }

    #[test]
    fn a_folder_of_a_file_is_there_and_a_beginning_of_a_name_is_not() {
        let project = Project::from_files(&[("docs/book/start.md", "")]);
        assert!(project.has("docs/book") && project.has("docs/book/start.md") && project.has(""));
        assert!(!project.has("docs/bo") && !project.has("other.md"));
    }
}
