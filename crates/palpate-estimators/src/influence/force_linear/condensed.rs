//! Condensed presses: few presses with the likelihood of many.
//!
//! Presses at one position, with responses φ_i and weights w_i (rows over variance), enter by the sums of w,
//! w·φ, w·φ², w·y and w·φ·y alone. Two presses at φ̄ ± sd(φ) on the least-squares line have equal sums.
//!
//! With many positions, neighbours share a cell, and an estimate ô, f̂ corrects for the change within it. One
//! press remains at x̄, the mean position by w·φ², and the root mean square φ_r:
//!
//! y = ô + φ_r·(f̂(x̄) + Σ w·φ·(y − ô − φ·f̂(x)) / Σ w·φ²).
//!
//! A press without force, of weight Σ w·(1 − φ̄²/φ_r²), reads ô.

use super::drift::END;
use super::evidence::{ChannelFit, Evidence};
use super::posterior::of_equal_ratio;
use super::prior::Prior;
use crate::influence::calibration::CalibrationRows;
use crate::influence::measured::MeasuredError;
use ndarray::{Array1, Array2, Axis as Dimension};
use palpate_numerics::NotPositiveDefinite;
use palpate_numerics::watch::{Cancelled, Watch};
use std::sync::Arc;

impl CalibrationRows {
    /// Condenses to about `most` presses, for a separable prior without drift.
    pub(super) fn condensed(
        &self,
        prior: &Prior,
        fits: &[ChannelFit],
        most: usize,
        watch: Watch,
    ) -> Result<Self, MeasuredError> {
        const ROUNDS: usize = 2;
        let all = All { presses: self, responses: prior.responses(self), prior };
        let (untouched, touched): (Vec<usize>, Vec<usize>) =
            (0..self.len()).partition(|i| self.force_n[*i] == 0.0);
        let untouched = (!untouched.is_empty()).then_some(untouched);
        let pairs = self.cells(&touched, most / 2, &prior.lengths_m);
        let mut few = self.select(&[]);
        pairs.iter().chain(&untouched).for_each(|cell| few.add_pair(&all, cell, None));
        if pairs.iter().all(|cell| all.is_one_place(cell)) {
            return Ok(few);
        }
        let cells = self.cells(&touched, most, &prior.lengths_m);
        for _ in 0..ROUNDS {
            let estimate = Estimate::new(few, prior, fits)?;
            few = self.select(&[]);
            let mut of_offset = 0.0;
            for cell in &cells {
                watch.round()?;
                of_offset += few.add_cell(&all, cell, &estimate);
            }
            if of_offset > 0.0 {
                few.push((vec![0.0; prior.lengths_m.len()], END), 0.0, of_offset, &estimate.offsets);
            }
            untouched.iter().for_each(|cell| few.add_pair(&all, cell, None));
        }
        Ok(few)
    }

    /// Condenses neighbours in time to about `most` presses, corrected to a common position by `estimate`.
    pub(super) fn condensed_in_time(
        &self,
        prior: &Prior,
        estimate: &Estimate,
        most: usize,
        watch: Watch,
    ) -> Result<Self, Cancelled> {
        let all = All { presses: self, responses: prior.responses(self), prior };
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by(|a, b| self.time[*a].total_cmp(&self.time[*b]));
        let mut few = self.select(&[]);
        for cell in order.chunks((2 * self.len()).div_ceil(most)) {
            watch.round()?;
            few.add_pair(&all, cell, Some(estimate));
        }
        Ok(few)
    }

    fn push(&mut self, (position_m, time): (Vec<f64>, f64), force_n: f64, count: f64, reading: &Array1<f64>) {
        self.positions_m.push(position_m);
        self.force_n.push(force_n);
        self.count.push(count);
        self.time.push(time);
        self.row.push(0);
        self.means.push_row(reading.view()).expect("as many channels as all presses have");
    }

