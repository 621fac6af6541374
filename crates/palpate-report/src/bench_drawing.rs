//! A beam bench as SVG text: supports, sensors, load and the deflected shape.

mod frame;
mod supports;

use super::canvas::{self, Anchor, Canvas, GRID, INK, Label, QUIET_INK, REFERENCE};
use super::geometry::{Point, Rect};
use super::text;
use super::ticks::plain;
use frame::{BEAM_Y, Frame, MARGIN, NUMBER_LINE, NUMBER_TOP, NumberRows};
use plotters::style::{Color, RGBColor};
use supports::draw_support;

const FONT_SIZE: f64 = 12.0;
/// Middle of the force label, and the tail of its arrow.
const LOAD_LABEL_Y: f64 = 20.0;
const ARROW_TAIL_Y: f64 = 34.0;
const BEAM_HALF_THICKNESS: f64 = 3.0;
/// The same of the thickest stretch of a stepped beam, and of any stretch at least.
const STEPPED_HALF_THICKNESS: (f64, f64) = (5.5, 1.2);
const PROBE_TOP: f64 = 164.0;
const PROBE_HEIGHT: f64 = 18.0;
const PROBE_HALF_WIDTH: f64 = 4.5;
/// Room for the dimension line, and for the remark beneath it.
const DIMENSION_LINE: f64 = 30.0;
const REMARK_LINE: f64 = 26.0;

/// What a bench drawing shows. Positions are from the left end of the beam.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchDrawing {
    /// Length of the beam in millimetres.
    pub length_mm: f64,
    /// How the beam is held.
    pub supports: Vec<BenchSupport>,
    /// Stretches of different thickness, from left to right; empty for a beam that has one thickness.
    pub steps: Vec<BenchStep>,
    /// Position of each sensor; they are numbered from 1 in this order.
    pub sensors_mm: Vec<f64>,
    /// Where the load acts.
    pub load_mm: f64,
    /// What stands above the arrow of the load: "3 N".
    pub load_label: String,
    /// Deflected shape as (position, deflection), both in millimetres and downward negative. Points that are not
    /// finite break the line; empty for none.
    pub deflection_mm: Vec<(f64, f64)>,
    /// Width of the image in pixels at scale 1; drawn within 320 to 4,000. The height follows from the content.
    pub width_px: u32,
}

/// A stretch of the beam that has one thickness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BenchStep {
    /// Where it ends, in millimetres.
    pub to_mm: f64,
    /// Its thickness, in millimetres.
    pub thickness_mm: f64,
}

/// A support of the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BenchSupport {
    /// Where it is, in millimetres.
    pub position_mm: f64,
    /// How it holds the beam.
    pub kind: BenchSupportKind,
}

/// How a support holds the beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BenchSupportKind {
    /// A wedge: no deflection, free to turn.
    Simple,
    /// A clamp: neither deflection nor slope.
    Clamped,
    /// A slide: no slope, free to deflect.
    Guided,
    /// A spring.
    Elastic,
}

/// A part of the bench that has a position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BenchPart {
    /// A support.
    Support,
    /// A step of the beam's thickness.
    Step,
    /// A sensor.
    Sensor,
    /// The load.
    Load,
}

impl std::fmt::Display for BenchPart {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.write_str(match self {
            BenchPart::Support => "support",
            BenchPart::Step => "step",
            BenchPart::Sensor => "sensor",
            BenchPart::Load => "load",
        })
    }
}

/// Why a bench cannot be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BenchDrawingError {
    /// The beam has no length.
    #[error("a beam of {length_mm} mm cannot be drawn; its length must be positive and finite")]
    Length {
        /// The length that was given.
        length_mm: f64,
    },
    /// Something is not on the beam.
    #[error("the {part} at {position_mm} mm is not on the beam, which reaches from 0 to {length_mm} mm")]
    OffBeam {
        /// What it is.
        part: BenchPart,
        /// Where it was said to be.
        position_mm: f64,
        /// Length of the beam.
        length_mm: f64,
    },
}

