//! The commands of docs/tutorials, one after the other, in a folder that has nothing but the examples.

use std::fs;
use std::path::Path;

use crate::support::command::{run, said};

/// Blocks of a page in one language, in their order, with the text before each.
fn blocks<'a>(page: &'a str, language: &'a str) -> impl Iterator<Item = (&'a str, &'a str)> {
    let opening = format!("```{language}\n");
    let mut rest = page;
    std::iter::from_fn(move || {
        let (before, from) = rest.split_once(&opening)?;
        let (block, after) = from.split_once("```")?;
        rest = after;
        Some((before, block))
    })
}

/// Words of a command line, of which some are in quotes, without its comment.
pub fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (i, part) in line.split('"').enumerate() {
        if i % 2 == 1 {
            words.push(part.to_owned());
        } else {
            let part = part.split(" #").next().unwrap_or_default();
            words.extend(part.split_whitespace().map(str::to_owned));
        }
    }
    words
}

/// Runs every `sh` block of a tutorial, after saving its `toml` blocks under the name before them; stdout of each command.
fn run_tutorial(name: &str) -> Vec<String> {
    let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = fs::read_to_string(project.join("docs/tutorials").join(name)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    copy(&project.join("examples"), &folder.path().join("examples"));
    for (before, block) in blocks(&page, "toml") {
        let (_, after) = before.rsplit_once("Save it as `").expect("a TOML block is saved as a file");
        let name = after.split('`').next().unwrap();
        fs::write(folder.path().join(name), block).unwrap();
    }
    let mut outputs = Vec::new();
    for (_, block) in blocks(&page, "sh") {
        for line in block.lines() {
            let words = words(line);
            assert_eq!(words[0], "palpate", "{line}");
            let arguments: Vec<&str> = words[1..].iter().map(String::as_str).collect();
            outputs.push(said(&run(folder.path(), &arguments)));
        }
    }
    outputs
}

/// Copies the files of a folder and of the folders in it.
pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let copied = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &copied);
        } else {
            fs::copy(&path, &copied).unwrap();
        }
    }
}

/// The number after `label` in a table's row.
fn figure(table: &str, label: &str, column: usize) -> f64 {
    let row =
        table.lines().find(|line| line.starts_with(label)).unwrap_or_else(|| panic!("{label}: {table}"));
    let rest = row[label.len()..].split_whitespace().filter(|word| !word.starts_with('('));
    rest.clone().nth(column).unwrap_or_else(|| panic!("{row}")).replace(',', "").parse().unwrap()
}

#[test]
fn first_contact_ends_with_an_error_below_a_millimetre() {
    let outputs = run_tutorial("first-contact.md");
    let [_, _, inspected, located, evaluated] = outputs.as_slice() else { panic!("{}", outputs.len()) };
    assert!(inspected.contains("gauge_1"), "{inspected}");
    assert!(located.lines().filter(|line| line.ends_with(",located")).count() >= 55, "{located}");
    assert!(figure(evaluated, "whole surface", 2) < 1.0, "{evaluated}");
}

#[test]
fn own_board_is_calibrated_by_a_rig_of_the_tutorial() {
    let outputs = run_tutorial("your-own-board.md");
    let [_, fitted, inspected, limit, located, evaluated] = outputs.as_slice() else {
        panic!("{}", outputs.len())
    };
    assert!(fitted.contains("force-linear") && fitted.contains("places held out"), "{fitted}");
    assert!(inspected.contains("gauge_6"), "{inspected}");
    assert!(limit.contains("mean error at the limit"), "{limit}");
    assert!(located.lines().filter(|line| line.ends_with(",located")).count() >= 55, "{located}");
    assert!(figure(evaluated, "whole surface", 2) < 1.0, "{evaluated}");
}

#[test]
fn designed_sensors_have_a_smaller_limit_and_reach_it() {
    let outputs = run_tutorial("design-a-sensor.md");
    let [_, limit, designed, _, _, _, _, evaluated] = outputs.as_slice() else { panic!("{}", outputs.len()) };
    assert_eq!(figure(limit, "20 mm", 1), 20.646, "{limit}");
    assert!(figure(designed, "refined", 1) < 0.85 * figure(designed, "even", 1), "{designed}");
    assert!((0.15..0.3).contains(&figure(evaluated, "20–380 mm", 1)), "{evaluated}");
}

#[test]
fn moving_contact_is_tracked_more_accurately_than_single_readings() {
    let outputs = run_tutorial("moving-contact.md");
    assert_eq!(outputs.len(), 4);
    let tracked = outputs.last().unwrap();
    assert!(tracked.starts_with("line,time_s,position_mm,speed_m_per_s,force_n"), "{tracked:.200}");
    assert!(tracked.lines().count() > 4000, "{}", tracked.lines().count());
}

#[test]
fn founding_paper_is_worse_near_the_supports_than_in_the_middle() {
    let outputs = run_tutorial("founding-paper.md");
    let [_, evaluated, compared] = outputs.as_slice() else { panic!("{}", outputs.len()) };
    assert!(figure(evaluated, "60–300 mm", 1) < 2.0, "{evaluated}");
    assert!(figure(evaluated, "whole surface", 1) > 5.0, "{evaluated}");
    assert!(compared.contains("influence"), "{compared}");
}
