//! Systematic sampling (Kitagawa, Journal of Computational and Graphical Statistics 5, 1996).

/// Number of draws of each item among `count`, at even steps of the cumulative probability.
pub(super) fn systematic_sample(probabilities: impl Iterator<Item = f64>, count: usize) -> Vec<usize> {
    let (mut passed, mut drawn) = (0.0, 0);
    let draws_of = |probability: f64| {
        passed += probability;
        let before = drawn;
        while drawn < count && (drawn as f64 + 0.5) / (count as f64) < passed {
            drawn += 1;
        }
        drawn - before
    };
    probabilities.map(draws_of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_item_is_drawn_by_its_probability_within_one() {
        let probabilities = [0.4, 0.001, 0.25, 0.0, 0.3, 0.049];
        for count in [1, 7, 32, 1000] {
            let drawn = systematic_sample(probabilities.into_iter(), count);
            assert_eq!(drawn.iter().sum::<usize>(), count);
            for (probability, drawn) in probabilities.iter().zip(drawn) {
                assert!((drawn as f64 - probability * count as f64).abs() < 1.0);
            }
        }
    }
}
