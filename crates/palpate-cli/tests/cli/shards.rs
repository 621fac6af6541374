//! `palpate study --shard` and `--merge` from outside: the files of a single machine, stopping and going on, and what is refused.

use crate::support::command::{complained, palpate, run, said};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Networks in lanes, networks of noisy sensors, and another estimator.
const SMALL: &str = r#"
name = "small"
seeds = 9

[surface]
kind = "beam"
length = "400 mm"
width = "40 mm"
thickness = "1.2 mm"
youngs_modulus = "200 GPa"

[sensors]
measure = "deflection"
count = 8
noise = "5 um"

[contact]
force = "3 N"

[training]
count = 10

[evaluation]
from = "20 mm"
to = "380 mm"
step = "40 mm"
readings = 2
portions = [["60 mm", "300 mm"]]

[[arm]]
name = "lanes"
sensors = { measure = "deflection", count = 8 }
estimator = { kind = "network", max_epochs = 200 }

[[arm]]
name = "noisy"
estimator = { kind = "network", max_epochs = 100 }

[[arm]]
name = "influence"
estimator = { kind = "influence" }
"#;

fn bench() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("small.toml"), SMALL).unwrap();
    folder
}

fn study(folder: &Path, arguments: &[&str]) -> String {
    said(&run(folder, &[&["study", "small.toml", "--threads", "1"], arguments].concat()))
}

fn complaint(folder: &Path, arguments: &[&str]) -> String {
    // As wide as the terminal is, so that lines are broken.
    let told = complained(&run(folder, &[&["study", "small.toml"], arguments].concat()), 2);
    told.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ")
}

/// Runs all shards; their folders.
fn shards(folder: &Path, of: u64) -> Vec<String> {
    let mut folders = Vec::new();
    for number in 1..=of {
        let out = format!("of-{of}/{number}");
        study(folder, &["--shard", &format!("{number}/{of}"), "--out", &out]);
        folders.push(out);
    }
    folders
}

fn merge(folder: &Path, shards: &[String], out: &str) -> String {
    let shards: Vec<&str> = shards.iter().map(String::as_str).collect();
    said(&run(folder, &[&["study", "small.toml", "--out", out, "--merge"], &shards[..]].concat()))
}

