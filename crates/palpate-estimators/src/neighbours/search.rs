//! The nearest rows of a recording, and the mean of their positions.

use super::Neighbour;
use palpate_mechanics::contact::Position;

/// The `most` nearest of `rows` to `place`, nearest first, with their squared distances. Ties go to the earlier row.
pub(super) fn nearest<'a>(
    rows: impl Iterator<Item = &'a Neighbour>,
    place: &[f64],
    most: usize,
) -> Vec<(f64, &'a Neighbour)> {
    let squared =
        |row: &Neighbour| row.features.iter().zip(place).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let mut found: Vec<(f64, &Neighbour)> = Vec::with_capacity(most + 1);
    for row in rows {
        let distance = squared(row);
        if found.len() == most && found.last().is_some_and(|(last, _)| distance >= *last) {
            continue;
        }
        let after = found.partition_point(|(other, _)| *other <= distance);
        found.insert(after, (distance, row));
        found.truncate(most);
    }
    found
}

/// Σ p_i/d_i / Σ 1/d_i over the nearest 1, 2, … of `found`: one position a count. Rows at distance 0 outweigh all others.
pub(super) fn means(found: &[(f64, &Neighbour)]) -> Vec<Position> {
    let exact = found.iter().take_while(|(squared, _)| *squared == 0.0).count();
    let (mut x, mut y, mut total) = (0.0, 0.0, 0.0);
    let mut means = Vec::with_capacity(found.len());
    for (i, (squared, row)) in found.iter().enumerate() {
        if exact == 0 || i < exact {
            let weight = if exact == 0 { 1.0 / squared.sqrt() } else { 1.0 };
            x += weight * row.position.x_m;
            y += weight * row.position.y_m;
            total += weight;
        }
        means.push(Position { x_m: x / total, y_m: y / total });
    }
    means
}
