//! What holds the beam of a drawing: wedges, clamps, guides and springs.

use super::frame::{BEAM_Y, DEFLECTION_ROOM, Frame};
use super::{BenchDrawing, BenchSupport, BenchSupportKind, half_thickness};
use crate::canvas::{Canvas, QUIET_INK};
use crate::geometry::{Point, Rect};
use plotters::style::Color;

const SUPPORT_HEIGHT: f64 = 22.0;
const SUPPORT_HALF_WIDTH: f64 = 12.0;
/// What springs stand on: beneath the beam at its deepest.
const SPRING_GROUND_Y: f64 = BEAM_Y + DEFLECTION_ROOM + 10.0;

/// One support, where the beam rests on it.
pub(super) fn draw_support(canvas: &Canvas<'_>, bench: &BenchDrawing, support: &BenchSupport, frame: &Frame) {
    let across = frame.across(support.position_mm);
    let over = bench.steps.iter().find(|step| step.to_mm >= support.position_mm);
    let top = BEAM_Y + half_thickness(bench, over);
    let block = |left: f64, right: f64, half_height: f64| {
        let (top, bottom) = (BEAM_Y - half_height, BEAM_Y + half_height);
        canvas.rectangle(Rect { left, right, top, bottom }, QUIET_INK.to_rgba());
    };
    match support.kind {
        BenchSupportKind::Simple => {
            let base = top + SUPPORT_HEIGHT;
            let wedge =
                [(across, top), (across + SUPPORT_HALF_WIDTH, base), (across - SUPPORT_HALF_WIDTH, base)];
            canvas.polygon(&wedge, QUIET_INK.to_rgba());
        }
        BenchSupportKind::Clamped => {
            // An end is held from beyond it, the beam between its ends from both sides.
            let (left, right) = if support.position_mm <= 0.0 {
                (across - SUPPORT_HALF_WIDTH, across)
            } else if support.position_mm >= bench.length_mm {
                (across, across + SUPPORT_HALF_WIDTH)
            } else {
                (across - 0.5 * SUPPORT_HALF_WIDTH, across + 0.5 * SUPPORT_HALF_WIDTH)
            };
            block(left, right, SUPPORT_HEIGHT);
        }
        BenchSupportKind::Guided => {
            let at = frame.surface_y(across);
            let half = 0.4 * SUPPORT_HALF_WIDTH;
            let (top, bottom) = (at - 0.5 * SUPPORT_HEIGHT, at + 0.5 * SUPPORT_HEIGHT);
            canvas.rectangle(
                Rect { left: across - half, right: across + half, top, bottom },
                QUIET_INK.to_rgba(),
            );
            for guide in [across - 0.75 * SUPPORT_HALF_WIDTH, across + 0.75 * SUPPORT_HALF_WIDTH] {
                let ends = [(guide, top.min(BEAM_Y) - 8.0), (guide, bottom.max(BEAM_Y) + 8.0)];
                canvas.line(&ends, 2.0, QUIET_INK);
            }
        }
        BenchSupportKind::Elastic => draw_spring(canvas, (across, frame.surface_y(across))),
    }
}

/// A zigzag that stands on the ground and carries the point.
fn draw_spring(canvas: &Canvas<'_>, (across, top): Point) {
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
    canvas.line(&points, 1.6, QUIET_INK);
    canvas.line(&[(across - SUPPORT_HALF_WIDTH, foot), (across + SUPPORT_HALF_WIDTH, foot)], 2.0, QUIET_INK);
}
