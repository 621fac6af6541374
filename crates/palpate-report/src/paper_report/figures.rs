//! Figures 2 to 6 of the paper over the study's seeds, and two further ones.

use maud::html;

use super::Paper;
use crate::error_lines::{banded, limit_in_words};
use crate::page::Figure;
use crate::study_report::{ArmLine, error_chart, quantiles_by_position};
use crate::{Axis, Chart, ErrorPoint, Marker, Series, SeriesKind};
use palpate_estimators::evaluation::Quantiles;
use palpate_studies::ArmResults;
use palpate_studies::paper::COUNTS;

/// Training rule, at each number of positions.
#[derive(Clone, Copy)]
struct Family {
    name: &'static str,
    label: &'static str,
    colour: usize,
    marker: Marker,
}

const POSITION: Family =
    Family { name: "position", label: "position output", colour: 1, marker: Marker::Square };
const NORMALIZED: Family =
    Family { name: "normalized", label: "normalized output", colour: 0, marker: Marker::Circle };
const EVEN: Family = Family { label: "equally spaced", ..NORMALIZED };
const MIDDLE_6: Family =
    Family { name: "middle6", label: "6 in the middle", colour: 2, marker: Marker::Square };
const MIDDLE_4: Family =
    Family { name: "middle4", label: "4 in the middle", colour: 3, marker: Marker::Triangle };

struct Measure {
    title: &'static str,
    axis: Axis,
    of: fn(&ArmResults) -> Option<Quantiles>,
    key: &'static str,
}

const PITCH: f64 = 1.3;
const BESIDE: f64 = 0.5;

