//! Where things stand in the drawing of a bench.

use super::BenchDrawing;
use crate::canvas::{Anchor, Label, QUIET_INK};
use crate::geometry::Point;
use crate::text;
use plotters::style::RGBColor;

pub(super) const MARGIN: f64 = 40.0;
/// Middle of the undeflected beam.
pub(super) const BEAM_Y: f64 = 92.0;
/// Room beneath the beam for the deflected shape, at its deepest.
pub(super) const DEFLECTION_ROOM: f64 = 56.0;
pub(super) const NUMBER_TOP: f64 = 186.0;
pub(super) const NUMBER_LINE: f64 = 16.0;
const NUMBER_SIZE: f64 = 11.0;
/// Exaggerations are one of these times a power of ten.
const ROUND: [f64; 10] = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];

/// From millimetres to pixels.
pub(super) struct Frame {
    pub width: f64,
    pub px_per_mm: f64,
    pub exaggeration: f64,
    /// The point of the largest deflection in millimetres; none for a beam that is not deflected.
    pub deepest: Option<(f64, f64)>,
    /// The stretches of the deflected shape in pixels.
    pub shape: Vec<Vec<Point>>,
}

impl Frame {
    pub fn new(bench: &BenchDrawing, width: f64) -> Self {
        let px_per_mm = (width - 2.0 * MARGIN) / bench.length_mm;
        let finite = |&(x, y): &(f64, f64)| (0.0..=bench.length_mm).contains(&x) && y.is_finite();
        let deepest = bench
            .deflection_mm
            .iter()
            .copied()
            .filter(finite)
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            .filter(|&(_, y)| (y * px_per_mm).abs() > 1e-9);
        let exaggeration = deepest.map_or(1.0, |(_, y)| round_below(DEFLECTION_ROOM / (y.abs() * px_per_mm)));
        let mut frame = Frame { width, px_per_mm, exaggeration, deepest, shape: Vec::new() };
        let stretches = bench.deflection_mm.split(|point| !finite(point)).filter(|stretch| stretch.len() > 1);
        frame.shape =
            stretches.map(|points| points.iter().map(|&(x, y)| frame.deflected(x, y)).collect()).collect();
        frame
    }

    pub fn across(&self, position_mm: f64) -> f64 {
        MARGIN + position_mm * self.px_per_mm
    }

    pub fn deflected(&self, position_mm: f64, deflection_mm: f64) -> Point {
        (self.across(position_mm), BEAM_Y - deflection_mm * self.px_per_mm * self.exaggeration)
    }

    /// Height of the deflected shape there, or of the straight beam where no shape is given.
    pub fn surface_y(&self, across: f64) -> f64 {
        let ends = self.shape.iter().flat_map(|stretch| stretch.windows(2)).find(|ends| {
            let (left, right) = (ends[0].0.min(ends[1].0), ends[0].0.max(ends[1].0));
            left < right && (left..=right).contains(&across)
        });
        ends.map_or(BEAM_Y, |ends| {
            let share = (across - ends[0].0) / (ends[1].0 - ends[0].0);
            ends[0].1 + share * (ends[1].1 - ends[0].1)
        })
    }

    /// A text in one line around `middle`, moved and cut so that it stays inside the image.
    pub fn centred(&self, text: &str, (middle, y): Point, size: f64, colour: RGBColor) -> Label {
        let text = text::fit(text, size, self.width - 16.0);
        let half = text::width(&text, size) / 2.0;
        let middle = middle.min(self.width - 8.0 - half).max(8.0 + half);
        Label { text, at: (middle, y), anchor: Anchor::Middle, size, colour }
    }
}

/// The largest round factor that is not above `most`.
fn round_below(most: f64) -> f64 {
    let decade = 10_f64.powf(most.log10().floor());
    ROUND.into_iter().rev().map(|factor| factor * decade).find(|&factor| factor <= most).unwrap_or(decade)
}

/// The sensors' numbers, in as many rows as keep them apart.
pub(super) struct NumberRows {
    pub labels: Vec<Label>,
    pub count: usize,
}

impl NumberRows {
    pub fn new(bench: &BenchDrawing, frame: &Frame) -> Self {
        let mut taken: Vec<Vec<(f64, f64)>> = Vec::new();
        let mut labels = Vec::new();
        for (index, &position_mm) in bench.sensors_mm.iter().enumerate() {
            let number = (index + 1).to_string();
            let middle = frame.across(position_mm);
            let half = text::width(&number, NUMBER_SIZE) / 2.0 + 2.0;
            let (left, right) = (middle - half, middle + half);
            let free = |row: &Vec<(f64, f64)>| row.iter().all(|&(start, end)| right <= start || end <= left);
            let row = taken.iter().position(free).unwrap_or(taken.len());
            if row == taken.len() {
                taken.push(Vec::new());
            }
            taken[row].push((left, right));
            let y = NUMBER_TOP + (row as f64 + 0.5) * NUMBER_LINE;
            labels.push(frame.centred(&number, (middle, y), NUMBER_SIZE, QUIET_INK));
        }
        NumberRows { labels, count: taken.len() }
    }
}
