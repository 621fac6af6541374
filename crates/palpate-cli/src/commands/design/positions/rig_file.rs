//! The rig with other training positions; everything else of its text stays as it was.

use crate::failure::{Complaint, Failure};
use crate::{input, output};
use palpate_design::positions::Placed;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use std::path::Path;
use toml_edit::{Array, DocumentMut, Item, Table, Value, value};

/// Keys of [training] that say where to press.
const PLACES: [&str; 6] = ["arrangement", "count", "grid", "middle", "portion", "positions"];

/// Writes the rig of `text` that is pressed at the positions found.
pub fn write(
    path: &Path,
    text: &str,
    placed: &Placed,
    repeats: usize,
    extent: Extent,
) -> Result<(), Failure> {
    let written = with_positions(text, &placed.positions, repeats, extent)
        .map_err(|error| Complaint::new(format!("cannot put the positions into the rig: {error}")))?;
    input::parse_rig(path, &written)?;
    output::write_file(path, written.as_bytes())
}

fn with_positions(
    text: &str,
    positions: &[Position],
    repeats: usize,
    extent: Extent,
) -> Result<String, toml_edit::TomlError> {
    let mut document: DocumentMut = text.parse()?;
    let own = document.get("training").and_then(Item::as_table).cloned();
    let mut training = own.unwrap_or_else(Table::new);
    PLACES.iter().for_each(|key| drop(training.remove(key)));
    training.insert("arrangement", value("explicit"));
    training.insert("positions", value(listed(positions, extent)));
    if repeats > 1 || training.contains_key("repeats") {
        training.insert("repeats", value(i64::try_from(repeats).unwrap_or(i64::MAX)));
    }
    document.insert("training", Item::Table(training));
    Ok(document.to_string())
}

/// Along a line lengths, on a plane pairs of them, to a micrometre.
fn listed(positions: &[Position], extent: Extent) -> Array {
    let length = |at_m: f64| format!("{} mm", (at_m * 1e6).round() / 1e3);
    let place = |at: &Position| match extent {
        Extent::Line { .. } => Value::from(length(at.x_m)),
        Extent::Plane { .. } => Value::from(Array::from_iter([length(at.x_m), length(at.y_m)])),
    };
    positions.iter().map(place).collect()
}
