//! Where and how hard a surface is touched; the same types as on a microcontroller.

pub use palpate_core::{Contact, Position};

/// Positions in millimetres with two decimals at most: "35, 40 mm"; on a plane "(10, 20), (10, 180) mm".
pub fn in_words(positions: &[Position], plane: bool) -> String {
    let mm = |length_m: f64| {
        let text = format!("{:.2}", length_m * 1e3);
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    let place = |at: &Position| {
        if plane { format!("({}, {})", mm(at.x_m), mm(at.y_m)) } else { mm(at.x_m) }
    };
    format!("{} mm", positions.iter().map(place).collect::<Vec<_>>().join(", "))
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
}
