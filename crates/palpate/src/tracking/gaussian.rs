//! A Gaussian in position, speed, acceleration and force, moved by time and by readings.
//!
//! Symbols: m mean and P covariance of (x, v, v̇, W); S covariance of what a reading sees, place and force; g and A pull and
//! information of a [`ContactFit`].

use crate::method::ContactFit;

/// Position, speed, acceleration and force.
pub(super) const STATES: usize = 4;
pub(super) const X: usize = 0;
pub(super) const V: usize = 1;
pub(super) const A: usize = 2;
pub(super) const W: usize = 3;

pub(super) type Vector = [f64; STATES];
pub(super) type Matrix = [[f64; STATES]; STATES];

/// A belief about one contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Gaussian {
    /// In m, m/s, m/s² and N.
    pub mean: Vector,
    pub covariance: Matrix,
}

/// What time does to a contact: m goes to F·m and P to F·P·Fᵀ + Q.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    forward: Matrix,
    noise: Matrix,
}

impl Motion {
    /// A contact whose acceleration has standard deviation `sd` and a correlation that falls by e in `lasts_s` (R. Singer,
    /// IEEE Trans. Aerosp. Electron. Syst. 6, 1970); its force gains a variance.
    pub fn new(duration_s: f64, lasts_s: f64, sd: f64, force_variance: f64) -> Self {
        let (t, u) = (duration_s, duration_s / lasts_s);
        let e = (-u).exp();
        let mut forward = [[0.0; STATES]; STATES];
        (0..STATES).for_each(|i| forward[i][i] = 1.0);
        forward[X][V] = t;
        forward[X][A] = lasts_s * lasts_s * (u - 1.0 + e);
        forward[V][A] = lasts_s * (1.0 - e);
        forward[A][A] = e;
        let mut noise = [[0.0; STATES]; STATES];
        let mut set = |i: usize, j: usize, value: f64| {
            noise[i][j] = value * sd * sd * lasts_s.powi(4 - i as i32 - j as i32);
            noise[j][i] = noise[i][j];
        };
        if u < 0.05 {
            // What the closed form comes to while it would lose its digits.
            set(X, X, u.powi(5) / 10.0);
            set(X, V, u.powi(4) / 4.0);
            set(X, A, u.powi(3) / 3.0);
            set(V, V, 2.0 * u.powi(3) / 3.0);
            set(V, A, u * u);
            set(A, A, 2.0 * u);
        } else {
            let ee = e * e;
            set(X, X, 1.0 - ee + 2.0 * u + 2.0 * u.powi(3) / 3.0 - 2.0 * u * u - 4.0 * u * e);
            set(X, V, ee + 1.0 - 2.0 * e + 2.0 * u * e - 2.0 * u + u * u);
            set(X, A, 1.0 - ee - 2.0 * u * e);
            set(V, V, 4.0 * e - 3.0 - ee + 2.0 * u);
            set(V, A, ee + 1.0 - 2.0 * e);
            set(A, A, 1.0 - ee);
        }
        noise[W][W] = force_variance;
        Self { forward, noise }
    }

    /// The motion whose noise is the mean of some that differ in nothing else, by their shares.
    pub fn mixed<const N: usize>(shares: [f64; N], motions: &[Self; N]) -> Self {
        let mut mixed = motions[0];
        for i in 0..STATES {
            for j in 0..STATES {
                mixed.noise[i][j] =
                    shares.iter().zip(motions).map(|(share, motion)| share * motion.noise[i][j]).sum();
            }
        }
        mixed
    }

    /// F·P.
    fn carried(&self, p: &Matrix) -> Matrix {
        let f = &self.forward;
        std::array::from_fn(|i| std::array::from_fn(|j| (0..STATES).map(|k| f[i][k] * p[k][j]).sum()))
    }
}

impl Gaussian {
    /// After a motion.
    pub fn predicted(&self, motion: &Motion) -> Self {
        let (f, carried) = (&motion.forward, motion.carried(&self.covariance));
        let mean = std::array::from_fn(|i| (0..STATES).map(|k| f[i][k] * self.mean[k]).sum());
        let mut covariance = motion.noise;
        for i in 0..STATES {
            for j in 0..STATES {
                covariance[i][j] += (0..STATES).map(|k| carried[i][k] * f[j][k]).sum::<f64>();
            }
        }
        Self { mean, covariance }
    }

    /// Position and force as a reading sees them: an accelerated contact as if it were `inertia_s2` times its acceleration
    /// behind.
    pub fn seen(&self, inertia_s2: f64) -> [f64; 2] {
        [self.mean[X] - inertia_s2 * self.mean[A], self.mean[W]]
    }

