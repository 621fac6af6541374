use super::drawing::axis::plain;
use super::drawing::geometry::{Point, Rect};
use super::drawing::svg::{Anchor, Colour, GRID, INK, Label, QUIET_INK, REFERENCE, Svg, palette};
use super::drawing::text;
use super::numbers::rig_number;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{Layout, SensorKind};
use palpate_mechanics::surface::{Beam, BeamSection, BeamSupportKind, SupportedBeam, Surface};

/// Off the middle, for a visibly asymmetric shape.
const DRAWN_LOAD: f64 = 0.35;
/// On other supports; the one with the largest bending is used.
const DRAWN_LOADS: [f64; 5] = [DRAWN_LOAD, 0.2, 0.5, 0.65, 0.8];
const SHAPE_STEPS: u32 = 200;

const MARGIN: f64 = 40.0;
const FONT_SIZE: f64 = 12.0;
const LOAD_LABEL_Y: f64 = 20.0;
const ARROW_TAIL_Y: f64 = 34.0;
const BEAM_Y: f64 = 92.0;
const BEAM_HALF_THICKNESS: f64 = 3.0;
const STEPPED_HALF_THICKNESS: (f64, f64) = (5.5, 1.2);
const DEFLECTION_ROOM: f64 = 56.0;
const ROUND: [f64; 10] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
const SUPPORT_HEIGHT: f64 = 22.0;
const SUPPORT_HALF_WIDTH: f64 = 12.0;
const SPRING_GROUND_Y: f64 = BEAM_Y + DEFLECTION_ROOM + 10.0;
const PROBE_TOP: f64 = 164.0;
const PROBE_HEIGHT: f64 = 18.0;
const PROBE_HALF_WIDTH: f64 = 4.5;
const NUMBER_TOP: f64 = 186.0;
const NUMBER_LINE: f64 = 16.0;
const NUMBER_SIZE: f64 = 11.0;
const DIMENSION_LINE: f64 = 30.0;
const REMARK_LINE: f64 = 26.0;

pub(super) fn beam_drawing(beam: &Beam, layout: &Layout, force_n: f64) -> (BeamDrawing, Position) {
    let supports = [0.0, beam.length_m()].map(|at_m| (at_m * 1e3, BeamSupportKind::Simple)).to_vec();
    let load = Position::along(DRAWN_LOAD * beam.length_m());
    (BeamDrawing { supports, ..BeamDrawing::new(beam, layout, load, force_n) }, load)
}

pub(super) fn supported_beam_drawing(
    beam: &SupportedBeam,
    layout: &Layout,
    force_n: f64,
) -> (BeamDrawing, Position) {
    let spec = beam.spec();
    let loads = DRAWN_LOADS.map(|share| Position::along(share * spec.length_m));
    let own = |at: &Position| beam.influence(SensorKind::Deflection, *at, *at).abs();
    let load = loads.into_iter().max_by(|a, b| own(a).total_cmp(&own(b))).unwrap_or(loads[0]);
    let thickness = |section: &BeamSection| (section.to_m * 1e3, section.thickness_m * 1e3);
    let drawing = BeamDrawing {
        supports: spec.supports.iter().map(|support| (support.at_m * 1e3, support.kind)).collect(),
        steps: spec.sections.iter().map(thickness).collect(),
        ..BeamDrawing::new(beam, layout, load, force_n)
    };
    (drawing, load)
}

/// Positions from the left end, clamped to the ends.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BeamDrawing {
    pub length_mm: f64,
    /// Position in millimetres and kind.
    pub supports: Vec<(f64, BeamSupportKind)>,
    /// End and thickness of each stretch in mm, from left to right; empty for one thickness.
    pub steps: Vec<(f64, f64)>,
    pub sensors_mm: Vec<f64>,
    pub load_mm: f64,
    pub load_label: String,
    /// (position, deflection) in mm, downward negative.
    pub deflection_mm: Vec<(f64, f64)>,
    pub width_px: u32,
}

impl BeamDrawing {
    fn new(beam: &dyn Surface, layout: &Layout, load: Position, force_n: f64) -> Self {
        // By reciprocity the bent shape is the influence function of the deflection under the load.
        let bent = beam.influence_function(SensorKind::Deflection, load);
        let point = |i: u32| {
            let at = Position::along(f64::from(i) / f64::from(SHAPE_STEPS) * beam.length_m());
            (at.x_m * 1e3, force_n * bent.at(at) * 1e3)
        };
        Self {
            length_mm: beam.length_m() * 1e3,
            supports: Vec::new(),
            steps: Vec::new(),
            sensors_mm: layout.sensors().iter().map(|sensor| sensor.position.x_m * 1e3).collect(),
            load_mm: load.x_m * 1e3,
            load_label: format!("{} N", rig_number(force_n)),
            deflection_mm: (0..=SHAPE_STEPS).map(point).collect(),
            width_px: 760,
        }
    }

