//! Gaussian states.
//!
//! Symbols: m mean and P covariance; s entries of the unknowns of a [`ContactFit`], with score g and
//! information A.

use crate::likelihood::ContactFit;
use palpate_numerics::small::{Ldl, Matrix, dot};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gaussian<const N: usize> {
    pub mean: [f64; N],
    pub covariance: Matrix<N>,
}

/// Linear transition: the mean becomes `mean`, P becomes F·P·Fᵀ + Q.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transition<const N: usize> {
    pub mean: [f64; N],
    /// F.
    pub forward: Matrix<N>,
    /// Q.
    pub noise: Matrix<N>,
}

impl<const N: usize> Transition<N> {
    pub fn identity(belief: &Gaussian<N>) -> Self {
        let mut transition = Self { mean: belief.mean, forward: [[0.0; N]; N], noise: [[0.0; N]; N] };
        (0..N).for_each(|i| transition.forward[i][i] = 1.0);
        transition
    }

    /// F·P.
    fn transition_product(&self, p: &Matrix<N>) -> Matrix<N> {
        let mut carried = [[0.0; N]; N];
        for (row, forward) in carried.iter_mut().zip(&self.forward) {
            for (share, from) in forward.iter().zip(p).filter(|(share, _)| **share != 0.0) {
                row.iter_mut().zip(from).for_each(|(value, from)| *value += share * from);
            }
        }
        carried
    }
}

impl<const N: usize> Default for Gaussian<N> {
    fn default() -> Self {
        Self { mean: [0.0; N], covariance: [[0.0; N]; N] }
    }
}

impl<const N: usize> Gaussian<N> {
    pub fn predicted(&self, transition: &Transition<N>) -> Self {
        let carried = transition.transition_product(&self.covariance);
        let mut covariance = transition.noise;
        for (row, carried) in covariance.iter_mut().zip(&carried) {
            for (value, forward) in row.iter_mut().zip(&transition.forward) {
                *value += dot(carried, forward);
            }
        }
        Self { mean: transition.mean, covariance }
    }

    /// Updates by a reading, expanded about `about`; returns the log probability.
    ///
    /// P⁺ = P − Y·G⁻¹·Yᵀ with Y = P_s·R, A = R·Rᵀ and G = 1 + Rᵀ·P_ss·R; m⁺ = m + P⁺_s·(g − A·δ), with δ the
    /// mean minus `about`. The log evidence is −½·(ln det G + χ²), with χ² reduced by the move.
    pub fn updated<const K: usize>(
        &self,
        fit: &ContactFit<K>,
        about: &[f64; K],
        entries: &[usize; K],
    ) -> (Self, f64) {
        let delta: [f64; K] = std::array::from_fn(|k| self.mean[entries[k]] - about[k]);
        let score: [f64; K] = std::array::from_fn(|k| fit.score[k] - dot(&fit.information[k], &delta));
        let misfit = fit.misfit - (0..K).map(|k| delta[k] * (fit.score[k] + score[k])).sum::<f64>();
        let root = Ldl::semidefinite(&fit.information).root();
        let mut y: [[f64; K]; N] = std::array::from_fn(|i| {
            std::array::from_fn(|c| (c..K).map(|k| self.covariance[i][entries[k]] * root[k][c]).sum())
        });
        let mut grown: Matrix<K> = std::array::from_fn(|r| {
            std::array::from_fn(|c| (r..K).map(|k| root[k][r] * y[entries[k]][c]).sum())
        });
        (0..K).for_each(|k| grown[k][k] += 1.0);
        let grown = Ldl::semidefinite(&grown);
        let mut after = *self;
        for i in 0..N {
            y[i] = grown.solve_lower(y[i]);
            let scaled: [f64; K] = std::array::from_fn(|c| y[i][c] * grown.inverse_pivots()[c]);
            for (j, other) in y.iter().enumerate().take(i + 1) {
                after.covariance[i][j] -= dot(&scaled, other);
                after.covariance[j][i] = after.covariance[i][j];
            }
        }
        let moved: [f64; N] =
            std::array::from_fn(|i| (0..K).map(|k| after.covariance[i][entries[k]] * score[k]).sum());
        after.mean.iter_mut().zip(&moved).for_each(|(mean, moved)| *mean += moved);
        let explained: f64 = (0..K).map(|k| score[k] * moved[entries[k]]).sum();
        (after, -0.5 * (grown.log_determinant() + misfit - explained))
    }

    /// Mixture moments; shares sum to 1.
    pub fn mixed(parts: impl Iterator<Item = (f64, Self)> + Clone) -> Self {
        let mut all = Self::default();
        for (share, part) in parts.clone() {
            all.mean.iter_mut().zip(&part.mean).for_each(|(mean, part)| *mean += share * part);
        }
        for (share, part) in parts {
            let away: [f64; N] = std::array::from_fn(|i| part.mean[i] - all.mean[i]);
            for i in 0..N {
                for j in 0..N {
                    all.covariance[i][j] += share * (part.covariance[i][j] + away[i] * away[j]);
                }
            }
        }
        all
    }

