//! The paper's tables 1 to 3, computed from the arrangements and the fits.

use maud::{Markup, html};

use super::{Paper, ours};
use crate::numbers::{NOTHING, listed, mm, number, spread, stretch};
use crate::page::{Table, numeric, short, text, wide};
use palpate_estimators::arrangement::{Arrangement, Training};
use palpate_estimators::evaluation::{Portion, Quantiles};
use palpate_mechanics::contact::Position;
use palpate_studies::PortionResults;

/// Arms with the same training positions.
struct Set<'a> {
    arms: Vec<&'a str>,
    training: &'a Training,
    positions: Vec<Position>,
}

impl Paper<'_> {
    /// The sets of training positions that `keep` wants, each once.
    fn sets(&self, keep: impl Fn(&Arrangement) -> bool) -> Vec<Set<'_>> {
        let mut sets: Vec<Set> = Vec::new();
        for arm in &self.report.study.study.arms {
            let Some(training) = arm.rig.training.as_ref().filter(|training| keep(&training.arrangement))
            else {
                continue;
            };
            let known = sets.iter_mut().find(|set| set.training == training);
            if let Some(set) = known {
                set.arms.push(&arm.name);
            } else if let Ok(positions) = training.positions(arm.rig.setup.surface.extent()) {
                sets.push(Set { arms: vec![&arm.name], training, positions });
            }
        }
        sets.sort_by_key(|set| set.positions.len());
        sets
    }

    pub(super) fn even_table(&self) -> Table {
        let sets = self.sets(|arrangement| *arrangement == Arrangement::Even);
        let rows = sets.iter().enumerate().map(|(i, set)| {
            vec![
                text((i + 1).to_string()),
                text(set.positions.len().to_string()),
                text(end(set.positions.first())),
                text(even_pitch(&set.positions)),
                text(end(set.positions.last())),
                text(listed(&set.arms)),
            ]
        });
        let columns = [
            short("set"),
            numeric("positions"),
            numeric("first, mm"),
            numeric("pitch, mm"),
            numeric("last, mm"),
            short("arms"),
        ];
        let caption = html! { "Equally spaced sets of training positions, computed from their rule." };
        Table::new(columns, rows, caption)
    }

    pub(super) fn edge_dense_table(&self) -> Table {
        let length_m = self.report.length_m();
        let sets = self.sets(|arrangement| matches!(arrangement, Arrangement::EdgeDense { .. }));
        let columns = [
            short("set"),
            numeric("positions"),
            numeric("in the middle"),
            numeric("in each edge"),
            numeric("start, mm"),
            numeric("pitch in the edges, mm"),
            numeric("pitch in the middle, mm"),
            wide("positions, mm"),
            short("arm"),
        ];
        let caption = html! {
            "Sets with few training positions in the middle portion and the others near the supports, computed from their \
             rule. The middle portion" (middle_in_words(&sets, length_m)) " begins and ends with a training position; dots \
             part it from the edges."
        };
        Table::new(columns, sets.iter().filter_map(|set| edge_dense_row(set, length_m)), caption)
    }

    pub(super) fn portions_table(&self) -> Table {
        let mut rows = Vec::new();
        if let Some(arm) = self.report.results.arm("position-10") {
            let all = self.report.judged_portion();
            rows.extend(all.map(|all| self.portion_row("average", all, "error_percent", arm.error_percent)));
            rows.extend(arm.portions.iter().map(|PortionResults { portion, error_percent, .. }| {
                let key = format!("error_percent_{}", portion.key());
                self.portion_row("average", *portion, &key, *error_percent)
            }));
            rows.extend(arm.portions.iter().map(|PortionResults { portion, max_error_percent, .. }| {
                let key = format!("max_error_percent_{}", portion.key());
                self.portion_row("largest", *portion, &key, *max_error_percent)
            }));
        }
        let columns = [
            short("portion"),
            short("error"),
            numeric("published, %"),
            numeric("found, %"),
            numeric("found, mm"),
        ];
        let caption = html! {
            "Percentage errors of the plain position output with ten training positions, by portion of the beam: what the \
             paper prints, and the median found here (5–95 % of the seeds)."
        };
        Table::new(columns, rows, caption)
    }

    fn portion_row(&self, kind: &str, portion: Portion, key: &str, found: Quantiles) -> Vec<Markup> {
        let published = self.published("position-10", key);
        vec![
            text(stretch(portion)),
            text(kind),
            text(published.map_or(NOTHING.to_owned(), super::verdicts::printed)),
            text(spread(published.map_or(found, ours), number)),
            text(spread(found.scaled(self.report.length_m() * 1e3 / 100.0), number)),
        ]
    }
}

fn end(position: Option<&Position>) -> String {
    position.map_or(NOTHING.to_owned(), |position| mm(position.x_m))
}

fn even_pitch(positions: &[Position]) -> String {
    match positions {
        [first, second, ..] => mm(second.x_m - first.x_m),
        _ => NOTHING.to_owned(),
    }
}

/// The paper's E1.1 to E3.2: tens of positions, then 1 for six in the middle and 2 for four.
fn paper_name(count: usize, middle: usize) -> String {
    match (count, middle) {
        (10 | 20 | 30, 6) => format!("E{}.1", count / 10),
        (10 | 20 | 30, 4) => format!("E{}.2", count / 10),
        _ => NOTHING.to_owned(),
    }
}

fn edge_dense_row(set: &Set, length_m: f64) -> Option<Vec<Markup>> {
    let Arrangement::EdgeDense { middle, portion } = &set.training.arrangement else { return None };
    let count = set.positions.len();
    let edge = (count - middle) / 2;
    let parts =
        [&set.positions[..edge], &set.positions[edge..edge + middle], &set.positions[edge + middle..]];
    let edge_pitch = portion.0 * length_m / (edge + 1) as f64;
    let compact: Vec<String> =
        parts.iter().filter(|part| !part.is_empty()).map(|part| run_of(part)).collect();
    Some(vec![
        text(paper_name(count, *middle)),
        text(count.to_string()),
        text(middle.to_string()),
        text(edge.to_string()),
        text(end(set.positions.first())),
        text(mm(edge_pitch)),
        text(even_pitch(parts[1])),
        text(compact.join(" · ")),
        text(listed(&set.arms)),
    ])
}

/// " (100–300 mm)" where every set has the same middle portion.
fn middle_in_words(sets: &[Set], length_m: f64) -> String {
    let mut portions: Vec<String> = sets
        .iter()
        .filter_map(|set| {
            let Arrangement::EdgeDense { portion, .. } = &set.training.arrangement else { return None };
            let (from_m, to_m) = (portion.0 * length_m, portion.1 * length_m);
            Some(stretch(Portion { from_m, to_m }))
        })
        .collect();
    portions.dedup();
    if let [only] = portions.as_slice() { format!(" ({only})") } else { String::new() }
}

/// Equally spaced positions in short: "33.33, 66.67", "7.14, 14.29 … 92.86".
fn run_of(positions: &[Position]) -> String {
    let shown = |position: &Position| mm(position.x_m);
    match positions {
        [first, second, .., last] if positions.len() > 6 => {
            format!("{}, {} … {}", shown(first), shown(second), shown(last))
        }
        _ => positions.iter().map(shown).collect::<Vec<_>>().join(", "),
    }
}
