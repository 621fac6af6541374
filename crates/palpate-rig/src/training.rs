//! `[contact]`, `[training]` and `[[load]]`: where and how hard the surface is pressed.

use serde::Deserialize;

use palpate_estimators::arrangement::{Arrangement, ArrangementError, Training};
use palpate_estimators::force_prior::ForceRange;
use palpate_mechanics::surface::{Digit, Extent, SurfaceSpec, UniformLoad};
use palpate_mechanics::units::format_length_mm;

use crate::document::{At, place};
use crate::error::{Place, RigError, RigProblem};
use crate::values::{Count, Force, Grid, Length, ON_A_PLANE, Point, Positive, Quantity, Ratio, check_order};

const MOST: i64 = 100_000;

/// The contacts to be located.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ContactKeys {
    /// Force of every contact, if it is known and the same for all; unknown by default.
    pub force: Option<At<Positive<Force>>>,
    /// Greatest value of an unknown force, on a surface with a model; ten times that of the presses by default.
    pub greatest_force: Option<At<Positive<Force>>>,
    /// Least and greatest force of contacts of unknown force: 1 in 200 is below the least, no contact is above the greatest; a decade either side
    /// of the presses by default.
    pub force_range: Option<At<ForceRangeKeys>>,
}

/// Least and greatest force.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(expecting = "a list of 2 forces, the least and the greatest, such as [\"0.5 N\", \"10 N\"]")]
pub(crate) struct ForceRangeKeys(Positive<Force>, Positive<Force>);

impl ContactKeys {
    pub fn force_range(&self, surface: &SurfaceSpec) -> Result<Option<ForceRange>, RigError> {
        let Some(range) = &self.force_range else { return Ok(None) };
        if self.force.is_some() {
            return Err(range.place.unused("`force`, by which the force is known"));
        }
        if let SurfaceSpec::Digit(_) = surface {
            return Err(range.place.unused("a digit: its model bounds the force"));
        }
        if let Some(greatest) = &self.greatest_force {
            return Err(greatest.place.unused("`force_range`, which contains the greatest force"));
        }
        let ForceRangeKeys(least, greatest) = **range;
        let built = ForceRange::new(least.si, greatest.si);
        built.map(Some).map_err(|_| {
            range.place.refuse_value(
                format!("{} N to {} N", least.si, greatest.si),
                "from a lesser to a greater force",
            )
        })
    }

    pub fn greatest_force_n(&self, surface: &SurfaceSpec) -> Result<Option<f64>, RigError> {
        let Some(greatest) = &self.greatest_force else { return Ok(None) };
        if self.force.is_some() {
            return Err(greatest.place.unused("`force`, by which the force is known"));
        }
        match surface {
            SurfaceSpec::Digit(_) => Err(greatest.place.unused("a digit: its model bounds the force")),
            surface if surface.model().is_none() => {
                Err(greatest.place.unused("a `measured` surface; give `force_range`"))
            }
            _ => Ok(Some(greatest.si)),
        }
    }
}

/// The presses of a calibration.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TrainingKeys {
    /// The rule that places them; `explicit` where there are `positions`, `grid` where there is a `grid`, else `even` by default.
    pub arrangement: Option<Rule>,
    /// Number of positions; needed on a line by all rules but `explicit`.
    pub count: Option<At<Count<1, MOST>>>,
    /// Columns and rows of a `grid`, on a plane.
    pub grid: Option<At<Grid<MOST>>>,
    /// Number of positions of `edge-dense` in the middle portion.
    pub middle: Option<At<Count<2, MOST>>>,
    /// Start and end of the middle portion of `edge-dense`, or of what `even` covers, as shares of the length; for `edge-dense` 25 % and
    /// 75 % by default.
    pub portion: Option<At<PortionKeys>>,
    /// The positions of `explicit`.
    pub positions: Option<At<Vec<At<Point>>>>,
    /// Presses at each position; 1 by default.
    pub repeats: Option<Count<1, MOST>>,
    /// The force of the presses; that of [contact] by default.
    pub force: Option<At<Positive<Force>>>,
    /// Standard deviation of the pressed place from the requested place, in each direction; unknown by default.
    pub placement: Option<At<Positive<Length>>>,
}

/// A rule that places positions.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Rule {
    /// Equally spaced, all along or over a `portion`.
    Even,
    /// Fewer in the middle and more towards the edges.
    EdgeDense,
    /// At Chebyshev's nodes.
    Chebyshev,
    /// In the middles of equal cells of a plane.
    Grid,
    /// One by one.
    Explicit,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(expecting = "a list of 2, start and end")]
pub(crate) struct PortionKeys(Quantity<Ratio>, Quantity<Ratio>);

/// A force spread evenly over part of the surface.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LoadKeys {
    /// The left end, or lower left corner.
    pub from: At<Point>,
    /// The right end, or upper right corner.
    pub to: At<Point>,
    /// The whole force.
    pub force: Positive<Force>,
}

