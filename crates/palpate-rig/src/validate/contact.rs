//! `[contact]` and `[training]`

use std::ops::Range;

use toml::Spanned;

use super::places::{grid_sides, place};
use crate::error::{RigError, RigProblem};
use crate::sections::{ContactSection, RigSections, TrainingSection};
use crate::value::{RawQuantity, choice, count, positive, quantity};
use palpate_estimators::arrangement::Training;
use palpate_estimators::arrangement::{Arrangement, ArrangementError};
use palpate_mechanics::surface::{Digit, Extent, SurfaceSpec};
use palpate_mechanics::units::Dimension;

/// More training positions, or presses of one position, than anyone makes.
const MOST: usize = 100_000;
const MOST_BOUND: &str = "at least 1 and at most 100000";

pub(super) fn validate_force(section: Option<&Spanned<ContactSection>>) -> Result<Option<f64>, RigError> {
    let force = section.and_then(|section| section.get_ref().force.as_ref());
    force.map(|force| positive("force", force, Dimension::Force)).transpose()
}

/// A digit's model goes as far as a load of [`Digit::MOST_LOAD`] at the tip.
pub(super) fn check_forces(
    sections: &RigSections,
    surface: &SurfaceSpec,
    contact_n: Option<f64>,
    training: Option<&Training>,
) -> Result<(), RigError> {
    let SurfaceSpec::Digit(digit) = surface else { return Ok(()) };
    let most_n = Digit::MOST_LOAD * digit.characteristic_force_n();
    let contact = sections.contact.as_ref().and_then(|section| section.get_ref().force.as_ref());
    let press = sections.training.as_ref().and_then(|section| section.get_ref().force.as_ref());
    let check = |raw: Option<&Spanned<RawQuantity>>, force_n: Option<f64>| match (raw, force_n) {
        (Some(raw), Some(force_n)) if force_n > most_n => {
            let value = raw.get_ref().to_string();
            Err(RigProblem::TooMuchForce { value, most_n }.at(raw.span()))
        }
        _ => Ok(()),
    };
    check(contact, contact_n)?;
    check(press, training.and_then(|training| training.force_n))
}

#[derive(Clone, Copy)]
enum Rule {
    Even,
    EdgeDense,
    Chebyshev,
    Grid,
    Explicit,
}

pub(super) fn validate_training(
    section: Option<&Spanned<TrainingSection>>,
    extent: Extent,
) -> Result<Option<Training>, RigError> {
    let Some(section) = section else { return Ok(None) };
    let keys = section.get_ref();
    let words = [
        ("even", Rule::Even),
        ("edge-dense", Rule::EdgeDense),
        ("chebyshev", Rule::Chebyshev),
        ("grid", Rule::Grid),
        ("explicit", Rule::Explicit),
    ];
    let rule = match &keys.arrangement {
        Some(arrangement) => choice("arrangement", arrangement, &words)?,
        None if keys.positions.is_some() => Rule::Explicit,
        None if keys.grid.is_some() => Rule::Grid,
        None if extent.is_plane() && keys.count.is_none() => return Err(missing("grid", section)),
        None => Rule::Even,
    };
    refuse_unused(keys, rule)?;
    let arrangement = match rule {
        Rule::Even => even(keys)?,
        Rule::Chebyshev => Arrangement::Chebyshev,
        Rule::EdgeDense => edge_dense(section)?,
        Rule::Grid => grid(section, extent)?,
        Rule::Explicit => explicit(section, extent)?,
    };
    let count = match (&keys.count, &arrangement) {
        (Some(raw), _) => count("count", raw, 1..=MOST, MOST_BOUND)?,
        (None, Arrangement::Explicit(positions)) => positions.len(),
        (None, Arrangement::Grid { columns, rows }) => columns * rows,
        (None, _) => return Err(missing("count", section)),
    };
    let repeats =
        keys.repeats.as_ref().map_or(Ok(1), |raw| self::count("repeats", raw, 1..=MOST, MOST_BOUND))?;
    let force_n = keys.force.as_ref().map(|force| positive("force", force, Dimension::Force)).transpose()?;
    let training = Training { arrangement, count, repeats, force_n };
    training.positions(extent).map_err(|error| {
        let span = culprit(section, &error);
        match error {
            ArrangementError::LineOnPlane { .. } => RigProblem::CountOnPlane { section: "training" }.at(span),
            error => RigProblem::Arrangement(error).at(span),
        }
    })?;
    Ok(Some(training))
}

