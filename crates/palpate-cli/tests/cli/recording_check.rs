//! Recordings with repeated readings, and those that contradict their rig.

use crate::support::board::set_force_linear;
use crate::support::command::{folder, run, said};
use crate::support::examples::NOISY_BEAM;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// A folder with these files of the tests' data.
fn folder_with(names: &[&str]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    for name in names {
        fs::copy(data.join(name), folder.path().join(name)).unwrap();
    }
    folder
}

/// Stderr of a command that succeeds.
fn warned(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    said(&output);
    String::from_utf8(output.stderr).unwrap()
}

/// Share of the fresh touches within their intervals, and number of untouched rows that are `no_contact`, of how many.
fn coverage_and_no_contacts(folder: &Path, locator: &str) -> (f64, usize, usize) {
    let located = said(&run(folder, &["locate", locator, "fresh.csv"]));
    let fresh = fs::read_to_string(folder.join("fresh.csv")).unwrap();
    let (mut within, mut touches, mut free, mut untouched) = (0, 0, 0, 0);
    for (row, estimate) in fresh.lines().zip(located.lines()).skip(1) {
        let at_mm = row.split(',').next().unwrap().parse::<f64>();
        let cells: Vec<&str> = estimate.split(',').collect();
        match at_mm {
            Ok(at_mm) => {
                let end = |i: usize| cells[i].parse::<f64>().unwrap_or(f64::NAN);
                touches += 1;
                within += usize::from(end(3) <= at_mm && at_mm <= end(4));
            }
            Err(_) => {
                untouched += 1;
                free += usize::from(cells.contains(&"no_contact"));
            }
        }
    }
    (f64::from(within as u32) / f64::from(touches), free, untouched)
}

#[test]
fn a_logger_faster_than_its_sensors_is_calibrated_as_if_each_reading_were_there_once() {
    let folder = folder_with(&["hold25.csv", "nohold25.csv", "fresh.csv"]);
    let folder = folder.path();
    let said_of_rows =
        "of 337 rows repeat the row before them in every channel: the logger is faster than its sensors";
    assert!(warned(folder, &["init", "hold25.csv", "-o", "hold.toml"]).contains(said_of_rows));
    warned(folder, &["init", "nohold25.csv", "-o", "nohold.toml"]);
    for rig in ["hold.toml", "nohold.toml"].map(|name| folder.join(name)) {
        set_force_linear(&rig);
    }
    let fit = |rig: &str, data: &str, out: &str| warned(folder, &["fit", rig, "--data", data, "-o", out]);
    let stderr = fit("hold.toml", "hold25.csv", "hold.json");
    assert!(stderr.contains(said_of_rows) && stderr.contains("repeated_readings = \"keep\""), "{stderr}");
    assert!(!fit("nohold.toml", "nohold25.csv", "nohold.json").contains("repeat the row"));
    let (held, plain) =
        (coverage_and_no_contacts(folder, "hold.json"), coverage_and_no_contacts(folder, "nohold.json"));
    assert_eq!(held, plain);
    assert!(held.0 > 0.9 && held.1 == held.2, "{held:?}");
    for arguments in [
        &["inspect", "hold25.csv", "--rig", "hold.toml"][..],
        &["evaluate", "hold.json", "--data", "hold25.csv"],
    ] {
        assert!(warned(folder, arguments).contains(said_of_rows));
    }
    assert!(said(&run(folder, &["inspect", "hold25.csv"])).contains(said_of_rows));
    let rig = fs::read_to_string(folder.join("hold.toml")).unwrap();
    let keep = rig.replace("[recording]\n", "[recording]\nrepeated_readings = \"keep\"\n");
    fs::write(folder.join("keep.toml"), keep).unwrap();
    let output = run(folder, &["fit", "keep.toml", "--data", "hold25.csv", "-o", "keep.json"]);
    assert!(said(&output).contains("337 rows"));
    assert!(!String::from_utf8_lossy(&output.stderr).contains("repeat the row"));
}

#[test]
fn positions_in_metres_under_a_rig_in_millimetres_are_warned_of_once() {
    let folder = folder_with(&["beam-posm.csv", "beam-posm.toml"]);
    let fit = ["fit", "beam-posm.toml", "--data", "beam-posm.csv", "-o", "locator.json"];
    let stderr = warned(folder.path(), &fit);
    let warnings: Vec<&str> = stderr.lines().filter(|line| line.starts_with("warning:")).collect();
    let expected = "warning: beam-posm.csv: the positions cover 0.36 mm of the surface's length of 400 mm (0.09 %): are they in m? \
                    Set `position_unit = \"m\"` in [recording]";
    assert_eq!(warnings, [expected]);
}

#[test]
fn positions_measured_from_the_other_end_are_recognised_by_a_locator() {
    let folder = folder(NOISY_BEAM);
    let path = folder.path();
    said(&run(path, &["fit", "rig.toml", "-o", "locator.json"]));
    said(&run(path, &["simulate", "rig.toml", "--every", "20 mm", "--seed", "1", "-o", "touches.csv"]));
    let evaluate = ["evaluate", "locator.json", "--data", "touches.csv"];
    assert!(!warned(path, &evaluate).contains("length − x"));
    let mirrored = |line: &str| match line.split_once(',').map(|(x_mm, rest)| (x_mm.parse::<f64>(), rest)) {
        Some((Ok(x_mm), rest)) => format!("{},{rest}\n", 400.0 - x_mm),
        _ => format!("{line}\n"),
    };
    let touches = fs::read_to_string(path.join("touches.csv")).unwrap();
    fs::write(path.join("touches.csv"), touches.lines().map(mirrored).collect::<String>()).unwrap();
    let warning = warned(path, &evaluate);
    assert!(
        warning.contains(
            " mm with x → length − x: correct the positions of touches.csv, or the order of its channels"
        ),
        "{warning}"
    );
}
