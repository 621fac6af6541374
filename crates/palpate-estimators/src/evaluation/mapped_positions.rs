//! Detection of mirrored or exchanged axes.

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
    fn all_of(extent: Extent) -> &'static [Self] {
        match extent {
            Extent::Line { .. } => &[Self::MirroredX],
            Extent::Plane { .. } => &[Self::MirroredX, Self::MirroredY, Self::Turned, Self::Exchanged],
        }
    }

    /// Map as a formula.
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

/// Map of recorded positions that reduces the errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MappedPositions {
    /// Map.
    pub map: SurfaceMap,
    /// Mean error of recorded positions.
    pub recorded_m: f64,
    /// Mean error of mapped positions.
    pub mapped_m: f64,
}

impl Evaluation {
    /// Map with less than half the mean error, significant at most positions (sign test, 5 % level over all
    /// maps).
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
            // Both errors are equal in the middle.
            better += usize::from(mapped_m < recorded_m);
            worse += usize::from(mapped_m > recorded_m);
        }
        let [recorded_m, mapped_m] = sums_m.map(|sum_m| sum_m / self.located.len() as f64);
        let is_found = binomial_tail(better + worse, better, 0.5) < level && mapped_m < 0.5 * recorded_m;
        is_found.then_some(MappedPositions { map, recorded_m, mapped_m })
    }
}
