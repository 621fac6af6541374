use super::*;
use crate::sensors::objective::ForceBelief::Vague;

fn row<const P: usize>(columns: [&[f64]; P]) -> Vec<Block> {
    columns.iter().flat_map(|column| padded(column)).collect()
}

/// Rows of a line with an unknown force, at 11 contacts, without a pattern.
fn rows() -> Vec<Vec<Block>> {
    let value = |i: usize, k: usize, p: usize| ((i * 7 + k * 3 + p) as f64 * 0.7).sin() * [2.0, 40.0][k];
    (0..5)
        .map(|i| {
            let columns: [Vec<f64>; 2] = std::array::from_fn(|k| (0..11).map(|p| value(i, k, p)).collect());
            row([&columns[0], &columns[1]])
        })
        .collect()
}

fn objective(criterion: DesignCriterion) -> LimitObjective<2, 1> {
    let weights = [1.0 / 11.0; 11];
    LimitObjective::new(Arc::new(Vec::new()), &weights, &[0.4], criterion, 0.02)
}

#[test]
fn a_sensor_more_scores_as_the_layout_with_it() {
    let rows = rows();
    use DesignCriterion::{DOptimality, MeanLimit, WithinTolerance, WorstLimit};
    for criterion in [MeanLimit, WorstLimit, WithinTolerance, DOptimality] {
        let objective = objective(criterion);
        let refs: Vec<&[Block]> = rows.iter().map(Vec::as_slice).collect();
        let whole = objective.score(&objective.state(&refs, Vague));
        let rest = objective.state(&refs[..4], Vague);
        for added in
            [objective.score_with(&rest, refs[4]), objective.score(&objective.updated(&rest, refs[4]))]
        {
            assert!((added - whole).abs() < 1e-9 * whole.abs(), "{criterion:?}: {added} {whole}");
        }
    }
}

#[test]
fn the_score_is_the_limit_with_the_prior() {
    let rows = rows();
    let refs: Vec<&[Block]> = rows.iter().map(Vec::as_slice).collect();
    let objective = objective(DesignCriterion::MeanLimit);
    let expected: f64 = (0..11)
        .map(|p| {
            let sum = |i: usize, k: usize| -> f64 {
                rows.iter().map(|row| row[2 * i + p / 8][p % 8] * row[2 * k + p / 8][p % 8]).sum()
            };
            let information = sum(1, 1) - sum(0, 1).powi(2) / (sum(0, 0) + 1e-6);
            1.0 / (information + 12.0 / 0.16).sqrt() / 11.0
        })
        .sum();
    let score = objective.score(&objective.state(&refs, Vague));
    assert!((score / expected - 1.0).abs() < 1e-12, "{score} {expected}");
}

#[test]
fn without_sensors_the_prior_is_all() {
    let unknown_m = 0.4 / 12f64.sqrt();
    for criterion in [DesignCriterion::MeanLimit, DesignCriterion::WorstLimit] {
        let objective = objective(criterion);
        let value = objective.value(&objective.state(&[], Vague));
        assert!((value / unknown_m - 1.0).abs() < 1e-12);
    }
    let objective = objective(DesignCriterion::WithinTolerance);
    assert!((objective.value(&objective.state(&[], Vague)) - 1.0).abs() < 1e-12);
}
