//! The strip of names beneath the plot.

use super::chart::{Chart, Mark, Series};
use super::geometry::Rect;
use super::svg::{Anchor, INK, Label};
use super::text;

pub(crate) const ROW_HEIGHT: f64 = 20.0;
const FONT_SIZE: f64 = 12.0;
const SWATCH_WIDTH: f64 = 24.0;
/// From the left of a swatch to the left of its name.
const INDENT: f64 = 31.0;
const GAP: f64 = 18.0;

/// What an entry names.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Named<'a> {
    Series(&'a Series),
    /// A horizontal reference line.
    Reference,
}

/// One name and its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry<'a> {
    pub named: Named<'a>,
    /// Where the sample of its drawing goes.
    pub swatch: Rect,
    pub label: Label,
    /// All the room it takes.
    pub area: Rect,
}

/// The legend of a chart, with its own left and top at zero until it is moved.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Legend<'a> {
    pub entries: Vec<Entry<'a>>,
    /// Says how many names found no room.
    pub remainder: Option<Label>,
    pub width: f64,
    pub height: f64,
}

impl<'a> Legend<'a> {
    /// Entries from left to right in rows of `width`, in no more than `most_rows` rows.
    pub fn new(chart: &'a Chart, width: f64, most_rows: usize) -> Self {
        let names: Vec<(Named<'_>, String)> =
            names(chart).map(|(named, name)| (named, text::fit(name, FONT_SIZE, width - INDENT))).collect();
        let mut kept = names.len();
        let mut places = arrange(&names, kept, width);
        while kept > 0 && places.last().is_some_and(|place| place.row >= most_rows) {
            kept -= 1;
            places = arrange(&names, kept, width);
        }
        if places.last().is_some_and(|place| place.row >= most_rows) {
            places.clear();
        }
        let entries =
            names.iter().zip(&places).take(kept).map(|((named, name), place)| entry(*named, name, place));
        Legend {
            entries: entries.collect(),
            remainder: places
                .get(kept)
                .map(|place| label(remainder(names.len() - kept), place.left, place.row)),
            width: places.iter().map(|place| place.left + place.width).fold(0.0, f64::max),
            height: places.last().map_or(0.0, |place| (place.row + 1) as f64 * ROW_HEIGHT),
        }
    }

    /// The legend with its left upper corner elsewhere.
    pub fn moved(mut self, left: f64, top: f64) -> Self {
        for entry in &mut self.entries {
            entry.swatch = entry.swatch.moved(left, top);
            entry.area = entry.area.moved(left, top);
        }
        for label in self.entries.iter_mut().map(|entry| &mut entry.label).chain(&mut self.remainder) {
            label.at = (label.at.0 + left, label.at.1 + top);
        }
        self
    }
}

/// Where an entry goes.
struct Place {
    left: f64,
    row: usize,
    width: f64,
}

/// Places of the first `kept` names and, if that is not all of them, of the remark about the others.
fn arrange(names: &[(Named<'_>, String)], kept: usize, width: f64) -> Vec<Place> {
    let mut widths: Vec<f64> =
        names[..kept].iter().map(|(_, name)| INDENT + text::width(name, FONT_SIZE)).collect();
    if kept < names.len() {
        widths.push(text::width(&remainder(names.len() - kept), FONT_SIZE));
    }
    let (mut left, mut row) = (0.0, 0);
    let mut places = Vec::new();
    for entry_width in widths {
        if left > 0.0 && left + entry_width > width {
            (left, row) = (0.0, row + 1);
        }
        places.push(Place { left, row, width: entry_width });
        left += entry_width + GAP;
    }
    places
}

fn names(chart: &Chart) -> impl Iterator<Item = (Named<'_>, &str)> {
    let series = chart.series.iter().map(|series| (Named::Series(series), series.label.as_str()));
    let references = chart.marks.iter().filter_map(|mark| match mark {
        Mark::HorizontalLine { label, .. } => Some((Named::Reference, label.as_str())),
        Mark::VerticalLine { .. } | Mark::Span { .. } => None,
    });
    series.chain(references).filter(|(_, name)| !name.trim().is_empty())
}

fn remainder(count: usize) -> String {
    format!("and {count} more")
}

fn label(text: String, left: f64, row: usize) -> Label {
    let middle = (row as f64 + 0.5) * ROW_HEIGHT;
    Label { text, at: (left, middle), anchor: Anchor::Start, size: FONT_SIZE, colour: INK }
}

fn entry<'a>(named: Named<'a>, name: &str, place: &Place) -> Entry<'a> {
    let top = place.row as f64 * ROW_HEIGHT;
    let left = place.left;
    Entry {
        named,
        swatch: Rect { left, top: top + 4.0, right: left + SWATCH_WIDTH, bottom: top + ROW_HEIGHT - 4.0 },
        label: label(name.to_owned(), left + INDENT, place.row),
        area: Rect { left, top, right: left + place.width, bottom: top + ROW_HEIGHT },
    }
}
