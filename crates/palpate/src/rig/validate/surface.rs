//! `[surface]`

use toml::Spanned;

use super::{plate, supported_beam};
use crate::mechanics::SurfaceSpec;
use crate::mechanics::{Beam, Extent};
use crate::rig::error::{RigError, RigProblem};
use crate::rig::sections::SurfaceSection;
use crate::rig::value::{RawQuantity, choice, positive};
use crate::units::Dimension;

const SECTION: &str = "surface";

#[derive(Clone, Copy)]
enum Kind {
    Beam,
    Plate,
    Measured,
}

pub(super) fn validate(section: Option<&Spanned<SurfaceSection>>) -> Result<SurfaceSpec, RigError> {
    let section = section.ok_or_else(|| RigProblem::MissingSection { section: SECTION }.nowhere())?;
    let keys = section.get_ref();
    let kind = need("kind", keys.kind.as_ref(), section)?;
    let kinds = [("beam", Kind::Beam), ("plate", Kind::Plate), ("measured", Kind::Measured)];
    match choice("kind", kind, &kinds)? {
        Kind::Beam if supported_beam::is_described(keys) => {
            refuse_plate_keys(keys, "a beam")?;
            supported_beam::validate(section).map(|beam| SurfaceSpec::SupportedBeam(Box::new(beam)))
        }
        Kind::Beam => beam(section).map(SurfaceSpec::Beam),
        Kind::Plate => match &keys.sections {
            Some(sections) => {
                Err(RigProblem::UnusedKey { key: "sections", with: "a plate" }.at(sections.span()))
            }
            None => plate::validate(section).map(SurfaceSpec::Plate),
        },
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
    refuse_plate_keys(keys, "a beam")?;
    beam.validate().map_err(|error| RigProblem::Beam(error).at(section.span()))?;
    Ok(beam)
}

fn measured(section: &Spanned<SurfaceSection>) -> Result<Extent, RigError> {
    let keys = section.get_ref();
    let unused = |key, span| Err(RigProblem::UnusedKey { key, with: "a measured surface" }.at(span));
    refuse_plate_keys(keys, "a measured surface")?;
    if let Some(thickness) = &keys.thickness {
        return unused("thickness", thickness.span());
    }
    if let Some(modulus) = &keys.youngs_modulus {
        return unused("youngs_modulus", modulus.span());
    }
    if let Some(density) = &keys.density {
        return unused("density", density.span());
    }
    if let Some(supports) = &keys.supports {
        return unused("supports", supports.span());
    }
    if let Some(sections) = &keys.sections {
        return unused("sections", sections.span());
    }
    let length_m = positive("length", need("length", keys.length.as_ref(), section)?, Dimension::Length)?;
    let width_m = keys.width.as_ref().map(|width| positive("width", width, Dimension::Length)).transpose()?;
    Ok(Extent { length_m, width_m })
}

/// Only a plate has these.
fn refuse_plate_keys(keys: &SurfaceSection, with: &'static str) -> Result<(), RigError> {
    let present = [
        ("poissons_ratio", keys.poissons_ratio.as_ref().map(Spanned::span)),
        ("edges", keys.edges.as_ref().map(Spanned::span)),
        ("elements", keys.elements.as_ref().map(Spanned::span)),
    ];
    match present.into_iter().find_map(|(key, span)| Some((key, span?))) {
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