    /// After a reading whose misfit is expanded about (position, force) = `about`, as seen; and the logarithm of how
    /// probable the reading was.
    ///
    /// P⁺ = P − P_s·(1 + A·S)⁻¹·A·P_sᵀ and m⁺ = m + P⁺_s·(g − A·δ), with P_s the covariance of the state with what is seen
    /// and δ the distance of what is seen from `about`; the evidence is −½·(ln det(1 + A·S) + χ² less what the move explains).
    pub fn updated(&self, fit: &ContactFit, about: [f64; 2], inertia_s2: f64) -> (Self, f64) {
        let with_seen = |p: &Matrix| -> [[f64; 2]; STATES] {
            std::array::from_fn(|i| [p[i][X] - inertia_s2 * p[i][A], p[i][W]])
        };
        let of_seen = |s: &[[f64; 2]; STATES]| {
            [s[X][0] - inertia_s2 * s[A][0], s[X][1] - inertia_s2 * s[A][1], s[W][1]]
        };
        let seen = self.seen(inertia_s2);
        let delta = [seen[0] - about[0], seen[1] - about[1]];
        let [a, b, c] = fit.information;
        let by = [a * delta[0] + b * delta[1], b * delta[0] + c * delta[1]];
        let pull = [fit.pull[0] - by[0], fit.pull[1] - by[1]];
        let misfit = fit.misfit - delta[0] * (fit.pull[0] + pull[0]) - delta[1] * (fit.pull[1] + pull[1]);
        let before = with_seen(&self.covariance);
        let [sx, sm, sw] = of_seen(&before);
        // 1 + A·S, its determinant, and G = (1 + A·S)⁻¹·A, which is symmetric.
        let (k00, k01) = (1.0 + a * sx + b * sm, a * sm + b * sw);
        let (k10, k11) = (b * sx + c * sm, 1.0 + b * sm + c * sw);
        let determinant = k00 * k11 - k01 * k10;
        let g00 = (k11 * a - k01 * b) / determinant;
        let g01 = (k11 * b - k01 * c) / determinant;
        let g11 = (k00 * c - k10 * b) / determinant;
        let mut after = *self;
        for i in 0..STATES {
            for j in 0..=i {
                let (left, right) = (before[i], before[j]);
                let fall =
                    left[0] * (g00 * right[0] + g01 * right[1]) + left[1] * (g01 * right[0] + g11 * right[1]);
                after.covariance[i][j] -= fall;
                after.covariance[j][i] = after.covariance[i][j];
            }
        }
        let left = with_seen(&after.covariance);
        for (mean, left) in after.mean.iter_mut().zip(&left) {
            *mean += left[0] * pull[0] + left[1] * pull[1];
        }
        let [lx, lm, lw] = of_seen(&left);
        let explained = pull[0] * (lx * pull[0] + 2.0 * lm * pull[1]) + pull[1] * lw * pull[1];
        (after, -0.5 * (determinant.max(f64::MIN_POSITIVE).ln() + misfit - explained))
    }

    /// The Gaussian with the mean and covariance of a mixture; shares add up to 1.
    pub fn mixed(parts: impl Iterator<Item = (f64, Self)> + Clone) -> Self {
        let mut all = Self::default();
        for (share, part) in parts.clone() {
            for i in 0..STATES {
                all.mean[i] += share * part.mean[i];
            }
        }
        for (share, part) in parts {
            let away: Vector = std::array::from_fn(|i| part.mean[i] - all.mean[i]);
            for i in 0..STATES {
                for j in 0..STATES {
                    all.covariance[i][j] += share * (part.covariance[i][j] + away[i] * away[j]);
                }
            }
        }
        all
    }