    /// Rauch–Tung–Striebel (1965): m + C·(m′ − m⁻) and P + C·(P′ − P⁻)·Cᵀ with C = P·Fᵀ·(P⁻)⁻¹; exact entries
    /// stay.
    pub fn smoothed(&self, transition: &Transition<N>, later: &Self) -> Self {
        let expected = self.predicted(transition);
        let carried = transition.transition_product(&self.covariance);
        let factors = Ldl::semidefinite(&expected.covariance);
        let gain: Matrix<N> = std::array::from_fn(|i| factors.solve(std::array::from_fn(|j| carried[j][i])));
        let mut before = *self;
        let news: [f64; N] = std::array::from_fn(|k| later.mean[k] - expected.mean[k]);
        let difference: Matrix<N> = std::array::from_fn(|k| {
            std::array::from_fn(|l| later.covariance[k][l] - expected.covariance[k][l])
        });
        for i in 0..N {
            before.mean[i] += dot(&gain[i], &news);
            let through: [f64; N] =
                std::array::from_fn(|l| (0..N).map(|k| gain[i][k] * difference[k][l]).sum());
            for (value, gain) in before.covariance[i].iter_mut().zip(&gain) {
                *value += dot(&through, gain);
            }
        }
        before
    }

    /// Information gained since `other`, with its point of expansion: precision P⁻¹ − P₀⁻¹, score P₀⁻¹·(m −
    /// m₀) at m. Entries without variance have no precision.
    pub fn information_beyond(&self, other: &Self) -> (ContactFit<N>, [f64; N]) {
        let [own, before] = [self, other].map(|belief| Ldl::semidefinite(&belief.covariance).inverse());
        let moved: [f64; N] = std::array::from_fn(|i| self.mean[i] - other.mean[i]);
        let information = std::array::from_fn(|i| std::array::from_fn(|j| own[i][j] - before[i][j]));
        let score = std::array::from_fn(|i| dot(&before[i], &moved));
        (ContactFit { misfit: 0.0, score, information }, self.mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Position, speed and force.
    const BELIEF: Gaussian<3> = Gaussian {
        mean: [0.2, 0.5, 3.0],
        covariance: [[4e-6, 1e-6, 1e-4], [1e-6, 1e-2, 2e-4], [1e-4, 2e-4, 0.04]],
    };

    #[test]
    fn a_reading_of_the_position_alone_is_the_textbook_s_kalman_filter() {
        let fit = ContactFit { misfit: 4.0, score: [2e3, 0.0], information: [[1e6, 0.0], [0.0, 0.0]] };
        // One measurement z of x with variance 1e-6, (z − 0.2)² / 1e-6 = 4: z = 0.202.
        let (after, evidence) = BELIEF.updated(&fit, &[0.2, 3.0], &[0, 2]);
        let (innovation, spread) = (2e-3, 5e-6);
        for i in 0..3 {
            let gain = BELIEF.covariance[i][0] / spread;
            assert!((after.mean[i] - (BELIEF.mean[i] + gain * innovation)).abs() < 1e-12);
        }
        assert!((after.covariance[0][0] - 0.8e-6).abs() < 1e-15);
        let expected = -0.5 * ((spread / 1e-6f64).ln() + innovation * innovation / spread);
        assert!((evidence - expected).abs() < 1e-9, "{evidence} {expected}");
    }

    #[test]
    fn where_a_misfit_is_expanded_does_not_matter_while_it_is_a_parabola() {
        let (information, score, misfit) = ([[1e6, 2e2], [2e2, 50.0]], [7e2, -1.5], 9.0);
        let moved = |delta: [f64; 2]| {
            let by: [f64; 2] = std::array::from_fn(|k| dot(&information[k], &delta));
            let misfit = misfit - 2.0 * dot(&score, &delta) + dot(&delta, &by);
            ContactFit { misfit, score: [score[0] - by[0], score[1] - by[1]], information }
        };
        let (here, one) = BELIEF.updated(&moved([0.0; 2]), &[0.2, 3.0], &[0, 2]);
        let (there, other) = BELIEF.updated(&moved([1e-3, 0.1]), &[0.201, 3.1], &[0, 2]);
        assert!((one - other).abs() < 1e-9);
        for i in 0..3 {
            assert!((here.mean[i] - there.mean[i]).abs() < 1e-10);
        }
    }

    #[test]
    fn later_readings_without_information_leave_the_state() {
        for known in [false, true] {
            let mut belief = BELIEF;
            let mut noise = [[0.0; 3]; 3];
            (noise[1][1], noise[2][2]) = (1e-4, 1e-4);
            if known {
                (0..3).for_each(|i| (belief.covariance[i][2], belief.covariance[2][i]) = (0.0, 0.0));
                noise[2][2] = 0.0;
            }
            let forward = [[1.0, 0.01, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let transition = Transition { mean: [0.205, 0.5, 3.0], forward, noise };
            let back = belief.smoothed(&transition, &belief.predicted(&transition));
            for i in 0..3 {
                assert!((back.mean[i] - belief.mean[i]).abs() < 1e-12);
                assert!((back.covariance[i][i] - belief.covariance[i][i]).abs() < 1e-12);
            }
        }
    }
}
