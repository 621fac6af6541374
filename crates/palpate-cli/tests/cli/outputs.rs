//! Targets that are refused (inputs, devices, pipes, folders, finished results), and links, which are followed.

use crate::support::command::{complained, folder, palpate, run, said};
use crate::support::examples::{
    LOAD_PROFILE, NOISY_BEAM, PAPER_STUDY, SENSOR_KINDS_STUDY, TRAINING_POSITIONS,
};
use crate::support::toml::Toml;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A folder with a rig, a recording of it, and a locator.
fn bench() -> TempDir {
    let folder = folder(Toml::parse(NOISY_BEAM).estimator("neighbours"));
    said(&run(folder.path(), &["simulate", "rig.toml", "-o", "presses.csv"]));
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    folder
}

fn text(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

/// Runs a command that must leave a file as it is, and say why.
fn kept(folder: &Path, arguments: &[&str], name: &str, why: &str) {
    let before = fs::read(folder.join(name)).unwrap();
    let complaint = complained(&run(folder, arguments), 2);
    assert!(complaint.contains(why), "{arguments:?}: {complaint}");
    assert_eq!(fs::read(folder.join(name)).unwrap(), before, "{arguments:?}");
}

#[test]
fn inputs_are_not_written_over() {
    let bench = bench();
    let folder = bench.path();
    fs::write(folder.join("load.toml"), LOAD_PROFILE).unwrap();
    fs::write(folder.join("positions.toml"), TRAINING_POSITIONS).unwrap();
    fs::write(folder.join("table.csv"), "x,a\n0,1\n10,2\n20,3\n").unwrap();
    let why = "this command reads it";
    kept(folder, &["fit", "rig.toml", "--data", "presses.csv", "-o", "presses.csv"], "presses.csv", why);
    kept(folder, &["fit", "rig.toml", "-o", "./rig.toml"], "rig.toml", why);
    kept(folder, &["simulate", "rig.toml", "-o", "rig.toml"], "rig.toml", why);
    kept(folder, &["simulate", "rig.toml", "--moving", "-o", "rig.toml"], "rig.toml", why);
    kept(folder, &["init", "table.csv", "-o", "table.csv", "--overwrite"], "table.csv", why);
    kept(folder, &["design", "sensors", "rig.toml", "-o", "rig.toml"], "rig.toml", why);
    kept(folder, &["design", "positions", "positions.toml", "-o", "positions.toml"], "positions.toml", why);
    fs::copy(folder.join("presses.csv"), folder.join("errors.csv")).unwrap();
    for verb in ["evaluate", "compare"] {
        kept(folder, &[verb, "rig.toml", "--data", "errors.csv", "--report", "."], "errors.csv", why);
    }
    fs::copy(folder.join("presses.csv"), folder.join("report.html")).unwrap();
    kept(folder, &["track", "locator.json", "report.html", "--report", "."], "report.html", why);
    kept(folder, &["profile", "load.toml", "report.html", "--report", "."], "report.html", why);
}

#[test]
#[cfg(unix)]
fn links_to_inputs_are_inputs() {
    let bench = bench();
    let folder = bench.path();
    fs::hard_link(folder.join("presses.csv"), folder.join("hard.csv")).unwrap();
    std::os::unix::fs::symlink("presses.csv", folder.join("soft.csv")).unwrap();
    let fit = |data: &str, out: &str| {
        let arguments = ["fit", "rig.toml", "--data", data, "-o", out];
        kept(folder, &arguments, "presses.csv", "this command reads it");
    };
    fit("presses.csv", "hard.csv");
    fit("presses.csv", "soft.csv");
    fit("soft.csv", "hard.csv");
    fit("soft.csv", "presses.csv");
    // Where stdin comes from, and where stdout goes.
    let stdin = fs::File::open(folder.join("presses.csv")).unwrap();
    let out = fs::File::create(folder.join("told.txt")).unwrap();
    fs::create_dir(folder.join("page")).unwrap();
    fs::hard_link(folder.join("presses.csv"), folder.join("page/report.html")).unwrap();
    let profile = ["profile", "rig.toml", "-", "--report", "page"];
    let output = palpate(folder).args(profile).stdin(stdin).output().unwrap();
    assert!(complained(&output, 2).contains("as stdin"));
    let output =
        palpate(folder).args(["simulate", "rig.toml", "-o", "told.txt"]).stdout(out).output().unwrap();
    assert!(complained(&output, 2).contains("stdout goes there"));
}

#[test]
#[cfg(unix)]
fn only_regular_files_are_replaced() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let folder = folder(NOISY_BEAM);
    let at = |name: &str| folder.path().join(name);
    fs::create_dir_all(at("out/report.html")).unwrap();
    std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap();
    let _socket = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
    // The device itself would be lost if this went wrong.
    symlink("/dev/null", at("null")).unwrap();
    symlink("round", at("about")).unwrap();
    symlink("about", at("round")).unwrap();
    let refused = |name: &str, why: &str| {
        let complaint = complained(&run(folder.path(), &["simulate", "rig.toml", "-o", name]), 2);
        assert!(complaint.contains(why), "{name}: {complaint}");
    };
    refused("pipe", "it is a pipe (FIFO)");
    refused("socket", "it is a socket");
    refused("null", "it is a device");
    refused("/dev/stdout", "it is a pipe (FIFO)");
    refused("about", "cannot write about");
    refused("out", "it is a folder");
    refused("-", "stdout is reserved for the output of the command");
    refused("none/..", "it names no file");
    refused("rig.toml/a.csv", "cannot write rig.toml/a.csv");
    refused("none/a.csv", "folder none does not exist");
    assert!(fs::symlink_metadata(at("pipe")).unwrap().file_type().is_fifo());
    assert!(fs::symlink_metadata(at("null")).unwrap().file_type().is_symlink());
    let limit = |out: &str, why: &str| {
        let complaint = complained(&run(folder.path(), &["limit", "rig.toml", "--report", out]), 2);
        assert!(complaint.contains(why), "{out}: {complaint}");
    };
    limit("out", "it is a folder");
    limit("rig.toml", "rig.toml is not a folder");
    limit("rig.toml/out", "rig.toml is not a folder");
    limit("pipe", "pipe is not a folder");
}

