//! Descriptions of tables without a rig.

use crate::first_rig::{FirstRig, Hints};
use crate::rig::Rig;
use palpate_estimators::recording::{CsvError, Header, Table};

/// Describes a table: comments, size, headings, and repeated readings of a recording.
///
/// ```
/// let lines = palpate_rig::table_in_words("presses.csv", b"x,left,right\n1,20,30\n2,19,31\n")?;
/// assert_eq!(lines, ["a table of 2 rows", "columns: x, left, right"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`CsvError`] with line and column.
pub fn table_in_words(name: &str, bytes: &[u8]) -> Result<Vec<String>, CsvError> {
    let text = String::from_utf8_lossy(bytes);
    let comments = text.lines().take_while(|line| line.starts_with('#'));
    let mut lines: Vec<String> =
        comments.map(|line| line.trim_start_matches(['#', ' ']).to_owned()).collect();
    let Table { header, columns, rows } = Table::read(name, bytes, None, None)?;
    lines.push(format!("a table of {rows} rows"));
    lines.push(match header {
        Header::Present => {
            let headings: Vec<&str> = columns.iter().map(|column| column.heading.as_str()).collect();
            format!("columns: {}", headings.join(", "))
        }
        Header::Absent => format!("{} columns without names", columns.len()),
    });
    lines.extend(repeated_readings(name, bytes));
    Ok(lines)
}

fn repeated_readings(name: &str, bytes: &[u8]) -> Option<String> {
    let first = FirstRig::infer(name, bytes, &Hints::default()).ok()?;
    let rig = Rig::from_toml(&first.to_toml(name)).ok()?;
    let recording = rig.setup.read_recording(name, bytes).ok()?;
    recording.provenance.repeats.filter(|repeats| repeats.removed > 0).map(|repeats| repeats.to_string())
}
