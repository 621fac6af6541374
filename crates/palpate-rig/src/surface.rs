//! `[surface]`

use serde::Deserialize;

use palpate_mechanics::surface::plate::{Edge, Edges, PlateSpec, PointSupport, PointSupportKind};
use palpate_mechanics::surface::{
    Beam, BeamPart, BeamSection, BeamSupport, BeamSupportKind, Digit, Extent, ForceDirection, Plate,
    PlateError, SupportedBeam, SupportedBeamSpec, SurfaceSpec,
};

use crate::document::{At, place};
use crate::error::{Place, RigError, RigProblem};
use crate::values::{Count, Density, Length, Modulus, Number, Point, Positive, Quantity};
use crate::values::{RotationalStiffness, Stiffness};

/// The elastic body.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename = "by kind", rename_all = "kebab-case")]
pub(crate) enum SurfaceKeys {
    /// A straight beam.
    Beam(BeamKeys),
    /// A rectangular plate.
    Plate(PlateKeys),
    /// A flexible finger, clamped at 0 and free at its tip.
    Digit(DigitKeys),
    /// A surface without a model, with recordings only.
    Measured(MeasuredKeys),
}

/// A straight beam of rectangular section; without `supports` simply supported at both ends.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BeamKeys {
    /// Length.
    pub length: Positive<Length>,
    /// Width of the section, and of `sections` without a width.
    pub width: Option<Positive<Length>>,
    /// Thickness of the section, and of `sections` without a thickness.
    pub thickness: Option<Positive<Length>>,
    /// Young's modulus of its material.
    pub youngs_modulus: Positive<Modulus>,
    /// The beam's supports; `simple`, at both ends, by default.
    pub supports: Option<At<BeamSupportsKeys>>,
    /// Stretches of one section each, from left to right.
    pub sections: Option<At<Vec<At<SectionKeys>>>>,
    /// Density, for a beam that swings under a moving contact.
    pub density: Option<At<Positive<Density>>>,
}

/// A word for both ends, or a list.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename = "by shape", expecting = "a word such as \"simple\", or a list of supports")]
pub(crate) enum BeamSupportsKeys {
    Text(EndsKeys),
    List(Vec<BeamSupportKeys>),
}

/// Support of both ends.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum EndsKeys {
    /// No deflection, free to turn.
    Simple,
}

/// A support of a beam.
#[derive(Clone, Debug, Deserialize)]
#[serde(
    rename = "by kind",
    rename_all = "kebab-case",
    deny_unknown_fields,
    expecting = "a support such as { at = \"0 mm\", kind = \"clamped\" }"
)]
pub(crate) enum BeamSupportKeys {
    /// No deflection, free to turn.
    Simple {
        /// Position.
        at: At<Quantity<Length>>,
    },
    /// Neither deflection nor slope.
    Clamped {
        /// Position.
        at: At<Quantity<Length>>,
    },
    /// No support: a free end.
    Free {
        /// Position, an end of the beam.
        at: At<Quantity<Length>>,
    },
    /// No slope, free to deflect.
    Guided {
        /// Position.
        at: At<Quantity<Length>>,
    },
    /// A spring.
    Elastic {
        /// Position.
        at: At<Quantity<Length>>,
        /// Upward force per downward deflection.
        stiffness: Positive<Stiffness>,
        /// Couple against the slope; without it the beam is free to turn there.
        rotational_stiffness: Option<Positive<RotationalStiffness>>,
    },
}

/// A stretch of a beam that has one width and thickness.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section such as { to = \"100 mm\", thickness = \"2 mm\" }")]
pub(crate) struct SectionKeys {
    /// End; without it, the end of the beam, for the last section.
    pub to: Option<At<Positive<Length>>>,
    /// Width, if it differs from the beam's.
    pub width: Option<Positive<Length>>,
    /// Thickness, if it differs from the beam's.
    pub thickness: Option<Positive<Length>>,
}

/// A rectangular plate; x runs along its length, y along its width.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PlateKeys {
    /// Length, along x.
    pub length: Positive<Length>,
    /// Width, along y.
    pub width: Positive<Length>,
    /// Thickness.
    pub thickness: Positive<Length>,
    /// Young's modulus of its material.
    pub youngs_modulus: Positive<Modulus>,
    /// Poisson's ratio of its material.
    pub poissons_ratio: At<Quantity<Number>>,
    /// Support of its edges; `free` by default.
    pub edges: Option<At<EdgesKeys>>,
    /// Supports at points.
    pub supports: Option<At<PointSupportsKeys>>,
    /// Elements along the longer side; 128 by default.
    pub elements: Option<At<Count<1, { i64::MAX }>>>,
}

