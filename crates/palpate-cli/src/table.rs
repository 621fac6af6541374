//! Tables and numbers for people.

use comfy_table::{CellAlignment, Table, presets};

/// A table with a heading; the columns after the first are aligned to the right.
pub fn table(heading: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(heading);
    for row in rows {
        table.add_row(row);
    }
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 2));
        column.set_cell_alignment(if i == 0 { CellAlignment::Left } else { CellAlignment::Right });
    }
    let lines = table.to_string();
    lines.lines().map(str::trim_end).collect::<Vec<_>>().join("\n")
}

/// "12,345"
pub fn thousands(number: f64) -> String {
    let digits = format!("{number:.0}");
    let (sign, digits) = digits.strip_prefix('-').map_or(("", digits.as_str()), |rest| ("-", rest));
    let groups: Vec<&str> =
        (0..digits.len()).rev().step_by(3).map(|end| &digits[end.saturating_sub(2)..=end]).collect();
    sign.to_owned() + &groups.into_iter().rev().collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_parted() {
        let numbers = [0.0, 12.0, 999.4, 1000.0, 1_234_567.0, -26_850.0];
        assert_eq!(numbers.map(thousands), ["0", "12", "999", "1,000", "1,234,567", "-26,850"]);
    }

    #[test]
    fn columns_line_up() {
        let text =
            table(&["arm", "epochs"], [vec!["a".into(), "1".into()], vec!["long".into(), "100".into()]]);
        insta::assert_snapshot!(text, @r"
        arm   epochs
        a          1
        long     100
        ");
    }
}