fn text(folder: &Path, path: &str) -> String {
    fs::read_to_string(folder.join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The results without what the run itself was.
fn results(folder: &Path, out: &str) -> Value {
    let mut results: Value = serde_json::from_str(&text(folder, &format!("{out}/results.json"))).unwrap();
    let facts = results.as_object_mut().unwrap();
    for of_the_run in ["shards", "threads", "presentations", "seconds", "presentations_per_second"] {
        facts.remove(of_the_run);
    }
    results
}

/// The report without its table of the run.
fn report(folder: &Path, out: &str) -> String {
    let page = text(folder, &format!("{out}/report.html"));
    let (before, after) = page.split_once("id=\"run\"").expect("a section about the run");
    let (_, after) = after.split_once("</table>").expect("its table");
    format!("{before}{after}")
}

#[test]
fn shards_make_the_files_of_a_single_machine() {
    let bench = bench();
    let folder = bench.path();
    study(folder, &["--out", "whole"]);
    let mut names: Vec<String> = fs::read_dir(folder.join("whole"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    for of in [1, 3, 16] {
        let out = format!("merged-{of}");
        let table = merge(folder, &shards(folder, of), &out);
        assert!(table.contains(&format!("in {of} shards of 1 threads")), "{table}");
        let mut merged: Vec<String> = fs::read_dir(folder.join(&out))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        merged.sort();
        assert_eq!(merged, names);
        for name in names.iter().filter(|name| *name != "results.json" && *name != "report.html") {
            let [whole, joined] = ["whole", &out].map(|folder| format!("{folder}/{name}"));
            let bytes = |path: &str| fs::read(folder.join(path)).unwrap();
            assert!(bytes(&whole) == bytes(&joined), "{name} of {of} shards");
        }
        assert_eq!(results(folder, &out), results(folder, "whole"));
        assert!(report(folder, &out) == report(folder, "whole"), "report of {of} shards");
    }
    assert!(names.contains(&"evaluations.csv".to_owned()), "{names:?}");
    // A run that goes on from them finds nothing to do.
    study(folder, &["--out", "merged-3", "--resume"]);
    assert_eq!(text(folder, "merged-3/networks.csv"), text(folder, "whole/networks.csv"));
}

#[test]
fn shard_identifies_itself() {
    let bench = bench();
    let folder = bench.path();
    let table = study(folder, &["--shard", "2/3", "--seeds", "2"]);
    assert!(table.starts_with("Shard 2/3 of 2 seeds: 2 fits in palpate-out/small/shard-2-of-3"), "{table}");
    let file: Value =
        serde_json::from_str(&text(folder, "palpate-out/small/shard-2-of-3/shard.json")).unwrap();
    assert_eq!((&file["shard"], &file["of"], &file["fits"]), (&2.into(), &3.into(), &2.into()));
    assert_eq!((&file["study"], &file["seeds"]), (&"small".into(), &2.into()));
    let networks = text(folder, "palpate-out/small/shard-2-of-3/networks.csv");
    assert!(networks.lines().next().unwrap().ends_with(", shard 2/3 of 2 seeds"), "{networks}");
}

#[test]
fn shards_that_do_not_make_a_study_are_refused() {
    let bench = bench();
    let folder = bench.path();
    let three = shards(folder, 3);
    let refused = |folders: &[&str]| complaint(folder, &[&["--out", "merged", "--merge"], folders].concat());
    let told = refused(&[&three[0], &three[2]]);
    assert!(told.contains("1 of 3 shards is missing: 2") && told.contains("--shard 2/3"), "{told}");
    let told = refused(&[&three[0], &three[1], &three[2], &three[1]]);
    assert!(told.contains("shard 2/3 is there twice: of-3/2 and of-3/2"), "{told}");
    study(folder, &["--shard", "2/4", "--out", "other"]);
    let told = refused(&[&three[0], "other"]);
    assert!(told.contains("other is shard 2/4 of 9 seeds, and of-3/1 is shard 1/3 of 9 seeds"), "{told}");
    study(folder, &["--seeds", "2", "--out", "whole"]);
    let told = refused(&["whole"]);
    assert!(told.contains("whole: networks.csv is of a whole study, not of a shard"), "{told}");
    fs::create_dir(folder.join("empty")).unwrap();
    for none in ["empty", "nowhere"] {
        let told = refused(&[none]);
        assert!(told.contains(&format!("{none}: networks.csv is missing")), "{told}");
    }

    // Of another study file.
    fs::write(folder.join("foreign.toml"), SMALL.replace("count = 10", "count = 11")).unwrap();
    said(&run(folder, &["study", "foreign.toml", "--shard", "2/3", "--out", "foreign"]));
    let told = refused(&[&three[0], "foreign", &three[2]]);
    assert!(told.contains("foreign: networks.csv: line 1 belongs to another run"), "{told}");

    // As a shard is left that was stopped, and by a crash between its last row and its end.
    let networks = text(folder, "of-3/1/networks.csv");
    let some: Vec<&str> = networks.lines().take(4).collect();
    fs::write(folder.join("of-3/1/networks.csv"), some.join("\n") + "\n").unwrap();
    let told = refused(&[&three[0], &three[1], &three[2]]);
    assert!(told.contains("of-3/1: shard 1/3 is not finished: it has 2 of its 9 fits"), "{told}");
    assert!(told.contains("--shard 1/3 --out of-3/1 --resume"), "{told}");
    fs::write(folder.join("of-3/1/networks.csv"), &networks).unwrap();
    let facts = text(folder, "of-3/1/shard.json");
    fs::remove_file(folder.join("of-3/1/shard.json")).unwrap();
    let told = refused(&[&three[0], &three[1], &three[2]]);
    assert!(told.contains("of-3/1: shard.json is missing"), "{told}");
    fs::write(folder.join("of-3/1/shard.json"), facts.replace("\"threads\": 1", "\"threads\": -1")).unwrap();
    let told = refused(&[&three[0], &three[1], &three[2]]);
    assert!(told.contains("of-3/1/shard.json: ") && told.contains("-1"), "{told}");
    fs::write(folder.join("of-3/1/shard.json"), &facts).unwrap();

    // A row with its place.
    fs::write(folder.join("of-3/1/networks.csv"), networks.replacen("capped", "tired", 1)).unwrap();
    let told = refused(&[&three[0], &three[1], &three[2]]);
    assert!(told.contains("of-3/1/networks.csv:") && told.contains("`tired` is not `converged`"), "{told}");
    assert!(!folder.join("merged").exists());
}

#[test]
fn outputs_of_shards_follow_the_rules_of_a_study() {
    let bench = bench();
    let folder = bench.path();
    let one = ["--shard", "1/2", "--seeds", "1", "--out", "one"];
    study(folder, &one);
    let before = text(folder, "one/networks.csv");
    let told = complaint(folder, &one);
    assert!(told.contains("one contains a finished shard") && told.contains("--resume"), "{told}");
    // Neither another shard nor the whole study goes on from it.
    for arguments in
        [&["--shard", "2/2", "--seeds", "1"][..], &["--shard", "1/2", "--seeds", "2"], &["--seeds", "1"]]
    {
        let told = complaint(folder, &[arguments, &["--out", "one", "--resume"]].concat());
        assert!(told.contains("line 1 belongs to another run"), "{told}");
    }
    assert_eq!(text(folder, "one/networks.csv"), before);
    study(folder, &[&one[..], &["--overwrite"]].concat());
    assert_eq!(text(folder, "one/networks.csv"), before);

    // Shards are not written over by what they are joined to.
    let two = ["--shard", "2/2", "--seeds", "1", "--out", "two"];
    study(folder, &two);
    let told = complaint(folder, &["--out", "one", "--merge", "one", "two"]);
    assert!(told.contains("this command reads it"), "{told}");
    let told = complaint(folder, &["--out", "one", "--overwrite", "--merge", "one", "two"]);
    assert!(told.contains("this command reads it"), "{told}");
    assert_eq!(text(folder, "one/networks.csv"), before);
    merge(folder, &["one".to_owned(), "two".to_owned()], "both");
    let told = complaint(folder, &["--out", "both", "--merge", "one", "two"]);
    assert!(told.contains("both contains the results of a finished run"), "{told}");
    assert!(told.contains("--overwrite") && !told.contains("--resume"), "{told}");
    said(&run(folder, &["study", "small.toml", "--out", "both", "--overwrite", "--merge", "one", "two"]));
    let told = complaint(folder, &["--shard", "1/2", "--out", "both", "--overwrite"]);
    assert!(told.contains("both contains a report, and a shard writes none"), "{told}");

    for (shard, why) in [("3/2", "from 1 to 2"), ("1/0", "from 1 to 1000000"), ("one", "it must be K/N")] {
        let told = complaint(folder, &["--shard", shard]);
        assert!(told.contains(why), "{told}");
    }
    for built_in in ["dead-areas", "elliott"] {
        for arguments in [["--shard", "1/2"], ["--merge", "one"]] {
            let told = complained(&run(folder, &[&["study", built_in][..], &arguments].concat()), 2);
            assert!(told.contains("is not run in shards"), "{told}");
        }
    }
}

#[test]
#[cfg(unix)]
fn a_stopped_shard_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let slow = SMALL.replace("max_epochs = 200", "max_epochs = 40000, aggregate_error = 1e-9");
    fs::write(folder.path().join("slow.toml"), slow).unwrap();
    let arguments = ["study", "slow.toml", "--seeds", "60", "--threads", "1", "--shard", "2/2", "--out"];
    said(&run(folder.path(), &[&arguments[..], &["whole"]].concat()));
    let networks = folder.path().join("parts/networks.csv");
    let child = palpate(folder.path())
        .args(arguments)
        .arg("parts")
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while fs::read_to_string(&networks).map_or(0, |text| text.lines().count()) < 6 {
        assert!(start.elapsed() < Duration::from_secs(60), "no networks after a minute");
        std::thread::sleep(Duration::from_millis(5));
    }
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{told}");
    assert!(told.contains("fits are in parts/networks.csv; --resume continues from them"), "{told}");
    assert!(!folder.path().join("parts/shard.json").exists());
    said(&run(folder.path(), &[&arguments[..], &["parts", "--resume"]].concat()));
    for name in ["networks.csv", "evaluations.csv"] {
        assert_eq!(
            text(folder.path(), &format!("parts/{name}")),
            text(folder.path(), &format!("whole/{name}"))
        );
    }
}