    /// Adds two presses on a cell's least-squares line, or one for a single force.
    fn add_pair(&mut self, all: &All, cell: &[usize], estimate: Option<&Estimate>) {
        let sums = Sums::new(all, cell);
        let spread = sums.spread();
        let readings = all.readings(cell, &sums, estimate);
        let mean_of = |c: usize| all.mean(cell, |k, _| readings[[k, c]]);
        let slope_of = |c: usize| {
            let product = |k: usize, i: usize| (all.responses[i] - sums.response) * readings[[k, c]];
            if spread > 0.0 { all.mean(cell, product) / (spread * spread) } else { 0.0 }
        };
        let channels = 0..self.means.ncols();
        let means: Array1<f64> = channels.clone().map(mean_of).collect();
        let slopes: Array1<f64> = channels.clone().map(slope_of).collect();
        let ends: &[f64] = if spread > 0.0 { &[-1.0, 1.0] } else { &[0.0] };
        for end in ends {
            let force_n = all.prior.force_of_relative_response(sums.response + end * spread);
            let reading = &means + end * spread * &slopes;
            self.push(
                (sums.position_m.clone(), sums.time),
                force_n,
                all.count_of(sums.weight / ends.len() as f64, force_n, &sums.position_m),
                &reading,
            );
        }
        if all.is_one_place(cell) {
            let squares: Array1<f64> = channels
                .map(|c| {
                    let left = |k: usize, i: usize| {
                        readings[[k, c]] - means[c] - slopes[c] * (all.responses[i] - sums.response)
                    };
                    sums.weight * all.mean(cell, |k, i| left(k, i).powi(2))
                })
                .collect();
            let force_n = all.prior.force_of_relative_response(sums.mean_square.sqrt());
            let squares = squares * all.prior.relative_noise(force_n, &sums.position_m);
            let repeated = Arc::make_mut(&mut self.repeats);
            repeated.force_n.push(force_n);
            repeated.degrees_of_freedom.push((cell.len() - ends.len()) as f64);
            repeated.positions_m.push(sums.position_m.clone());
            repeated.squares.push_row(squares.view()).expect("as many channels as all presses have");
        }
    }

    /// Adds the press of a cell; returns the weight of the press without force.
    fn add_cell(&mut self, all: &All, cell: &[usize], estimate: &Estimate) -> f64 {
        let sums = Sums::new(all, cell);
        let response = sums.mean_square.sqrt();
        let influences = estimate.influences_at(all, cell);
        let at_middle = estimate.influences(all.prior, &sums.position_m);
        let reading = (0..at_middle.len())
            .map(|c| {
                let offset = estimate.offsets[c];
                let left = |i: usize, influence: f64| {
                    all.presses.means[[i, c]] - offset - all.responses[i] * influence
                };
                let products = cell
                    .iter()
                    .enumerate()
                    .map(|(k, i)| all.weight(*i) * all.responses[*i] * left(*i, influences[[k, c]]));
                let rest = products.sum::<f64>() / (sums.weight * sums.mean_square);
                offset + response * (at_middle[c] + rest)
            })
            .collect();
        let force_n = all.prior.force_of_relative_response(response);
        self.push(
            (sums.position_m.clone(), sums.time),
            force_n,
            all.count_of(sums.weight, force_n, &sums.position_m),
            &reading,
        );
        sums.weight * sums.spread().powi(2) / sums.mean_square
    }
}

struct All<'a> {
    presses: &'a CalibrationRows,
    responses: Vec<f64>,
    prior: &'a Prior,
}

impl All<'_> {
    /// Weighted mean of `value(k, i)`, with k the index in the cell.
    fn mean(&self, cell: &[usize], value: impl Fn(usize, usize) -> f64) -> f64 {
        let (sum, weight) = cell.iter().enumerate().fold((0.0, 0.0), |(sum, weight), (k, i)| {
            let own = self.weight(*i);
            (sum + own * value(k, *i), weight + own)
        });
        sum / weight
    }

    fn readings(&self, cell: &[usize], sums: &Sums, estimate: Option<&Estimate>) -> Array2<f64> {
        let mut readings = self.presses.means.select(Dimension(0), cell);
        if let Some(estimate) = estimate
            && !self.is_one_place(cell)
        {
            let changes =
                estimate.influences_at(self, cell) - estimate.influences(self.prior, &sums.position_m);
            for ((mut reading, change), i) in readings.outer_iter_mut().zip(changes.outer_iter()).zip(cell) {
                reading.scaled_add(-self.responses[*i], &change);
            }
        }
        readings
    }

    /// Number of rows over the relative noise variance.
    fn weight(&self, i: usize) -> f64 {
        self.presses.count[i] / self.prior.relative_noise_of(self.presses, i)
    }

    fn count_of(&self, weight: f64, force_n: f64, place_m: &[f64]) -> f64 {
        weight * self.prior.relative_noise(force_n, place_m)
    }

    fn is_one_place(&self, cell: &[usize]) -> bool {
        cell.iter().all(|i| self.presses.positions_m[*i] == self.presses.positions_m[cell[0]])
    }
}