impl Paper<'_> {
    pub(super) fn predicted_against_actual(&self) -> Option<Figure> {
        let outcome = self.report.outcome("position-10")?;
        let length_mm = self.report.length_m() * 1e3;
        let predicted = quantiles_by_position(outcome, |located| located.estimate.x_m * 1e3);
        let ends = vec![(0.0, 0.0), (length_mm, length_mm)];
        let mut series = vec![Series::dashes("predicted = actual", 6, ends)];
        series.extend(banded("predicted, median of the seeds", 1, &predicted, outcome.fits.len() > 1));
        series.extend(self.training_points());
        let x = Axis::linear("actual load position, mm").from_to(0.0, length_mm);
        let y = Axis::linear("predicted load position, mm");
        let chart = Chart::new("Predicted against actual load position", x, y, series).with_height(560);
        let caption = html! {
            "Position output, ten equally spaced training positions: where the networks see the load, against where it is. "
            (self.seeds_in_words("Lines", "bands")) " Where the line leaves the dashes, the estimate is off."
        };
        Some(Figure::chart(&chart, caption))
    }

    fn training_points(&self) -> Option<Series> {
        let rig = &self.report.arm("position-10")?.rig;
        let positions = rig.training.as_ref()?.positions(rig.setup.surface().extent()).ok()?;
        let points = positions.iter().map(|position| (position.x_m * 1e3, position.x_m * 1e3)).collect();
        Some(Series::markers("training positions", 6, points, Marker::Circle))
    }

    pub(super) fn iterations_by_coding(&self) -> Option<Figure> {
        let measure = Measure {
            title: "Iterations until training stops",
            axis: Axis::log10("iterations (epochs)"),
            of: |arm| arm.epochs,
            key: "epochs",
        };
        let caption = html! {
            "Iterations against the number of training positions, for the two codings of the output. "
            (self.seeds_in_words("Markers", "bars")) " The paper prints one number of iterations; the cross shows it."
        };
        Some(Figure::chart(&self.against_count(&measure, &[POSITION, NORMALIZED])?, caption))
    }

    pub(super) fn error_by_coding(&self) -> Option<Figure> {
        let caption = html! {
            "Average error over the whole beam against the number of training positions, for the two codings of the output. "
            (self.seeds_in_words("Markers", "bars")) (CROSSES)
        };
        Some(Figure::chart(&self.against_count(&average_error(), &[POSITION, NORMALIZED])?, caption))
    }

    pub(super) fn error_by_arrangement(&self) -> Option<Figure> {
        let caption = html! {
            "Average error over the whole beam against the number of training positions, for the three arrangements, all with \
             the normalized output. " (self.seeds_in_words("Markers", "bars")) (CROSSES)
        };
        Some(Figure::chart(&self.against_count(&average_error(), &[EVEN, MIDDLE_6, MIDDLE_4])?, caption))
    }

    pub(super) fn effective_length_by_arrangement(&self) -> Option<Figure> {
        let measure = Measure {
            title: "Effective length",
            axis: Axis::linear("effective length, % of the beam"),
            of: |arm| Some(arm.effective_length_percent),
            key: "effective_length_percent",
        };
        let caption = html! {
            "Share of the beam that is located within the tolerance, for the three arrangements, all with the normalized \
             output. " (self.seeds_in_words("Markers", "bars")) (CROSSES)
        };
        Some(Figure::chart(&self.against_count(&measure, &[EVEN, MIDDLE_6, MIDDLE_4])?, caption))
    }

    pub(super) fn errors_of_codings(&self) -> Option<Figure> {
        let chart =
            self.errors_of("Location error of the two codings, 10 positions", &[POSITION, NORMALIZED])?;
        let caption = html! {
            "Location error by load position with ten equally spaced training positions, for the two codings of the output. "
            (self.seeds_in_words("Lines", "bands")) (limit_in_words(&chart))
        };
        Some(Figure::chart(&chart, caption))
    }

    pub(super) fn errors_of_arrangements(&self) -> Option<Figure> {
        let families = [EVEN, MIDDLE_6, MIDDLE_4];
        let chart = self.errors_of("Location error of the three arrangements, 10 positions", &families)?;
        let caption = html! {
            "Location error by load position with ten training positions in the three arrangements, all with the normalized \
             output. " (self.seeds_in_words("Lines", "bands")) (limit_in_words(&chart))
        };
        Some(Figure::chart(&chart, caption))
    }

    fn errors_of(&self, title: &str, families: &[Family]) -> Option<Chart> {
        let arms: Vec<String> = families.iter().map(|family| format!("{}-10", family.name)).collect();
        let lines: Vec<ArmLine> = arms
            .iter()
            .zip(families)
            .map(|(arm, family)| ArmLine { arm, label: family.label, colour: family.colour })
            .collect();
        error_chart(self.report, title, &lines)
    }

    /// Medians with bars, and the paper's points; `None` without an arm.
    fn against_count(&self, measure: &Measure, families: &[Family]) -> Option<Chart> {
        let middle = (families.len() - 1) as f64 / 2.0;
        let families: Vec<(Family, f64)> =
            families.iter().enumerate().map(|(i, family)| (*family, (i as f64 - middle) * PITCH)).collect();
        let ours = families.iter().flat_map(|(family, shift)| self.measured_series(measure, *family, *shift));
        let theirs = families.iter().filter_map(|(family, shift)| self.printed(measure, *family, *shift));
        let mut series: Vec<Series> = ours.chain(theirs).collect();
        let crosses = |series: &&mut Series| matches!(series.kind, SeriesKind::Points { .. });
        if let Some(first) = series.iter_mut().find(crosses) {
            first.label = "published, in the colour of its kind".to_owned();
        }
        let counts = COUNTS.map(f64::from);
        let x = Axis::linear("number of training positions").from_to(6.0, 34.0).ticks_at(counts);
        (!series.is_empty()).then(|| Chart::new(measure.title, x, measure.axis.clone(), series))
    }

    fn measured_series(&self, measure: &Measure, family: Family, shift: f64) -> Vec<Series> {
        let points: Vec<ErrorPoint> = COUNTS
            .iter()
            .filter_map(|&count| {
                let arm = self.report.results.arm(&format!("{}-{count}", family.name))?;
                let Quantiles { median, p05, p95 } = (measure.of)(arm)?;
                Some(ErrorPoint { x: f64::from(count) + shift, y: median, low: p05, high: p95 })
            })
            .collect();
        if points.is_empty() {
            return Vec::new();
        }
        let line = points.iter().map(|point| (point.x, point.y)).collect();
        vec![
            Series::dashes("", family.colour, line),
            Series::error_bars(family.label, family.colour, points, family.marker),
        ]
    }

    fn printed(&self, measure: &Measure, family: Family, shift: f64) -> Option<Series> {
        let points: Vec<(f64, f64)> = COUNTS
            .iter()
            .filter_map(|&count| {
                let figure = self.published(&format!("{}-{count}", family.name), measure.key)?;
                Some((f64::from(count) + shift + BESIDE, figure.published))
            })
            .collect();
        (!points.is_empty()).then(|| Series::markers("", family.colour, points, Marker::Cross))
    }

    fn seeds_in_words(&self, medians: &str, ranges: &str) -> String {
        match self.report.run.seeds {
            1 => "One seed.".to_owned(),
            _ => {
                format!("{medians}: median over {}; {ranges}: 5–95 % of them.", self.report.seeds_in_words())
            }
        }
    }
}

const CROSSES: &str = " Crosses: what the paper prints.";

fn average_error() -> Measure {
    Measure {
        title: "Average error over the whole beam",
        axis: Axis::linear("average error, % of the length"),
        of: |arm| Some(arm.error_percent),
        key: "error_percent",
    }
}
