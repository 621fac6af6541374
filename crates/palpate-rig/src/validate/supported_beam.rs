//! `supports` and `sections` of a beam

use std::ops::Range;

use toml::Spanned;

use super::surface::need;
use crate::error::{RigError, RigProblem};
use crate::sections::{BeamSectionKeys, SupportKeys, SupportsKey, SurfaceSection};
use crate::value::{RawPosition, RawQuantity, choice, positive, quantity};
use palpate_mechanics::surface::{
    BeamPart, BeamSection, BeamSupport, BeamSupportKind, SupportedBeam, SupportedBeamError, SupportedBeamSpec,
};
use palpate_mechanics::units::Dimension;

/// Whether a beam's section says more than two simple supports and one section.
pub(super) fn is_described(keys: &SurfaceSection) -> bool {
    let simple = |supports: &Spanned<SupportsKey>| matches!(supports.get_ref(), SupportsKey::Word(word) if word == "simple");
    keys.sections.is_some() || keys.supports.as_ref().is_some_and(|supports| !simple(supports))
}

pub(super) fn validate(section: &Spanned<SurfaceSection>) -> Result<SupportedBeam, RigError> {
    let keys = section.get_ref();
    let size = |key, value: Option<&Spanned<RawQuantity>>, dimension| {
        positive(key, need(key, value, section)?, dimension)
    };
    let length_m = size("length", keys.length.as_ref(), Dimension::Length)?;
    let spec = SupportedBeamSpec {
        length_m,
        youngs_modulus_pa: size("youngs_modulus", keys.youngs_modulus.as_ref(), Dimension::Modulus)?,
        sections: sections(section, length_m)?,
        supports: supports(keys.supports.as_ref(), length_m)?,
    };
    SupportedBeam::new(spec).map_err(|error| RigProblem::SupportedBeam(error).at(place(error, section)))
}

/// As they are listed, each with the beam's width and thickness where it has none of its own; or one, all along.
fn sections(section: &Spanned<SurfaceSection>, length_m: f64) -> Result<Vec<BeamSection>, RigError> {
    let keys = section.get_ref();
    let no_keys = BeamSectionKeys { to: None, width: None, thickness: None };
    let listed: Vec<&BeamSectionKeys> = match &keys.sections {
        Some(listed) => listed.get_ref().iter().map(Spanned::get_ref).collect(),
        None => vec![&no_keys],
    };
    let count = listed.len();
    let read = |(i, own): (usize, &BeamSectionKeys)| {
        let size = |key, own: &Option<Spanned<RawQuantity>>, beams: &Option<Spanned<RawQuantity>>| {
            positive(key, need(key, own.as_ref().or(beams.as_ref()), section)?, Dimension::Length)
        };
        let to_m = match (&own.to, &keys.sections) {
            (Some(to), _) => positive("to", to, Dimension::Length)?,
            (None, Some(all)) if i + 1 < count => {
                return Err(
                    RigProblem::MissingKey { section: "sections", key: "to" }.at(all.get_ref()[i].span())
                );
            }
            (None, _) => length_m,
        };
        let width_m = size("width", &own.width, &keys.width)?;
        Ok(BeamSection { to_m, width_m, thickness_m: size("thickness", &own.thickness, &keys.thickness)? })
    };
    listed.into_iter().enumerate().map(read).collect()
}

/// As they are listed; or simple ones under both ends.
fn supports(key: Option<&Spanned<SupportsKey>>, length_m: f64) -> Result<Vec<BeamSupport>, RigError> {
    let simple = |at_m| BeamSupport { at_m, kind: BeamSupportKind::Simple };
    let both_ends = vec![simple(0.0), simple(length_m)];
    let Some(key) = key else { return Ok(both_ends) };
    match key.get_ref() {
        SupportsKey::Word(word) => {
            choice("supports", &Spanned::new(key.span(), word.clone()), &[("simple", both_ends.as_slice())])?;
            Ok(both_ends)
        }
        SupportsKey::List(listed) => listed.iter().map(support).collect(),
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Rigid(BeamSupportKind),
    Elastic,
}

fn support(section: &Spanned<SupportKeys>) -> Result<BeamSupport, RigError> {
    const WORDS: [(&str, Kind); 5] = [
        ("simple", Kind::Rigid(BeamSupportKind::Simple)),
        ("clamped", Kind::Rigid(BeamSupportKind::Clamped)),
        ("free", Kind::Rigid(BeamSupportKind::Free)),
        ("guided", Kind::Rigid(BeamSupportKind::Guided)),
        ("elastic", Kind::Elastic),
    ];
    let keys = section.get_ref();
    let missing = |key| RigProblem::MissingKey { section: "supports", key }.at(section.span());
    let at_m = along(keys.at.as_ref().ok_or_else(|| missing("at"))?)?;
    let kind = choice("kind", keys.kind.as_ref().ok_or_else(|| missing("kind"))?, &WORDS)?;
    let kind = match kind {
        Kind::Rigid(kind) => {
            let springs =
                [("stiffness", &keys.stiffness), ("rotational_stiffness", &keys.rotational_stiffness)];
            for (key, spring) in springs {
                if let Some(spring) = spring {
                    let with = "a support that is not elastic";
                    return Err(RigProblem::UnusedKey { key, with }.at(spring.span()));
                }
            }
            kind
        }
        Kind::Elastic => {
            let stiffness = keys.stiffness.as_ref().ok_or_else(|| missing("stiffness"))?;
            let turning = keys.rotational_stiffness.as_ref();
            let turning = turning
                .map(|raw| positive("rotational_stiffness", raw, Dimension::RotationalStiffness))
                .transpose()?;
            BeamSupportKind::Elastic {
                stiffness_n_per_m: positive("stiffness", stiffness, Dimension::Stiffness)?,
                rotational_stiffness_nm_per_rad: turning,
            }
        }
    };
    Ok(BeamSupport { at_m, kind })
}

/// A place along the beam.
fn along(raw: &Spanned<RawPosition>) -> Result<f64, RigError> {
    match raw.get_ref() {
        RawPosition::Along(at) => quantity("at", &Spanned::new(raw.span(), at.clone()), Dimension::Length),
        RawPosition::List(list) => {
            let (value, bound) = (format!("a list of {}", list.len()), "one length on a beam");
            Err(RigProblem::OutOfRange { key: "at", value, bound }.at(raw.span()))
        }
    }
}

/// Where the document says what is at fault.
fn place(error: SupportedBeamError, section: &Spanned<SurfaceSection>) -> Range<usize> {
    let keys = section.get_ref();
    let sections = keys.sections.as_ref().map(Spanned::span);
    let place = match error.part() {
        BeamPart::Whole => None,
        BeamPart::Supports => keys.supports.as_ref().map(Spanned::span),
        BeamPart::Support(i) => match keys.supports.as_ref().map(Spanned::get_ref) {
            Some(SupportsKey::List(listed)) => listed
                .get(i)
                .map(|support| support.get_ref().at.as_ref().map_or(support.span(), Spanned::span)),
            _ => None,
        },
        BeamPart::Sections => sections,
        BeamPart::Section(i) => keys
            .sections
            .as_ref()
            .and_then(|listed| listed.get_ref().get(i))
            .map(|section| section.get_ref().to.as_ref().map_or(section.span(), Spanned::span)),
    };
    place.unwrap_or(section.span())
}