/// A word for all edges, or one for each.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(
    rename = "by shape",
    expecting = "a word such as \"simple\", or a table of left, right, bottom and top"
)]
pub(crate) enum EdgesKeys {
    Text(Edge),
    Table(Edges),
}

#[derive(Clone, Debug, Deserialize)]
#[serde(rename = "by shape", expecting = "a list of points on a plate; `edges` supports its edges")]
pub(crate) enum PointSupportsKeys {
    List(Vec<At<PointSupportKeys>>),
}

/// A support of a plate at one point.
#[derive(Clone, Debug, Deserialize)]
#[serde(
    rename = "by kind",
    rename_all = "kebab-case",
    deny_unknown_fields,
    expecting = "a support such as { at = [\"10 mm\", \"10 mm\"], kind = \"simple\" }"
)]
pub(crate) enum PointSupportKeys {
    /// No deflection; the plate can turn on it.
    Simple {
        /// Position.
        at: At<Point>,
    },
    /// A spring.
    Elastic {
        /// Position.
        at: At<Point>,
        /// Upward force per downward deflection.
        stiffness: Positive<Stiffness>,
    },
}

/// A flexible finger of rectangular section, clamped at 0 and free at its tip.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DigitKeys {
    /// Length from the clamp to the tip.
    pub length: Positive<Length>,
    /// Width of the section.
    pub width: Positive<Length>,
    /// Thickness of the section.
    pub thickness: Positive<Length>,
    /// Young's modulus of its material.
    pub youngs_modulus: Positive<Modulus>,
    /// Direction of a contact's force.
    pub direction: ForceDirection,
}

/// The size of a surface without a model.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MeasuredKeys {
    /// Length.
    pub length: Positive<Length>,
    /// Width of a plane; without it the surface is a line.
    pub width: Option<Positive<Length>>,
}

impl At<SurfaceKeys> {
    pub fn build(&self) -> Result<SurfaceSpec, RigError> {
        match &**self {
            SurfaceKeys::Beam(keys) => keys.build(&self.place),
            SurfaceKeys::Plate(keys) => keys.build(&self.place).map(SurfaceSpec::Plate),
            SurfaceKeys::Digit(keys) => {
                let (length_m, width_m) = (keys.length.si, keys.width.si);
                let digit = Digit::new(length_m, width_m, keys.thickness.si, keys.youngs_modulus.si);
                let digit = digit.map_err(|error| RigProblem::Digit(error).at_place(&self.place))?;
                Ok(SurfaceSpec::Digit(digit.with_direction(keys.direction)))
            }
            SurfaceKeys::Measured(keys) => {
                let extent = Extent::new(keys.length.si, keys.width.map(|width| width.si));
                Ok(extent.map_err(|error| RigProblem::Extent(error).at_place(&self.place))?.into())
            }
        }
    }

    pub fn density(&self) -> Option<&At<Positive<Density>>> {
        match &**self {
            SurfaceKeys::Beam(keys) => keys.density.as_ref(),
            _ => None,
        }
    }
}

impl BeamKeys {
    fn build(&self, place: &Place) -> Result<SurfaceSpec, RigError> {
        let (length_m, youngs_modulus_pa) = (self.length.si, self.youngs_modulus.si);
        let size = |key, own: Option<Positive<Length>>, beams: Option<Positive<Length>>| {
            own.or(beams).map(|size| size.si).ok_or_else(|| place.missing(key))
        };
        let section = |to_m, width, thickness| {
            let width_m = size("width", width, self.width)?;
            Ok(BeamSection { to_m, width_m, thickness_m: size("thickness", thickness, self.thickness)? })
        };
        let supports = match self.supports.as_deref() {
            Some(BeamSupportsKeys::List(listed)) => Some(listed.as_slice()),
            Some(BeamSupportsKeys::Text(EndsKeys::Simple)) | None => None,
        };
        let sections = match &self.sections {
            None => vec![section(length_m, None, None)?],
            Some(listed) => {
                let last = listed.len().saturating_sub(1);
                let each = listed.iter().enumerate().map(|(i, own)| {
                    let to_m = match &own.to {
                        Some(to) => to.si,
                        None if i == last => length_m,
                        None => return Err(own.place.missing("to")),
                    };
                    section(to_m, own.width, own.thickness)
                });
                each.collect::<Result<_, _>>()?
            }
        };
        if let (None, None, [BeamSection { width_m, thickness_m, .. }]) =
            (supports, &self.sections, sections.as_slice())
        {
            let beam = Beam::new(length_m, *width_m, *thickness_m, youngs_modulus_pa);
            return beam.map(SurfaceSpec::Beam).map_err(|error| RigProblem::Beam(error).at_place(place));
        }
        let supports = match supports {
            Some(listed) => listed.iter().map(|support| support.build().1).collect(),
            None => vec![
                BeamSupport { at_m: 0.0, kind: BeamSupportKind::Simple },
                BeamSupport { at_m: length_m, kind: BeamSupportKind::Simple },
            ],
        };
        let spec = SupportedBeamSpec { length_m, youngs_modulus_pa, sections, supports };
        let beam = SupportedBeam::new(spec).map_err(|error| {
            let part = self.place_of(error.part()).unwrap_or(place);
            RigProblem::SupportedBeam(error).at_place(part)
        })?;
        Ok(SurfaceSpec::SupportedBeam(Box::new(beam)))
    }

