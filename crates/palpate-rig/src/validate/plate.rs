//! `[surface]` of kind "plate"

use std::ops::Range;

use toml::Spanned;

use super::surface::need;
use crate::error::{RigError, RigProblem};
use crate::sections::{EdgesSection, SupportKeys, SupportsKey, SurfaceSection};
use crate::value::{RawPosition, RawQuantity, choice, count, number, positive, quantity};
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::plate::{Edge, Edges, PlateSpec, PointSupport, PointSupportKind};
use palpate_mechanics::surface::{Plate, PlateError};
use palpate_mechanics::units::Dimension;

pub(super) fn validate(section: &Spanned<SurfaceSection>) -> Result<Plate, RigError> {
    let keys = section.get_ref();
    let size = |key, value: Option<&Spanned<RawQuantity>>, dimension| {
        positive(key, need(key, value, section)?, dimension)
    };
    let ratio = need("poissons_ratio", keys.poissons_ratio.as_ref(), section)?;
    let possible = |ratio: f64| ratio > -1.0 && ratio <= 0.5;
    let elements = keys
        .elements
        .as_ref()
        .map_or(Ok(PlateSpec::DEFAULT_ELEMENTS), |raw| count("elements", raw, 1..=usize::MAX, "at least 1"));
    let spec = PlateSpec {
        length_m: size("length", keys.length.as_ref(), Dimension::Length)?,
        width_m: size("width", keys.width.as_ref(), Dimension::Length)?,
        thickness_m: size("thickness", keys.thickness.as_ref(), Dimension::Length)?,
        youngs_modulus_pa: size("youngs_modulus", keys.youngs_modulus.as_ref(), Dimension::Modulus)?,
        poissons_ratio: number("poissons_ratio", ratio, possible, "greater than -1 and at most 0.5")?,
        edges: edges(keys.edges.as_ref())?,
        supports: keys.supports.as_ref().map_or(Ok(Vec::new()), supports)?,
        elements: elements?,
    };
    Plate::new(spec).map_err(|error| RigProblem::Plate(error).at(culprit(section, error)))
}

/// What `edges` says; an edge of which nothing is said is free.
fn edges(section: Option<&Spanned<EdgesSection>>) -> Result<Edges, RigError> {
    let Some(section) = section else { return Ok(Edges::all(Edge::Free)) };
    match section.get_ref() {
        EdgesSection::All(word) => {
            choice("edges", &Spanned::new(section.span(), word.clone()), &Edge::NAMED).map(Edges::all)
        }
        EdgesSection::Each(each) => {
            let edge = |key, word: &Option<Spanned<String>>| {
                word.as_ref().map_or(Ok(Edge::Free), |word| choice(key, word, &Edge::NAMED))
            };
            Ok(Edges {
                left: edge("left", &each.left)?,
                right: edge("right", &each.right)?,
                bottom: edge("bottom", &each.bottom)?,
                top: edge("top", &each.top)?,
            })
        }
    }
}

fn supports(section: &Spanned<SupportsKey>) -> Result<Vec<PointSupport>, RigError> {
    match section.get_ref() {
        SupportsKey::List(list) => list.iter().map(support).collect(),
        SupportsKey::Word(word) => {
            let (value, bound) = (word.clone(), "a list of points on a plate; its edges are held by `edges`");
            Err(RigProblem::OutOfRange { key: "supports", value, bound }.at(section.span()))
        }
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Simple,
    Elastic,
}

fn support(section: &Spanned<SupportKeys>) -> Result<PointSupport, RigError> {
    let keys = section.get_ref();
    let missing = |key| RigProblem::MissingKey { section: "surface.supports", key }.at(section.span());
    let position = point(keys.at.as_ref().ok_or_else(|| missing("at"))?)?;
    if let Some(rotational) = &keys.rotational_stiffness {
        let problem = RigProblem::UnusedKey { key: "rotational_stiffness", with: "a plate" };
        return Err(problem.at(rotational.span()));
    }
    let kinds = [("simple", Kind::Simple), ("elastic", Kind::Elastic)];
    let kind = match choice("kind", keys.kind.as_ref().ok_or_else(|| missing("kind"))?, &kinds)? {
        Kind::Simple => match &keys.stiffness {
            None => PointSupportKind::Simple,
            Some(stiffness) => {
                let problem = RigProblem::UnusedKey { key: "stiffness", with: "a simple support" };
                return Err(problem.at(stiffness.span()));
            }
        },
        Kind::Elastic => {
            let stiffness = keys.stiffness.as_ref().ok_or_else(|| missing("stiffness"))?;
            PointSupportKind::Elastic {
                stiffness_n_per_m: positive("stiffness", stiffness, Dimension::Stiffness)?,
            }
        }
    };
    Ok(PointSupport { position, kind })
}

/// A point of the plate: `["10 mm", "20 mm"]`.
fn point(raw: &Spanned<RawPosition>) -> Result<Position, RigError> {
    let refuse = |value| {
        let bound = "a list of 2, along the length and along the width, on a plate";
        Err(RigProblem::OutOfRange { key: "at", value, bound }.at(raw.span()))
    };
    match raw.get_ref() {
        RawPosition::Along(along) => refuse(along.to_string()),
        RawPosition::List(list) => match list.as_slice() {
            [x, y] => Ok(Position {
                x_m: quantity("at", x, Dimension::Length)?,
                y_m: quantity("at", y, Dimension::Length)?,
            }),
            _ => refuse(format!("a list of {}", list.len())),
        },
    }
}

/// The place that is to blame for a plate that cannot be computed.
fn culprit(section: &Spanned<SurfaceSection>, error: PlateError) -> Range<usize> {
    let keys = section.get_ref();
    let support = |number: usize| match keys.supports.as_ref().map(Spanned::get_ref) {
        Some(SupportsKey::List(list)) => list.get(number - 1).map(Spanned::span),
        _ => None,
    };
    let place = match error {
        PlateError::SupportOffPlate { number, .. }
        | PlateError::Stiffness { number, .. }
        | PlateError::SupportOnHeldEdge { number, .. } => support(number),
        PlateError::SupportsAtOnePlace { second, .. } | PlateError::SupportsTooClose { second, .. } => {
            support(second)
        }
        PlateError::NotHeld | PlateError::HeldAtOnePoint { .. } | PlateError::HeldOnALine { .. } => {
            keys.supports.as_ref().map(Spanned::span).or(keys.edges.as_ref().map(Spanned::span))
        }
        PlateError::Elements { .. } | PlateError::MeshTooLarge { .. } => {
            keys.elements.as_ref().map(Spanned::span)
        }
        PlateError::NotPositive { .. }
        | PlateError::PoissonsRatio { .. }
        | PlateError::Compliance { .. }
        | PlateError::Unsolvable { .. } => None,
    };
    place.unwrap_or(section.span())
}
