//! Files of an experiment in Markdown and JSON.

use crate::experiment::{Experiment, Progress, Size};
use crate::machine::Machine;
use crate::table::Table;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::Path;

/// Figures of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name.
    pub experiment: String,
    /// Title.
    pub title: String,
    /// Method, in two sentences.
    pub method: String,
    /// Command to reproduce it.
    pub command: String,
    /// Version.
    pub palpate: String,
    /// Smallest seed.
    pub seed: u64,
    /// Repetitions.
    pub size: Size,
    /// Machine of the run.
    pub machine: Machine,
    /// Tables.
    pub tables: Vec<Table>,
}

impl Report {
    /// Runs an experiment.
    ///
    /// # Errors
    /// A bench that cannot be simulated or fitted.
    pub fn run(experiment: &Experiment, size: Size, progress: Progress) -> Result<Self> {
        let Experiment { name, title, method, seed, run } = *experiment;
        let tables = run(size, progress).with_context(|| format!("experiment `{name}`"))?;
        let command = format!("cargo xtask validate {name}{}", size.pick("", " --quick"));
        let palpate = env!("CARGO_PKG_VERSION").to_owned();
        let [experiment, title, method] = [name, title, method].map(str::to_owned);
        Ok(Self { experiment, title, method, command, palpate, seed, size, machine: Machine::this(), tables })
    }

    /// Text in Markdown.
    pub fn markdown(&self) -> String {
        let Self { title, method, command, palpate, seed, machine, .. } = self;
        let tables: Vec<String> = self.tables.iter().map(Table::markdown).collect();
        format!(
            "# {title}\n\n{method}\n\n`{command}`: palpate {palpate}, seeds from {seed} on; {machine}. [How to read a table](README.md#how-to-read-a-table).\n\n{}",
            tables.join("\n")
        )
    }

    /// Writes NAME.md and NAME.json, and makes the folder.
    ///
    /// # Errors
    /// Unwritable folder or file.
    pub fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        let json = serde_json::to_string_pretty(self).context("cannot write the figures as JSON")?;
        write_file(folder, &format!("{}.md", self.experiment), &self.markdown())?;
        write_file(folder, &format!("{}.json", self.experiment), &(json + "\n"))
    }

    /// Reads a stored report.
    ///
    /// # Errors
    /// Missing file, or other keys.
    pub fn read(folder: &Path, name: &str) -> Result<Self> {
        let path = folder.join(format!("{name}.json"));
        let text = std::fs::read_to_string(&path).with_context(|| {
            format!("cannot read {}: `cargo xtask validate {name}` writes it", path.display())
        })?;
        serde_json::from_str(&text).with_context(|| format!("cannot read {}", path.display()))
    }

    #[cfg(test)]
    pub(crate) fn for_test(name: &str, size: Size, tables: Vec<Table>) -> Self {
        let [experiment, title, method, command, palpate] =
            [name, "Title", "Method.", "command", "0"].map(str::to_owned);
        let machine = Machine { cores: 2, processor: "CPU".to_owned() };
        Self { experiment, title, method, command, palpate, seed: 0, size, machine, tables }
    }
}

/// Writes a temporary file, then renames it.
fn write_file(folder: &Path, name: &str, text: &str) -> Result<()> {
    let path = folder.join(name);
    let cannot = || format!("cannot write {}", path.display());
    let mut file = tempfile::NamedTempFile::new_in(folder).with_context(cannot)?;
    file.write_all(text.as_bytes()).with_context(cannot)?;
    make_readable(file.as_file()).with_context(cannot)?;
    file.persist(&path).with_context(cannot)?;
    Ok(())
}

/// Gives a temporary file the permissions of others.
#[cfg(unix)]
fn make_readable(file: &std::fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_: &std::fs::File) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::EXPERIMENTS;
    use crate::table::{Column, Figure, Goal, Row};

    #[test]
    fn files_round_trip() {
        let mut table = Table::new("Contacts.", &["place"], vec![Column::percent("covered", Goal::COVERAGE)]);
        let figure = Figure { value: 95.123_456_789, standard_error: Some(0.1 + 0.2) };
        table.rows.push(Row::new(&["3 mm"], vec![Some(figure)]));
        let report = Report::for_test("strip", Size::Quick, vec![table]);
        let folder = tempfile::tempdir().unwrap();
        report.write(folder.path()).unwrap();
        assert_eq!(Report::read(folder.path(), "strip").unwrap(), report);
        let markdown = std::fs::read_to_string(folder.path().join("strip.md")).unwrap();
        assert!(
            markdown
                .starts_with("# Title\n\nMethod.\n\n`command`: palpate 0, seeds from 0 on; 2 cores, CPU.")
        );
        let missing = Report::read(folder.path(), "plate").unwrap_err().to_string();
        assert!(missing.ends_with("`cargo xtask validate plate` writes it"), "{missing}");
    }

    /// The Markdown of docs/validation is that of its JSON, every file is of an experiment, and README.md lists all experiments.
    #[test]
    fn stored_tables_are_those_of_their_figures() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/validation");
        let readme = std::fs::read_to_string(folder.join("README.md")).unwrap();
        // README.md and speeds.md.
        let mut files = 2;
        for Experiment { name, title, method, .. } in EXPERIMENTS {
            assert!(readme.contains(&format!("| `{name}` | ")), "README.md does not list {name}");
            if !folder.join(format!("{name}.json")).exists() {
                continue;
            }
            let report = Report::read(&folder, name).unwrap();
            assert_eq!((report.title.as_str(), report.method.as_str()), (*title, *method));
            let markdown = std::fs::read_to_string(folder.join(format!("{name}.md"))).unwrap();
            assert_eq!(markdown, report.markdown(), "{name}.md");
            assert_eq!(report.size, Size::Full, "{name}.json");
            files += 2;
        }
        let is_file = |entry: &std::io::Result<std::fs::DirEntry>| entry.as_ref().unwrap().path().is_file();
        let found = std::fs::read_dir(folder).unwrap().filter(is_file).count();
        assert_eq!(found, files, "a file is of no experiment");
    }
}