    /// States the length, the largest deflection, both in mm, and the factor of exaggeration.
    pub fn svg(&self) -> String {
        let frame = Frame::new(self);
        let (numbers, number_rows) = number_labels(self, &frame);
        let dimension_y = NUMBER_TOP + number_rows as f64 * NUMBER_LINE + DIMENSION_LINE / 2.0;
        let remark_y = dimension_y + DIMENSION_LINE / 2.0 + REMARK_LINE / 2.0;
        let mut svg = Svg::new(self.width_px, (remark_y + REMARK_LINE / 2.0).ceil() as u32);
        draw_sensors(&mut svg, self, &frame);
        numbers.iter().for_each(|label| svg.text(label));
        draw_beam(&mut svg, self, &frame);
        self.supports.iter().for_each(|support| draw_support(&mut svg, self, *support, &frame));
        draw_deflection(&mut svg, self, &frame);
        draw_load(&mut svg, self, &frame);
        draw_dimension(&mut svg, self, &frame, dimension_y);
        draw_remark(&mut svg, &frame, remark_y);
        svg.finish()
    }
}

struct Frame {
    width: f64,
    length_mm: f64,
    px_per_mm: f64,
    exaggeration: f64,
    /// Position of the largest deflection in mm, if any.
    deepest: Option<(f64, f64)>,
    shape: Vec<Point>,
}

impl Frame {
    fn new(drawing: &BeamDrawing) -> Self {
        let width = f64::from(drawing.width_px);
        let px_per_mm = (width - 2.0 * MARGIN) / drawing.length_mm;
        let points = drawing.deflection_mm.iter().copied();
        let deepest = points
            .clone()
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            .filter(|&(_, y)| (y * px_per_mm).abs() > 1e-9);
        let exaggeration = deepest.map_or(1.0, |(_, y)| round_below(DEFLECTION_ROOM / (y.abs() * px_per_mm)));
        let length_mm = drawing.length_mm;
        let mut frame = Frame { width, length_mm, px_per_mm, exaggeration, deepest, shape: Vec::new() };
        frame.shape = points.map(|(x, y)| frame.deflected(x, y)).collect();
        frame
    }

    fn x_px(&self, position_mm: f64) -> f64 {
        MARGIN + position_mm.clamp(0.0, self.length_mm) * self.px_per_mm
    }

    fn deflected(&self, position_mm: f64, deflection_mm: f64) -> Point {
        (self.x_px(position_mm), BEAM_Y - deflection_mm * self.px_per_mm * self.exaggeration)
    }

    fn surface_y(&self, across: f64) -> f64 {
        let around = self.shape.windows(2).find(|ends| (ends[0].0..=ends[1].0).contains(&across));
        around.map_or(BEAM_Y, |ends| {
            let share = (across - ends[0].0) / (ends[1].0 - ends[0].0);
            ends[0].1 + share * (ends[1].1 - ends[0].1)
        })
    }

    fn centred(&self, text: &str, (middle, y): Point, size: f64, colour: Colour) -> Label {
        let text = text::fit(text, size, self.width - 16.0);
        let half = text::width(&text, size) / 2.0;
        let middle = middle.min(self.width - 8.0 - half).max(8.0 + half);
        Label { text, at: (middle, y), anchor: Anchor::Middle, size, colour }
    }
}

fn round_below(most: f64) -> f64 {
    let decade = 10_f64.powf(most.log10().floor());
    ROUND.into_iter().rev().map(|factor| factor * decade).find(|&factor| factor <= most).unwrap_or(decade)
}

fn number_labels(drawing: &BeamDrawing, frame: &Frame) -> (Vec<Label>, usize) {
    let mut rows = text::Rows::default();
    let label = |(index, &position_mm): (usize, &f64)| {
        let number = (index + 1).to_string();
        let middle = frame.x_px(position_mm);
        let half = text::width(&number, NUMBER_SIZE) / 2.0 + 2.0;
        let row = rows.place(middle - half, middle + half);
        let y = NUMBER_TOP + (row as f64 + 0.5) * NUMBER_LINE;
        frame.centred(&number, (middle, y), NUMBER_SIZE, QUIET_INK)
    };
    let labels = drawing.sensors_mm.iter().enumerate().map(label).collect();
    (labels, rows.count())
}