struct Sums {
    position_m: Vec<f64>,
    weight: f64,
    time: f64,
    /// Means of φ/F̄ and its square.
    response: f64,
    mean_square: f64,
}

impl Sums {
    fn new(all: &All, cell: &[usize]) -> Self {
        let mean_square = all.mean(cell, |_, i| all.responses[i].powi(2));
        let first_m = &all.presses.positions_m[cell[0]];
        let coordinate = |k: usize| match mean_square {
            0.0 => first_m[k],
            _ => {
                let product = |_, i: usize| all.responses[i].powi(2) * all.presses.positions_m[i][k];
                all.mean(cell, product) / mean_square
            }
        };
        Self {
            position_m: if all.is_one_place(cell) {
                first_m.clone()
            } else {
                (0..first_m.len()).map(coordinate).collect()
            },
            weight: cell.iter().map(|i| all.weight(*i)).sum(),
            time: all.mean(cell, |_, i| all.presses.time[i]),
            response: all.mean(cell, |_, i| all.responses[i]),
            mean_square,
        }
    }

    /// Standard deviation of φ/F̄.
    fn spread(&self) -> f64 {
        const ROUNDING: f64 = 1e-12;
        let variance = self.mean_square - self.response * self.response;
        if variance > ROUNDING * self.mean_square { variance.sqrt() } else { 0.0 }
    }
}

pub(super) struct Estimate {
    presses: CalibrationRows,
    responses: Vec<f64>,
    offsets: Array1<f64>,
    /// Polynomial coefficients, and A⁻¹·(y − H·β), one column per channel.
    polynomials: Array2<f64>,
    weights: Array2<f64>,
}

impl Estimate {
    pub fn new(
        presses: CalibrationRows,
        prior: &Prior,
        fits: &[ChannelFit],
    ) -> Result<Self, NotPositiveDefinite> {
        let mut coefficients = Array2::zeros((1 + prior.polynomials(), fits.len()));
        let mut weights = Array2::zeros((presses.len(), fits.len()));
        let evidence = Evidence::new(&presses, prior, &[]);
        for channels in of_equal_ratio(fits) {
            let restricted = evidence.restricted(fits[channels[0]].ratio)?;
            let means = presses.means.select(Dimension(1), &channels);
            let (white, own) = restricted.residuals(means);
            let solved = restricted.cholesky.solve_upper_matrix(white);
            for (k, c) in channels.into_iter().enumerate() {
                coefficients.column_mut(c).assign(&own.column(k));
                weights.column_mut(c).assign(&solved.column(k));
            }
        }
        let (offsets, polynomials) = coefficients.view().split_at(Dimension(0), 1);
        Ok(Self {
            responses: prior.responses(&presses),
            offsets: offsets.row(0).to_owned(),
            polynomials: polynomials.to_owned(),
            weights,
            presses,
        })
    }

    /// f̂ at a position.
    fn influences(&self, prior: &Prior, place_m: &[f64]) -> Array1<f64> {
        let covariance = prior.influence_covariance(&self.presses, &self.responses, place_m);
        covariance.dot(&self.weights) + Array1::from(prior.polynomials_at(place_m)).dot(&self.polynomials)
    }

    /// f̂ at each press of a cell.
    fn influences_at(&self, all: &All, cell: &[usize]) -> Array2<f64> {
        let mut influences = Array2::zeros((cell.len(), self.offsets.len()));
        for (k, i) in cell.iter().enumerate() {
            let own_m = &all.presses.positions_m[*i];
            let row = match k.checked_sub(1).filter(|before| all.presses.positions_m[cell[*before]] == *own_m)
            {
                Some(before) => influences.row(before).to_owned(),
                None => self.influences(all.prior, own_m),
            };
            influences.row_mut(k).assign(&row);
        }
        influences
    }
}
