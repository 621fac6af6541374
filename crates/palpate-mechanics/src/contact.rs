//! Where and how hard a surface is touched; the same types as on a microcontroller.

pub use palpate_core::{Contact, Position};

/// Positions in millimetres with two decimals at most: "35, 40 mm"; on a plane "(10, 20), (10, 180) mm", and where they are a
/// grid, at least two by three, "x 10, 20, 30 with y 50, 100 mm each".
pub fn in_words(positions: &[Position], plane: bool) -> String {
    let place = |at: &Position| {
        if plane { format!("({}, {})", mm(at.x_m), mm(at.y_m)) } else { mm(at.x_m) }
    };
    match grid(positions).filter(|_| plane) {
        Some((columns, rows)) => format!("x {} with y {} mm each", columns.join(", "), rows.join(", ")),
        None => format!("{} mm", positions.iter().map(place).collect::<Vec<_>>().join(", ")),
    }
}

fn mm(length_m: f64) -> String {
    let text = format!("{:.2}", length_m * 1e3);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// The columns and rows of a grid whose positions go row by row, as they are written.
fn grid(positions: &[Position]) -> Option<(Vec<String>, Vec<String>)> {
    let first = mm(positions.first()?.y_m);
    let columns: Vec<String> =
        positions.iter().take_while(|at| mm(at.y_m) == first).map(|at| mm(at.x_m)).collect();
    let rows: Vec<String> = positions.iter().step_by(columns.len()).map(|at| mm(at.y_m)).collect();
    let at = |i: usize| (&columns[i % columns.len()], &rows[i / columns.len()]);
    let whole = positions.len() == columns.len() * rows.len();
    let is_grid =
        whole && positions.iter().enumerate().all(|(i, place)| at(i) == (&mm(place.x_m), &mm(place.y_m)));
    (is_grid && columns.len().min(rows.len()) >= 2 && positions.len() >= 6).then_some((columns, rows))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_read_well() {
        let positions = [Position { x_m: 0.035, y_m: 0.0 }, Position { x_m: 0.1 / 3.0, y_m: 0.2 }];
        assert_eq!(in_words(&positions, false), "35, 33.33 mm");
        assert_eq!(in_words(&positions, true), "(35, 0), (33.33, 200) mm");
    }

    #[test]
    fn a_grid_is_told_by_its_columns_and_rows() {
        let at = |i: usize| Position { x_m: 0.01 * (i % 3) as f64, y_m: 0.1 * (i / 3) as f64 };
        let mut positions: Vec<Position> = (0..6).map(at).collect();
        assert_eq!(in_words(&positions, true), "x 0, 10, 20 with y 0, 100 mm each");
        assert_eq!(in_words(&positions[..5], true), "(0, 0), (10, 0), (20, 0), (0, 100), (10, 100) mm");
        positions[4].x_m = 0.011;
        assert!(in_words(&positions, true).starts_with("(0, 0), (10, 0), "));
    }
}