/// Draws the bench as one self-contained SVG document.
///
/// The deflected shape is exaggerated by a round factor, which the drawing states together with the beam's length
/// and the largest deflection, both in millimetres.
///
/// # Errors
/// A length that is not positive and finite, and a support, sensor or load that is not on the beam.
pub fn bench_to_svg(bench: &BenchDrawing) -> Result<String, BenchDrawingError> {
    validate(bench)?;
    let width_px = bench.width_px.clamp(320, 4000);
    let frame = Frame::new(bench, f64::from(width_px));
    let numbers = NumberRows::new(bench, &frame);
    let dimension_y = NUMBER_TOP + numbers.count as f64 * NUMBER_LINE + DIMENSION_LINE / 2.0;
    let remark_y = dimension_y + DIMENSION_LINE / 2.0 + REMARK_LINE / 2.0;
    let height_px = (remark_y + REMARK_LINE / 2.0).ceil() as u32;
    Ok(canvas::svg(width_px, height_px, |canvas| {
        draw_sensors(canvas, bench, &frame);
        numbers.labels.iter().for_each(|label| canvas.text(label));
        draw_beam(canvas, bench, &frame);
        bench.supports.iter().for_each(|support| draw_support(canvas, bench, support, &frame));
        draw_deflection(canvas, bench, &frame);
        draw_load(canvas, bench, &frame);
        draw_dimension(canvas, bench, &frame, dimension_y);
        draw_remark(canvas, &frame, remark_y);
    }))
}

fn validate(bench: &BenchDrawing) -> Result<(), BenchDrawingError> {
    let length_mm = bench.length_mm;
    if !(length_mm > 0.0 && length_mm.is_finite()) {
        return Err(BenchDrawingError::Length { length_mm });
    }
    let supports = bench.supports.iter().map(|support| (BenchPart::Support, support.position_mm));
    let steps = bench.steps.iter().map(|step| (BenchPart::Step, step.to_mm));
    let sensors = bench.sensors_mm.iter().map(|&position_mm| (BenchPart::Sensor, position_mm));
    let mut parts = supports.chain(steps).chain(sensors).chain([(BenchPart::Load, bench.load_mm)]);
    match parts.find(|(_, position_mm)| !(0.0..=length_mm).contains(position_mm)) {
        Some((part, position_mm)) => Err(BenchDrawingError::OffBeam { part, position_mm, length_mm }),
        None => Ok(()),
    }
}

/// Probes that stand beneath the beam and touch it.
fn draw_sensors(canvas: &Canvas<'_>, bench: &BenchDrawing, frame: &Frame) {
    let colour = canvas::palette(2);
    for &position_mm in &bench.sensors_mm {
        let across = frame.across(position_mm);
        canvas.line(&[(across, frame.surface_y(across)), (across, PROBE_TOP)], 1.2, colour);
        let body = Rect {
            left: across - PROBE_HALF_WIDTH,
            right: across + PROBE_HALF_WIDTH,
            top: PROBE_TOP,
            bottom: PROBE_TOP + PROBE_HEIGHT,
        };
        canvas.rectangle(body, colour.to_rgba());
    }
}

/// Half the drawn thickness of a stretch of the beam; of the whole beam where it has no steps.
fn half_thickness(bench: &BenchDrawing, step: Option<&BenchStep>) -> f64 {
    let thickest_mm = bench.steps.iter().map(|step| step.thickness_mm).fold(0.0, f64::max);
    let (largest, least) = STEPPED_HALF_THICKNESS;
    match step {
        Some(step) if bench.steps.len() > 1 => {
            (largest * step.thickness_mm / thickest_mm).clamp(least, largest)
        }
        _ => BEAM_HALF_THICKNESS,
    }
}

/// The beam as it is without a load.
fn draw_beam(canvas: &Canvas<'_>, bench: &BenchDrawing, frame: &Frame) {
    let stretch = |left: f64, right: f64, half: f64| {
        let beam = Rect { left, right, top: BEAM_Y - half, bottom: BEAM_Y + half };
        canvas.rectangle(beam, GRID.to_rgba());
    };
    if bench.steps.is_empty() {
        return stretch(MARGIN, frame.width - MARGIN, BEAM_HALF_THICKNESS);
    }
    let mut from = MARGIN;
    for step in &bench.steps {
        let to = frame.across(step.to_mm);
        stretch(from, to, half_thickness(bench, Some(step)));
        from = to;
    }
}