#[test]
#[cfg(unix)]
fn links_are_followed_and_modes_kept() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = folder(NOISY_BEAM);
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("kept")).unwrap();
    fs::write(at("kept/presses.csv"), "old").unwrap();
    fs::set_permissions(at("kept/presses.csv"), PermissionsExt::from_mode(0o640)).unwrap();
    symlink("kept/presses.csv", at("link.csv")).unwrap();
    symlink("link.csv", at("second.csv")).unwrap();
    symlink("kept/new.csv", at("dangling.csv")).unwrap();
    for name in ["second.csv", "dangling.csv"] {
        said(&run(folder.path(), &["simulate", "rig.toml", "-o", name]));
        assert!(fs::symlink_metadata(at(name)).unwrap().file_type().is_symlink(), "{name}");
    }
    assert!(fs::symlink_metadata(at("link.csv")).unwrap().file_type().is_symlink());
    let written = text(folder.path(), "kept/presses.csv");
    assert!(written.starts_with("# palpate"), "{written}");
    assert_eq!(text(folder.path(), "kept/new.csv"), written);
    let mode = |name: &str| fs::metadata(at(name)).unwrap().permissions().mode() & 0o7777;
    assert_eq!(mode("kept/presses.csv"), 0o640);
    // Nobody leaves temporary files behind.
    assert_eq!(fs::read_dir(at("kept")).unwrap().count(), 2);

    fs::set_permissions(at("kept/presses.csv"), PermissionsExt::from_mode(0o440)).unwrap();
    let simulate = ["simulate", "rig.toml", "-o", "link.csv", "--seed", "1"];
    kept(folder.path(), &simulate, "kept/presses.csv", "it is write-protected");
}

