//! Tables 1 to 3, replicated figures, claims, and unstated settings.

use maud::{Markup, html};

use super::Paper;
use crate::numbers::{NOTHING, as_written, listed, mm, number, quantile_range, rig_number, stretch, whole};
use crate::page::{Table, verdict};
use palpate_estimators::arrangement::{Arrangement, Training};
use palpate_estimators::estimator::Setting;
use palpate_estimators::evaluation::{Portion, Quantiles};
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::Surface;
use palpate_rig::Rig;
use palpate_studies::PortionResults;
use palpate_studies::paper::{AgreementCriterion, Claim, ClaimPart, PublishedFigure};

struct Set<'a> {
    arms: Vec<&'a str>,
    training: &'a Training,
    positions: Vec<Position>,
}

impl Paper<'_> {
    /// Distinct sets.
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
            } else if let Ok(positions) = training.positions(arm.rig.setup.surface().extent()) {
                sets.push(Set { arms: vec![&arm.name], training, positions });
            }
        }
        sets.sort_by_key(|set| set.positions.len());
        sets
    }

    pub(super) fn even_table(&self) -> Table {
        let sets = self.sets(|arrangement| *arrangement == Arrangement::Even);
        Table::from_rows(sets.iter().zip(1..))
            .short("set", |(_, number)| number.to_string())
            .numeric("positions", |(set, _)| set.positions.len().to_string())
            .numeric("first, mm", |(set, _)| end(set.positions.first()))
            .numeric("pitch, mm", |(set, _)| even_pitch(&set.positions))
            .numeric("last, mm", |(set, _)| end(set.positions.last()))
            .short("arms", |(set, _)| listed(&set.arms))
            .caption(html! { "Equally spaced sets of training positions, computed from their rule." })
    }

    pub(super) fn edge_dense_table(&self) -> Table {
        let length_m = self.report.length_m();
        let sets = self.sets(|arrangement| matches!(arrangement, Arrangement::EdgeDense { .. }));
        let caption = html! {
            "Sets with few training positions in the middle portion and the others near the supports, computed from their \
             rule. The middle portion" (middle_in_words(&sets, length_m)) " begins and ends with a training position; dots \
             part it from the edges."
        };
        Table::from_rows(sets.iter().filter_map(EdgeDense::from_set))
            .short("set", |row| paper_name(row.set.positions.len(), row.middle))
            .numeric("positions", |row| row.set.positions.len().to_string())
            .numeric("in the middle", |row| row.middle.to_string())
            .numeric("in each edge", |row| row.edge.to_string())
            .numeric("start, mm", |row| end(row.set.positions.first()))
            .numeric("pitch in the edges, mm", |row| mm(row.portion.0 * length_m / (row.edge + 1) as f64))
            .numeric("pitch in the middle, mm", |row| even_pitch(row.parts()[1]))
            .wide("positions, mm", |row| {
                let parts = row.parts().into_iter().filter(|part| !part.is_empty());
                parts.map(run_of).collect::<Vec<_>>().join(" · ")
            })
            .short("arm", |row| listed(&row.set.arms))
            .caption(caption)
    }

    pub(super) fn portions_table(&self) -> Table {
        let mut rows: Vec<(&str, Portion, String, Quantiles)> = Vec::new();
        if let Some(arm) = self.report.results.arm("position-10") {
            let all = self.report.evaluated_portion();
            rows.extend(all.map(|all| ("average", all, "error_percent".to_owned(), arm.error_percent)));
            rows.extend(arm.portions.iter().map(|PortionResults { portion, error_percent, .. }| {
                ("average", *portion, format!("error_percent_{}", portion.key()), *error_percent)
            }));
            rows.extend(arm.portions.iter().map(|PortionResults { portion, max_error_percent, .. }| {
                ("largest", *portion, format!("max_error_percent_{}", portion.key()), *max_error_percent)
            }));
        }
        let published = |key: &str| self.published("position-10", key);
        let mm_per_percent = self.report.length_m() * 1e3 / 100.0;
        let caption = html! {
            "Percentage errors of the plain position output with ten training positions, by portion of the beam: what the \
             paper prints, and the median found here (5–95 % of the seeds)."
        };
        Table::from_rows(rows)
            .short("portion", |(_, portion, ..)| stretch(*portion))
            .short("error", |(kind, ..)| *kind)
            .numeric("published, %", |(_, _, key, _)| published(key).map_or(NOTHING.to_owned(), printed))
            .numeric("found, %", |(_, _, key, found)| {
                quantile_range(published(key).map_or(*found, |figure| figure.result), number)
            })
            .numeric("found, mm", |(.., found)| quantile_range(found.scaled(mm_per_percent), number))
            .caption(caption)
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

/// E1.1 to E3.2: tens of positions, then 1 for six in the middle and 2 for four.
fn paper_name(count: usize, middle: usize) -> String {
    match (count, middle) {
        (10 | 20 | 30, 6) => format!("E{}.1", count / 10),
        (10 | 20 | 30, 4) => format!("E{}.2", count / 10),
        _ => NOTHING.to_owned(),
    }
}

struct EdgeDense<'a> {
    set: &'a Set<'a>,
    middle: usize,
    edge: usize,
    portion: (f64, f64),
}

