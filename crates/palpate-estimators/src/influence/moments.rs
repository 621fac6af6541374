//! Mean and covariance of a weighted distribution of contacts.

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Moments {
    pub weight: f64,
    /// x, y and W.
    first: [f64; 3],
    /// xx, xy, xf, yy, yf, ff.
    second: [f64; 6],
}

impl Moments {
    pub fn add(&mut self, weight: f64, contact: [f64; 3]) {
        self.weight += weight;
        self.first.iter_mut().zip(contact).for_each(|(sum, value)| *sum += weight * value);
        self.second.iter_mut().zip(products(contact)).for_each(|(sum, value)| *sum += weight * value);
    }

    pub fn add_force_variance(&mut self, weight: f64, variance_n2: f64) {
        self.second[5] += weight * variance_n2;
    }

    /// Mean of x, y, W and covariance xx, xy, xf, yy, yf, ff; NaN for an empty sum.
    pub fn mean_and_covariance(&self) -> ([f64; 3], [f64; 6]) {
        let mean = self.first.map(|sum| sum / self.weight);
        let squares = products(mean);
        let mut covariance = std::array::from_fn(|k| self.second[k] / self.weight - squares[k]);
        for variance in [0, 3, 5] {
            covariance[variance] = f64::max(covariance[variance], 0.0);
        }
        (mean, covariance)
    }
}

fn products([x, y, f]: [f64; 3]) -> [f64; 6] {
    [x * x, x * y, x * f, y * y, y * f, f * f]
}
