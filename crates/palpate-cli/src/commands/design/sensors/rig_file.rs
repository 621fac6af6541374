//! The rig with another layout; everything else of its text stays as it was.

use crate::failure::{Complaint, Failure};
use crate::{input, output};
use palpate_mechanics::sensing::{ChannelModel, Layout, Sensor, SensorKind};
use palpate_mechanics::units::Quantity;
use std::path::Path;
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, value};

/// Keys of a section that say where its sensors are, or which of them are dead.
const PLACES: [&str; 4] = ["count", "grid", "positions", "dead"];

/// Writes the rig of `text` with the sensors of `layout`, a section a kind.
pub fn write(path: &Path, text: &str, layout: &Layout) -> Result<(), Failure> {
    let written = with_layout(text, layout)
        .map_err(|error| Complaint::new(format!("cannot put the layout into the rig: {error}")))?;
    // Whatever else the rig says must go with as many sensors.
    let rig = input::parse_rig(path, &written)?;
    if rig.setup.layout.len() != layout.len() {
        return Err(Complaint::new("the rig does not take the layout").into());
    }
    output::write_file(path, written.as_bytes())
}

fn with_layout(text: &str, layout: &Layout) -> Result<String, toml_edit::TomlError> {
    let mut document: DocumentMut = text.parse()?;
    let own = sections(document.get("sensors"));
    let mut new = ArrayOfTables::new();
    for kind in SensorKind::ALL {
        let sensors: Vec<&Sensor> = layout.sensors().iter().filter(|sensor| sensor.kind == kind).collect();
        if let Some(first) = sensors.first() {
            let mut section = section(kind, &own, &first.channel);
            section.insert("positions", value(positions(&sensors)));
            new.push(section);
        }
    }
    if let (Some(first), Some(table)) = (own.first(), new.get_mut(0)) {
        table.decor_mut().clone_from(first.decor());
    }
    // Where the old sections stood.
    let position = own.first().and_then(Table::position);
    for table in new.iter_mut() {
        table.set_position(position);
    }
    document.insert("sensors", Item::ArrayOfTables(new));
    Ok(document.to_string())
}

fn sections(sensors: Option<&Item>) -> Vec<Table> {
    match sensors {
        Some(Item::Table(table)) => vec![table.clone()],
        Some(Item::ArrayOfTables(tables)) => tables.iter().cloned().collect(),
        _ => Vec::new(),
    }
}

/// The rig's section of this kind without its places, or a new one; its noise is the design's.
fn section(kind: SensorKind, own: &[Table], channel: &ChannelModel) -> Table {
    let measures = |table: &&Table| table.get("measure").and_then(Item::as_str) == Some(kind.name());
    let mut section = own.iter().find(measures).cloned().unwrap_or_default();
    PLACES.iter().for_each(|key| drop(section.remove(key)));
    if section.get("measure").is_none() {
        section.decor_mut().set_prefix("\n");
        section.insert("measure", value(kind.name()));
    }
    for (key, si) in [("noise", channel.noise_sd), ("resolution", channel.resolution)] {
        let written = section.get(key).and_then(Item::as_str);
        let same = written.and_then(|text| Quantity::parse_as(text, kind.dimension()).ok()) == Some(si);
        if !same && (si > 0.0 || written.is_some()) {
            section.insert(key, value(Quantity { value: si, dimension: kind.dimension() }.to_string()));
        }
    }
    section
}

/// Along a line lengths, on a plane pairs of them.
fn positions(sensors: &[&Sensor]) -> Array {
    let plane = sensors.iter().any(|sensor| sensor.position.y_m != 0.0);
    let length = |sensor: &Sensor, at_m: f64| {
        // A reaction sensor must meet its support to the last digit; a micrometre is enough for the others.
        let mm = if sensor.kind == SensorKind::Reaction { at_m * 1e3 } else { (at_m * 1e6).round() / 1e3 };
        format!("{mm} mm")
    };
    sensors
        .iter()
        .map(|sensor| {
            let x = length(sensor, sensor.position.x_m);
            if plane {
                let pair: Array = [x, length(sensor, sensor.position.y_m)].into_iter().collect();
                toml_edit::Value::from(pair)
            } else {
                toml_edit::Value::from(x)
            }
        })
        .collect()
}

#[cfg(test)]
mod tests;
