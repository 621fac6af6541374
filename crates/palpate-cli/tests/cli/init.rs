//! From a spreadsheet of presses to a locator, without an editor.

use crate::support::board::set_force_linear;
use crate::support::command::{complained, palpate, run, said};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Stdio;

/// A press of a strip of 300 mm: place in millimetres, force in newtons, six gauges in counts, with two decimals.
struct Press {
    at_mm: f64,
    force_n: f64,
    gauges: Vec<f64>,
}

/// Three sweeps over fourteen places with forces that change: bells around the gauges, and a ripple for noise.
fn presses() -> Vec<Press> {
    let press = |i: usize| {
        let (at_mm, force_n) = (20.5 + 20.0 * (i % 14) as f64, 0.5 + 0.375 * ((i * 5) % 12) as f64);
        let gauge = |k: usize| {
            let distance = (at_mm - 45.0 * (k + 1) as f64) / 60.0;
            let noise = ((i * 7919 + k * 104_729) % 17) as f64 / 10.0;
            let counts = 500.0 + 10.0 * k as f64 + 60.0 * force_n * (-distance * distance).exp() + noise;
            (counts * 100.0).round() / 100.0
        };
        Press { at_mm, force_n, gauges: (0..6).map(gauge).collect() }
    };
    (0..42).map(press).collect()
}

fn comma(number: f64) -> String {
    number.to_string().replace('.', ",")
}

/// As a German spreadsheet exports it: byte-order mark, semicolons, decimal commas, quoted headings with units, timestamps, a remark, and
/// empty rows at the end.
fn export(presses: &[Press]) -> String {
    let gauges = (1..=6).map(|k| format!("\"DMS {k} [Digits]\"")).collect::<Vec<_>>().join(";");
    let mut text =
        format!("\u{feff}\"Nr.\";\"Zeit\";\"Position [mm]\";\"Kraft (N)\";{gauges};\"Bemerkung\"\r\n");
    for (i, press) in presses.iter().enumerate() {
        let gauges = press.gauges.iter().map(|counts| comma(*counts)).collect::<Vec<_>>().join(";");
        let (at_mm, force_n) = (comma(press.at_mm), comma(press.force_n));
        let note = if i == 3 { "\"schief; wiederholt\"" } else { "" };
        text += &format!("{};03.04.2026 14:{i:02}:25,120;{at_mm};{force_n};{gauges};{note}\r\n", i + 1);
    }
    text + &format!("{}\r\n", ";".repeat(10)).repeat(3)
}

/// The same as plain CSV.
fn plain(presses: &[Press]) -> String {
    let mut text = "Zeit,Position,Kraft,DMS 1,DMS 2,DMS 3,DMS 4,DMS 5,DMS 6\n".to_owned();
    for (i, press) in presses.iter().enumerate() {
        let gauges = press.gauges.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        text += &format!("{},{},{},{gauges}\n", 60 * i, press.at_mm, press.force_n);
    }
    text
}

fn folder_with(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, text)| fs::write(folder.path().join(name), text).unwrap());
    folder
}