/// The key, or the listed position, that `error` is about.
fn culprit(section: &Spanned<TrainingSection>, error: &ArrangementError) -> Range<usize> {
    let keys = section.get_ref();
    let listed = keys.positions.as_ref();
    let key = match error {
        ArrangementError::OffSurface { number, .. } => {
            listed.and_then(|listed| listed.get_ref().get(number.saturating_sub(1))).map(Spanned::span)
        }
        ArrangementError::MiddleTooSmall { .. } => keys.middle.as_ref().map(Spanned::span),
        ArrangementError::Portion { .. } | ArrangementError::EvenPortion { .. } => {
            keys.portion.as_ref().map(Spanned::span)
        }
        _ => keys.count.as_ref().map(Spanned::span),
    };
    key.unwrap_or_else(|| section.span())
}

fn refuse_unused(keys: &TrainingSection, rule: Rule) -> Result<(), RigError> {
    let with = match rule {
        Rule::Even => "arrangement = \"even\"",
        Rule::EdgeDense => "arrangement = \"edge-dense\"",
        Rule::Chebyshev => "arrangement = \"chebyshev\"",
        Rule::Grid => "arrangement = \"grid\"",
        Rule::Explicit => "arrangement = \"explicit\"",
    };
    let unused = |key, span| Err(RigProblem::UnusedKey { key, with }.at(span));
    let edge_dense = matches!(rule, Rule::EdgeDense);
    let has_portion = matches!(rule, Rule::Even | Rule::EdgeDense);
    match (&keys.middle, &keys.portion, &keys.positions, &keys.grid) {
        (Some(middle), ..) if !edge_dense => unused("middle", middle.span()),
        (_, Some(portion), ..) if !has_portion => unused("portion", portion.span()),
        (_, _, Some(positions), _) if !matches!(rule, Rule::Explicit) => {
            unused("positions", positions.span())
        }
        (.., Some(grid)) if !matches!(rule, Rule::Grid) => unused("grid", grid.span()),
        _ => Ok(()),
    }
}

fn even(keys: &TrainingSection) -> Result<Arrangement, RigError> {
    let portion = keys.portion.as_ref().map(portion).transpose()?;
    Ok(portion.map_or(Arrangement::Even, |portion| Arrangement::EvenOver { portion }))
}

fn edge_dense(section: &Spanned<TrainingSection>) -> Result<Arrangement, RigError> {
    let keys = section.get_ref();
    let middle = keys.middle.as_ref().ok_or_else(|| missing("middle", section))?;
    let middle = count("middle", middle, 2..=MOST, "at least 2 and at most 100000")?;
    let portion = keys.portion.as_ref().map_or(Ok(Arrangement::PAPER_PORTION), portion)?;
    Ok(Arrangement::EdgeDense { middle, portion })
}

/// Start and end, as shares of the length.
fn portion(raw: &Spanned<Vec<Spanned<RawQuantity>>>) -> Result<(f64, f64), RigError> {
    let share = |end| quantity("portion", end, Dimension::Ratio);
    match raw.get_ref().as_slice() {
        [start, end] => Ok((share(start)?, share(end)?)),
        listed => {
            let (value, bound) = (format!("a list of {}", listed.len()), "a list of 2, start and end");
            Err(RigProblem::OutOfRange { key: "portion", value, bound }.at(raw.span()))
        }
    }
}

fn grid(section: &Spanned<TrainingSection>, extent: Extent) -> Result<Arrangement, RigError> {
    let sides = section.get_ref().grid.as_ref().ok_or_else(|| missing("grid", section))?;
    let [columns, rows] = grid_sides(sides, extent, MOST, "at least 1 and at most 100000 in all")?;
    Ok(Arrangement::Grid { columns, rows })
}

fn explicit(section: &Spanned<TrainingSection>, extent: Extent) -> Result<Arrangement, RigError> {
    let positions = section.get_ref().positions.as_ref().ok_or_else(|| missing("positions", section))?;
    if positions.get_ref().is_empty() {
        let value = "a list of 0".to_owned();
        return Err(RigProblem::OutOfRange { key: "positions", value, bound: "a list of at least 1" }
            .at(positions.span()));
    }
    let positions =
        positions.get_ref().iter().map(|raw| place("positions", raw, extent)).collect::<Result<_, _>>()?;
    Ok(Arrangement::Explicit(positions))
}

fn missing(key: &'static str, section: &Spanned<TrainingSection>) -> RigError {
    RigProblem::MissingKey { section: "training", key }.at(section.span())
}
