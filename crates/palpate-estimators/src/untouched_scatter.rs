//! Scatter of an untouched surface between rests: residue, drift and noise.
//!
//! A rest is a run of untouched rows. About a line in time the rests have the variance s² in each channel,
//! and a reading less a baseline has 2·s².
//!
//! Symbols: d reading less the untouched reading, n channels, ν degrees of freedom, R correlation matrix.
//!
//! T = Σ d²/(2·s²) is Σ λ·χ²₁ with the eigenvalues λ of R. With c₁ = n, c₂ = tr R², c₃ = tr R³ it is about n
//! − g·b + g·χ²_b, g = c₃/c₂, b = c₂³/c₃², of equal first three moments (Imhof, *Biometrika* 48, 1961). For
//! the estimated s² the critical value c of χ²_b becomes that of b·F, about ν·(e^(c/(ν + b/2 − 1)) − 1)
//! (Bartlett, *Journal of the Royal Statistical Society B* 9, 1947). Few rests make the test conservative.
//! Heavy tails raise the value to that of Student's t (`tails.rs`).

mod tails;

use crate::locator_fault::LocatorFault;
use crate::recording::{Recording, Row};
use crate::status::{FalseAlarmRate, SIGNIFICANCE};
use palpate_mechanics::sensing::Layout;
use palpate_numerics::{chi_squared_critical_value, mean, median, normal_quantile};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use tails::HeavyTails;

/// Scatter between rests; see [the module](self).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UntouchedScatter {
    /// Untouched reading of each channel.
    pub centre: Vec<f64>,
    /// Standard deviation of each channel; 0 for a constant or disabled one.
    pub sd: Vec<f64>,
    /// Critical value of Σ d²/sd² at the false-alarm rate.
    pub bound: f64,
}

/// Fewer leave hardly any degrees of freedom.
pub(crate) const FEWEST_RESTS: usize = 5;

/// Deviations of untouched rows from their slow course, or of repeats from their means.
pub(crate) struct Deviations {
    rows: Vec<(Vec<f64>, f64)>,
    /// ν.
    degrees_of_freedom: f64,
    /// Repeats that scatter no more than the rests.
    noise: Option<Box<Self>>,
}

impl Deviations {
    const OF_LINE: usize = 2;

    pub fn of_rests(recording: &Recording) -> Option<Self> {
        let rests = Self::new(recording, &recording.untouched_groups())?;
        let noise = Self::of_repeats(&recording.touched()).filter(|noise| rests.scatter_as_much_as(noise));
        Some(Self { noise: noise.map(Box::new), ..rests })
    }

    /// Single rows, without the residue of touches.
    pub fn of_single_rows(recording: &Recording) -> Option<Self> {
        let rows: Vec<Vec<usize>> =
            recording.untouched_groups().into_iter().flatten().map(|row| vec![row]).collect();
        Self::new(recording, &rows)
    }

    /// Repeats and untouched rows about their means.
    pub fn of_repeats(recording: &Recording) -> Option<Self> {
        let rows = &recording.rows;
        let key = |row: &usize| {
            let Row { position, force_n, .. } = &rows[*row];
            let touched = rows[*row].touches().then_some((position.x_m, position.y_m, *force_n));
            touched.map(|(x_m, y_m, force_n)| [x_m, y_m, force_n.unwrap_or(f64::NAN)].map(f64::to_bits))
        };
        let mut ordered: Vec<usize> = (0..rows.len()).collect();
        ordered.sort_by_key(key);
        let groups: Vec<&[usize]> = ordered.chunk_by(|a, b| key(a) == key(b)).collect();
        let freedom = rows.len() - groups.len();
        if freedom < FEWEST_RESTS {
            return None;
        }
        let deviations = groups.into_iter().flat_map(|group| {
            let mean = recording.mean_reading(group);
            // Each row is part of the mean, so rows deviate less from the mean than from the truth.
            let share = 1.0 - 1.0 / group.len() as f64;
            let off = move |row: &usize| -> Vec<f64> {
                let values = rows[*row].reading.iter().zip(&mean);
                values.map(|(value, mean)| (value - mean) / share.sqrt()).collect()
            };
            group.iter().filter(move |_| share > 0.0).map(move |row| (off(row), share))
        });
        Some(Self { rows: deviations.collect(), degrees_of_freedom: freedom as f64, noise: None })
    }