fn stderr(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    said(&output);
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn three_commands_lead_from_a_spreadsheet_to_estimates() {
    let presses = presses();
    let folder = folder_with(&[("presses.csv", &export(&presses)), ("plain.csv", &plain(&presses))]);
    let folder = folder.path();
    let found = "presses.csv: semicolons, decimal commas, units in the header\n";

    assert_eq!(stderr(folder, &["init", "presses.csv", "-o", "rig.toml"]), found);
    let fitted = stderr(folder, &["fit", "rig.toml", "--data", "presses.csv", "-o", "export.json"]);
    let chosen = fitted.strip_prefix(found).unwrap();
    assert!(chosen.contains("\nchosen: influence force-"), "{chosen}");
    assert_eq!(stderr(folder, &["fit", "rig.toml", "--data", "plain.csv", "-o", "plain.json"]), chosen);
    assert_eq!(stderr(folder, &["locate", "export.json", "presses.csv"]), found);
    assert_eq!(stderr(folder, &["locate", "plain.json", "plain.csv"]), "");

    for options in [&[][..], &["--json"]] {
        let located = |locator: &str, data: &str| {
            let text = said(&run(folder, &[&["locate", locator, data], options].concat()));
            // The byte-order mark, the header and the rows are on the same lines of both files.
            assert_eq!(text.lines().filter(|line| line.contains("located")).count(), presses.len(), "{text}");
            text
        };
        assert_eq!(located("export.json", "presses.csv"), located("plain.json", "plain.csv"));
        assert_eq!(located("export.json", "plain.csv"), located("plain.json", "presses.csv"));
    }
    let evaluated = |data: &str| said(&run(folder, &["evaluate", "export.json", "--data", data]));
    assert_eq!(evaluated("presses.csv").replace("presses.csv", "plain.csv"), evaluated("plain.csv"));
}

#[test]
fn first_rig_of_a_spreadsheet_lists_its_assumptions() {
    let folder = folder_with(&[("presses.csv", &export(&presses()))]);
    let printed = said(&run(folder.path(), &["init", "presses.csv"]));
    let told = said(&run(folder.path(), &["init", "presses.csv", "-o", "rig.toml"]));
    let written = fs::read_to_string(folder.path().join("rig.toml")).unwrap();
    assert_eq!(written, printed.replace("RIG.toml", "rig.toml"));
    insta::assert_snapshot!(format!("{told}\n{written}"));
}

#[test]
fn a_stream_of_an_export_is_located_line_by_line() {
    let presses = presses();
    let (export, plain) = (export(&presses), plain(&presses));
    let folder = folder_with(&[("presses.csv", &export), ("plain.csv", &plain)]);
    said(&run(folder.path(), &["init", "presses.csv", "-o", "rig.toml"]));
    said(&run(folder.path(), &["fit", "rig.toml", "--data", "presses.csv", "-o", "locator.json"]));
    let piped = |text: &str| {
        let mut command = palpate(folder.path());
        command.args(["locate", "locator.json", "-"]).stdin(Stdio::piped());
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
        child.wait_with_output().unwrap()
    };
    // A row in another way than the first is lost, and said with its place; those after it are not.
    let mixed = export.replacen(&comma(presses[2].gauges[0]), &presses[2].gauges[0].to_string(), 1);
    let output = piped(&mixed);
    let complaint = complained(&output, 3);
    assert!(complaint.starts_with("stdin: semicolons, decimal commas, units in the header\n"), "{complaint}");
    assert!(complaint.contains("skipped: stdin:4:5: `"), "{complaint}");
    let expected = said(&run(folder.path(), &["locate", "locator.json", "plain.csv"]));
    let expected: Vec<&str> =
        expected.lines().enumerate().filter(|(i, _)| *i != 3).map(|(_, line)| line).collect();
    assert_eq!(String::from_utf8(output.stdout).unwrap().lines().collect::<Vec<_>>(), expected);
}

#[test]
fn unknown_roles_are_requested() {
    let nameless = "a,b,c\n10,1,5\n20,2,6\n35,1,9\n";
    let folder = folder_with(&[
        ("nameless.csv", nameless),
        ("twice.csv", "Ort,Position,S1\n1,2,3\n2,3,5\n"),
        ("thousands.csv", "Position,S1\n1,\"1,234\"\n2,\"2,345\"\n"),
        ("empty.csv", ""),
        ("rig.toml", "precious"),
    ]);
    let cases: [&[&str]; 8] = [
        &["init", "nameless.csv"],
        &["init", "twice.csv"],
        &["init", "thousands.csv"],
        &["init", "empty.csv"],
        &["init", "missing.csv"],
        &["init", "nameless.csv", "--position", "d"],
        &["init", "nameless.csv", "--position", "a", "-o", "rig.toml"],
        &["init", "nameless.csv", "--position", "a", "--separator", "colon"],
    ];
    let complaints: Vec<String> = cases
        .iter()
        .map(|arguments| {
            format!("{}:\n{}", arguments.join(" "), complained(&run(folder.path(), arguments), 2))
        })
        .collect();
    insta::assert_snapshot!(complaints.join("\n"));
    assert_eq!(fs::read_to_string(folder.path().join("rig.toml")).unwrap(), "precious");

    let named = ["init", "nameless.csv", "--position", "a", "--force", "b", "-o", "rig.toml", "--overwrite"];
    let told = said(&run(folder.path(), &named));
    assert!(told.starts_with("rig.toml: position `a`, force `b`, 1 channel `c`\n"), "{told}");
    said(&run(folder.path(), &["fit", "rig.toml", "--data", "nameless.csv", "-o", "locator.json"]));
}

/// The presses of a spreadsheet with untouched rows between them, as `row` writes these.
fn with_untouched(presses: &[Press], heading: &str, mark: &str, row: &str) -> String {
    let mut text = format!("{heading}Position [mm];Kraft [N];DMS 1;DMS 2;DMS 3;DMS 4;DMS 5;DMS 6\r\n");
    for (i, press) in presses.iter().enumerate() {
        let gauges = press.gauges.iter().map(|counts| comma(*counts)).collect::<Vec<_>>().join(";");
        text += &format!("{mark}{};{};{gauges}\r\n", comma(press.at_mm), comma(press.force_n));
        if i % 4 == 1 {
            let idle =
                |k: usize| comma(500.0 + 10.0 * k as f64 + ((i * 7919 + k * 104_729) % 17) as f64 / 10.0);
            text += &format!("{row}{}\r\n", (0..6).map(idle).collect::<Vec<_>>().join(";"));
        }
    }
    text
}

#[test]
fn untouched_rows_may_have_no_position_and_be_marked_by_a_column() {
    let presses = presses();
    let files = [
        ("nothing", with_untouched(&presses, "", "", ";;")),
        ("zero", with_untouched(&presses, "", "", ";0;")),
        ("marked", with_untouched(&presses, "unberührt;", "nein;", "ja;0;;")),
        ("numbered", with_untouched(&presses, "No contact;", "0,0;", "1,0;-999;;")),
        ("crossed", with_untouched(&presses, "Idle;", ";", "x;;0;")),
    ];
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (mut rigs, mut located) = (Vec::new(), Vec::new());
    for (name, text) in &files {
        let [data, rig, locator] = ["csv", "toml", "json"].map(|extension| format!("{name}.{extension}"));
        fs::write(folder.join(&data), text).unwrap();
        let told = said(&run(folder, &["init", &data, "-o", &rig]));
        let written = fs::read_to_string(folder.join(&rig)).unwrap();
        let marks = written.lines().filter(|line| line.contains("untouched")).collect::<String>();
        rigs.push(format!("{}\n{marks}", told.lines().next().unwrap_or_default()));
        assert!(written.contains("length = \"320 mm\""), "{written}");
        set_force_linear(&folder.join(&rig));
        said(&run(folder, &["fit", &rig, "--data", &data, "-o", &locator]));
        located.push(said(&run(folder, &["locate", &locator, "nothing.csv"])));
    }
    insta::assert_snapshot!(rigs.join("\n"));
    assert!(located.iter().all(|estimates| *estimates == located[0]));
    assert_eq!(located[0].lines().filter(|line| line.ends_with("no_contact")).count(), 11, "{}", located[0]);

    // A press without a position is no untouched row.
    let pressed = files[0].1.replacen(";;", ";2,5;", 1);
    fs::write(folder.join("pressed.csv"), pressed).unwrap();
    let refused = complained(&run(folder, &["init", "pressed.csv"]), 2);
    assert!(refused.contains("pressed.csv:4:1"), "{refused}");
    let words = ["init", "nothing.csv", "--untouched", "Kraft"];
    let refused = complained(&run(folder, &words), 2);
    assert!(refused.contains("every row of column `Kraft [N]` must be 1, true or yes"), "{refused}");
}

#[test]
fn inspect_reads_a_spreadsheet_export_as_init_does() {
    let folder = folder_with(&[("presses.csv", &export(&presses()))]);
    let told = said(&run(folder.path(), &["inspect", "presses.csv"]));
    assert!(
        told.starts_with("a table of 42 rows\ncolumns: Nr., Zeit, Position [mm], Kraft (N), DMS 1"),
        "{told}"
    );
}

/// Presses of a strip as loggers and spreadsheets write them.
fn field_file(name: &str) -> Vec<u8> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../palpate-estimators/tests/data/field");
    if name == "utf16.txt" {
        let text = fs::read_to_string(data.join("tabs.txt")).unwrap().replace('\n', "\r\n");
        return format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect();
    }
    fs::read(data.join(name)).unwrap()
}

