//! `[[load]]`

use toml::Spanned;

use super::places::{in_order, on_surface};
use crate::error::{RigError, RigProblem};
use crate::sections::LoadSection;
use crate::value::positive;
use palpate_mechanics::surface::{Extent, SurfaceSpec, UniformLoad};
use palpate_mechanics::units::Dimension;

const SECTION: &str = "load";

pub(super) fn validate(
    sections: Option<&[Spanned<LoadSection>]>,
    surface: &SurfaceSpec,
) -> Result<Vec<UniformLoad>, RigError> {
    let sections = sections.unwrap_or_default();
    if let (SurfaceSpec::Digit(_), Some(section)) = (surface, sections.first()) {
        let with = "a digit, whose readings under several loads do not add up";
        return Err(RigProblem::UnusedKey { key: "load", with }.at(section.span()));
    }
    sections.iter().map(|section| load(section, surface.extent())).collect()
}

fn load(section: &Spanned<LoadSection>, extent: Extent) -> Result<UniformLoad, RigError> {
    let keys = section.get_ref();
    let from = on_surface("from", need("from", keys.from.as_ref(), section)?, extent)?;
    let end = need("to", keys.to.as_ref(), section)?;
    let to = on_surface("to", end, extent)?;
    in_order(from, to, extent).map_err(|problem| problem.at(end.span()))?;
    let force_n = positive("force", need("force", keys.force.as_ref(), section)?, Dimension::Force)?;
    Ok(UniformLoad { from, to, force_n })
}

fn need<'a, T>(
    key: &'static str,
    value: Option<&'a Spanned<T>>,
    section: &Spanned<LoadSection>,
) -> Result<&'a Spanned<T>, RigError> {
    value.ok_or_else(|| RigProblem::MissingKey { section: SECTION, key }.at(section.span()))
}
