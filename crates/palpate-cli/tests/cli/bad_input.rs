//! Bad input: a message with the place and the bound, exit code 2, nothing written, no panic.

use crate::support::command::{complained, folder, run, said};
use crate::support::examples::{FSI_WATER, NOISY_BEAM, PAPER, PAPER_STUDY, PLATE, SENSOR_KINDS_STUDY};
use crate::support::toml::{Toml, replaced};
use std::fs;
use std::path::Path;

/// Runs the command among some files and answers with its complaint; no file may have come or gone.
fn complaint(files: &[(&str, &[u8])], arguments: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let complaint = complained(&run(folder.path(), arguments), 2);
    assert_eq!(names(folder.path()).len(), files.len(), "{:?}", names(folder.path()));
    let panicked = complaint.contains("panicked") || complaint.contains("RUST_BACKTRACE");
    assert!(!panicked, "{complaint}");
    complaint
}

fn names(folder: &Path) -> Vec<String> {
    fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect()
}

fn rig_complaint(from: &str, to: &str) -> String {
    let rig = replaced(PAPER, from, to);
    complaint(&[("rig.toml", rig.as_bytes())], &["fit", "rig.toml", "-o", "locator.json"])
}

fn csv_complaint(csv: &[u8]) -> String {
    let files: &[(&str, &[u8])] = &[("rig.toml", FSI_WATER.as_bytes()), ("data.csv", csv)];
    complaint(files, &["fit", "rig.toml", "--data", "data.csv", "-o", "locator.json"])
}

