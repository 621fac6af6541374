//! The commands of the README, in a folder that has nothing but the sample data.

use crate::support::board::set_force_linear;
use crate::support::command::{json, run, said};
use std::fs;
use std::path::Path;

const README: &str = include_str!("../../../../README.md");

/// Commands of the first `sh` block after a heading.
fn commands(heading: &str) -> Vec<Vec<&'static str>> {
    let (_, section) = README.split_once(&format!("\n## {heading}\n")).expect("the README has this section");
    let block = section.split("```sh\n").nth(1).and_then(|rest| rest.split("```").next());
    let lines = block.expect("the section has commands").lines();
    let command =
        |line: &'static str| line.strip_prefix("palpate ").map(|rest| rest.split_whitespace().collect());
    lines.filter_map(command).collect()
}

#[test]
fn three_commands_lead_from_the_sample_data_to_located_contacts() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("examples/data");
    fs::create_dir_all(&data).unwrap();
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    for name in ["strip-presses.csv", "strip-touches.csv"] {
        fs::copy(project.join("examples/data").join(name), data.join(name)).unwrap();
    }
    let commands = commands("The same with three commands");
    let [init, fit, locate] = commands.as_slice() else { panic!("{commands:?}") };
    said(&run(folder.path(), init));
    // The first tutorial has the same commands, whose fit chooses this structure too.
    set_force_linear(&folder.path().join("strip.toml"));
    said(&run(folder.path(), fit));
    let located = run(folder.path(), locate);
    said(&located);
    let table = String::from_utf8(located.stdout).unwrap();
    assert_eq!(table.lines().filter(|line| line.ends_with(",no_contact")).count(), 61, "{table}");
    assert!(table.lines().filter(|line| line.ends_with(",located")).count() >= 55, "{table}");

    let errors =
        json(folder.path(), &["evaluate", "strip.json", "--data", "examples/data/strip-touches.csv"]);
    let median_mm = errors["errors"][0]["error_mm"]["median"].as_f64().unwrap_or_else(|| panic!("{errors}"));
    assert!(README.contains(&format!("here {median_mm:.2} mm in the median")), "{median_mm}");
}
