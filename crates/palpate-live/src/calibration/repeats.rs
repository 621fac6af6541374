use super::press::Press;
use palpate_estimators::recording::Row;
use palpate_mechanics::contact::Position;

/// Place of a plan, with its scatter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Position.
    pub position: Position,
    /// Recorded presses.
    pub recorded: usize,
    /// Remaining presses.
    pub left: usize,
    /// Relative standard deviation in %; `None` for one press, or different forces.
    pub spread_percent: Option<f64>,
}

/// Places of past and future presses, sorted.
pub fn places(rows: &[Row], to_come: &[Press]) -> Vec<Place> {
    let mut positions: Vec<Position> = rows
        .iter()
        .filter(|row| row.touches())
        .map(|row| row.position)
        .chain(to_come.iter().map(|press| press.position))
        .collect();
    positions.sort_by(|a, b| a.x_m.total_cmp(&b.x_m).then(a.y_m.total_cmp(&b.y_m)));
    positions.dedup();
    let place = |position: Position| {
        let here: Vec<(usize, &Row)> =
            rows.iter().enumerate().filter(|(_, row)| row.touches() && row.position == position).collect();
        Place {
            position,
            recorded: here.len(),
            left: to_come.iter().filter(|press| press.position == position).count(),
            spread_percent: range_percent(rows, &here),
        }
    };
    positions.into_iter().map(place).collect()
}

/// Relative deviation of the last press from the mean of its repeats, in %.
pub fn last_deviation_percent(rows: &[Row]) -> Option<f64> {
    deviation_percent(rows, rows.len().checked_sub(1)?)
}

/// Relative deviation of a press from the mean of its repeats, in %; `None` without repeats, or untouched.
pub fn deviation_percent(rows: &[Row], at: usize) -> Option<f64> {
    let press = rows.get(at).filter(|row| row.touches())?;
    let others = rows.iter().enumerate().filter(|(i, row)| *i != at && is_repeat(row, press));
    let others: Vec<&Row> = others.map(|(_, row)| row).collect();
    let untouched = untouched_before(rows, at)?;
    if others.is_empty() {
        return None;
    }
    let mean = mean(&others, press.reading.len());
    let size = distance(&mean, &untouched.reading);
    (size > 0.0).then(|| 100.0 * distance(&press.reading, &mean) / size)
}

fn range_percent(rows: &[Row], here: &[(usize, &Row)]) -> Option<f64> {
    let [(first_at, first), _, ..] = here else { return None };
    if here.iter().any(|(_, row)| !is_repeat(row, first)) {
        return None;
    }
    let untouched = untouched_before(rows, *first_at)?;
    let presses: Vec<&Row> = here.iter().map(|(_, row)| *row).collect();
    let mean = mean(&presses, first.reading.len());
    let squares: f64 = presses.iter().map(|row| distance(&row.reading, &mean).powi(2)).sum();
    let size = distance(&mean, &untouched.reading);
    (size > 0.0).then(|| 100.0 * (squares / (presses.len() - 1) as f64).sqrt() / size)
}

fn is_repeat(row: &Row, other: &Row) -> bool {
    row.touches()
        && row.position == other.position
        && row.force_n == other.force_n
        && row.nuisances == other.nuisances
}

pub(super) fn untouched_before(rows: &[Row], at: usize) -> Option<&Row> {
    rows[..at].iter().rev().find(|row| !row.touches())
}

fn mean(rows: &[&Row], channels: usize) -> Vec<f64> {
    (0..channels)
        .map(|channel| rows.iter().map(|row| row.reading[channel]).sum::<f64>() / rows.len() as f64)
        .collect()
}

/// Euclidean distance.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(x_m: f64, force_n: f64, reading: [f64; 2]) -> Row {
        Row {
            position: Position::along(x_m),
            force_n: Some(force_n),
            nuisances: Vec::new(),
            time_s: None,
            reading: reading.to_vec(),
        }
    }

    #[test]
    fn repeats_are_measured_against_the_size_of_their_press() {
        let press = Press { position: Position::along(0.3), force_n: None, depth_m: None };
        // Deviation (3, 4) has norm 5.
        let rows = [row(0.0, 0.0, [1.0, 1.0]), row(0.1, 2.0, [4.0, 5.0]), row(0.1, 2.0, [4.0, 5.1])];
        assert!((last_deviation_percent(&rows).unwrap() - 2.0).abs() < 1e-9);
        let places = places(&rows, &[press]);
        assert_eq!((places[0].recorded, places[0].left, places[1].recorded, places[1].left), (2, 0, 0, 1));
        // Standard deviation 0.1 / √2.
        let spread = places[0].spread_percent.unwrap();
        assert!((spread - 100.0 * 0.1 / 2f64.sqrt() / 5.04).abs() < 0.01, "{spread}");
        assert_eq!(places[1].spread_percent, None);
    }

    #[test]
    fn a_press_is_measured_against_its_repeats_before_and_after() {
        let rows = [
            row(0.0, 0.0, [0.0, 0.0]),
            row(0.1, 2.0, [0.0, 8.0]),
            row(0.1, 2.0, [0.0, 10.0]),
            row(0.2, 2.0, [5.0, 5.0]),
            row(0.1, 2.0, [0.0, 10.0]),
        ];
        assert!((deviation_percent(&rows, 1).unwrap() - 20.0).abs() < 1e-9);
        assert_eq!([0, 3, 5].map(|at| deviation_percent(&rows, at)), [None; 3]);
    }

    #[test]
    fn presses_of_different_forces_are_no_repeats() {
        let rows = [row(0.0, 0.0, [0.0, 0.0]), row(0.1, 1.0, [1.0, 1.0]), row(0.1, 2.0, [2.0, 2.0])];
        assert_eq!(last_deviation_percent(&rows), None);
        assert_eq!(places(&rows, &[])[0].spread_percent, None);
    }
}
