//! Published against replicated, the claims, and what does not replicate.

use maud::{Markup, html};

use super::{Paper, ours};
use crate::numbers::{as_written, number, spread, whole};
use crate::page::{Table, numeric, short, text, verdict, wide};
use palpate_studies::paper::{Claim, ClaimPart, PublishedFigure, Yardstick};

/// A share of seeds below this is worth a remark where the medians hold.
const MOST_SEEDS: f64 = 0.5;

impl Paper<'_> {
    pub(super) fn about_published(&self) -> Markup {
        if self.published.is_empty() {
            return html! { p { "No arm with a published figure was run." } };
        }
        html! {
            p {
                "Each published figure comes from one network that the author trained; another random start would have given \
                 another figure. How far ours may be off to count as agreeing was fixed beforehand."
            }
        }
    }

    pub(super) fn published_table(&self) -> Table {
        let rows = self.published.iter().map(|figure| {
            vec![
                text(figure.arm),
                text(figure.what),
                text(printed(figure)),
                text(spread(ours(figure), shown(figure))),
                text(yardstick(figure)),
                verdict(figure.agrees, "agrees", "differs"),
            ]
        });
        let columns = [
            short("arm"),
            short("figure"),
            numeric("published"),
            numeric("found"),
            short("agrees if within"),
            short("verdict"),
        ];
        let caption = html! {
            "Every figure that the paper prints and that belongs to an arm here, beside the median found here (5–95 % of \
             the seeds)."
        };
        Table::new(columns, rows, caption)
    }

    pub(super) fn about_claims(&self) -> Markup {
        html! {
            @if self.claims.is_empty() { p { "The arms that the paper's claims are about were not all run." } }
        }
    }

    pub(super) fn claims_table(&self) -> Table {
        let rows = self.claims.iter().map(|claim| {
            vec![
                text(claim.id),
                html! {
                    (claim.claim)
                    ul { @for part in &claim.parts { li { (part_in_words(part)) } } }
                },
                verdict(claim.holds, "holds", "does not hold"),
                text(share(claim.share_of_seeds)),
            ]
        });
        let columns =
            [short("claim"), wide("in words, and its parts"), short("verdict"), numeric("share of seeds")];
        let caption = html! {
            "The paper's claims in our words, each parted into what a program can check. A claim holds when every part of \
             it holds in the medians. ✓ and ✗ say whether a part does; beside them is the share of the seeds for which it \
             holds, each seed of one arm beside the same seed of another, and in the last column the share of those for \
             which every part holds."
        };
        Table::new(columns, rows, caption)
    }

    pub(super) fn not_replicated(&self) -> Markup {
        let figures: Vec<&PublishedFigure> = self.published.iter().filter(|figure| !figure.agrees).collect();
        let failed: Vec<&Claim> = self.claims.iter().filter(|claim| !claim.holds).collect();
        let unsteady: Vec<&Claim> =
            self.claims.iter().filter(|claim| claim.holds && claim.share_of_seeds < MOST_SEEDS).collect();
        html! {
            @if self.published.is_empty() && self.claims.is_empty() {
                p { "Nothing was compared." }
            } @else if figures.is_empty() && failed.is_empty() {
                p { "Every published figure that was compared agrees, and every claim that was judged holds in the medians." }
            }
            @if !figures.is_empty() {
                h3 { "Figures" }
                ul { @for figure in &figures { li { (difference(figure)) } } }
            }
            @if !failed.is_empty() {
                h3 { "Claims" }
                ul { @for claim in &failed { li { (failure(claim)) } } }
            }
            @if !unsteady.is_empty() {
                h3 { "Claims that a single run may well miss" }
                p { "They hold in the medians, but for fewer than half of the seeds by themselves:" }
                ul {
                    @for claim in &unsteady {
                        li { b { (claim.id) } " (" (claim.claim) "): every part holds for " (share(claim.share_of_seeds)) " of the seeds." }
                    }
                }
            }
        }
    }
}

/// What the paper prints; a bound with its sign.
pub(super) fn printed(figure: &PublishedFigure) -> String {
    let sign = if figure.yardstick == Yardstick::Below { "< " } else { "" };
    format!("{sign}{}", as_written(figure.published))
}

fn shown(figure: &PublishedFigure) -> fn(f64) -> String {
    if matches!(figure.yardstick, Yardstick::Factor(_)) { whole } else { number }
}

fn yardstick(figure: &PublishedFigure) -> String {
    match figure.yardstick {
        Yardstick::Within(difference) => format!("±{difference} points"),
        Yardstick::Factor(factor) => format!("a factor of {factor}"),
        Yardstick::Below => format!("below {}", as_written(figure.published)),
    }
}

fn difference(figure: &PublishedFigure) -> Markup {
    let inside = (figure.p05..=figure.p95).contains(&figure.published);
    html! {
        b { (figure.arm) } ", " (figure.what) ": the paper prints " (printed(figure)) ", the median found here is "
        (shown(figure)(figure.median)) ", not " @if figure.yardstick != Yardstick::Below { "within " } (yardstick(figure)) ". "
        @if figure.yardstick == Yardstick::Below {
            @if figure.p05 < figure.published { "Some seeds do stay below it." }
            @else { "Hardly any seed stays below it." }
        } @else if inside {
            "The published figure is within the range of the seeds."
        } @else {
            "The published figure is outside the range of the seeds."
        }
    }
}

fn failure(claim: &Claim) -> Markup {
    let failed: Vec<&ClaimPart> = claim.parts.iter().filter(|part| !part.holds).collect();
    html! {
        b { (claim.id) } " says: " (claim.claim) ". "
        @if failed.len() == claim.parts.len() { "None of its parts holds in the medians:" }
        @else { "In the medians, " (failed.len()) " of its " (claim.parts.len()) " parts " (fails(failed.len())) ":" }
        ul { @for part in &failed { li { (part.what) " (holds for " (share(part.share_of_seeds)) " of the seeds)" } } }
    }
}

fn fails(count: usize) -> &'static str {
    if count == 1 { "does not hold" } else { "do not hold" }
}

fn part_in_words(part: &ClaimPart) -> Markup {
    html! {
        span.share.yes[part.holds].no[!part.holds] {
            @if part.holds { "✓ " } @else { "✗ " } (share(part.share_of_seeds))
        }
        (part.what)
    }
}

fn share(share: f64) -> String {
    format!("{:.0} %", share * 100.0)
}
