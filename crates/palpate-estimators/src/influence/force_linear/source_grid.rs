//! Candidate positions of a point sensor.

use palpate_mechanics::surface::Extent;

/// Middles of cells of equal size, with equal prior probabilities.
pub(super) struct SourceGrid {
    pub places_m: Vec<Vec<f64>>,
    /// Size of a cell.
    steps_m: Vec<f64>,
    /// Cells of the whole surface.
    pub cells: f64,
}

impl SourceGrid {
    /// Grid of the whole surface.
    pub fn new(extent: Extent) -> Self {
        /// Count along a line; below, along a plane's longer side.
        const ALONG: usize = 600;
        const OF_PLANE: usize = 30;
        let middles =
            |size_m: f64, count: usize| (0..count).map(move |i| size_m * (i as f64 + 0.5) / count as f64);
        let length_m = extent.length_m();
        let (places_m, steps_m): (Vec<Vec<f64>>, Vec<f64>) = match extent.width_m() {
            None => (middles(length_m, ALONG).map(|x_m| vec![x_m]).collect(), vec![length_m / ALONG as f64]),
            Some(width_m) => {
                let longer_m = length_m.max(width_m);
                let count = |size_m: f64| ((OF_PLANE as f64 * size_m / longer_m).ceil() as usize).max(2);
                let across = |x_m: f64| middles(width_m, count(width_m)).map(move |y_m| vec![x_m, y_m]);
                let steps_m = [length_m, width_m].map(|size_m| size_m / count(size_m) as f64);
                (middles(length_m, count(length_m)).flat_map(across).collect(), steps_m.to_vec())
            }
        };
        Self { cells: places_m.len() as f64, places_m, steps_m }
    }

    /// Four parts of each of the `cells`, given by index.
    pub fn divided(&self, cells: &[usize]) -> Self {
        let [parts, fraction] = if self.steps_m.len() == 1 { [4.0, 0.25] } else { [2.0, 0.5] };
        let offsets =
            |step_m: f64| (0..parts as usize).map(move |i| ((i as f64 + 0.5) / parts - 0.5) * step_m);
        let parts_of = |place_m: &Vec<f64>| -> Vec<Vec<f64>> {
            match (place_m.as_slice(), self.steps_m.as_slice()) {
                ([x_m], [step_m]) => offsets(*step_m).map(|offset| vec![x_m + offset]).collect(),
                ([x_m, y_m], [along_m, across_m]) => offsets(*along_m)
                    .flat_map(|along| offsets(*across_m).map(move |across| vec![x_m + along, y_m + across]))
                    .collect(),
                _ => vec![place_m.clone()],
            }
        };
        Self {
            places_m: cells.iter().flat_map(|cell| parts_of(&self.places_m[*cell])).collect(),
            steps_m: self.steps_m.iter().map(|step_m| step_m * fraction).collect(),
            cells: 4.0 * self.cells,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_all_cells_are_a_finer_grid_of_the_surface() {
        for extent in [Extent::line(0.3).unwrap(), Extent::plane(0.3, 0.2).unwrap()] {
            let grid = SourceGrid::new(extent);
            let parts = grid.divided(&(0..grid.places_m.len()).collect::<Vec<_>>());
            assert_eq!(parts.places_m.len() as f64, parts.cells);
            let mean = |grid: &SourceGrid, k: usize| {
                grid.places_m.iter().map(|place_m| place_m[k]).sum::<f64>() / grid.places_m.len() as f64
            };
            for (k, size_m) in [extent.length_m(), extent.width_m().unwrap_or(0.0)].into_iter().enumerate() {
                if k < extent.dimensions() {
                    assert!((mean(&parts, k) - 0.5 * size_m).abs() < 1e-12);
                    let least = parts.places_m.iter().map(|place_m| place_m[k]).fold(f64::INFINITY, f64::min);
                    assert!((least - 0.5 * parts.steps_m[k]).abs() < 1e-12);
                }
            }
        }
    }
}
