//! Output of a command on stdout: lines, JSON and tables.

use crate::failure::{Failure, UserError};
use crate::stdout;
use comfy_table::{CellAlignment, presets};
use palpate_mechanics::units::format_count;
use std::fmt::Display;
use std::io::{ErrorKind, Write};
use std::path::Path;

pub fn print_report_path(before: &str, folder: Option<&Path>) -> Result<(), Failure> {
    match folder {
        Some(folder) => print_line(format!("{before}Report: {}", folder.join("report.html").display())),
        None => Ok(()),
    }
}

pub fn print_line(line: impl Display) -> Result<(), Failure> {
    print(&mut std::io::stdout().lock(), format!("{line}\n").as_bytes())
}

pub fn print_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    print_line(to_json(value)?)
}

pub fn print_json_line(value: &impl serde::Serialize) -> Result<(), Failure> {
    print_line(serde_json::to_string(value).map_err(UserError::new)?)
}

pub fn to_json(value: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(|error| UserError::new(error).into())
}

/// Writes to stdout or its replacement; a closed reader is not an error.
pub fn print(out: &mut impl Write, bytes: &[u8]) -> Result<(), Failure> {
    if stdout::was_closed() {
        return Err(closed());
    }
    out.write_all(bytes).map_err(|error| print_failure(&error))
}

/// Flushes the output: the reader of a pipe gets each result at once.
pub fn flush(out: &mut impl Write) -> Result<(), Failure> {
    out.flush().map_err(|error| print_failure(&error))
}

/// Failure of a write to stdout; a closed reader is not an error.
pub fn print_failure(error: &std::io::Error) -> Failure {
    match error.kind() {
        ErrorKind::BrokenPipe => Failure::NobodyReads,
        _ => UserError::new(format!("cannot write to stdout: {error}")).into(),
    }
}

pub fn closed() -> Failure {
    UserError::new("cannot write to stdout: it is closed").into()
}

/// A text table; the columns after the first are aligned to the right.
pub struct Table<R> {
    rows: Vec<R>,
    heading: Vec<String>,
    cells: Vec<Vec<String>>,
}

impl<R> Table<R> {
    pub fn from_rows(rows: impl IntoIterator<Item = R>) -> Self {
        let rows: Vec<R> = rows.into_iter().collect();
        Self { cells: vec![Vec::new(); rows.len()], heading: Vec::new(), rows }
    }

    pub fn column(mut self, heading: impl Into<String>, cell: impl Fn(&R) -> String) -> Self {
        self.heading.push(heading.into());
        self.cells.iter_mut().zip(&self.rows).for_each(|(cells, row)| cells.push(cell(row)));
        self
    }

    pub fn row(mut self, cells: Vec<String>) -> Self {
        self.cells.push(cells);
        self
    }
}

impl<R> Display for Table<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut table = comfy_table::Table::new();
        table.load_preset(presets::NOTHING).set_header(&self.heading).add_rows(&self.cells);
        for (i, column) in table.column_iter_mut().enumerate() {
            column.set_padding((0, 2));
            column.set_cell_alignment(if i == 0 { CellAlignment::Left } else { CellAlignment::Right });
        }
        f.write_str(&table.to_string().lines().map(str::trim_end).collect::<Vec<_>>().join("\n"))
    }
}

/// Formats three decimals, or a whole number if it has many digits before the point; a dash for
/// `None`.
pub fn figure(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(value) if value >= 100.0 => format_count(value.round() as u64),
        Some(value) => format!("{value:.3}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let table = Table::from_rows([("a", 1), ("long", 100)])
            .column("arm", |(name, _)| (*name).to_owned())
            .column("epochs", |(_, epochs)| epochs.to_string());
        insta::assert_snapshot!(table.to_string(), @r"
        arm   epochs
        a          1
        long     100
        ");
    }
}
