//! `[[load]]`

use toml::Spanned;

use crate::contact::Position;
use crate::mechanics::{Extent, SurfaceSpec, UniformLoad};
use crate::rig::error::{RigError, RigProblem};
use crate::rig::sections::LoadSection;
use crate::rig::value::{RawQuantity, positive, quantity};
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
    if extent.width_m.is_some() {
        return Err(RigProblem::LoadOnPlane.at(section.span()));
    }
    let keys = section.get_ref();
    let from = need("from", keys.from.as_ref(), section)?;
    let to = need("to", keys.to.as_ref(), section)?;
    let from_m = quantity("from", from, Dimension::Length)?;
    let to_m = quantity("to", to, Dimension::Length)?;
    let force_n = positive("force", need("force", keys.force.as_ref(), section)?, Dimension::Force)?;
    let load = UniformLoad { from: Position::along(from_m), to: Position::along(to_m), force_n };
    if from_m < to_m && extent.contains(load.from) && extent.contains(load.to) {
        Ok(load)
    } else {
        let length_m = extent.length_m;
        Err(RigProblem::LoadStretch { from_m, to_m, length_m }.at(from.span()))
    }
}

fn need<'a>(
    key: &'static str,
    value: Option<&'a Spanned<RawQuantity>>,
    section: &Spanned<LoadSection>,
) -> Result<&'a Spanned<RawQuantity>, RigError> {
    value.ok_or_else(|| RigProblem::MissingKey { section: SECTION, key }.at(section.span()))
}