impl<'a> EdgeDense<'a> {
    fn from_set(set: &'a Set<'a>) -> Option<Self> {
        let Arrangement::EdgeDense { middle, portion } = set.training.arrangement else { return None };
        Some(Self { set, middle, edge: (set.positions.len() - middle) / 2, portion })
    }

    fn parts(&self) -> [&'a [Position]; 3] {
        let (edge, middle) = (self.edge, self.middle);
        let positions = &self.set.positions;
        [&positions[..edge], &positions[edge..edge + middle], &positions[edge + middle..]]
    }
}

/// " (100–300 mm)" if every set has this middle portion.
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

/// Positions in short: "33.33, 66.67", "7.14, 14.29 … 92.86".
fn run_of(positions: &[Position]) -> String {
    let shown = |position: &Position| mm(position.x_m);
    match positions {
        [first, second, .., last] if positions.len() > 6 => {
            format!("{}, {} … {}", shown(first), shown(second), shown(last))
        }
        _ => positions.iter().map(shown).collect::<Vec<_>>().join(", "),
    }
}

/// Share of seeds below which a true claim gets a remark.
const MOST_SEEDS: f64 = 0.5;

impl Paper<'_> {
    pub(super) fn published_section(&self) -> Markup {
        if self.published.is_empty() {
            return html! { p { "No arm with a published figure was run." } };
        }
        html! {
            p {
                "Each published figure comes from one network that the author trained; another random start would have given \
                 another figure. Two yardsticks are laid on it: how far our median may be off to count as agreeing, which was fixed beforehand and is \
                 the wider one of most figures; and whether it lies between the 5th and the 95th percentile of our seeds, as nine in \
                 ten single networks do."
            }
        }
    }

    pub(super) fn published_table(&self) -> Table {
        let caption = html! {
            "Every figure that the paper prints and that belongs to an arm here, beside the median found here (5–95 % of \
             the seeds)."
        };
        Table::from_rows(&self.published)
            .short("arm", |figure| figure.arm)
            .short("figure", |figure| figure.label)
            .numeric("published", |figure| printed(figure))
            .numeric("found", |figure| quantile_range(figure.result, number_format(figure)))
            .short("agrees if within", |figure| criterion_text(figure))
            .column("short", "verdict", |figure| verdict(figure.agrees, "agrees", "differs"))
            .column("short", "within 5–\u{2060}95\u{a0}%", |figure| {
                verdict(figure.within_seeds, "yes", "no")
            })
            .caption(caption)
    }

    pub(super) fn claims_section(&self) -> Markup {
        html! {
            @if self.claims.is_empty() { p { "The arms that the paper's claims are about were not all run." } }
        }
    }

    pub(super) fn claims_table(&self) -> Table {
        let caption = html! {
            "The paper's claims in our words, each divided into parts that a program can check. A claim holds when every part \
             of it holds in the medians. ✓ and ✗ mark whether a part does; beside them is the share of the seeds for which it \
             holds, each seed of one arm beside the same seed of another, and in the last column the share of those for \
             which every part holds."
        };
        let in_words = |claim: &&Claim| {
            html! { (claim.claim) ul { @for part in &claim.parts { li { (part_in_words(part)) } } } }
        };
        Table::from_rows(&self.claims)
            .short("claim", |claim| claim.id)
            .column("wide", "in words, and its parts", in_words)
            .column("short", "verdict", |claim| verdict(claim.holds, "holds", "does not hold"))
            .numeric("share of seeds", |claim| share(claim.share_of_seeds))
            .caption(caption)
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
                p { "Every published figure that was compared agrees, and every claim that was tested holds in the medians." }
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

/// Formats a value as in the paper; a bound with its sign.
fn printed(figure: &PublishedFigure) -> String {
    let sign = if figure.criterion == AgreementCriterion::Below { "< " } else { "" };
    format!("{sign}{}", as_written(figure.published))
}

fn number_format(figure: &PublishedFigure) -> fn(f64) -> String {
    if matches!(figure.criterion, AgreementCriterion::Factor(_)) { whole } else { number }
}

fn criterion_text(figure: &PublishedFigure) -> String {
    figure.criterion.in_words(&as_written(figure.published))
}

fn difference(figure: &PublishedFigure) -> Markup {
    html! {
        b { (figure.arm) } ", " (figure.label) ": the paper prints " (printed(figure)) ", the median found here is "
        (number_format(figure)(figure.result.median)) ", not " @if figure.criterion != AgreementCriterion::Below { "within " } (criterion_text(figure)) ". "
        @if figure.criterion == AgreementCriterion::Below {
            @if figure.within_seeds { "Some seeds do stay below it." }
            @else { "Hardly any seed stays below it." }
        } @else if figure.within_seeds {
            "The published figure is within the range of the seeds."
        } @else {
            "The published figure is outside the range of the seeds."
        }
    }
}

fn failure(claim: &Claim) -> Markup {
    let failed: Vec<&ClaimPart> = claim.parts.iter().filter(|part| !part.holds).collect();
    html! {
        b { (claim.id) } " states: " (claim.claim) ". "
        @if failed.len() == claim.parts.len() { "In the medians, every part fails:" }
        @else { "In the medians, " (failed.len()) " of its " (claim.parts.len()) " parts " (fails(failed.len())) ":" }
        ul { @for part in &failed { li { (part.statement) " (holds for " (share(part.share_of_seeds)) " of the seeds)" } } }
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
        (part.statement)
    }
}

fn share(share: f64) -> String {
    format!("{:.0} %", share * 100.0)
}

/// As the paper prints it, in pascals.
const PRINTED_MODULUS_PA: f64 = 200e6;

/// Statements about settings of the network.
const OF_THE_NETWORK: [(&str, &str); 13] = [
    ("input_scale", "not stated"),
    ("biases", "not stated"),
    ("initial_weights", "not stated"),
    ("order", "not stated"),
    ("weight_update", "not stated"),
    ("aggregate_error", "stops at an aggregate error of 0.001 %, without saying of what it is the sum"),
    ("max_epochs", "at most a million iterations, without saying what one iteration is"),
    ("hidden", "10"),
    ("hidden_activation", "sigmoid"),
    ("output_activation", "sigmoid"),
    ("output", "both, compared"),
    ("learning_rate", "0.7"),
    ("momentum", "0.9"),
];

impl Paper<'_> {
    pub(super) fn discrepancies_section(&self) -> Markup {
        html! {
            p {
                "The paper does not specify everything that a replication needs. The study's file specifies the rest; the \
                 table lists the settings of this run."
            }
            (self.modulus_section())
        }
    }

    pub(super) fn open_table(&self) -> Table {
        let mut rows: Vec<[String; 3]> = Vec::new();
        if let Some((rig, beam, force_n)) = self.setup() {
            let modulus = format!("{} GPa", rig_number(beam.youngs_modulus_pa() / 1e9));
            rows.push(row("Young's modulus", "200 MPa, treated as a misprint", modulus));
            rows.push(row("sensor noise", "none: readings are computed", noise_in_words(rig)));
            rows.push(row("force", "3 N, known", format!("{} N, known", rig_number(force_n))));
        }
        rows.extend(OF_THE_NETWORK.iter().filter_map(|(key, paper)| self.network_row(key, paper)));
        rows.push(row("iteration", "undefined", "one epoch: every training position shown once"));
        rows.push(row("networks of each kind", "one", self.report.seeds_in_words()));
        Table::from_rows(rows)
            .words("setting", |[setting, ..]| setting.clone())
            .words("the paper", |[_, paper, _]| paper.clone())
            .words("this study", |[.., study]| study.clone())
            .caption(html! { "Settings of this study and of the paper." })
    }

    fn modulus_section(&self) -> Markup {
        let Some((_, beam, force_n)) = self.setup() else { return Markup::default() };
        if (beam.youngs_modulus_pa() / PRINTED_MODULUS_PA - 1.0).abs() < 1e-6 {
            return Markup::default();
        }
        let sag_m = |youngs_modulus_pa: f64| {
            // The deflection is inversely proportional to the modulus.
            force_n * beam.full_scale(SensorKind::Deflection) * beam.youngs_modulus_pa() / youngs_modulus_pa
        };
        html! {
            p {
                "One value is not followed: the paper prints a Young's modulus of 200 MPa. With it, the load in the middle would \
                 bend this " (rig_number(beam.length_m() * 1e3)) " mm beam by " (number(sag_m(PRINTED_MODULUS_PA)))
                " m, far outside the small deflections that the beam equation is made for. Steel has 200 GPa, so the value is \
                 treated as a misprint. With " (rig_number(beam.youngs_modulus_pa() / 1e9)) " GPa, as here, it bends by "
                (number(sag_m(beam.youngs_modulus_pa()) * 1e3)) " mm."
            }
        }
    }

    fn network_row(&self, key: &str, paper: &str) -> Option<[String; 3]> {
        let arms = self.report.study.study.arms.iter();
        let found: Vec<Setting> = arms
            .flat_map(|arm| arm.rig.estimator.settings(&arm.rig.setup))
            .filter(|setting| setting.key == key)
            .collect();
        let name = found.first()?.name;
        let mut values: Vec<String> = Vec::new();
        for setting in found {
            if !values.contains(&setting.value) {
                values.push(setting.value);
            }
        }
        let mut value = values.join(", or ");
        if key == "input_scale"
            && let Some((_, beam, force_n)) = self.setup()
        {
            let full_scale_mm = force_n * beam.full_scale(SensorKind::Deflection) * 1e3;
            value += &format!("; the full scale of the deflection is {full_scale_mm:.4} mm");
        }
        Some(row(name, paper, value))
    }
}

fn row(setting: &str, paper: &str, study: impl Into<String>) -> [String; 3] {
    [setting.to_owned(), paper.to_owned(), study.into()]
}

fn noise_in_words(rig: &Rig) -> &'static str {
    if rig.setup.layout().sensors().iter().any(|sensor| sensor.channel != Default::default()) {
        "the sensors have faults, as the study's file states"
    } else {
        "none: readings are exact"
    }
}
