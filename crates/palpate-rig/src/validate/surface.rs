//! `[surface]`

use std::ops::Range;

use toml::Spanned;

use super::{plate, supported_beam};
use crate::error::{RigError, RigProblem};
use crate::sections::SurfaceSection;
use crate::value::{RawQuantity, choice, positive};
use palpate_mechanics::surface::SurfaceSpec;
use palpate_mechanics::surface::{Beam, Digit, Extent, ForceDirection};
use palpate_mechanics::units::Dimension;

const SECTION: &str = "surface";

/// Keys beside the kind and the size.
const BEAM_KEYS: [&str; 5] = ["thickness", "youngs_modulus", "supports", "sections", "density"];
const PLATE_KEYS: [&str; 6] =
    ["thickness", "youngs_modulus", "poissons_ratio", "edges", "supports", "elements"];
const DIGIT_KEYS: [&str; 3] = ["thickness", "youngs_modulus", "direction"];

#[derive(Clone, Copy)]
enum Kind {
    Beam,
    Plate,
    Digit,
    Measured,
}

pub(super) fn validate(section: Option<&Spanned<SurfaceSection>>) -> Result<SurfaceSpec, RigError> {
    let section = section.ok_or_else(|| RigProblem::MissingSection { section: SECTION }.nowhere())?;
    let keys = section.get_ref();
    let kind = need("kind", keys.kind.as_ref(), section)?;
    let kinds =
        [("beam", Kind::Beam), ("plate", Kind::Plate), ("digit", Kind::Digit), ("measured", Kind::Measured)];
    match choice("kind", kind, &kinds)? {
        Kind::Beam if supported_beam::is_described(keys) => {
            refuse_but(&BEAM_KEYS, keys, "a beam")?;
            supported_beam::validate(section).map(|beam| SurfaceSpec::SupportedBeam(Box::new(beam)))
        }
        Kind::Beam => beam(section).map(SurfaceSpec::Beam),
        Kind::Plate => {
            refuse_but(&PLATE_KEYS, keys, "a plate")?;
            plate::validate(section).map(SurfaceSpec::Plate)
        }
        Kind::Digit => digit(section).map(SurfaceSpec::Digit),
        Kind::Measured => measured(section).map(SurfaceSpec::Measured),
    }
}

fn beam(section: &Spanned<SurfaceSection>) -> Result<Beam, RigError> {
    let keys = section.get_ref();
    let size = |key, value: Option<&Spanned<RawQuantity>>, dimension| {
        positive(key, need(key, value, section)?, dimension)
    };
    let beam = Beam {
        length_m: size("length", keys.length.as_ref(), Dimension::Length)?,
        width_m: size("width", keys.width.as_ref(), Dimension::Length)?,
        thickness_m: size("thickness", keys.thickness.as_ref(), Dimension::Length)?,
        youngs_modulus_pa: size("youngs_modulus", keys.youngs_modulus.as_ref(), Dimension::Modulus)?,
    };
    refuse_but(&BEAM_KEYS, keys, "a beam")?;
    beam.validate().map_err(|error| RigProblem::Beam(error).at(section.span()))?;
    Ok(beam)
}

fn digit(section: &Spanned<SurfaceSection>) -> Result<Digit, RigError> {
    let keys = section.get_ref();
    refuse_but(&DIGIT_KEYS, keys, "a digit, which is clamped at 0 and free at its tip")?;
    let size = |key, value: Option<&Spanned<RawQuantity>>, dimension| {
        positive(key, need(key, value, section)?, dimension)
    };
    let directions =
        [ForceDirection::Normal, ForceDirection::Vertical].map(|direction| (direction.name(), direction));
    let digit = Digit {
        length_m: size("length", keys.length.as_ref(), Dimension::Length)?,
        width_m: size("width", keys.width.as_ref(), Dimension::Length)?,
        thickness_m: size("thickness", keys.thickness.as_ref(), Dimension::Length)?,
        youngs_modulus_pa: size("youngs_modulus", keys.youngs_modulus.as_ref(), Dimension::Modulus)?,
        direction: choice("direction", need("direction", keys.direction.as_ref(), section)?, &directions)?,
    };
    digit.validate().map_err(|error| RigProblem::Digit(error).at(section.span()))?;
    Ok(digit)
}

fn measured(section: &Spanned<SurfaceSection>) -> Result<Extent, RigError> {
    let keys = section.get_ref();
    refuse_but(&[], keys, "a measured surface")?;
    let length_m = positive("length", need("length", keys.length.as_ref(), section)?, Dimension::Length)?;
    let width_m = keys.width.as_ref().map(|width| positive("width", width, Dimension::Length)).transpose()?;
    Ok(Extent { length_m, width_m })
}

/// Refuses every key that means nothing on a surface of this kind; those of `meant` do.
fn refuse_but(meant: &[&str], keys: &SurfaceSection, with: &'static str) -> Result<(), RigError> {
    fn place<T>(name: &'static str, key: &Option<Spanned<T>>) -> Option<(&'static str, Range<usize>)> {
        key.as_ref().map(|key| (name, key.span()))
    }
    let present = [
        place("thickness", &keys.thickness),
        place("youngs_modulus", &keys.youngs_modulus),
        place("supports", &keys.supports),
        place("sections", &keys.sections),
        place("poissons_ratio", &keys.poissons_ratio),
        place("edges", &keys.edges),
        place("elements", &keys.elements),
        place("density", &keys.density),
        place("direction", &keys.direction),
    ];
    match present.into_iter().flatten().find(|(key, _)| !meant.contains(key)) {
        Some((key, span)) => Err(RigProblem::UnusedKey { key, with }.at(span)),
        None => Ok(()),
    }
}

pub(super) fn need<'a, T>(
    key: &'static str,
    value: Option<&'a Spanned<T>>,
    section: &Spanned<SurfaceSection>,
) -> Result<&'a Spanned<T>, RigError> {
    value.ok_or_else(|| RigProblem::MissingKey { section: SECTION, key }.at(section.span()))
}