    fn new(recording: &Recording, rests: &[Vec<usize>]) -> Option<Self> {
        let times_s = recording.times_or_order();
        if rests.len() < FEWEST_RESTS {
            return None;
        }
        let time_of = |rest: &Vec<usize>| mean(rest.iter().map(|row| times_s[*row]));
        let rest_times_s: Vec<f64> = rests.iter().map(time_of).collect();
        let levels: Vec<Vec<f64>> = rests.iter().map(|rest| recording.mean_reading(rest)).collect();
        let of_channel = |c: usize| levels.iter().map(|level| level[c]).collect::<Vec<f64>>();
        let lines: Vec<[f64; 2]> =
            (0..recording.channels.len()).map(|c| line(&rest_times_s, &of_channel(c))).collect();
        let deviations = rests.iter().flat_map(|rest| rest.iter().map(|row| (*row, 1.0 / rest.len() as f64)));
        let deviations = deviations.map(|(row, share)| {
            let values = recording.rows[row].reading.iter().zip(&lines);
            (values.map(|(value, [level, slope])| value - level - slope * times_s[row]).collect(), share)
        });
        Some(Self {
            rows: deviations.collect(),
            degrees_of_freedom: (rests.len() - Self::OF_LINE) as f64,
            noise: None,
        })
    }

    /// True for normal noise at the 5 % level.
    pub fn are_noise(&self, noise_sd: &[Option<f64>]) -> bool {
        let channels: Vec<(usize, f64)> =
            noise_sd.iter().enumerate().filter_map(|(channel, sd)| Some((channel, (*sd)?))).collect();
        let square =
            |row: &[f64]| -> f64 { channels.iter().map(|(channel, sd)| (row[*channel] / sd).powi(2)).sum() };
        let sum: f64 = self.rows.iter().map(|(row, share)| share * square(row)).sum();
        let of_all = channels.len() as f64 * self.degrees_of_freedom;
        sum <= of_all + normal_quantile(1.0 - SIGNIFICANCE) * (2.0 * of_all).sqrt()
            && self.heavy_tails(&channels.iter().map(|(channel, _)| *channel).collect::<Vec<_>>()).is_none()
    }

    /// Compares median absolute deviations at the 5 % level; for n normal values of quartile q they have the
    /// relative variance 1/(16·q²·φ(q)²·n) (Serfling, *Approximation Theorems of Mathematical Statistics*,
    /// 1980).
    fn scatter_as_much_as(&self, repeats: &Self) -> bool {
        let quartile = normal_quantile(0.75);
        let density = (-0.5 * quartile * quartile).exp() / TAU.sqrt();
        let relative_variance = (4.0 * quartile * density).powi(-2);
        let spread = |of: &Self, c: usize| median(of.rows.iter().map(|(row, _)| row[c].abs()).collect());
        let channels = self.rows.first().map_or(0, |(row, _)| row.len());
        let ratios: Vec<f64> = (0..channels)
            .filter_map(|c| Some(spread(repeats, c)? / spread(self, c)?))
            .filter(|ratio| ratio.is_finite())
            .collect();
        let variance = relative_variance
            * (self.degrees_of_freedom.recip() + repeats.degrees_of_freedom.recip())
            / ratios.len() as f64;
        mean(ratios) <= 1.0 + normal_quantile(1.0 - SIGNIFICANCE) * variance.sqrt()
    }

    fn heavy_tails(&self, channels: &[usize]) -> Option<(HeavyTails, f64)> {
        let noise = self.noise.as_deref().unwrap_or(self);
        let standardized: Vec<(f64, f64)> = channels
            .iter()
            .map(|c| (*c, noise.product(*c, *c).sqrt()))
            .filter(|(_, sd)| *sd > 0.0)
            .flat_map(|(c, sd)| noise.rows.iter().map(move |(row, share)| (row[c] / sd, *share)))
            .collect();
        let shares = channels.iter().map(|c| noise.product(*c, *c) / self.product(*c, *c));
        let share = shares.filter(|share| share.is_finite()).fold(0.0, f64::max);
        Some((HeavyTails::of_deviations(&standardized)?, share))
    }

    fn product(&self, a: usize, b: usize) -> f64 {
        self.rows.iter().map(|(row, share)| share * row[a] * row[b]).sum::<f64>() / self.degrees_of_freedom
    }

