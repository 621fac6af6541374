use super::calibration::Calibrator;
use crate::frame::Channel;
use crate::recording::RecordingStatus;
use crate::session::Estimation;
use palpate_estimators::description;
use palpate_estimators::estimator::Locator;
use palpate_estimators::setup::Setup;
use palpate_mechanics::limit::{CramerRaoBound, Force, LimitCurve};
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::{BeamSupportKind, Extent, SurfaceSpec};
use serde::Serialize;
use serde_json::{Value, json};

/// Limit on the time for the accuracy limit.
const LIMIT_S: f64 = 5.0;
/// Force of the accuracy limit, if unknown.
const FORCE_N: f64 = 1.0;

#[derive(Clone, Debug, Serialize)]
pub struct SessionInfo {
    version: &'static str,
    locator: Option<Value>,
    /// Null without a rig.
    surface: Option<Value>,
    channels: Vec<Value>,
    force: Value,
    tare: Value,
    limit: Option<Value>,
    estimation: Estimation,
    source: Option<String>,
    recording: Option<Value>,
    has_simulated: bool,
    /// See `/api/calibration`.
    calibrates: bool,
    /// See `/api/bring-up`.
    brings_up: bool,
}

impl SessionInfo {
    pub fn new(locator: &Locator, name: &str, has_simulated: bool) -> Self {
        let description = description::locator(locator);
        Self {
            locator: Some(json!({ "name": name, "kind": locator.kind(), "description": description })),
            tare: match locator.tare() {
                Ok(_) => json!({ "available": true, "follows": locator.false_alarm_rate().is_some() }),
                Err(why) => json!({ "available": false, "follows": false, "why": why.to_string() }),
            },
            limit: limit(locator),
            has_simulated,
            ..Self::of_setup(&locator.setup)
        }
    }

    pub fn of_setup(setup: &Setup) -> Self {
        let known_n = setup.force_n();
        let why = "the locator does not exist yet: the calibration has not ended";
        Self {
            version: env!("CARGO_PKG_VERSION"),
            locator: None,
            surface: Some(surface(setup.surface())),
            channels: channels(setup),
            force: json!({ "known_n": known_n, "unknown": known_n.is_none() }),
            tare: json!({ "available": false, "follows": false, "why": why }),
            limit: None,
            estimation: Estimation::default(),
            source: None,
            recording: None,
            has_simulated: false,
            calibrates: false,
            brings_up: false,
        }
    }

    pub fn without_rig() -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            locator: None,
            surface: None,
            channels: Vec::new(),
            force: json!({ "known_n": null, "unknown": true }),
            tare: json!({ "available": false, "follows": false, "why": "the rig does not exist yet" }),
            limit: None,
            estimation: Estimation::default(),
            source: None,
            recording: None,
            has_simulated: false,
            calibrates: false,
            brings_up: true,
        }
    }

    pub fn with_source(self, source: Option<String>) -> Self {
        Self { source, ..self }
    }

    pub fn with_estimation(self, estimation: Estimation) -> Self {
        Self { estimation, ..self }
    }

    pub fn with_calibration(self, calibrator: Option<&Calibrator>) -> Self {
        Self { calibrates: calibrator.is_some(), ..self }
    }

    pub fn with_bring_up(self, brings_up: bool) -> Self {
        Self { brings_up, ..self }
    }

    pub fn with_recording(self, recording: Option<(String, Option<RecordingStatus>)>) -> Self {
        let recording = recording.map(|(folder, status)| match status {
            Some(RecordingStatus { name, bytes, seconds, problem, .. }) => {
                json!({ "folder": folder, "name": name, "bytes": bytes, "seconds": seconds, "problem": problem })
            }
            None => json!({ "folder": folder, "name": null, "bytes": 0, "seconds": 0 }),
        });
        Self { recording, ..self }
    }
}

fn surface(surface: &SurfaceSpec) -> Value {
    let extent = surface.extent();
    let (length_mm, width_mm) = (extent.length_m() * 1e3, extent.width_m().map(|width_m| width_m * 1e3));
    let at = |at_m: f64, kind: &str| json!({ "at_mm": at_m * 1e3, "kind": kind });
    let (kind, supports) = match surface {
        SurfaceSpec::Beam(_) => ("beam", vec![at(0.0, "simple"), at(extent.length_m(), "simple")]),
        SurfaceSpec::SupportedBeam(beam) => {
            let supports = beam.spec().supports.iter();
            ("beam", supports.map(|support| at(support.at_m, support_kind(support.kind))).collect())
        }
        SurfaceSpec::Digit(_) => ("digit", vec![at(0.0, "clamped")]),
        SurfaceSpec::Plate(_) => ("plate", Vec::new()),
        SurfaceSpec::Measured(_) => ("measured", Vec::new()),
    };
    json!({ "kind": kind, "length_mm": length_mm, "width_mm": width_mm, "supports": supports })
}

fn support_kind(kind: BeamSupportKind) -> &'static str {
    match kind {
        BeamSupportKind::Simple => "simple",
        BeamSupportKind::Clamped => "clamped",
        BeamSupportKind::Guided => "guided",
        BeamSupportKind::Free => "free",
        BeamSupportKind::Elastic { .. } => "elastic",
    }
}

fn channels(setup: &Setup) -> Vec<Value> {
    let is_plane = setup.surface().extent().width_m().is_some();
    let channels = Channel::all_of(setup).into_iter().zip(setup.layout().sensors());
    channels
        .map(|(channel, sensor)| {
            let placed = sensor.kind != SensorKind::Raw;
            json!({
                "name": channel.name,
                "label": channel.label,
                "unit": channel.unit.symbol(),
                "measure": sensor.kind.name(),
                "x_mm": placed.then_some(sensor.position.x_m * 1e3),
                "y_mm": (placed && is_plane).then_some(sensor.position.y_m * 1e3),
            })
        })
        .collect()
}

/// Accuracy limit over the surface, if fast to compute.
fn limit(locator: &Locator) -> Option<Value> {
    let setup = locator.learnt_setup().ok()?;
    let extent = setup.surface().extent();
    let bound = match locator.force_linear() {
        Some(linear) => linear.cramer_rao_bound(extent),
        None => {
            let cost = CramerRaoBound::cost(setup.surface().model()?, setup.layout(), 0);
            // Lower bound, without a search for ambiguous contacts.
            if cost.seconds[0] > LIMIT_S {
                return None;
            }
            setup.cramer_rao_bound().ok()?
        }
    };
    let (force, force_n) = match setup.force_n() {
        Some(force_n) => (Force::Known, force_n),
        None => (Force::Unknown, FORCE_N),
    };
    let curve = LimitCurve::over_surface(&bound, force_n, force).ok()?;
    let place = |point: &palpate_mechanics::contact::Position| match extent {
        Extent::Line { .. } => json!(point.x_m * 1e3),
        Extent::Plane { .. } => json!([point.x_m * 1e3, point.y_m * 1e3]),
    };
    let positions: Vec<Value> = curve.points.iter().map(|point| place(&point.position)).collect();
    let sd_mm: Vec<Option<f64>> =
        curve.points.iter().map(|point| point.bound.map(|bound| bound.sd_position_m * 1e3)).collect();
    Some(json!({ "positions_mm": positions, "sd_mm": sd_mm, "force_n": force_n }))
}
