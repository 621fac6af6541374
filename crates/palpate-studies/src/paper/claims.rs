//! Claims of the paper, checked by the medians and for each seed k (equal random streams in all arms).

use serde::Serialize;

use super::COUNTS;
use crate::results::average_percent;
use crate::{ArmOutcome, EvaluationSettings, TrainedSeed};
use palpate_estimators::evaluation::Portion;
use palpate_mechanics::contact::Position;

/// Claim with the results of its checks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// "C1" to "C8".
    pub id: &'static str,
    /// Claim in words.
    pub claim: &'static str,
    /// True if the medians confirm all parts.
    pub holds: bool,
    /// Share of the seeds that confirm all parts, 0 to 1.
    pub share_of_seeds: f64,
    /// Parts.
    pub parts: Vec<ClaimPart>,
}

/// Checkable part of a claim.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClaimPart {
    /// Statement in words.
    #[serde(rename = "what")]
    pub statement: String,
    /// True if the medians confirm it.
    pub holds: bool,
    /// Share of the seeds that confirm it, 0 to 1.
    pub share_of_seeds: f64,
}

/// Sensor pitch of the paper, l/9, %.
const PITCH_PERCENT: f64 = 100.0 / 9.0;
/// Range of "about 1 %".
const ABOUT_ONE: std::ops::RangeInclusive<f64> = 0.5..=1.5;
/// Largest ratio of "linear" increments.
const LINEAR_FACTOR: f64 = 2.0;
/// Accurate portion according to the paper, m.
const GOOD: Portion = Portion { from_m: 0.060, to_m: 0.300 };

/// Checks the claims C1 to C8; omits claims with missing arms.
pub fn claims(outcomes: &[ArmOutcome], judging: &EvaluationSettings) -> Vec<Claim> {
    let table = Table { outcomes, settings: judging };
    let claims = [
        (
            "C1",
            "errors grow towards the edges, and the position output overshoots 400 mm near the right edge",
            c1(),
        ),
        (
            "C2",
            "the average error falls as the number of training positions grows, sharply from 10 to 20 and less from 20 to 30",
            c2(),
        ),
        (
            "C3",
            "the normalized output lowers the average error by about 1 % of the length at each number of training positions",
            c3(),
        ),
        ("C4", "the normalized output needs fewer iterations at each number of training positions", c4()),
        (
            "C5",
            "iterations grow with the number of training positions, linearly for the position output",
            c5(),
        ),
        (
            "C6",
            "at equal number, more training positions near the edges lower the average error, but for 6 in the middle at 10",
            c6(),
        ),
        (
            "C7",
            "at equal number, 4 in the middle gives the largest effective length, and the difference shrinks as the number grows",
            c7(),
        ),
        ("C8", "the location error is far below the sensor pitch of 44.4 mm", c8()),
    ];
    claims.into_iter().filter_map(|(id, claim, parts)| table.check_claim(id, claim, &parts)).collect()
}

#[derive(Clone, Copy)]
enum Figure {
    Error,
    /// Average error outside the accurate portion.
    EdgeError,
    /// Average error inside the accurate portion.
    GoodError,
    /// Largest estimated position, in % of the length.
    LargestPosition,
    Epochs,
    Effective,
}

type FigureLookup<'a> = dyn Fn(&str, Figure) -> f64 + 'a;

struct Part {
    statement: String,
    test: Box<dyn Fn(&FigureLookup) -> bool>,
}

fn part(what: impl Into<String>, test: impl Fn(&FigureLookup) -> bool + 'static) -> Part {
    Part { statement: what.into(), test: Box::new(test) }
}

fn arm(family: &str, count: u32) -> String {
    format!("{family}-{count}")
}

fn c1() -> Vec<Part> {
    let edges = part("position-10: larger average error outside 60–300 mm than inside", |look| {
        look("position-10", Figure::EdgeError) > look("position-10", Figure::GoodError)
    });
    let overshoot = part("position-10: some estimates lie beyond 400 mm", |look| {
        look("position-10", Figure::LargestPosition) > 100.0
    });
    vec![edges, overshoot]
}

fn c2() -> Vec<Part> {
    let family = |family: &'static str| {
        let error = move |look: &FigureLookup| COUNTS.map(|n| look(&arm(family, n), Figure::Error));
        let falls = part(format!("{family}: the error falls from 10 to 20 to 30"), move |look| {
            let [ten, twenty, thirty] = error(look);
            ten > twenty && twenty > thirty
        });
        let levels = part(format!("{family}: it falls more from 10 to 20 than from 20 to 30"), move |look| {
            let [ten, twenty, thirty] = error(look);
            ten - twenty > twenty - thirty
        });
        [falls, levels]
    };
    ["position", "normalized"].into_iter().flat_map(family).collect()
}

fn c3() -> Vec<Part> {
    let at = |n: u32| {
        part(format!("n = {n}: the error falls by 0.5 to 1.5 % of the length"), move |look| {
            let fall = look(&arm("position", n), Figure::Error) - look(&arm("normalized", n), Figure::Error);
            ABOUT_ONE.contains(&fall)
        })
    };
    COUNTS.map(at).into()
}

fn c4() -> Vec<Part> {
    let at = |n: u32| {
        part(format!("n = {n}: normalized takes fewer iterations than position"), move |look| {
            look(&arm("normalized", n), Figure::Epochs) < look(&arm("position", n), Figure::Epochs)
        })
    };
    COUNTS.map(at).into()
}

