//! The moment balance of two supports that weigh: a = l·R_right / (R_left + R_right), W = R_left + R_right.

/// The readings of the scales under both supports, in newtons, and their noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Balance {
    pub(super) length_m: f64,
    pub(super) left_n: f64,
    pub(super) right_n: f64,
    /// Variances of left and right in N².
    pub(super) variances: [f64; 2],
}

/// A contact that balances the reactions; its position may lie beyond the supports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Balanced {
    pub(super) position_m: f64,
    pub(super) force_n: f64,
    /// Covariance of position and force: xx, xf, ff.
    pub(super) covariance: [f64; 3],
}

impl Balance {
    /// Position and force, and to first order ∂a/∂R_left = −a/W, ∂a/∂R_right = (l − a)/W, ∂W/∂R = 1.
    pub(super) fn unknown_force(&self) -> Balanced {
        let force_n = self.left_n + self.right_n;
        let position_m = self.length_m * self.right_n / force_n;
        let slopes = [-position_m / force_n, (self.length_m - position_m) / force_n];
        let [left, right] = self.variances;
        let covariance = [
            slopes[0] * slopes[0] * left + slopes[1] * slopes[1] * right,
            slopes[0] * left + slopes[1] * right,
            left + right,
        ];
        Balanced { position_m, force_n, covariance }
    }

    /// The position by weighted least squares of R_left = W·(1 − a/l) and R_right = W·a/l, for a known force W.
    pub(super) fn known_force(&self, force_n: f64) -> Balanced {
        let [left, right] = self.variances.map(|variance| if variance > 0.0 { 1.0 / variance } else { 1.0 });
        let share = (right * self.right_n + left * (force_n - self.left_n)) / ((left + right) * force_n);
        let [var_left, var_right] = self.variances;
        let noise = (right * right * var_right + left * left * var_left) / ((left + right) * force_n).powi(2);
        let position_m = self.length_m * share;
        Balanced { position_m, force_n, covariance: [self.length_m.powi(2) * noise, 0.0, 0.0] }
    }
}
