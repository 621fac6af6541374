//! CSV writer.

use std::io::{self, Write};

use super::columns::{Column, Columns, PositionColumns};
use super::csv_in::{SECOND, TIME};
use super::{Recording, Row, TimedRecording};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::Unit;

/// Writes the columns of [`Columns::own`] losslessly.
///
/// Times and forces are written if every row has one; nuisance coordinates are in SI units. `comment` is the
/// first line, after `#`.
///
/// ```
/// use palpate_estimators::{arrangement::Training, recording, setup::Setup};
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let presses = setup.simulate(&Training::even(10), 0)?;
/// let mut file = Vec::new();
/// recording::write(&presses, setup.surface().extent(), "simulated", &mut file)?;
/// assert_eq!(setup.read_recording("simulated.csv", &file[..])?.rows, presses.rows);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Errors of `out`.
pub fn write(recording: &Recording, extent: Extent, comment: &str, out: impl Write) -> io::Result<()> {
    let own = Columns::own(&recording.channels, &recording.kinds, extent);
    write_as(recording, &with_nuisances(own, recording), comment, out)
}

/// Writes the given columns losslessly, separated by commas. Times and forces are written if every row has
/// one.
///
/// # Errors
/// Errors of `out`.
pub fn write_as(recording: &Recording, columns: &Columns, comment: &str, out: impl Write) -> io::Result<()> {
    let forces_known = recording.rows.iter().all(|row| row.force_n.is_some());
    let columns = Columns { force: columns.force.clone().filter(|_| forces_known), ..columns.clone() };
    let times_known = recording.times_s().is_some();
    let timed = |time: Option<String>, rest: Vec<String>| -> Vec<String> {
        time.into_iter().filter(|_| times_known).chain(rest).collect()
    };
    let (time_column, time_unit) = match &columns.time {
        Some(time) => (column_name(&time.column), time.unit),
        None => (TIME.to_owned(), Unit::NONE),
    };
    let heading = timed(Some(time_column), header(&columns));
    let time = |row: &Row| row.time_s.map(|time_s| time_unit.format_si(time_s));
    let rows = recording.rows.iter().map(|row| timed(time(row), record(row, &columns)));
    write_lines(comment, std::iter::once(heading).chain(rows), out)
}

/// Writes a timed recording as [`write()`] does.
///
/// # Errors
/// Errors of `out`.
pub fn write_timed(timed: &TimedRecording, extent: Extent, comment: &str, out: impl Write) -> io::Result<()> {
    let columns = Columns::own(&timed.recording.channels, &timed.recording.kinds, extent);
    let columns = with_nuisances(columns, &timed.recording);
    let timed_record = |time: String, second: [String; 2], rest: Vec<String>| {
        let second = second.into_iter().filter(|_| !timed.second.is_empty());
        std::iter::once(time).chain(second).chain(rest).collect::<Vec<_>>()
    };
    let heading = timed_record(TIME.to_owned(), SECOND.map(str::to_owned), header(&columns));
    let rows = timed.recording.rows.iter().zip(&timed.times_s).enumerate().map(|(i, (row, time_s))| {
        let second = timed.second.get(i).map_or_else(Default::default, |contact| {
            [columns.position_unit.format_si(contact.position.x_m), Unit::NONE.format_si(contact.force_n)]
        });
        timed_record(Unit::NONE.format_si(*time_s), second, record(row, &columns))
    });
    write_lines(comment, std::iter::once(heading).chain(rows), out)
}

fn with_nuisances(columns: Columns, recording: &Recording) -> Columns {
    let count = recording.rows.iter().map(|row| row.nuisances.len()).max().unwrap_or(0);
    (1..=count)
        .fold(columns, |columns, number| columns.nuisance(format!("nuisance_{number}").as_str(), Unit::NONE))
}

fn write_lines(
    comment: &str,
    lines: impl Iterator<Item = Vec<String>>,
    mut out: impl Write,
) -> io::Result<()> {
    writeln!(out, "# {}", comment.replace(['\r', '\n'], " "))?;
    for line in lines {
        out.write_all(csv_row(line).as_bytes())?;
    }
    out.flush()
}

/// Returns a CSV line (RFC 4180).
pub fn csv_row(fields: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let mut line = String::new();
    for (i, field) in fields.into_iter().enumerate() {
        if i > 0 {
            line.push(',');
        }
        let field = field.as_ref();
        if field.contains([',', '"', '\r', '\n']) {
            line.push('"');
            line += &field.replace('"', "\"\"");
            line.push('"');
        } else {
            line += field;
        }
    }
    line.push('\n');
    line
}

fn header(columns: &Columns) -> Vec<String> {
    let position = match &columns.position {
        PositionColumns::Along(x) => vec![x],
        PositionColumns::Plane { x, y } => vec![x, y],
    };
    let force = columns.force.iter().map(|force| &force.values.column);
    let nuisances = columns.nuisances().map(|nuisance| &nuisance.column);
    let channels = columns.channels.iter().map(|channel| &channel.column);
    let all = position.into_iter().chain(force).chain(nuisances).chain(channels);
    all.map(column_name).collect()
}

fn column_name(column: &Column) -> String {
    match column {
        Column::Name(name) => name.clone(),
        Column::Number(number) => number.to_string(),
    }
}

fn record(row: &Row, columns: &Columns) -> Vec<String> {
    let origin = columns.frame.origin;
    let mut record = vec![columns.position_unit.format_si(row.position.x_m + origin.x_m)];
    if let PositionColumns::Plane { .. } = columns.position {
        record.push(columns.position_unit.format_si(row.position.y_m + origin.y_m));
    }
    if let (Some(force), Some(force_n)) = (&columns.force, row.force_n) {
        record.push(force.values.unit.format_si(force_n));
    }
    record.extend(columns.nuisances().enumerate().map(|(i, nuisance)| {
        row.nuisances.get(i).map_or_else(String::new, |value| nuisance.unit.format_si(*value))
    }));
    record.extend(
        columns.channels.iter().zip(&row.reading).map(|(channel, value)| channel.unit.format_si(*value)),
    );
    record
}

#[cfg(test)]
mod tests {
    use super::csv_row;
    use crate::recording::cells::split;
    use crate::recording::marks::Separator;

    #[test]
    fn a_field_is_quoted_where_it_must_be() {
        let fields = ["plain", "with, comma", "with \"quotes\"", "", "5 µm", " spaced "];
        let line = csv_row(fields);
        assert_eq!(line, "plain,\"with, comma\",\"with \"\"quotes\"\"\",,5 µm, spaced \n");
        let read: Vec<_> = split(line.trim_end_matches('\n'), Separator::Comma)
            .unwrap()
            .into_iter()
            .map(|f| f.value)
            .collect();
        assert_eq!(read, fields.map(str::trim));
        assert_eq!(csv_row(["two\nlines", "b"]), "\"two\nlines\",b\n");
    }
}
