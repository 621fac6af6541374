use crate::calibration::{Check, Trace, deviation_percent};
use palpate_estimators::recording::Row;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use serde::Serialize;

#[derive(Clone, Debug, Serialize)]
pub struct PressRecord {
    /// Number, from 1.
    press: usize,
    x_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<f64>,
    force_n: Option<f64>,
    deviation_percent: Option<f64>,
    /// Error of a locator fitted without this place.
    held_out_mm: Option<f64>,
    /// Seconds relative to the recording, and relative distance in %.
    trace: Vec<(f64, f64)>,
}

/// Records of presses; `errors_m` has one value per press.
pub fn press_records(
    rows: &[Row],
    traces: &[Option<Trace>],
    errors_m: &[Option<f64>],
    extent: Extent,
) -> Vec<PressRecord> {
    let touched = rows.iter().enumerate().filter(|(_, row)| row.touches());
    let record = |(press, (at, row)): (usize, (usize, &Row))| {
        let (x_mm, y_mm) = place_mm(row.position, extent);
        PressRecord {
            press: press + 1,
            x_mm,
            y_mm,
            force_n: row.force_n,
            deviation_percent: deviation_percent(rows, at),
            held_out_mm: errors_m.get(press).copied().flatten().map(|error_m| error_m * 1e3),
            trace: traces.get(at).cloned().flatten().unwrap_or_default().points,
        }
    };
    touched.enumerate().map(record).collect()
}

#[derive(Clone, Debug, Serialize)]
pub struct CheckRecord {
    presses: String,
    places: Vec<CheckedPlaceRecord>,
    median_mm: f64,
    mean_mm: f64,
    covered: Option<usize>,
    placement_mm: Option<f64>,
}

#[derive(Clone, Debug, Serialize)]
struct CheckedPlaceRecord {
    x_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<f64>,
    estimate_x_mm: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    estimate_y_mm: Option<f64>,
    error_mm: f64,
    covered: Option<bool>,
}

impl CheckRecord {
    pub fn new(presses: &str, check: &Check, placement_sd_m: Option<f64>, extent: Extent) -> Self {
        let places = check.places.iter().map(|place| {
            let (x_mm, y_mm) = place_mm(place.position, extent);
            let (estimate_x_mm, estimate_y_mm) = place_mm(place.estimate, extent);
            let error_mm = place.error_m * 1e3;
            CheckedPlaceRecord { x_mm, y_mm, estimate_x_mm, estimate_y_mm, error_mm, covered: place.covered }
        });
        Self {
            presses: presses.to_owned(),
            places: places.collect(),
            median_mm: check.median_m * 1e3,
            mean_mm: check.mean_m * 1e3,
            covered: check.covered,
            placement_mm: placement_sd_m.map(|sd_m| sd_m * 1e3),
        }
    }
}

fn place_mm(position: Position, extent: Extent) -> (f64, Option<f64>) {
    (position.x_m * 1e3, extent.width_m().map(|_| position.y_m * 1e3))
}
