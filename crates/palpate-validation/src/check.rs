//! Policy of `--check`: when a figure is worse than the stored one.

use crate::experiment::Size;
use crate::report::Report;
use crate::table::{Figure, Goal, Row, Table};

/// Threshold in standard errors of the difference; chance exceeds it for 0.03 of 1,000 figures.
const STANDARD_ERRORS: f64 = 4.0;

/// True if worse by more than [`STANDARD_ERRORS`] standard errors √(σ₁² + σ₂²) of the difference. Figures without a standard error are not compared.
/// For [`Goal::Near`] the loss is the growth of the distance.
fn is_worse(stored: Figure, measured: Figure, goal: Goal) -> bool {
    let (Some(stored_error), Some(measured_error)) = (stored.standard_error, measured.standard_error) else {
        return false;
    };
    let loss = match goal {
        Goal::Smaller => measured.value - stored.value,
        Goal::Larger => stored.value - measured.value,
        Goal::Near(goal) => (measured.value - goal).abs() - (stored.value - goal).abs(),
        Goal::None => return false,
    };
    let rounding = 1e-9 * stored.value.abs();
    loss > STANDARD_ERRORS * stored_error.hypot(measured_error) + rounding
}

/// Worse figures, a line each: experiment, row, column, stored and measured value. Missing figures, rows and tables are lines too, except for rows
/// that a quick experiment omits.
pub fn worse_figures(stored: &Report, measured: &Report) -> Vec<String> {
    let mut lines = Vec::new();
    let of_experiment = |line: String| format!("{}: {line}", measured.experiment);
    for table in &stored.tables {
        match measured.tables.iter().find(|other| other.title == table.title) {
            Some(other) => {
                lines.extend(worse_in_table(table, other, measured.size).into_iter().map(of_experiment));
            }
            None if measured.size == Size::Quick => {}
            None => lines.push(of_experiment(format!("table not measured: {}", table.title))),
        }
    }
    lines
}

fn worse_in_table(stored: &Table, measured: &Table, size: Size) -> Vec<String> {
    let mut lines = Vec::new();
    for row in &stored.rows {
        match measured.rows.iter().find(|other| other.labels == row.labels) {
            Some(other) => lines.extend(worse_in_row((stored, row), (measured, other), size)),
            None if size == Size::Quick => {}
            None => lines.push(format!("row not measured: {}", row.name())),
        }
    }
    lines
}

fn worse_in_row((stored, row): (&Table, &Row), (measured, other): (&Table, &Row), size: Size) -> Vec<String> {
    let mut lines = Vec::new();
    for (column, figure) in stored.columns.iter().zip(&row.figures) {
        let Some(figure) = figure else { continue };
        let place = measured.columns.iter().position(|other| other.name == column.name);
        let found = place.and_then(|place| other.figures.get(place).copied().flatten());
        let unit = &column.unit;
        let shown = |figure: Figure| format!("{} {unit}", figure.text(3)).trim_end().to_owned();
        match found {
            Some(found) if !is_worse(*figure, found, column.goal) => {}
            Some(found) => lines.push(format!(
                "{}, {}: stored {}, measured {}",
                row.name(),
                column.name,
                shown(*figure),
                shown(found)
            )),
            None if column.goal == Goal::None => {}
            // Few readings may have no contact that is detected.
            None if size == Size::Quick && other.failure.is_none() => {}
            None => {
                let reason = other.failure.as_deref().unwrap_or("no figure");
                let name = row.name();
                lines.push(format!("{name}, {}: stored {}, measured: {reason}", column.name, shown(*figure)));
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Column;

    const fn figure(value: f64, standard_error: f64) -> Figure {
        Figure { value, standard_error: Some(standard_error) }
    }

    #[test]
    fn a_figure_is_worse_beyond_four_errors_of_the_difference_in_its_direction() {
        let (stored, error) = (figure(10.0, 0.3), 0.4);
        // √(0.3² + 0.4²) = 0.5, so that 2 is the bound.
        for (goal, value, expected) in [
            (Goal::Smaller, 11.9, false),
            (Goal::Smaller, 12.1, true),
            (Goal::Smaller, 1.0, false),
            (Goal::Larger, 8.1, false),
            (Goal::Larger, 7.9, true),
            (Goal::None, 99.0, false),
        ] {
            assert_eq!(is_worse(stored, figure(value, error), goal), expected, "{goal:?} {value}");
        }
        // 92 % and 98 % are as far from 95 %.
        assert!(!is_worse(figure(98.0, 0.3), figure(92.0, 0.4), Goal::COVERAGE));
        assert!(is_worse(figure(95.0, 0.3), figure(92.9, 0.4), Goal::COVERAGE));
        assert!(is_worse(figure(95.0, 0.3), figure(97.1, 0.4), Goal::COVERAGE));
    }

    #[test]
    fn figures_without_a_standard_error_are_not_compared() {
        let [stored, alone] = [figure(1.0, 0.1), Figure::exact(9.0)];
        assert!(!is_worse(stored, alone, Goal::Smaller));
        assert!(!is_worse(alone, figure(19.0, 0.1), Goal::Smaller));
    }

    fn report(rows: Vec<Row>) -> Report {
        let columns = vec![Column::mm("error", Goal::Smaller)];
        let table = Table { rows, ..Table::new("Contacts.", &["place"], columns) };
        Report::for_test("strip", Size::Full, vec![table])
    }

    #[test]
    fn lines_name_row_stored_and_measured_values() {
        let row = |value| Row::new(&["3 mm"], vec![Some(figure(value, 0.1))]);
        let stored = report(vec![row(1.0)]);
        assert_eq!(worse_figures(&stored, &report(vec![row(1.3)])), [""; 0]);
        let worse = worse_figures(&stored, &report(vec![row(2.0)]));
        assert_eq!(worse, ["strip: 3 mm, error: stored 1.000 ± 0.100 mm, measured 2.000 ± 0.100 mm"]);
        let failed = Row { failure: Some("no fit".to_owned()), ..Row::new(&["3 mm"], vec![None]) };
        let worse = worse_figures(&stored, &report(vec![failed]));
        assert_eq!(worse, ["strip: 3 mm, error: stored 1.000 ± 0.100 mm, measured: no fit"]);
        assert_eq!(worse_figures(&stored, &report(Vec::new())), ["strip: row not measured: 3 mm"]);
    }
}