fn draw_sensors(svg: &mut Svg, drawing: &BeamDrawing, frame: &Frame) {
    let colour = palette(2);
    for &position_mm in &drawing.sensors_mm {
        let across = frame.x_px(position_mm);
        svg.line(&[(across, frame.surface_y(across)), (across, PROBE_TOP)], 1.2, colour);
        let (left, right) = (across - PROBE_HALF_WIDTH, across + PROBE_HALF_WIDTH);
        svg.rectangle(Rect { left, right, top: PROBE_TOP, bottom: PROBE_TOP + PROBE_HEIGHT }, colour);
    }
}

fn half_thickness(drawing: &BeamDrawing, position_mm: f64) -> f64 {
    let thickest_mm = drawing.steps.iter().map(|step| step.1).fold(0.0, f64::max);
    let (largest, least) = STEPPED_HALF_THICKNESS;
    match drawing.steps.iter().find(|step| step.0 >= position_mm) {
        Some(step) if drawing.steps.len() > 1 => (largest * step.1 / thickest_mm).clamp(least, largest),
        _ => BEAM_HALF_THICKNESS,
    }
}

fn draw_beam(svg: &mut Svg, drawing: &BeamDrawing, frame: &Frame) {
    let mut left = MARGIN;
    let ends_mm = drawing.steps.iter().map(|step| step.0);
    for to_mm in ends_mm.chain(drawing.steps.is_empty().then_some(drawing.length_mm)) {
        let (right, half) = (frame.x_px(to_mm), half_thickness(drawing, to_mm));
        svg.rectangle(Rect { left, right, top: BEAM_Y - half, bottom: BEAM_Y + half }, GRID);
        left = right;
    }
}

fn draw_support(
    svg: &mut Svg,
    drawing: &BeamDrawing,
    (position_mm, kind): (f64, BeamSupportKind),
    frame: &Frame,
) {
    let across = frame.x_px(position_mm);
    match kind {
        BeamSupportKind::Simple => {
            let top = BEAM_Y + half_thickness(drawing, position_mm);
            let base = top + SUPPORT_HEIGHT;
            let feet = [(across + SUPPORT_HALF_WIDTH, base), (across - SUPPORT_HALF_WIDTH, base)];
            svg.polygon(&[(across, top), feet[0], feet[1]], QUIET_INK);
        }
        BeamSupportKind::Clamped => {
            // An end is clamped from its outer side, a place between the ends from both sides.
            let (left, right) = if position_mm <= 0.0 {
                (across - SUPPORT_HALF_WIDTH, across)
            } else if position_mm >= drawing.length_mm {
                (across, across + SUPPORT_HALF_WIDTH)
            } else {
                (across - 0.5 * SUPPORT_HALF_WIDTH, across + 0.5 * SUPPORT_HALF_WIDTH)
            };
            let (top, bottom) = (BEAM_Y - SUPPORT_HEIGHT, BEAM_Y + SUPPORT_HEIGHT);
            svg.rectangle(Rect { left, right, top, bottom }, QUIET_INK);
        }
        BeamSupportKind::Guided => {
            let at = frame.surface_y(across);
            let half = 0.4 * SUPPORT_HALF_WIDTH;
            let (top, bottom) = (at - 0.5 * SUPPORT_HEIGHT, at + 0.5 * SUPPORT_HEIGHT);
            svg.rectangle(Rect { left: across - half, right: across + half, top, bottom }, QUIET_INK);
            for guide in [across - 0.75 * SUPPORT_HALF_WIDTH, across + 0.75 * SUPPORT_HALF_WIDTH] {
                let ends = [(guide, top.min(BEAM_Y) - 8.0), (guide, bottom.max(BEAM_Y) + 8.0)];
                svg.line(&ends, 2.0, QUIET_INK);
            }
        }
        BeamSupportKind::Elastic { .. } => draw_spring(svg, (across, frame.surface_y(across))),
        BeamSupportKind::Free => {}
    }
}

