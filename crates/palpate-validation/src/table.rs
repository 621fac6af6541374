//! Tables of figures.

use serde::{Deserialize, Serialize};

/// Value with its Monte-Carlo standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// In the unit of the column.
    pub value: f64,
    /// Standard error; `None` for an exact value, an extreme, or a mean of one value.
    pub standard_error: Option<f64>,
}

impl Figure {
    /// Without a standard error.
    pub const fn exact(value: f64) -> Self {
        Self { value, standard_error: None }
    }

    /// Value ± standard error.
    pub fn text(self, decimals: usize) -> String {
        let Self { value, standard_error } = self;
        match standard_error {
            Some(error) => format!("{value:.decimals$} ± {error:.decimals$}"),
            None => format!("{value:.decimals$}"),
        }
    }
}

/// Direction in which a figure is better.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// Smaller is better: an error.
    Smaller,
    /// Larger is better: a share of detected contacts.
    Larger,
    /// Nearer to this value is better: the coverage of an interval.
    Near(f64),
    /// Neither is better: a width, or a reference.
    None,
}

impl Goal {
    /// Coverage of 95 % intervals.
    pub const COVERAGE: Self = Self::Near(95.0);
}

/// Column of figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Name.
    pub name: String,
    /// Unit, such as "mm".
    pub unit: String,
    /// Better direction.
    pub goal: Goal,
    /// Decimals in Markdown.
    pub decimals: usize,
}

impl Column {
    /// Column in a unit.
    pub fn new(name: &str, unit: &str, goal: Goal) -> Self {
        let decimals = if unit == "%" { 1 } else { 2 };
        Self { name: name.to_owned(), unit: unit.to_owned(), goal, decimals }
    }

    /// Column in %.
    pub fn percent(name: &str, goal: Goal) -> Self {
        Self::new(name, "%", goal)
    }

    /// Column in mm.
    pub fn mm(name: &str, goal: Goal) -> Self {
        Self::new(name, "mm", goal)
    }
}

/// Row of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Values of the table's labels.
    pub labels: Vec<String>,
    /// Figures by column; `None` if missing.
    pub figures: Vec<Option<Figure>>,
    /// Reason for missing figures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

impl Row {
    /// Row of figures.
    pub fn new(labels: &[&str], figures: Vec<Option<Figure>>) -> Self {
        let labels = labels.iter().map(|label| (*label).to_owned()).collect();
        Self { labels, figures, failure: None }
    }

    /// Joined labels.
    pub fn name(&self) -> String {
        self.labels.join(", ")
    }
}

/// Table of figures with standard errors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Title.
    pub title: String,
    /// Names of the labels.
    pub labels: Vec<String>,
    /// Columns of figures.
    pub columns: Vec<Column>,
    /// Rows.
    pub rows: Vec<Row>,
}

impl Table {
    /// Empty table.
    pub fn new(title: &str, labels: &[&str], columns: Vec<Column>) -> Self {
        let labels = labels.iter().map(|label| (*label).to_owned()).collect();
        Self { title: title.to_owned(), labels, columns, rows: Vec::new() }
    }

    /// Table in Markdown.
    pub fn markdown(&self) -> String {
        let named = |column: &Column| match column.unit.as_str() {
            "" => column.name.clone(),
            unit => format!("{} ({unit})", column.name),
        };
        let head: Vec<String> = self.labels.iter().cloned().chain(self.columns.iter().map(named)).collect();
        let mut text = format!("{}\n\n{}{}\n", self.title, line(&head), "|---".repeat(head.len()) + "|");
        for row in &self.rows {
            let figures = row.figures.iter().zip(&self.columns).map(|(figure, column)| match figure {
                None => "–".to_owned(),
                Some(figure) => figure.text(column.decimals),
            });
            let mut cells: Vec<String> = row.labels.iter().cloned().chain(figures).collect();
            if let (Some(failure), Some(first)) = (&row.failure, cells.get_mut(row.labels.len())) {
                first.clone_from(failure);
            }
            text += &line(&cells);
        }
        text
    }
}

fn line(cells: &[String]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "/")).collect();
    format!("| {} |\n", cells.join(" | "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markdown_has_figures_with_errors_and_failures_with_reasons() {
        let columns = vec![Column::percent("covered", Goal::COVERAGE), Column::mm("error", Goal::Smaller)];
        let mut table = Table::new("Contacts.", &["place"], columns);
        let figure = |value, error| Some(Figure { value, standard_error: Some(error) });
        table.rows.push(Row::new(&["3 mm"], vec![figure(95.04, 0.31), None]));
        let failure = Some("no | presses".to_owned());
        table.rows.push(Row { failure, ..Row::new(&["9 mm"], vec![None, None]) });
        let expected = "Contacts.\n\n| place | covered (%) | error (mm) |\n|---|---|---|\n\
            | 3 mm | 95.0 ± 0.3 | – |\n| 9 mm | no / presses | – |\n";
        assert_eq!(table.markdown(), expected);
    }
}
