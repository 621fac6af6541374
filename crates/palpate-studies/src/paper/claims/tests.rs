//! Claims on artificial outcomes.

use super::*;
use crate::{ArmOutcome, PreparedStudy, Study, TrainedSeed};
use palpate_numerics::watch::Watch;

/// Error in % of the length, and epochs.
type SyntheticArms = fn(&str, u32) -> (f64, u32);

fn checked_claims(made_up: SyntheticArms) -> Vec<Claim> {
    let text = crate::paper::STUDY_TOML.replace("max_epochs = 1_000_000", "max_epochs = 1");
    let prepared = PreparedStudy::new(Study::from_toml(&text).unwrap(), Watch::NONE).unwrap();
    let mut outcomes = Vec::new();
    for (index, arm) in prepared.study.arms.iter().enumerate() {
        let (family, count) = arm.name.rsplit_once('-').unwrap();
        let (error_percent, epochs) = made_up(family, count.parse().unwrap());
        let fits = (0..3).map(|seed| {
            let weights = vec![0.0; 101];
            let outcome = palpate_estimators::network::TrainingOutcome {
                status: palpate_estimators::network::TrainingStatus::Converged,
                epochs,
                aggregate_error: 0.0,
            };
            let mut fit: TrainedSeed = prepared.restore(index, seed, weights, outcome).unwrap().fit;
            for located in &mut fit.evaluation.located {
                // Twice as far off outside the good portion, and to the right, so that the right end is overshot.
                let edge = if GOOD.contains(located.truth) { 1.0 } else { 2.0 };
                located.estimate = located.truth;
                located.estimate.x_m += edge * error_percent / 100.0 * 0.4;
            }
            fit
        });
        outcomes.push(ArmOutcome { name: arm.name.clone(), fits: fits.collect() });
    }
    claims(&outcomes, &prepared.study.evaluation)
}

fn verdicts(claims: &[Claim]) -> Vec<bool> {
    claims.iter().map(|claim| claim.holds).collect()
}

#[test]
fn a_world_as_the_paper_has_it_bears_every_claim_out() {
    let claims = checked_claims(|family, count| {
        let error = match (family, count) {
            ("position", 10) => 2.2,
            ("position", 20) => 1.0,
            ("position", _) => 0.9,
            ("middle6", 10) => 1.6,
            ("normalized", 10) => 1.4,
            ("middle4", 10) => 0.45,
            ("normalized", 20) => 0.4,
            ("normalized", _) => 0.3,
            ("middle6", 20) => 0.39,
            ("middle6", _) => 0.28,
            (_, 20) => 0.2,
            _ => 0.2,
        };
        let epochs = if family == "position" { 1000 * count } else { 500 * count };
        (error, epochs)
    });
    assert_eq!(verdicts(&claims), [true; 8], "{claims:#?}");
    assert!(claims.iter().all(|claim| claim.share_of_seeds == 1.0));
}

#[test]
fn a_world_upside_down_bears_none_out() {
    let claims = checked_claims(|family, count| {
        let error = if family == "position" { -1.0 } else { -6.0 };
        (error * f64::from(count), if family == "position" { 10 } else { 100 - count })
    });
    assert_eq!(verdicts(&claims)[1..], [false; 7], "{claims:#?}");
    assert!(claims[1..].iter().all(|claim| claim.share_of_seeds == 0.0));
}

#[test]
fn arms_that_were_not_run_leave_their_claims_out() {
    let none = claims(&[], &Study::from_toml(crate::paper::STUDY_TOML).unwrap().evaluation);
    assert_eq!(none, []);
}