/// The deflected shape and its largest deflection.
fn draw_deflection(canvas: &Canvas<'_>, bench: &BenchDrawing, frame: &Frame) {
    let colour = canvas::palette(0);
    for stretch in &frame.shape {
        canvas.line(stretch, 2.5, colour);
    }
    let Some((position_mm, deflection_mm)) = frame.deepest else { return };
    let (across, y) = frame.deflected(position_mm, deflection_mm);
    double_arrow(canvas, (across, BEAM_Y), (across, y), colour);
    let text = format!("{} mm", rounded(deflection_mm.abs()));
    let right_half = position_mm > bench.length_mm / 2.0;
    let label = Label {
        text,
        at: (across + if right_half { -9.0 } else { 9.0 }, BEAM_Y.midpoint(y)),
        anchor: if right_half { Anchor::End } else { Anchor::Start },
        size: FONT_SIZE,
        colour,
    };
    canvas.text(&label);
}

fn draw_load(canvas: &Canvas<'_>, bench: &BenchDrawing, frame: &Frame) {
    let colour = canvas::palette(1);
    let across = frame.across(bench.load_mm);
    let tip = (across, frame.surface_y(across).min(BEAM_Y) - BEAM_HALF_THICKNESS);
    canvas.line(&[(across, ARROW_TAIL_Y.min(tip.1 - 10.0)), (across, tip.1 - 8.0)], 2.2, colour);
    arrow_head(canvas, tip, (0.0, 1.0), 10.0, colour);
    canvas.text(&frame.centred(&bench.load_label, (across, LOAD_LABEL_Y), FONT_SIZE + 1.0, colour));
}

/// The beam's length between two ticks.
fn draw_dimension(canvas: &Canvas<'_>, bench: &BenchDrawing, frame: &Frame, y: f64) {
    let (left, right) = (MARGIN, frame.width - MARGIN);
    for end in [left, right] {
        canvas.line(&[(end, y - 7.0), (end, y + 7.0)], 1.0, REFERENCE);
    }
    let text = format!("{} mm", plain(bench.length_mm));
    let label = frame.centred(&text, (frame.width / 2.0, y), FONT_SIZE, INK);
    let half_gap = text::width(&label.text, FONT_SIZE) / 2.0 + 6.0;
    for (start, end, outward) in
        [(frame.width / 2.0 - half_gap, left, -1.0), (frame.width / 2.0 + half_gap, right, 1.0)]
    {
        canvas.line(&[(start, y), (end, y)], 1.0, REFERENCE);
        arrow_head(canvas, (end, y), (outward, 0.0), 7.0, REFERENCE);
    }
    canvas.text(&label);
}

fn draw_remark(canvas: &Canvas<'_>, frame: &Frame, y: f64) {
    let remark = match frame.deepest {
        Some(_) => format!("deflection drawn {} ×", rounded(frame.exaggeration)),
        None => "no deflection".to_owned(),
    };
    canvas.text(&frame.centred(&remark, (frame.width / 2.0, y), FONT_SIZE - 1.0, QUIET_INK));
}

/// A vertical line between two points with a head at each end, where it is long enough for them.
fn double_arrow(canvas: &Canvas<'_>, start: Point, end: Point, colour: RGBColor) {
    canvas.line(&[start, end], 1.0, colour);
    let downward = (end.1 - start.1).signum();
    if (end.1 - start.1).abs() > 14.0 {
        arrow_head(canvas, start, (0.0, -downward), 6.0, colour);
        arrow_head(canvas, end, (0.0, downward), 6.0, colour);
    }
}

/// A filled triangle with its tip at the point, pointing along the unit vector.
fn arrow_head(canvas: &Canvas<'_>, tip: Point, along: Point, length: f64, colour: RGBColor) {
    let back = (tip.0 - along.0 * length, tip.1 - along.1 * length);
    let aside = (-along.1 * length * 0.4, along.0 * length * 0.4);
    let corners = [tip, (back.0 + aside.0, back.1 + aside.1), (back.0 - aside.0, back.1 - aside.1)];
    canvas.polygon(&corners, colour.to_rgba());
}

/// Three significant digits.
fn rounded(value: f64) -> String {
    let unit = 10_f64.powf(value.abs().log10().floor() - 2.0);
    plain((value / unit).round() * unit)
}