    fn place_of(&self, part: BeamPart) -> Option<&Place> {
        match part {
            BeamPart::Whole => None,
            BeamPart::Supports => place(&self.supports),
            BeamPart::Support(i) => match self.supports.as_deref()? {
                BeamSupportsKeys::List(listed) => Some(listed.get(i)?.build().0),
                BeamSupportsKeys::Text(_) => None,
            },
            BeamPart::Sections => place(&self.sections),
            BeamPart::Section(i) => {
                let section = self.sections.as_ref()?.get(i)?;
                place(&section.to).or(Some(&section.place))
            }
        }
    }
}

impl BeamSupportKeys {
    fn build(&self) -> (&Place, BeamSupport) {
        let (at, kind) = match self {
            Self::Simple { at } => (at, BeamSupportKind::Simple),
            Self::Clamped { at } => (at, BeamSupportKind::Clamped),
            Self::Free { at } => (at, BeamSupportKind::Free),
            Self::Guided { at } => (at, BeamSupportKind::Guided),
            Self::Elastic { at, stiffness, rotational_stiffness } => (
                at,
                BeamSupportKind::Elastic {
                    stiffness_n_per_m: stiffness.si,
                    rotational_stiffness_nm_per_rad: rotational_stiffness.map(|stiffness| stiffness.si),
                },
            ),
        };
        (&at.place, BeamSupport { at_m: at.si, kind })
    }
}

impl PlateKeys {
    fn build(&self, place: &Place) -> Result<Plate, RigError> {
        let extent = Extent::plane(self.length.si, self.width.si)
            .map_err(|error| RigProblem::Extent(error).at_place(place))?;
        let edges = match self.edges.as_deref() {
            None => Edges::default(),
            Some(EdgesKeys::Text(edge)) => Edges::all(*edge),
            Some(EdgesKeys::Table(edges)) => *edges,
        };
        let supports = self.supports().iter().map(|support| support.build(extent));
        let spec = PlateSpec {
            length_m: self.length.si,
            width_m: self.width.si,
            thickness_m: self.thickness.si,
            youngs_modulus_pa: self.youngs_modulus.si,
            poissons_ratio: self.poissons_ratio.si,
            edges,
            supports: supports.collect::<Result<_, _>>()?,
            elements: self.elements.as_deref().map_or(PlateSpec::DEFAULT_ELEMENTS, |elements| elements.get()),
        };
        Plate::new(spec)
            .map_err(|error| RigProblem::Plate(error).at_place(self.place_of(error).unwrap_or(place)))
    }

    fn supports(&self) -> &[At<PointSupportKeys>] {
        match self.supports.as_deref() {
            Some(PointSupportsKeys::List(listed)) => listed,
            None => &[],
        }
    }

    fn place_of(&self, error: PlateError) -> Option<&Place> {
        match error {
            PlateError::SupportOffPlate { number, .. }
            | PlateError::Stiffness { number, .. }
            | PlateError::SupportOnHeldEdge { number, .. }
            | PlateError::SupportsAtOnePlace { second: number, .. }
            | PlateError::SupportsTooClose { second: number, .. } => {
                self.supports().get(number - 1).map(|support| &support.place)
            }
            PlateError::NotHeld | PlateError::HeldAtOnePoint { .. } | PlateError::HeldOnALine { .. } => {
                place(&self.supports).or(place(&self.edges))
            }
            PlateError::Elements { .. } | PlateError::MeshTooLarge { .. } => place(&self.elements),
            PlateError::PoissonsRatio { .. } => Some(&self.poissons_ratio.place),
            PlateError::NotPositive(_) | PlateError::Compliance { .. } | PlateError::Unsolvable { .. } => {
                None
            }
        }
    }
}

impl PointSupportKeys {
    fn build(&self, extent: Extent) -> Result<PointSupport, RigError> {
        let (at, kind) = match self {
            Self::Simple { at } => (at, PointSupportKind::Simple),
            Self::Elastic { at, stiffness } => {
                (at, PointSupportKind::Elastic { stiffness_n_per_m: stiffness.si })
            }
        };
        Ok(PointSupport { position: at.position(extent)?, kind })
    }
}
