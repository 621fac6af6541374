//! The helper that finds real recordings, on one that the project relies on.

use std::fs;

use palpate_testing::data;

#[test]
fn the_water_recording_is_found_with_its_columns() {
    let Some(path) = data::recording("tactile-fsi/1d-water-1.5mm.csv") else { return };
    let text = fs::read_to_string(path).unwrap();
    let header = text.lines().next().unwrap();
    assert!(
        ["X", "Pl", "Pr"].iter().all(|column| header.split(',').any(|name| name.trim() == *column)),
        "{header}"
    );
}
