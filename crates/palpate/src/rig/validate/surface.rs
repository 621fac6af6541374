//! `[surface]`

use toml::Spanned;

use crate::mechanics::SurfaceSpec;
use crate::mechanics::{Beam, Digit, Extent, ForceDirection};
use crate::rig::error::{RigError, RigProblem};
use crate::rig::sections::SurfaceSection;
use crate::rig::value::{RawQuantity, choice, positive};
use crate::units::Dimension;

const SECTION: &str = "surface";

#[derive(Clone, Copy)]
enum Kind {
    Beam,
    Digit,
    Measured,
}

pub(super) fn validate(section: Option<&Spanned<SurfaceSection>>) -> Result<SurfaceSpec, RigError> {
    let section = section.ok_or_else(|| RigProblem::MissingSection { section: SECTION }.nowhere())?;
    let keys = section.get_ref();
    let kind = need("kind", keys.kind.as_ref(), section)?;
    let kinds = [("beam", Kind::Beam), ("digit", Kind::Digit), ("measured", Kind::Measured)];
    match choice("kind", kind, &kinds)? {
        Kind::Beam => beam(section).map(SurfaceSpec::Beam),
        Kind::Digit => digit(section).map(SurfaceSpec::Digit),
        Kind::Measured => measured(section).map(SurfaceSpec::Measured),
    }
}

fn beam(section: &Spanned<SurfaceSection>) -> Result<Beam, RigError> {
    let keys = section.get_ref();
    refuse("direction", keys.direction.as_ref(), "a beam, whose forces are vertical")?;
    let size = |key, value: Option<&Spanned<RawQuantity>>, dimension| {
        positive(key, need(key, value, section)?, dimension)
    };
    let beam = Beam {
        length_m: size("length", keys.length.as_ref(), Dimension::Length)?,
        width_m: size("width", keys.width.as_ref(), Dimension::Length)?,
        thickness_m: size("thickness", keys.thickness.as_ref(), Dimension::Length)?,
        youngs_modulus_pa: size("youngs_modulus", keys.youngs_modulus.as_ref(), Dimension::Modulus)?,
    };
    if let Some(supports) = &keys.supports {
        choice("supports", supports, &[("simple", ())])?;
    }
    beam.validate().map_err(|error| RigProblem::Beam(error).at(section.span()))?;
    Ok(beam)
}

fn digit(section: &Spanned<SurfaceSection>) -> Result<Digit, RigError> {
    let keys = section.get_ref();
    refuse("supports", keys.supports.as_ref(), "a digit, which is clamped at 0 and free at its tip")?;
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
    let unused = |key, span| Err(RigProblem::UnusedKey { key, with: "a measured surface" }.at(span));
    if let Some(thickness) = &keys.thickness {
        return unused("thickness", thickness.span());
    }
    if let Some(modulus) = &keys.youngs_modulus {
        return unused("youngs_modulus", modulus.span());
    }
    if let Some(supports) = &keys.supports {
        return unused("supports", supports.span());
    }
    refuse("direction", keys.direction.as_ref(), "a measured surface")?;
    let length_m = positive("length", need("length", keys.length.as_ref(), section)?, Dimension::Length)?;
    let width_m = keys.width.as_ref().map(|width| positive("width", width, Dimension::Length)).transpose()?;
    Ok(Extent { length_m, width_m })
}

fn need<'a, T>(
    key: &'static str,
    value: Option<&'a Spanned<T>>,
    section: &Spanned<SurfaceSection>,
) -> Result<&'a Spanned<T>, RigError> {
    value.ok_or_else(|| RigProblem::MissingKey { section: SECTION, key }.at(section.span()))
}

/// Refuses a key that means nothing beside another one.
fn refuse(key: &'static str, value: Option<&Spanned<String>>, with: &'static str) -> Result<(), RigError> {
    match value {
        Some(value) => Err(RigProblem::UnusedKey { key, with }.at(value.span())),
        None => Ok(()),
    }
}