fn draw_spring(svg: &mut Svg, (across, top): Point) {
    const TURNS: usize = 6;
    let foot = SPRING_GROUND_Y;
    let head = top + 0.2 * (foot - top);
    let turn = |i: usize| {
        let side = if i.is_multiple_of(2) { 0.6 } else { -0.6 };
        let share = (i as f64 + 0.5) / TURNS as f64;
        (across + side * SUPPORT_HALF_WIDTH, head + share * (foot - 4.0 - head))
    };
    let mut points = vec![(across, top), (across, head)];
    points.extend((0..TURNS).map(turn));
    points.extend([(across, foot - 4.0), (across, foot)]);
    svg.line(&points, 1.6, QUIET_INK);
    svg.line(&[(across - SUPPORT_HALF_WIDTH, foot), (across + SUPPORT_HALF_WIDTH, foot)], 2.0, QUIET_INK);
}

fn draw_deflection(svg: &mut Svg, drawing: &BeamDrawing, frame: &Frame) {
    let colour = palette(0);
    svg.line(&frame.shape, 2.5, colour);
    let Some((position_mm, deflection_mm)) = frame.deepest else { return };
    let (across, y) = frame.deflected(position_mm, deflection_mm);
    double_arrow(svg, (across, BEAM_Y), (across, y), colour);
    let text = format!("{} mm", rounded(deflection_mm.abs()));
    let right_half = position_mm > drawing.length_mm / 2.0;
    let at = (across + if right_half { -9.0 } else { 9.0 }, BEAM_Y.midpoint(y));
    let anchor = if right_half { Anchor::End } else { Anchor::Start };
    svg.text(&Label { text, at, anchor, size: FONT_SIZE, colour });
}

fn draw_load(svg: &mut Svg, drawing: &BeamDrawing, frame: &Frame) {
    let colour = palette(1);
    let across = frame.x_px(drawing.load_mm);
    let tip = (across, frame.surface_y(across).min(BEAM_Y) - BEAM_HALF_THICKNESS);
    svg.line(&[(across, ARROW_TAIL_Y.min(tip.1 - 10.0)), (across, tip.1 - 8.0)], 2.2, colour);
    arrow_head(svg, tip, (0.0, 1.0), 10.0, colour);
    svg.text(&frame.centred(&drawing.load_label, (across, LOAD_LABEL_Y), FONT_SIZE + 1.0, colour));
}

fn draw_dimension(svg: &mut Svg, drawing: &BeamDrawing, frame: &Frame, y: f64) {
    let middle = frame.width / 2.0;
    let text = format!("{} mm", plain(drawing.length_mm));
    let label = frame.centred(&text, (middle, y), FONT_SIZE, INK);
    let half_gap = text::width(&label.text, FONT_SIZE) / 2.0 + 6.0;
    for (end, outward) in [(MARGIN, -1.0), (frame.width - MARGIN, 1.0)] {
        svg.line(&[(end, y - 7.0), (end, y + 7.0)], 1.0, REFERENCE);
        svg.line(&[(middle + outward * half_gap, y), (end, y)], 1.0, REFERENCE);
        arrow_head(svg, (end, y), (outward, 0.0), 7.0, REFERENCE);
    }
    svg.text(&label);
}

fn draw_remark(svg: &mut Svg, frame: &Frame, y: f64) {
    let remark = match frame.deepest {
        Some(_) => format!("deflection drawn {} ×", rounded(frame.exaggeration)),
        None => "no deflection".to_owned(),
    };
    svg.text(&frame.centred(&remark, (frame.width / 2.0, y), FONT_SIZE - 1.0, QUIET_INK));
}

fn double_arrow(svg: &mut Svg, start: Point, end: Point, colour: Colour) {
    svg.line(&[start, end], 1.0, colour);
    let downward = (end.1 - start.1).signum();
    if (end.1 - start.1).abs() > 14.0 {
        arrow_head(svg, start, (0.0, -downward), 6.0, colour);
        arrow_head(svg, end, (0.0, downward), 6.0, colour);
    }
}

/// Triangle with its tip at `tip`, along the unit vector `along`.
fn arrow_head(svg: &mut Svg, tip: Point, along: Point, length: f64, colour: Colour) {
    let back = (tip.0 - along.0 * length, tip.1 - along.1 * length);
    let aside = (-along.1 * length * 0.4, along.0 * length * 0.4);
    svg.polygon(&[tip, (back.0 + aside.0, back.1 + aside.1), (back.0 - aside.0, back.1 - aside.1)], colour);
}

fn rounded(value: f64) -> String {
    let unit = 10_f64.powf(value.abs().log10().floor() - 2.0);
    plain((value / unit).round() * unit)
}
