//! Distribution functions of statistics.

/// The standard normal distribution Φ(z).
pub fn normal_distribution(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// The z with Φ(z) = `share`, for a share between 0 and 1, by bisection to the last bits.
pub fn normal_quantile(share: f64) -> f64 {
    let (mut low, mut high) = (-39.0, 39.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if normal_distribution(middle) < share { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The value below which a χ² variable of `freedom` degrees of freedom lies with probability `share`, within 2 % for
/// shares of 0.5 and more: the cube-root approximation of Wilson and Hilferty (PNAS 17, 1931).
pub fn chi_squared_quantile(share: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    freedom * (1.0 - spread + normal_quantile(share) * spread.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_met() {
        assert!((normal_distribution(1.959_963_984_540_054) - 0.975).abs() < 1e-15);
        assert!((normal_quantile(0.975) - 1.959_963_984_540_054).abs() < 1e-12);
        // Tables of χ²: 95 % and 99.99 %.
        for (share, freedom, value) in
            [(0.95, 1.0, 3.841), (0.95, 8.0, 15.507), (0.9999, 7.0, 29.88), (0.9999, 1.0, 15.137)]
        {
            let found = chi_squared_quantile(share, freedom);
            assert!((found / value - 1.0).abs() < 0.03, "{share} {freedom}: {found}");
        }
    }
}
