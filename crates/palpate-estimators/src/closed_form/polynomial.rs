//! Polynomials and their real roots in an interval.

/// c₀ + c₁·t + c₂·t² + …
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Polynomial(pub(super) Vec<f64>);

impl Polynomial {
    pub(super) fn zero() -> Self {
        Self(vec![0.0])
    }

    /// Cubic through values at t = 0, ⅓, ⅔ and 1.
    pub(super) fn cubic_through([a, b, c, d]: [f64; 4]) -> Self {
        Self(vec![
            a,
            (-11.0 * a + 18.0 * b - 9.0 * c + 2.0 * d) / 2.0,
            (18.0 * a - 45.0 * b + 36.0 * c - 9.0 * d) / 2.0,
            (-9.0 * a + 27.0 * b - 27.0 * c + 9.0 * d) / 2.0,
        ])
    }

    pub(super) fn value_at(&self, t: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, c| sum * t + c)
    }

    pub(super) fn derivative(&self) -> Self {
        let terms = self.0.iter().enumerate().skip(1).map(|(power, c)| power as f64 * c);
        Self(terms.chain((self.0.len() <= 1).then_some(0.0)).collect())
    }

    pub(super) fn plus(&self, factor: f64, other: &Self) -> Self {
        let coefficient = |terms: &[f64], i: usize| terms.get(i).copied().unwrap_or(0.0);
        let len = self.0.len().max(other.0.len());
        Self((0..len).map(|i| coefficient(&self.0, i) + factor * coefficient(&other.0, i)).collect())
    }

    pub(super) fn times(&self, other: &Self) -> Self {
        let mut product = vec![0.0; self.0.len() + other.0.len() - 1];
        for (i, a) in self.0.iter().enumerate() {
            for (j, b) in other.0.iter().enumerate() {
                product[i + j] += a * b;
            }
        }
        Self(product)
    }

    pub(super) fn mirrored(&self) -> Self {
        let mirror = Self(vec![1.0, -1.0]);
        self.0.iter().rev().fold(Self::zero(), |sum, c| sum.times(&mirror).plus(1.0, &Self(vec![*c])))
    }

    /// Drops the constant, 0 in theory.
    pub(super) fn over_t(&self) -> Self {
        Self(self.0.iter().skip(1).copied().chain((self.0.len() <= 1).then_some(0.0)).collect())
    }

    pub(super) fn size(&self) -> f64 {
        self.0.iter().fold(0.0, |m: f64, c| m.max(c.abs()))
    }

    /// Roots in 0 ≤ t ≤ 1 with a change of sign, by bisection between roots of the derivative.
    pub(super) fn sign_changes(&self) -> Vec<f64> {
        if self.0.len() <= 1 || self.size() == 0.0 {
            return Vec::new();
        }
        let turns = self.derivative().sign_changes();
        let mut ends = vec![0.0];
        ends.extend(turns);
        ends.push(1.0);
        let mut roots: Vec<f64> = ends.windows(2).filter_map(|pair| self.bisect(pair[0], pair[1])).collect();
        roots.dedup();
        roots
    }

    fn bisect(&self, mut low: f64, mut high: f64) -> Option<f64> {
        let (at_low, at_high) = (self.value_at(low), self.value_at(high));
        if at_low == 0.0 {
            return Some(low);
        }
        if at_high == 0.0 {
            return Some(high);
        }
        if at_low.is_sign_positive() == at_high.is_sign_positive() {
            return None;
        }
        // Each halving gives a binary digit, and a double has 53.
        for _ in 0..f64::MANTISSA_DIGITS {
            let middle = 0.5 * (low + high);
            if self.value_at(middle).is_sign_positive() == at_low.is_sign_positive() {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(0.5 * (low + high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_roots(roots: &[f64]) -> Polynomial {
        roots.iter().fold(Polynomial(vec![-2.5]), |p, root| p.times(&Polynomial(vec![-root, 1.0])))
    }

    #[test]
    fn every_root_within_the_interval_is_found_and_no_other() {
        let inside = [0.05, 0.3, 0.31, 0.8, 0.99];
        let roots = with_roots(&[-0.4, 0.05, 0.3, 0.31, 0.8, 0.99, 1.7]).sign_changes();
        assert_eq!(roots.len(), inside.len(), "{roots:?}");
        assert!(roots.iter().zip(inside).all(|(found, root)| (found - root).abs() < 1e-9), "{roots:?}");
        assert!(Polynomial(vec![1.0, 0.0, 1.0]).sign_changes().is_empty());
    }

    #[test]
    fn a_cubic_is_known_by_four_values() {
        let cubic = Polynomial(vec![0.7, -1.3, 2.0, 4.1]);
        let through = Polynomial::cubic_through([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|t| cubic.value_at(t)));
        assert!(cubic.plus(-1.0, &through).size() < 1e-13);
    }

    #[test]
    fn mirroring_and_division_meet_their_definitions() {
        let p = Polynomial(vec![0.0, -1.3, 2.0, 4.1]);
        for t in [0.0, 0.2, 0.9] {
            assert!((p.mirrored().value_at(t) - p.value_at(1.0 - t)).abs() < 1e-14);
            assert!((t * p.over_t().value_at(t) - p.value_at(t)).abs() < 1e-14);
            let slope = (p.value_at(t + 1e-6) - p.value_at(t - 1e-6)) / 2e-6;
            assert!((p.derivative().value_at(t) - slope).abs() < 1e-8);
        }
    }
}