#[test]
fn init_and_fit_report_skipped_and_ambiguous_input_alike() {
    let names = ["dup.csv", "units-row.csv", "press.lvm", "utf16.txt", "zero-noise.csv", "negforce.csv"];
    let said_of = |name: &str| {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        fs::write(folder.join(name), field_file(name)).unwrap();
        let of_init = stderr(folder, &["init", name, "-o", "rig.toml"]);
        let rig = fs::read_to_string(folder.join("rig.toml")).unwrap();
        let keys = rig.lines().filter(|line| line.starts_with("force_zero") || line.starts_with("channels"));
        let keys: Vec<&str> = keys.map(|line| line.split('#').next().unwrap_or_default().trim()).collect();
        let of_fit = stderr(folder, &["inspect", name, "--rig", "rig.toml"]);
        format!("{name}: {}\n{of_init}then\n{of_fit}", keys.join(", "))
    };
    insta::assert_snapshot!(names.map(said_of).join("\n"));
}

#[test]
fn a_locator_of_one_file_locates_its_other_forms() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for name in ["press.lvm", "utf16.txt", "units-row.csv"] {
        fs::write(folder.join(name), field_file(name)).unwrap();
    }
    said(&run(folder, &["init", "press.lvm", "-o", "rig.toml"]));
    said(&run(folder, &["fit", "rig.toml", "--data", "press.lvm", "-o", "locator.json"]));
    let located = |name: &str| {
        let text = said(&run(folder, &["locate", "locator.json", name]));
        // The number of the line is another one below a preamble.
        let rows: Vec<String> =
            text.lines().skip(1).map(|line| line.split_once(',').unwrap().1.to_owned()).collect();
        assert_eq!(rows.len(), 69, "{text}");
        rows
    };
    assert_eq!(located("press.lvm"), located("utf16.txt"));
    assert_eq!(located("press.lvm"), located("units-row.csv"));

    fs::write(folder.join("no-heading.csv"), "S1,S2\nbeside,others\n").unwrap();
    let complaint = complained(&run(folder, &["locate", "locator.json", "no-heading.csv"]), 2);
    assert!(complaint.contains("column `S3` does not exist; the columns are `S1`, `S2`"), "{complaint}");
}
