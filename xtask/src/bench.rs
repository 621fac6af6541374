//! `cargo xtask bench`: the benchmarks, with stored and compared figures.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::run;

/// Variable with the file for the figures, a line of JSON each, by `palpate_testing::figure`.
const VARIABLE: &str = "PALPATE_FIGURES";
const FOLDER: &str = "target/bench";

/// Options of the chore.
#[derive(clap::Args)]
pub struct Arguments {
    /// Save the figures under a name, in target/bench/NAME.json
    #[arg(long, value_name = "NAME", value_parser = name)]
    save: Option<String>,
    /// Compare the figures with those saved under a name
    #[arg(long, value_name = "NAME", value_parser = name)]
    compare: Option<String>,
    /// Handed on to `cargo bench`, such as `-- --bench influence`
    #[arg(last = true)]
    for_cargo: Vec<String>,
}

fn name(text: &str) -> Result<String, String> {
    let is_name = !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c));
    if is_name {
        Ok(text.to_owned())
    } else {
        Err(format!("`{text}` must have letters, digits, `-`, `_` and `.` only"))
    }
}

type Figures = BTreeMap<String, (f64, String)>;

pub fn run(root: &Path, arguments: &Arguments) -> Result<bool> {
    // Read first: without it, minutes of benchmarks would be lost.
    let base = arguments.compare.as_ref().map(|name| read(&saved(root, name))).transpose()?;
    let folder = root.join(FOLDER);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let lines = folder.join("last.jsonl");
    fs::write(&lines, "").with_context(|| format!("cannot empty {}", lines.display()))?;
    let mut bench = Command::new("cargo");
    bench.args(["bench", "--workspace"]).args(&arguments.for_cargo);
    if !run::run_shown(bench.env(VARIABLE, &lines).current_dir(root))? {
        return Ok(false);
    }
    let figures = read(&lines)?;
    if let Some(name) = &arguments.save {
        let path = saved(root, name);
        fs::write(&path, json_lines(&figures)).with_context(|| format!("cannot write {}", path.display()))?;
        println!("{} figures saved in {}", figures.len(), path.display());
    }
    if let (Some(base), Some(name)) = (base, &arguments.compare) {
        print!("\n{}", table(name, &base, &figures));
    }
    Ok(true)
}

fn saved(root: &Path, name: &str) -> PathBuf {
    root.join(FOLDER).join(format!("{name}.json"))
}

fn read(path: &Path) -> Result<Figures> {
    let text = fs::read_to_string(path)
        .with_context(|| format!("cannot read {}; --save writes such a file", path.display()))?;
    text.lines().map(|line| figure(line).with_context(|| format!("{}: {line}", path.display()))).collect()
}

fn figure(line: &str) -> Result<(String, (f64, String))> {
    let value: Value = serde_json::from_str(line)?;
    match (value["name"].as_str(), value["median"].as_f64(), value["unit"].as_str()) {
        (Some(name), Some(median), Some(unit)) => Ok((name.to_owned(), (median, unit.to_owned()))),
        _ => bail!("a figure has `name`, `median` and `unit`"),
    }
}

fn json_lines(figures: &Figures) -> String {
    let line = |(name, (median, unit)): (&String, &(f64, String))| {
        format!("{}\n", serde_json::json!({"name": name, "median": median, "unit": unit}))
    };
    figures.iter().map(line).collect()
}

/// Includes figures of only one side.
fn table(name: &str, base: &Figures, figures: &Figures) -> String {
    let width = base
        .keys()
        .chain(figures.keys())
        .map(|name| name.chars().count())
        .max()
        .unwrap_or(0)
        .max("benchmark".len());
    let mut text = format!("{:<width$}  {:>12}  {:>12}  {:>7}\n", "benchmark", name, "median", "ratio");
    for (benchmark, (median, unit)) in figures {
        let _ = match base.get(benchmark) {
            Some((before, _)) => writeln!(
                text,
                "{benchmark:<width$}  {before:>12.4}  {median:>12.4}  {:>7.3}  {unit}",
                median / before
            ),
            None => writeln!(text, "{benchmark:<width$}  {:>12}  {median:>12.4}  {:>7}  {unit}", "–", "–"),
        };
    }
    for (benchmark, (before, unit)) in base.iter().filter(|(benchmark, _)| !figures.contains_key(*benchmark))
    {
        let _ = writeln!(text, "{benchmark:<width$}  {before:>12.4}  {:>12}  {:>7}  {unit}", "–", "–");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(figures: &[(&str, f64)]) -> Figures {
        figures.iter().map(|(name, median)| ((*name).to_owned(), (*median, "ns".to_owned()))).collect()
    }

    #[test]
    fn figures_are_read_as_they_are_saved() {
        let saved = figures(&[("a: \"b\"", 1.25), ("c", 3e9)]);
        let read: Result<Figures> = json_lines(&saved).lines().map(figure).collect();
        assert_eq!(read.unwrap(), saved);
        assert!(figure("{\"name\": \"a\", \"median\": \"1\", \"unit\": \"s\"}").is_err());
    }

    #[test]
    fn table_has_medians_ratios_and_missing_entries() {
        let table =
            table("base", &figures(&[("fit", 4.0), ("old", 1.0)]), &figures(&[("fit", 5.0), ("added", 2.0)]));
        let expected = "\
benchmark          base        median    ratio
added                 –        2.0000        –  ns
fit              4.0000        5.0000    1.250  ns
old              1.0000             –        –  ns
";
        assert_eq!(table, expected);
    }

    #[test]
    fn names_stay_in_their_folder() {
        assert!(name("base-1.2").is_ok());
        assert!(name("../base").is_err() && name("").is_err());
    }
}
