//! An estimate as a line of CSV or JSON.

use crate::failure::{Complaint, Failure};
use palpate_estimators::digit::DigitShape;
use palpate_estimators::estimator::{ContactEstimate, Estimate, Uncertainty};
use palpate_estimators::recording::csv_row;
use palpate_mechanics::surface::Extent;

/// The columns of [`csv`]. What a locator does not estimate stays empty.
pub fn heading(extent: Extent) -> &'static str {
    match extent {
        Extent::Line { .. } => "position_mm,force_n,low_mm,high_mm,status\n",
        Extent::Plane { .. } => "x_mm,y_mm,force_n,x_low_mm,x_high_mm,y_low_mm,y_high_mm,status\n",
    }
}

/// A line of CSV: position, force, the ends of the 95 % interval, status.
pub fn csv(estimate: &Estimate, extent: Extent) -> String {
    let contact = &estimate.contact;
    let mm = |at_m: f64| format!("{:.4}", at_m * 1e3);
    let mut cells: Vec<String> = extent.coordinates_m(contact.position).map(mm).collect();
    cells.push(contact.force_n.map_or_else(String::new, |force_n| format!("{force_n:.4}")));
    cells.extend(match contact.uncertainty {
        None => vec![String::new(); 2 * extent.dimensions()],
        Some(Uncertainty { x_95_m: x, y_95_m: y, .. }) => {
            [x.0, x.1, y.0, y.1].map(mm).into_iter().take(2 * extent.dimensions()).collect()
        }
    });
    cells.push(estimate.status.name().to_owned());
    csv_row(cells)
}

/// An estimate as JSON.
#[derive(serde::Serialize)]
struct JsonEstimate {
    line: u64,
    #[serde(flatten)]
    contact: JsonContact,
    status: &'static str,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    modes: Vec<JsonMode>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    further: Vec<JsonContact>,
    #[serde(skip_serializing_if = "Option::is_none")]
    shape: Option<Vec<JsonShapePoint>>,
}

/// A point of the bent finger's centre line: how far along it, where, and how sure.
#[derive(serde::Serialize)]
struct JsonShapePoint {
    at_mm: f64,
    x_mm: f64,
    y_mm: f64,
    sd_mm: f64,
}

#[derive(serde::Serialize)]
struct JsonMode {
    #[serde(flatten)]
    contact: JsonContact,
    probability: f64,
}

#[derive(serde::Serialize)]
struct JsonContact {
    x_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    force_n: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    x_95_mm: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_95_mm: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sd_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sd_force_n: Option<f64>,
}

/// A line of JSON: all that the locator says of the reading in line `line` of its source, and the shape where it is asked for.
pub fn json(
    estimate: &Estimate,
    line: u64,
    extent: Extent,
    shape: Option<&DigitShape>,
) -> Result<String, Failure> {
    let mode = |mode: &palpate_estimators::estimator::Mode| JsonMode {
        contact: json_contact(&mode.contact, extent),
        probability: mode.probability,
    };
    let object = JsonEstimate {
        line,
        contact: json_contact(&estimate.contact, extent),
        status: estimate.status.name(),
        modes: estimate.modes.as_slice().iter().map(mode).collect(),
        further: estimate.further.as_slice().iter().map(|further| json_contact(further, extent)).collect(),
        shape: shape.map(json_shape),
    };
    serde_json::to_string(&object).map(|line| line + "\n").map_err(|error| Complaint::new(error).into())
}

fn json_shape(shape: &DigitShape) -> Vec<JsonShapePoint> {
    let point = |point: &palpate_estimators::digit::ShapePoint| JsonShapePoint {
        at_mm: point.at_m * 1e3,
        x_mm: point.x_m * 1e3,
        y_mm: point.y_m * 1e3,
        sd_mm: point.sd_m * 1e3,
    };
    shape.points.iter().map(point).collect()
}

fn json_contact(contact: &ContactEstimate, extent: Extent) -> JsonContact {
    let uncertainty = contact.uncertainty.as_ref();
    let mm = |(low, high): (f64, f64)| [low * 1e3, high * 1e3];
    // JSON has no infinity: what is not known at all is left out.
    let sd = |variance: f64| Some(variance.sqrt()).filter(|sd| *sd > 0.0 && sd.is_finite());
    JsonContact {
        x_mm: contact.position.x_m * 1e3,
        y_mm: extent.across(contact.position.y_m * 1e3),
        force_n: contact.force_n,
        x_95_mm: uncertainty.map(|uncertainty| mm(uncertainty.x_95_m)),
        y_95_mm: uncertainty.and_then(|uncertainty| extent.across(mm(uncertainty.y_95_m))),
        sd_mm: uncertainty.and_then(|u| sd(u.covariance[0] + u.covariance[3])).map(|sd_m| sd_m * 1e3),
        sd_force_n: uncertainty.and_then(|u| sd(u.covariance[5])),
    }
}
