//! Drawing of surfaces: supports, and shape under a contact.

use palpate::mechanics::contact::{Contact, OffSurface, Position};
use palpate::mechanics::sensing::SensorKind;
use palpate::mechanics::surface::plate::{Edge, PointSupportKind};
use palpate::mechanics::surface::{Extent, Surface, SurfaceSpec};
use pyo3::prelude::*;

use crate::errors::refused;

/// Positions and heights of a bent line, in metres, with both ends.
///
/// # Errors
/// `PalpateError` on a plane, without a model, and for a contact off the surface.
pub fn bent_line(surface: &SurfaceSpec, contact: Contact, points: usize) -> PyResult<Vec<[f64; 2]>> {
    let model = surface.model().ok_or_else(|| refused("a measured surface has no model"))?;
    if let Extent::Plane { .. } = model.extent() {
        return Err(refused("a plane has no bent line; `response` gives the readings of its sensors"));
    }
    if points < 2 {
        return Err(refused(format!("`points` is {points}; it must be at least 2")));
    }
    OffSurface::check("position", &[contact.position], model.extent()).map_err(refused)?;
    let along_m = (0..points).map(|i| model.length_m() * i as f64 / (points - 1) as f64);
    if let SurfaceSpec::Digit(digit) = surface {
        let shape = digit.shape(contact);
        return Ok(along_m.map(|at_m| shape.point(at_m)).collect());
    }
    // By reciprocity the shape is the influence function of the deflection under the force.
    let bent = model.influence_function(SensorKind::Deflection, contact.position);
    Ok(along_m.map(|at_m| [at_m, contact.force_n * bent.at(Position::along(at_m))]).collect())
}

/// In the order of [`Surface::force_supports`].
pub fn support_kinds(surface: &SurfaceSpec) -> Vec<&'static str> {
    match surface {
        SurfaceSpec::Beam(beam) => beam.force_supports().iter().map(|_| "simple").collect(),
        SurfaceSpec::SupportedBeam(beam) => {
            let kind_at = |at: &Position| {
                let mut supports = beam.spec().supports.iter();
                supports.find(|support| support.at_m == at.x_m).map(|support| support.kind.name())
            };
            beam.force_supports().iter().filter_map(kind_at).collect()
        }
        SurfaceSpec::Plate(plate) => {
            let kind_at = |at: &Position| {
                let mut supports = plate.spec().supports.iter();
                supports.find(|support| support.position == *at).map(|support| match support.kind {
                    PointSupportKind::Simple => "simple",
                    PointSupportKind::Elastic { .. } => "elastic",
                })
            };
            plate.force_supports().iter().filter_map(kind_at).collect()
        }
        SurfaceSpec::Digit(_) | SurfaceSpec::Measured(_) => Vec::new(),
    }
}

/// Edges of a plate with their supports.
pub fn edges(surface: &SurfaceSpec) -> Option<[(&'static str, &'static str); 4]> {
    let SurfaceSpec::Plate(plate) = surface else { return None };
    let edges = plate.spec().edges;
    let named = [("left", edges.left), ("right", edges.right), ("bottom", edges.bottom), ("top", edges.top)];
    Some(named.map(|(name, edge)| (name, edge_name(edge))))
}

fn edge_name(edge: Edge) -> &'static str {
    match edge {
        Edge::Simple => "simple",
        Edge::Clamped => "clamped",
        Edge::Free => "free",
    }
}