    pub fn scatter(&self, centre: Vec<f64>, layout: &Layout, rate: FalseAlarmRate) -> UntouchedScatter {
        let is_live = |c: usize| !layout.sensors()[c].channel.disabled;
        let variances: Vec<f64> =
            (0..layout.len()).map(|c| if is_live(c) { self.product(c, c) } else { 0.0 }).collect();
        let changing: Vec<usize> = (0..layout.len()).filter(|c| variances[*c] > 0.0).collect();
        let correlation = |a: usize, b: usize| self.product(a, b) / (variances[a] * variances[b]).sqrt();
        let correlations: Vec<Vec<f64>> =
            changing.iter().map(|a| changing.iter().map(|b| correlation(*a, *b)).collect()).collect();
        let of_normal = critical_value(&correlations, self.degrees_of_freedom, rate);
        let bound = self.heavy_tails(&changing).map_or(of_normal, |(tails, share)| {
            of_normal.max(tails.bound(changing.len(), share, rate.share()))
        });
        let sd = variances.iter().map(|variance| (2.0 * variance).sqrt()).collect();
        UntouchedScatter { centre, sd, bound }
    }
}

fn critical_value(correlations: &[Vec<f64>], freedom: f64, rate: FalseAlarmRate) -> f64 {
    let n = correlations.len();
    if n == 0 {
        return 0.0;
    }
    let squared =
        |a: usize, b: usize| -> f64 { (0..n).map(|k| correlations[a][k] * correlations[k][b]).sum() };
    let second: f64 = (0..n).map(|a| squared(a, a)).sum();
    let pairs = (0..n).flat_map(|a| (0..n).map(move |b| (a, b)));
    let third: f64 = pairs.map(|(a, b)| squared(a, b) * correlations[b][a]).sum();
    let scale = third / second;
    // At least 1, except for rounding where all channels are fully correlated.
    let effective = (second.powi(3) / third.powi(2)).max(1.0);
    // Critical values are nearly linear in the degrees of freedom.
    let below = effective.floor();
    let of_whole = |whole: f64| chi_squared_critical_value(rate.share(), whole as usize);
    let critical = of_whole(below) + (effective - below) * (of_whole(below + 1.0) - of_whole(below));
    let exponent = critical / (freedom + 0.5 * effective - 1.0);
    n as f64 - scale * effective + scale * freedom * (exponent.exp() - 1.0)
}

fn line(times_s: &[f64], values: &[f64]) -> [f64; 2] {
    let (time_s, value) = (mean(times_s.iter().copied()), mean(values.iter().copied()));
    let products = times_s.iter().zip(values).map(|(t, y)| (t - time_s) * (y - value));
    let squares: f64 = times_s.iter().map(|t| (t - time_s).powi(2)).sum();
    let slope = if squares > 0.0 { products.sum::<f64>() / squares } else { 0.0 };
    [value - slope * time_s, slope]
}

impl UntouchedScatter {
    /// Disables a channel; the bound stays.
    pub fn disable(&mut self, channel: usize) {
        if let Some(sd) = self.sd.get_mut(channel) {
            *sd = 0.0;
        }
    }

    /// True for an untouched reading at the false-alarm rate.
    pub fn contains(&self, reading: &[f64]) -> bool {
        let channels = reading.iter().zip(&self.centre).zip(&self.sd).filter(|(_, sd)| **sd > 0.0);
        channels.map(|((value, centre), sd)| ((value - centre) / sd).powi(2)).sum::<f64>() <= self.bound
    }

    /// Checks values from a file.
    ///
    /// # Errors
    /// [`LocatorFault`].
    pub fn check(&self, channels: usize) -> Result<(), LocatorFault> {
        LocatorFault::check_count("untouched channels", channels, self.centre.len())?;
        LocatorFault::check_count("scatters of untouched channels", channels, self.sd.len())?;
        LocatorFault::check_numbers("untouched reading", &self.centre, |_| true, "a finite number")?;
        LocatorFault::check_numbers("untouched scatter", &self.sd, |sd| sd >= 0.0, "finite and at least 0")?;
        let bound = [self.bound];
        LocatorFault::check_numbers("untouched bound", bound, |bound| bound >= 0.0, "finite and at least 0")
    }
}

#[cfg(test)]
mod tests;