#[test]
fn rigs_are_refused_at_the_place() {
    let cases = [
        ("a typo in a key", "length =", "lenght ="),
        ("a wrong unit", "\"3 N\"", "\"3 mm\""),
        ("an unknown unit", "\"1.2 mm\"", "\"1.2 furlong\""),
        ("a sensor off the beam", "count = 8 ", "positions = [\"44 mm\", \"401 mm\"] "),
        ("0 sensors", "count = 8 ", "count = 0 "),
        ("0 training positions", "count = 10", "count = 0"),
        ("a momentum of 1", "momentum = 0.9", "momentum = 1.0"),
        ("a negative thickness", "\"1.2 mm\"", "\"-1.2 mm\""),
        ("an estimator that does not exist", "\"network\"", "\"netwrok\""),
        ("not TOML", "[surface]", "[surface"),
    ];
    let messages: Vec<String> =
        cases.iter().map(|(what, from, to)| format!("{what}:\n{}", rig_complaint(from, to))).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn recordings_are_refused_at_the_place() {
    let cases: [(&str, &[u8]); 9] = [
        ("a text cell", b"X,Pl,Pr,F,depth\n10,1,2,3,4\n12,one,2,3,4\n"),
        ("NaN", b"X,Pl,Pr,F,depth\n10,1,NaN,3,4\n"),
        ("a short row", b"X,Pl,Pr,F,depth\n10,1,2,3,4\n12,1\n"),
        ("an empty file", b""),
        ("a header alone", b"X,Pl,Pr,F,depth\n"),
        ("a missing column", b"X,Pl,F,depth\n10,1,2,3\n"),
        ("a position off the surface", b"X,Pl,Pr,F,depth\n10,1,2,3,4\n101,1,2,3,4\n"),
        ("not UTF-8", b"X,Pl,Pr,F,depth\n10,1,\xff,3,4\n"),
        ("one position only", b"X,Pl,Pr,F,depth\n10,1,2,3,4\n10,1.5,2,3,4\n"),
    ];
    let messages: Vec<String> =
        cases.iter().map(|(what, csv)| format!("{what}:\n{}", csv_complaint(csv))).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn binary_data_is_refused_at_its_first_zero_byte() {
    let utf16: Vec<u8> = PAPER.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for verb in ["inspect", "limit", "init"] {
        let told = complaint(&[("rig.toml", &utf16)], &[verb, "rig.toml"]);
        assert!(
            told.contains("rig.toml is not text: byte 2 is 0") && told.contains("UTF-8"),
            "{verb}: {told}"
        );
    }
    #[cfg(unix)]
    for device in ["/dev/zero", "/dev/full"] {
        let told = complaint(&[], &["inspect", device]);
        assert!(told.contains("is not text: byte 1 is 0"), "{told}");
    }
}

#[test]
fn frequencies_beyond_all_clocks_are_refused() {
    for rate in ["1e308 Hz", "1e-308 Hz"] {
        let told = complaint(&[], &["track", "locator.json", "--rate", rate]);
        assert!(told.contains("must be at least 0.000001 Hz and at most 1000000000 Hz"), "{told}");
    }
}

#[test]
fn missing_files_are_named() {
    let no_rig = complaint(&[], &["fit", "none.toml", "-o", "locator.json"]);
    let rig = [("rig.toml", FSI_WATER.as_bytes())];
    let no_data = complaint(&rig, &["fit", "rig.toml", "--data", "none.csv", "-o", "locator.json"]);
    let no_model = complaint(&rig, &["fit", "rig.toml", "-o", "locator.json"]);
    let no_locator = complaint(&[], &["locate", "none.json"]);
    let no_folder =
        complaint(&[("rig.toml", PAPER.as_bytes())], &["simulate", "rig.toml", "-o", "none/a.csv"]);
    insta::assert_snapshot!([no_rig, no_data, no_model, no_locator, no_folder].join("\n"));
}

#[test]
fn locators_of_another_kind_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rig.toml"), PAPER).unwrap();
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    let good = fs::read_to_string(folder.path().join("locator.json")).unwrap();
    let inspect = |text: &str| complaint(&[("locator.json", text.as_bytes())], &["inspect", "locator.json"]);
    let cases = [
        ("another version", replaced(&good, "\"format_version\": 1", "\"format_version\": 2")),
        ("another format", replaced(&good, "palpate-locator", "palpate-lock")),
        ("a missing weight", replaced(&good, "\"weights\": [", "\"weights\": [], \"none\": [")),
        ("cut off", good[..good.len() / 2].to_owned()),
        ("empty", String::new()),
    ];
    let messages: Vec<String> =
        cases.iter().map(|(what, text)| format!("{what}:\n{}", inspect(text))).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn numbers_of_locators_are_refused_at_the_place() {
    let folder = tempfile::tempdir().unwrap();
    let rig = Toml::parse(NOISY_BEAM).estimator("neighbours").to_string();
    fs::write(folder.path().join("rig.toml"), rig).unwrap();
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    let good = fs::read_to_string(folder.path().join("locator.json")).unwrap();
    let put = |key: &str, number: &str| {
        let start = good.find(&format!("\"{key}\": ")).unwrap() + key.len() + 4;
        let end = start + good[start..].find([',', '\n']).unwrap();
        let text = format!("{}{number}{}", &good[..start], &good[end..]);
        let locate = ["locate", "locator.json", "--no-header"];
        let complaint = complaint(&[("locator.json", text.as_bytes())], &locate);
        assert!(complaint.contains("locator.json:"), "{key} = {number}: no place: {complaint}");
        complaint
    };
    let cases = [
        ("divisor", "1e-320"),
        ("divisor", "1e308"),
        ("divisor", "1e999"),
        ("divisor", "NaN"),
        ("divisor", "Infinity"),
        ("spread", "-1"),
        ("count", "1000000000000000000"),
        ("count", "99999999999999999999"),
    ];
    let messages: Vec<String> =
        cases.iter().map(|(key, number)| format!("{key} = {number}:\n{}", put(key, number))).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn numbers_within_influence_locators_are_refused_at_the_place() {
    let folder = folder(NOISY_BEAM);
    said(&run(folder.path(), &["fit", "rig.toml", "-o", "locator.json"]));
    let good = fs::read_to_string(folder.path().join("locator.json")).unwrap();
    let digits = |text: &str, from: usize| {
        let start = from + text[from..].find(|letter: char| letter.is_ascii_digit()).unwrap();
        start..start + text[start..].find([',', '\n']).unwrap()
    };
    for (key, number) in
        [("length_m", "-0.4"), ("noise_sd", "-5e-6"), ("variances", "-0.125"), ("gain_error", "-1e-3")]
    {
        let number_at = digits(&good, good.find(&format!("\"{key}\": ")).unwrap() + key.len() + 3);
        let text = format!("{}{number}{}", &good[..number_at.start], &good[number_at.end..]);
        let line = good[..number_at.start].matches('\n').count() + 1;
        let column = number_at.start - good[..number_at.start].rfind('\n').unwrap();
        let complaint = complaint(&[("locator.json", text.as_bytes())], &["inspect", "locator.json"]);
        assert!(
            complaint.contains(&format!("locator.json:{line}:{column}]")),
            "{key} = {number}: {complaint}"
        );
        assert!(complaint.contains("must"), "{complaint}");
        assert!(!complaint.contains(" at line "), "the place is said twice: {complaint}");
    }
}

#[test]
fn arms_are_refused_at_the_place() {
    let kinds = |from: &str, to: &str| replaced(SENSOR_KINDS_STUDY, from, to);
    let refined = "layout = \"refined\"";
    let own = "layout = \"even\"\nsensors = { measure = \"deflection\", positions = [\"50 mm\"], noise = \"5 um\" }";
    let cases = [
        ("an unknown layout", kinds(refined, "layout = \"qr-pivotting\"")),
        ("a layout and positions", kinds(refined, own)),
        ("a layout without room", kinds("sites = \"5 mm\"", "sites = \"5 mm\"\nspacing = \"80 mm\"")),
        (
            "a layout without noise",
            kinds("{ measure = \"strain\", noise = \"1 ue\" },", "{ measure = \"slope\" },"),
        ),
        ("no force at all", kinds("force = \"3 N\"", "")),
        ("a force that is none", kinds("{ force = \"3 N\" }", "{ force = \"3 mm\" }")),
        ("no readings", kinds("readings = 5", "readings = 0")),
        ("an arm's key that no arm has", kinds(refined, "layuot = \"even\"")),
        ("a plane", format!("name = \"plate\"\n{PLATE}\n[[arm]]\nname = \"only\"\n")),
    ];
    let run = |text: &str| complaint(&[("study.toml", text.as_bytes())], &["study", "study.toml"]);
    let messages: Vec<String> = cases.iter().map(|(what, text)| format!("{what}:\n{}", run(text))).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn studies_are_refused_at_the_place() {
    let study = |from: &str, to: &str| replaced(PAPER_STUDY, from, to);
    let cases = [
        ("no arms", Toml::parse(PAPER_STUDY).remove("arm").to_string()),
        ("two arms of one name", study("position-20", "position-10")),
        ("0 seeds", study("seeds = 100", "seeds = 0")),
        ("a typo in an arm", study("training = {", "trainin = {")),
        ("an odd rest", study("middle = 6, count = 10", "middle = 6, count = 11")),
        ("a precision that does not exist", study("\"f64\"", "\"f16\"")),
        ("a position off the beam", study("to = \"399 mm\"", "to = \"399 m\"")),
    ];
    let run = |text: &str| complaint(&[("study.toml", text.as_bytes())], &["study", "study.toml"]);
    let messages: Vec<String> = cases.iter().map(|(what, text)| format!("{what}:\n{}", run(text))).collect();
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn a_fit_that_needs_more_memory_than_it_may_is_refused_with_the_bound() {
    let fit = ["fit", "rig.toml", "-o", "locator.json", "--memory-limit"];
    let refused = |limit: &str| complaint(&[("rig.toml", PAPER.as_bytes())], &[&fit[..], &[limit]].concat());
    let complaint = refused("1 kB");
    for part in ["the fit of", "of memory; the limit is 1 kB", "raise the limit"] {
        assert!(complaint.contains(part), "{part}: {complaint}");
    }
    for wrong in ["3 apples", "0 GB", "GB"] {
        assert!(refused(wrong).contains("memory"), "{wrong}");
    }
}

#[test]
fn limits_and_designs_that_need_more_memory_than_they_may_are_refused_with_the_bound() {
    for (command, what) in [
        (&["limit", "rig.toml"][..], "the limit of 9 sensors needs about "),
        (&["design", "sensors", "rig.toml"], "the design with 841 candidate sensors needs about "),
    ] {
        let arguments = [command, &["--memory-limit", "1 MB"]].concat();
        let complaint = complaint(&[("rig.toml", PLATE.as_bytes())], &arguments);
        for part in [what, " MB of memory; the limit is 1 MB", "raise the limit, or "] {
            assert!(complaint.contains(part), "{part}: {complaint}");
        }
    }
}