fn c5() -> Vec<Part> {
    let epochs = |look: &FigureLookup, family: &str| COUNTS.map(|n| look(&arm(family, n), Figure::Epochs));
    let grow = |family: &'static str| {
        part(format!("{family}: iterations grow from 10 to 20 to 30"), move |look| {
            let [ten, twenty, thirty] = epochs(look, family);
            ten < twenty && twenty < thirty
        })
    };
    let linear = part(
        "position: the increments from 10 to 20 and from 20 to 30 are within a factor of 2",
        move |look| {
            let [ten, twenty, thirty] = epochs(look, "position");
            let ratio = (thirty - twenty) / (twenty - ten);
            (1.0 / LINEAR_FACTOR..=LINEAR_FACTOR).contains(&ratio)
        },
    );
    vec![grow("position"), grow("normalized"), linear]
}

fn c6() -> Vec<Part> {
    let lower = |family: &'static str, n: u32| {
        part(format!("n = {n}: {family} has a lower error than the even arrangement"), move |look| {
            look(&arm(family, n), Figure::Error) < look(&arm("normalized", n), Figure::Error)
        })
    };
    let exception = part("n = 10: 6 in the middle has the highest error of the normalized sets", |look| {
        let error = look("middle6-10", Figure::Error);
        error > look("normalized-10", Figure::Error) && error > look("middle4-10", Figure::Error)
    });
    let mut parts = vec![exception, lower("middle4", 10)];
    for n in [20, 30] {
        parts.push(lower("middle6", n));
        parts.push(lower("middle4", n));
    }
    parts
}

fn c7() -> Vec<Part> {
    let effective = |look: &FigureLookup, family: &str, n: u32| look(&arm(family, n), Figure::Effective);
    let largest = |n: u32| {
        part(format!("n = {n}: 4 in the middle has the largest effective length"), move |look| {
            let four = effective(look, "middle4", n);
            four > effective(look, "middle6", n) && four > effective(look, "normalized", n)
        })
    };
    let shrinks = part("its lead over the even arrangement is smaller at 30 than at 10", move |look| {
        let lead = |n| effective(look, "middle4", n) - effective(look, "normalized", n);
        lead(30) < lead(10)
    });
    COUNTS.map(largest).into_iter().chain([shrinks]).collect()
}

fn c8() -> Vec<Part> {
    let below = |family: &'static str, n: u32| {
        part(format!("{family}-{n}: the average error is less than half the pitch"), move |look| {
            look(&arm(family, n), Figure::Error) < PITCH_PERCENT / 2.0
        })
    };
    let families = ["position", "normalized", "middle6", "middle4"];
    families.into_iter().flat_map(|family| COUNTS.map(|n| below(family, n))).collect()
}

struct Table<'a> {
    outcomes: &'a [ArmOutcome],
    settings: &'a EvaluationSettings,
}

impl Table<'_> {
    fn check_claim(&self, id: &'static str, claim: &'static str, parts: &[Part]) -> Option<Claim> {
        let seeds = self.outcomes.iter().map(|outcome| outcome.fits.len()).min().unwrap_or(0);
        let asked = std::cell::Cell::new(true);
        let median = |name: &str, figure: Figure| {
            let values = self.fits(name).iter().map(|fit| self.figure(fit, figure)).collect();
            palpate_numerics::median(values).unwrap_or_else(|| {
                asked.set(false);
                f64::NAN
            })
        };
        let of_seed = |seed: u64| {
            move |name: &str, figure: Figure| {
                let fit = self.fits(name).iter().find(|fit| fit.seed == seed);
                fit.map_or(f64::NAN, |fit| self.figure(fit, figure))
            }
        };
        let share = |test: &dyn Fn(u64) -> bool| {
            (0..seeds as u64).filter(|seed| test(*seed)).count() as f64 / seeds.max(1) as f64
        };
        let judged: Vec<ClaimPart> = parts
            .iter()
            .map(|part| ClaimPart {
                statement: part.statement.clone(),
                holds: (part.test)(&median),
                share_of_seeds: share(&|seed| (part.test)(&of_seed(seed))),
            })
            .collect();
        let all = share(&|seed| parts.iter().all(|part| (part.test)(&of_seed(seed))));
        let holds = judged.iter().all(|part| part.holds);
        asked.get().then_some(Claim { id, claim, holds, share_of_seeds: all, parts: judged })
    }

    fn fits(&self, name: &str) -> &[TrainedSeed] {
        self.outcomes.iter().find(|outcome| outcome.name == name).map_or(&[], |outcome| &outcome.fits)
    }

    fn figure(&self, fit: &TrainedSeed, figure: Figure) -> f64 {
        let evaluation = &fit.evaluation;
        let error = |keep: &dyn Fn(Position) -> bool| average_percent(evaluation, keep).unwrap_or(f64::NAN);
        match figure {
            Figure::Error => error(&|_| true),
            Figure::GoodError => error(&|at| GOOD.contains(at)),
            Figure::EdgeError => error(&|at| !GOOD.contains(at)),
            Figure::LargestPosition => {
                let positions = evaluation.located.iter().map(|located| located.estimate.x_m);
                positions.fold(f64::NEG_INFINITY, f64::max) / evaluation.extent.length_m() * 100.0
            }
            Figure::Epochs => f64::from(fit.training.unwrap_or_default().epochs),
            Figure::Effective => evaluation.effective_percent(self.settings.tolerance_m),
        }
    }
}

#[cfg(test)]
mod tests;
