//! Sizes of the unit readings of a sensor, for the expected Euler characteristic of noise along them (Adler and Taylor,
//! *Random Fields and Geometry*, 2007, section 12.4).

/// Returns the Lipschitz–Killing curvatures L₁ and L₂ of the unit vectors along the readings of a grid of `rows` rows: on a
/// surface half the length of its boundary, and its area; on a line of one row its length, and 0.
pub fn curvatures(rows: usize, columns: usize, reading: impl Fn(usize, usize) -> Vec<f64>) -> [f64; 2] {
    let unit = |row: usize, column: usize| {
        let reading = reading(row, column);
        let length = dot(&reading, &reading).sqrt();
        reading.into_iter().map(|value| value / length).collect::<Vec<f64>>()
    };
    let grid: Vec<Vec<Vec<f64>>> =
        (0..rows).map(|row| (0..columns).map(|column| unit(row, column)).collect()).collect();
    let step = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| b - a).collect() };
    // The unit vector of a zero reading is NaN, and the maximum of NaN and 0 is 0.
    let distance = |a: &[f64], b: &[f64]| dot(&step(a, b), &step(a, b)).sqrt().max(0.0);
    let along = |row: usize| grid[row].windows(2).map(|pair| distance(&pair[0], &pair[1])).sum::<f64>();
    let across =
        |column: usize| grid.windows(2).map(|pair| distance(&pair[0][column], &pair[1][column])).sum::<f64>();
    let half = 0.5 * (along(0) + along(rows - 1) + across(0) + across(columns - 1));
    let parallelogram = |row: usize, column: usize| {
        let here = &grid[row][column];
        let (a, b) = (step(here, &grid[row][column + 1]), step(here, &grid[row + 1][column]));
        (dot(&a, &a) * dot(&b, &b) - dot(&a, &b).powi(2)).sqrt().max(0.0)
    };
    let cells = (1..rows).flat_map(|row| (1..columns).map(move |column| (row - 1, column - 1)));
    [half, cells.map(|(row, column)| parallelogram(row, column)).sum()]
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn an_eighth_of_the_sphere_has_its_area_and_half_its_boundary() {
        const COUNT: usize = 200;
        let angle = |i: usize| FRAC_PI_2 * i as f64 / (COUNT - 1) as f64;
        let reading = |row: usize, column: usize| {
            let (latitude, longitude) = (angle(row), angle(column));
            vec![latitude.cos() * longitude.cos(), latitude.cos() * longitude.sin(), latitude.sin()]
        };
        let [half, area] = curvatures(COUNT, COUNT, reading);
        assert!((half / (1.5 * FRAC_PI_2) - 1.0).abs() < 1e-4, "{half}");
        assert!((area / FRAC_PI_2 - 1.0).abs() < 1e-2, "{area}");
        let [length, none] = curvatures(1, COUNT, |_, column| reading(0, column));
        assert!((length / FRAC_PI_2 - 1.0).abs() < 1e-4 && none == 0.0, "{length} {none}");
    }

    #[test]
    fn zero_reading_adds_zero() {
        let reading =
            |_: usize, column: usize| if column == 0 { vec![0.0; 2] } else { vec![1.0, column as f64] };
        let [length, _] = curvatures(1, 3, reading);
        assert!((length - (2.0 * (0.5 * (2f64.atan() - 1f64.atan())).sin())).abs() < 1e-12, "{length}");
    }
}
