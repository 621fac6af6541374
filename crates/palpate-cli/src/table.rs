//! Tables for people.

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

#[cfg(test)]
mod tests {
    use super::*;

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
