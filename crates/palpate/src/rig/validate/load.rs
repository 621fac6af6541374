//! `[[load]]`

use toml::Spanned;

use super::places::place;
use crate::mechanics::{Extent, SurfaceSpec, UniformLoad};
use crate::rig::error::{RigError, RigProblem};
use crate::rig::sections::LoadSection;
use crate::rig::value::positive;
use crate::units::Dimension;

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
    let written = need("from", keys.from.as_ref(), section)?;
    let from = place("from", written, extent)?;
    let to = place("to", need("to", keys.to.as_ref(), section)?, extent)?;
    let force_n = positive("force", need("force", keys.force.as_ref(), section)?, Dimension::Force)?;
    let rises = from.x_m < to.x_m && (!extent.is_plane() || from.y_m < to.y_m);
    if rises && extent.contains(from) && extent.contains(to) {
        Ok(UniformLoad { from, to, force_n })
    } else {
        Err(RigProblem::LoadStretch { from, to, extent }.at(written.span()))
    }
}

fn need<'a, T>(
    key: &'static str,
    value: Option<&'a Spanned<T>>,
    section: &Spanned<LoadSection>,
) -> Result<&'a Spanned<T>, RigError> {
    value.ok_or_else(|| RigProblem::MissingKey { section: SECTION, key }.at(section.span()))
}