impl At<TrainingKeys> {
    pub fn build(&self, extent: Extent) -> Result<Training, RigError> {
        let need = |key| self.place.missing(key);
        let rule = match (self.arrangement, &self.positions, &self.grid) {
            (Some(rule), ..) => rule,
            (None, Some(_), _) => Rule::Explicit,
            (None, None, Some(_)) => Rule::Grid,
            (None, None, None) => Rule::Even,
        };
        self.refuse_unused(rule)?;
        if let (Extent::Plane { .. }, Rule::Even | Rule::EdgeDense | Rule::Chebyshev) = (extent, rule) {
            return Err(self.count.as_ref().map_or(need("grid"), |count| count.place.unused(ON_A_PLANE)));
        }
        let portion = self.portion.as_ref().map(|portion| (portion.0.si, portion.1.si));
        let arrangement = match rule {
            Rule::Even => portion.map_or(Arrangement::Even, |portion| Arrangement::EvenOver { portion }),
            Rule::EdgeDense => Arrangement::EdgeDense {
                middle: self.middle.as_ref().ok_or_else(|| need("middle"))?.get(),
                portion: portion.unwrap_or(Arrangement::PAPER_PORTION),
            },
            Rule::Chebyshev => Arrangement::Chebyshev,
            Rule::Grid => {
                let (columns, rows) = self.grid.as_ref().ok_or_else(|| need("grid"))?.sides(extent)?;
                Arrangement::Grid { columns, rows }
            }
            Rule::Explicit => {
                let listed = self.positions.as_ref().ok_or_else(|| need("positions"))?;
                if listed.is_empty() {
                    return Err(listed.place.refuse("a list of at least 1"));
                }
                let positions = listed.iter().map(|point| point.on_surface(extent));
                Arrangement::Explicit(positions.collect::<Result<_, _>>()?)
            }
        };
        let count = match (&self.count, &arrangement) {
            (Some(count), _) => count.get(),
            (None, Arrangement::Explicit(positions)) => positions.len(),
            (None, Arrangement::Grid { columns, rows }) => columns * rows,
            (None, _) => return Err(need("count")),
        };
        let training = Training {
            arrangement,
            count,
            repeats: self.repeats.map_or(1, Count::get),
            force_n: self.force.as_ref().map(|force| force.si),
            placement_sd_m: self.placement_sd_m(extent)?,
        };
        training.positions(extent).map_err(|error| {
            let place = self.place_of(&error).unwrap_or(&self.place);
            RigProblem::Arrangement(error).at_place(place)
        })?;
        Ok(training)
    }

    /// An error above the longest side would not restrict the place.
    fn placement_sd_m(&self, extent: Extent) -> Result<Option<f64>, RigError> {
        let Some(placement) = &self.placement else { return Ok(None) };
        let side_m = extent.length_m().max(extent.width_m().unwrap_or(0.0));
        match placement.si < side_m {
            true => Ok(Some(placement.si)),
            false => {
                let most = format_length_mm(side_m);
                Err(placement.place.refuse(format!("less than {most}, the longest side of the surface")))
            }
        }
    }

    fn refuse_unused(&self, rule: Rule) -> Result<(), RigError> {
        let (name, meant): (_, &[&str]) = match rule {
            Rule::Even => ("even", &["portion"]),
            Rule::EdgeDense => ("edge-dense", &["middle", "portion"]),
            Rule::Chebyshev => ("chebyshev", &[]),
            Rule::Grid => ("grid", &["grid"]),
            Rule::Explicit => ("explicit", &["positions"]),
        };
        let keys = [place(&self.middle), place(&self.portion), place(&self.positions), place(&self.grid)];
        match keys.into_iter().flatten().find(|key| !meant.contains(&key.key())) {
            Some(key) => Err(key.unused(format!("arrangement = \"{name}\""))),
            None => Ok(()),
        }
    }

    fn place_of(&self, error: &ArrangementError) -> Option<&Place> {
        match error {
            ArrangementError::MiddleTooSmall { .. } => place(&self.middle),
            ArrangementError::Portion { .. } | ArrangementError::EvenPortion { .. } => place(&self.portion),
            _ => place(&self.count),
        }
    }
}

/// Limits the force to a digit's model: [`Digit::MOST_LOAD`] at the tip.
pub(crate) fn check_force(
    force: Option<&At<Positive<Force>>>,
    surface: &SurfaceSpec,
) -> Result<(), RigError> {
    let (Some(force), SurfaceSpec::Digit(digit)) = (force, surface) else { return Ok(()) };
    let most_n = Digit::MOST_LOAD * digit.characteristic_force_n();
    if force.si <= most_n {
        return Ok(());
    }
    let most = Digit::MOST_LOAD;
    Err(force
        .place
        .refuse(format!("at most {most_n:.3} N on this digit, at its tip a load F·l²/(E·I) of {most}")))
}

impl At<LoadKeys> {
    pub fn build(&self, surface: &SurfaceSpec) -> Result<UniformLoad, RigError> {
        if let SurfaceSpec::Digit(_) = surface {
            return Err(self.place.unused("a digit: its readings under several loads do not add up"));
        }
        let extent = surface.extent();
        let (from, to) = (self.from.on_surface(extent)?, self.to.on_surface(extent)?);
        check_order(from, to, extent, &self.to.place)?;
        Ok(UniformLoad::new(from, to, self.force.si))
    }
}