    /// What it was before a motion, given that it was `later` after it (Rauch, Tung and Striebel 1965):
    /// m + C·(m′ − m⁻) and P + C·(P′ − P⁻)·Cᵀ with C = P·Fᵀ·(P⁻)⁻¹, by elimination on what is not known exactly.
    pub fn smoothed(&self, motion: &Motion, later: &Self) -> Self {
        let expected = self.predicted(motion);
        let carried = motion.carried(&self.covariance);
        let gain: Matrix =
            std::array::from_fn(|i| solve(&expected.covariance, std::array::from_fn(|j| carried[j][i])));
        let mut before = *self;
        let news: Vector = std::array::from_fn(|k| later.mean[k] - expected.mean[k]);
        let change: Matrix = std::array::from_fn(|k| {
            std::array::from_fn(|l| later.covariance[k][l] - expected.covariance[k][l])
        });
        for i in 0..STATES {
            before.mean[i] += dot(&gain[i], &news);
            let through: Vector =
                std::array::from_fn(|l| (0..STATES).map(|k| gain[i][k] * change[k][l]).sum());
            for (value, gain) in before.covariance[i].iter_mut().zip(&gain) {
                *value += dot(&through, gain);
            }
        }
        before
    }
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// P⁻¹·b by Gauss's elimination, scaled to a diagonal of ones; 0 for what has no variance, as a known force.
fn solve(p: &Matrix, b: Vector) -> Vector {
    let scale: Vector = std::array::from_fn(|i| p[i][i].max(0.0).sqrt());
    let over = |value: f64, scale: f64| if scale > 0.0 { value / scale } else { 0.0 };
    let mut a: Matrix =
        std::array::from_fn(|i| std::array::from_fn(|j| over(over(p[i][j], scale[i]), scale[j])));
    let mut y: Vector = std::array::from_fn(|i| over(b[i], scale[i]));
    for i in 0..STATES {
        if a[i][i] <= 1e-14 {
            a[i] = [0.0; STATES];
            a.iter_mut().for_each(|row| row[i] = 0.0);
            (a[i][i], y[i]) = (1.0, 0.0);
        }
        let (pivot, right) = (a[i], y[i]);
        for (row, y) in a.iter_mut().zip(&mut y).skip(i + 1) {
            let factor = row[i] / pivot[i];
            row.iter_mut().zip(&pivot).skip(i).for_each(|(value, above)| *value -= factor * above);
            *y -= factor * right;
        }
    }
    for i in (0..STATES).rev() {
        let known: f64 = (i + 1..STATES).map(|c| a[i][c] * y[c]).sum();
        y[i] = (y[i] - known) / a[i][i];
    }
    std::array::from_fn(|i| over(y[i], scale[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const BELIEF: Gaussian = Gaussian {
        mean: [0.2, 0.5, 1.0, 3.0],
        covariance: [
            [4e-6, 1e-6, 1e-5, 1e-4],
            [1e-6, 1e-2, 1e-3, 2e-4],
            [1e-5, 1e-3, 4.0, 1e-3],
            [1e-4, 2e-4, 1e-3, 0.04],
        ],
    };

    #[test]
    fn a_reading_of_the_position_alone_is_the_textbook_s_kalman_filter() {
        let fit =
            ContactFit { misfit: 4.0, pull: [2e3, 0.0], information: [1e6, 0.0, 0.0], calibration_m2: 0.0 };
        // One measurement z of x with variance 1e-6, (z − 0.2)² / 1e-6 = 4: z = 0.202.
        let (after, evidence) = BELIEF.updated(&fit, [0.2, 3.0], 0.0);
        let (innovation, spread) = (2e-3, 5e-6);
        for i in 0..STATES {
            let gain = BELIEF.covariance[i][0] / spread;
            assert!((after.mean[i] - (BELIEF.mean[i] + gain * innovation)).abs() < 1e-12);
        }
        assert!((after.covariance[0][0] - 0.8e-6).abs() < 1e-15);
        let expected = -0.5 * ((spread / 1e-6f64).ln() + innovation * innovation / spread);
        assert!((evidence - expected).abs() < 1e-9, "{evidence} {expected}");
    }

    #[test]
    fn where_a_misfit_is_expanded_does_not_matter_while_it_is_a_parabola() {
        let (information, pull, misfit) = ([1e6, 2e2, 50.0], [7e2, -1.5], 9.0);
        let moved = |delta: [f64; 2]| {
            let [a, b, c] = information;
            let by = [a * delta[0] + b * delta[1], b * delta[0] + c * delta[1]];
            let misfit = misfit - 2.0 * (pull[0] * delta[0] + pull[1] * delta[1])
                + delta[0] * by[0]
                + delta[1] * by[1];
            ContactFit { misfit, pull: [pull[0] - by[0], pull[1] - by[1]], information, calibration_m2: 0.0 }
        };
        let (here, one) = BELIEF.updated(&moved([0.0; 2]), [0.2, 3.0], 1e-4);
        let (there, other) = BELIEF.updated(&moved([1e-3, 0.1]), [0.201, 3.1], 1e-4);
        assert!((one - other).abs() < 1e-9);
        for i in 0..STATES {
            assert!((here.mean[i] - there.mean[i]).abs() < 1e-10);
        }
    }

    #[test]
    fn what_comes_later_and_tells_nothing_new_changes_nothing() {
        for known in [false, true] {
            let mut belief = BELIEF;
            if known {
                (0..STATES).for_each(|i| (belief.covariance[i][W], belief.covariance[W][i]) = (0.0, 0.0));
            }
            let motion = Motion::new(0.01, 0.1, 2.0, if known { 0.0 } else { 1e-4 });
            let back = belief.smoothed(&motion, &belief.predicted(&motion));
            for i in 0..STATES {
                assert!((back.mean[i] - belief.mean[i]).abs() < 1e-12);
                assert!((back.covariance[i][i] - belief.covariance[i][i]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn a_motion_of_two_halves_is_the_whole_motion() {
        // On both sides of where the closed form is replaced by its first terms.
        for duration_s in [0.2, 9e-3] {
            let motion = |share: f64| Motion::new(share * duration_s, 0.1, 2.0, share * 1e-4);
            let halves = BELIEF.predicted(&motion(0.5)).predicted(&motion(0.5));
            let whole = BELIEF.predicted(&motion(1.0));
            for i in 0..STATES {
                let rounded = 1e-9 + if duration_s < 0.1 { 0.05 } else { 0.0 };
                assert!((halves.mean[i] - whole.mean[i]).abs() < 1e-12);
                let off = (halves.covariance[i][i] - whole.covariance[i][i]).abs();
                assert!(
                    off <= rounded * motion(1.0).noise[i][i] + 1e-12 * whole.covariance[i][i],
                    "{i}: {off}"
                );
            }
        }
    }
}