#[test]
fn finished_studies_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let study = Toml::parse(PAPER_STUDY).set("name", "small").keep_arms(|name| name == "position-10");
    fs::write(path.join("small.toml"), study.set("estimator.max_epochs", 500).to_string()).unwrap();
    let seeds = |seeds: &str, more: &[&str]| {
        run(path, &[&["study", "small.toml", "--seeds", seeds, "--out", "out"], more].concat())
    };
    said(&seeds("4", &[]));
    let (networks, results) = (text(path, "out/networks.csv"), text(path, "out/results.json"));
    assert_eq!(networks.lines().count(), 6);
    for count in ["1", "4", "9"] {
        let complaint = complained(&seeds(count, &[]), 2);
        assert!(complaint.contains("a finished run") && complaint.contains("--resume"), "{complaint}");
    }
    let rig = path.join("rig.toml");
    fs::write(&rig, NOISY_BEAM).unwrap();
    fs::write(path.join("load.toml"), LOAD_PROFILE).unwrap();
    for arguments in [["limit", "rig.toml", "--report", "out"], ["profile", "load.toml", "--report", "out"]] {
        let complaint = complained(&run(path, &arguments), 2);
        assert!(complaint.contains("a study's results.json is there"), "{complaint}");
    }
    assert_eq!((text(path, "out/networks.csv"), text(path, "out/results.json")), (networks.clone(), results));

    // Nor by a command that writes one file.
    for (arguments, name) in [
        (&["fit", "rig.toml", "-o", "out/results.json"][..], "results.json"),
        (&["simulate", "rig.toml", "-o", "out/networks.csv"], "networks.csv"),
    ] {
        kept(path, arguments, &format!("out/{name}"), "it is a result of the study with");
    }
    said(&run(path, &["fit", "rig.toml", "-o", "out/locator.json"]));

    // Fewer seeds: the results are of them, and no network is lost.
    let fewer = seeds("2", &["--resume"]);
    said(&fewer);
    assert!(String::from_utf8_lossy(&fewer.stderr).contains("2 fits of further seeds stay in networks.csv"));
    assert_eq!(text(path, "out/networks.csv"), networks);
    assert!(text(path, "out/results.json").contains("\"seeds\": 2"));
    // More: only those that are missing are trained.
    said(&seeds("5", &["--resume"]));
    let more = text(path, "out/networks.csv");
    assert!(more.starts_with(networks.lines().take(6).collect::<Vec<_>>().join("\n").as_str()), "{more}");
    assert_eq!(more.lines().count(), 7);

    said(&seeds("1", &["--overwrite"]));
    assert_eq!(text(path, "out/networks.csv").lines().count(), 3);
}

#[test]
fn fits_of_other_estimators_are_kept_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let study = Toml::parse(SENSOR_KINDS_STUDY).keep_arms(|name| name == "known-reaction-2").to_string();
    fs::write(path.join("kinds.toml"), study).unwrap();
    let seeds = |seeds: &str, more: &[&str]| {
        run(path, &[&["study", "kinds.toml", "--seeds", seeds, "--out", "out"], more].concat())
    };
    said(&seeds("3", &[]));
    let fits = text(path, "out/networks.csv");
    assert_eq!(fits.lines().count(), 5);
    complained(&seeds("1", &[]), 2);
    said(&seeds("1", &["--resume"]));
    assert_eq!(text(path, "out/networks.csv"), fits);
}

#[test]
fn finished_studies_that_are_built_in_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("out")).unwrap();
    fs::write(folder.path().join("out/results.json"), "{}").unwrap();
    for study in ["dead-areas", "elliott"] {
        kept(folder.path(), &["study", study, "--out", "out"], "out/results.json", "a finished run");
        let resume = ["study", study, "--out", "out", "--resume"];
        kept(folder.path(), &resume, "out/results.json", "keeps no networks to continue from");
    }
}
