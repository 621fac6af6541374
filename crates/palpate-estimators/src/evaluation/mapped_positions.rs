//! Positions of a recording that count along another axis than the locator's: measured from the other end, or with the axes exchanged.

use super::Evaluation;
use crate::status::SIGNIFICANCE;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::binomial_tail;

/// Map of a surface onto itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceMap {
    /// x → length − x.
    MirroredX,
    /// y → width − y.
    MirroredY,
    /// x → length − x and y → width − y.
    Turned,
    /// x ↔ y.
    Exchanged,
}

impl SurfaceMap {
    /// The maps of an extent: a line has no y.
    fn all_of(extent: Extent) -> &'static [Self] {
        match extent {
            Extent::Line { .. } => &[Self::MirroredX],
            Extent::Plane { .. } => &[Self::MirroredX, Self::MirroredY, Self::Turned, Self::Exchanged],
        }
    }

    /// The map as a formula.
    pub fn formula(self) -> &'static str {
        match self {
            Self::MirroredX => "x → length − x",
            Self::MirroredY => "y → width − y",
            Self::Turned => "x → length − x and y → width − y",
            Self::Exchanged => "x and y exchanged",
        }
    }

    fn map(self, Position { x_m, y_m }: Position, extent: Extent) -> Position {
        let (length_m, width_m) = (extent.length_m(), extent.width_m().unwrap_or(0.0));
        match self {
            Self::MirroredX => Position { x_m: length_m - x_m, y_m },
            Self::MirroredY => Position { x_m, y_m: width_m - y_m },
            Self::Turned => Position { x_m: length_m - x_m, y_m: width_m - y_m },
            Self::Exchanged => Position { x_m: y_m, y_m: x_m },
        }
    }
}

/// Map of the recorded positions that makes a locator's errors smaller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedPositions {
    /// The map.
    pub map: SurfaceMap,
    /// Mean error as recorded, in metres.
    pub recorded_m: f64,
    /// Mean error of mapped positions, in metres.
    pub mapped_m: f64,
}

impl Evaluation {
    /// The map of recorded positions that explains the errors: with it the mean error is less than half, and errors are smaller at more places than
    /// chance explains (sign test, 5 % level over all maps). `None` without such a map.
    pub fn mapped_positions(&self) -> Option<MappedPositions> {
        let places = self.by_position();
        let maps = SurfaceMap::all_of(self.extent);
        let level = SIGNIFICANCE / maps.len() as f64;
        let found = maps.iter().filter_map(|map| self.errors_with(*map, &places, level));
        found.min_by(|a, b| a.mapped_m.total_cmp(&b.mapped_m))
    }

    fn errors_with(
        &self,
        map: SurfaceMap,
        places: &[(Position, Self)],
        level: f64,
    ) -> Option<MappedPositions> {
        let (mut sums_m, mut better, mut worse) = ([0.0; 2], 0, 0);
        for (truth, evaluation) in places {
            let [recorded_m, mapped_m] = [*truth, map.map(*truth, self.extent)].map(|truth| {
                evaluation.located.iter().map(|located| located.estimate.distance_m(truth)).sum::<f64>()
            });
            sums_m[0] += recorded_m;
            sums_m[1] += mapped_m;
            // In the middle both are equal.
            better += usize::from(mapped_m < recorded_m);
            worse += usize::from(mapped_m > recorded_m);
        }
        let [recorded_m, mapped_m] = sums_m.map(|sum_m| sum_m / self.located.len() as f64);
        let is_found = binomial_tail(better + worse, better, 0.5) < level && mapped_m < 0.5 * recorded_m;
        is_found.then_some(MappedPositions { map, recorded_m, mapped_m })
    }
}
