//! Estimate of one contact from the local minima of χ².

use super::coarse::{COARSE, MOST_MINIMA, Profile};
use super::gauss_newton::Minimum;
use super::search::Search;
use crate::confidence_region::{
    BEYOND_A_BARRIER, CALIBRATED, ConfidenceRegion, Contacts, Force, is_near_end,
};
use crate::influence::config::ForceBelief;
use crate::status::OTHER_PLACE;
use palpate_core::{ContactEstimate, Estimate, Mode, Status, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_numerics::{bisect, normal_cdf, normal_interval_95};

/// Standard deviation, in node spacings, above which a minimum is not a parabola.
const MOST_SPACINGS: f64 = 1.5;

/// Policy: a normal distribution stands for places whose χ² rises half as much as its parabola. The interval is
/// then too short by at most √2 on that side.
const LEAST_RISE: f64 = 0.5;
/// Squared distance, in standard deviations, of the ends of the interval: χ² at nodes within does not decide.
const INNER_SQUARE: f64 = 4.0;

#[derive(Clone, Copy)]
pub(super) struct WhitenedReading<'a> {
    pub whitened: &'a [[f64; 8]],
    pub square: f64,
}

#[inline(always)]
pub(super) fn conclude(
    search: &Search,
    reading: WhitenedReading,
    minima: &[Minimum],
    profile: &Profile,
    estimate: &mut Estimate,
) {
    let best = &minima[0];
    estimate.modes.clear();
    estimate.further.clear();
    if search.rule.is_no_contact(reading.square, best.misfit) {
        estimate.contact =
            ContactEstimate { position: Position::along(best.x_m), ..ContactEstimate::default() };
        estimate.status = Status::NoContact;
        return;
    }
    let elsewhere = better_minima(search, reading, best, profile);
    let minima = elsewhere.as_ref().map_or(minima, |(found, count)| &found[..*count]);
    let best = &minima[0];
    let sd_m = best.covariance[0].sqrt();
    let narrow = sd_m <= MOST_SPACINGS * search.gauss_newton.spacing.h_m && best.misfit.is_finite();
    if minima.len() == 1 && narrow && is_clear(search, best, profile) {
        estimate.contact = contact(search, best, normal_interval_95(best.x_m, sd_m));
        estimate.status = Status::Located;
        if !search.is_explained(reading.whitened, best) {
            estimate.status = Status::OutsideModel;
        }
    } else {
        write_uncertain(search, reading, minima, profile, estimate);
    }
}

/// Minima that explain a reading which the search from the valleys of χ² does not.
#[inline(always)]
fn better_minima(
    search: &Search,
    reading: WhitenedReading,
    best: &Minimum,
    profile: &Profile,
) -> Option<([Minimum; MOST_MINIMA], usize)> {
    if best.covariance[0].is_finite() && search.rule.is_explained(best.misfit) {
        return None;
    }
    let (found, count) = search.minima_from_everywhere(reading.whitened, profile);
    let is_better = found[0].misfit < best.misfit && search.rule.is_explained(found[0].misfit);
    is_better.then_some((found, count))
}

/// True of a minimum with a normal distribution about it.
#[inline(always)]
fn is_clear(search: &Search, best: &Minimum, profile: &Profile) -> bool {
    let (sd_m, length_m) = (best.covariance[0].sqrt(), search.table.length_m);
    match search.force {
        ForceBelief::Unknown => {
            !is_near_end(best.x_m, sd_m, length_m)
                && !is_too_hard(search, best)
                && is_parabola(search, best, profile)
        }
        _ => 4.0 * sd_m < best.x_m && 4.0 * sd_m < length_m - best.x_m,
    }
}

/// True where χ² rises at least [`LEAST_RISE`] times as much as a parabola, up to a barrier.
///
/// Beside the outermost strain gauge it does not: place and force are confounded on one side alone.
#[inline(always)]
fn is_parabola(search: &Search, minimum: &Minimum, profile: &Profile) -> bool {
    let inverse_sd = minimum.covariance[0].sqrt().recip();
    let (step, at) = (search.coarse.h_m * inverse_sd, minimum.x_m * inverse_sd);
    profile.misfits().iter().enumerate().fold(true, |all, (node, misfit)| {
        let square = (node as f64 * step - at).powi(2);
        let rise = (LEAST_RISE * square).min(BEYOND_A_BARRIER);
        all & (square < INNER_SQUARE || *misfit >= minimum.misfit + rise)
    })
}

/// True within four standard deviations of the greatest force.
#[inline(always)]
fn is_too_hard(search: &Search, minimum: &Minimum) -> bool {
    let left_n = search.greatest_force_n - minimum.force_n;
    search.force == ForceBelief::Unknown && !(left_n > 0.0 && left_n * left_n > 16.0 * minimum.covariance[2])
}

#[cold]
fn write_uncertain(
    search: &Search,
    reading: WhitenedReading,
    minima: &[Minimum],
    profile: &Profile,
    estimate: &mut Estimate,
) {
    let length_m = search.table.length_m;
    let is_near = |minimum: &Minimum| is_near_end(minimum.x_m, minimum.covariance[0].sqrt(), length_m);
    let is_roughly_known = matches!(search.force, ForceBelief::Normal { .. });
    let is_bounded = |minimum: &Minimum| is_near(minimum) || is_too_hard(search, minimum);
    let is_one_sided = minima.len() == 1 && !is_parabola(search, &minima[0], profile);
    let trades_off = !is_roughly_known && (minima.iter().any(is_bounded) || is_one_sided);
    let misfit = match trades_off.then(|| confidence_region(search, reading.whitened, minima)).flatten() {
        Some(found) => {
            found.write(estimate);
            found.misfit
        }
        None => {
            write_competing(search, minima, profile.misfits(), estimate);
            minima[0].misfit
        }
    };
    let is_point = minima.iter().any(|minimum| !search.is_spread(reading.whitened, minimum));
    if !search.rule.is_explained(misfit) || !is_point {
        estimate.status = Status::OutsideModel;
    }
}

fn confidence_region(search: &Search, whitened: &[[f64; 8]], minima: &[Minimum]) -> Option<ConfidenceRegion> {
    let (table, gauss_newton) = (&search.table, &search.gauss_newton);
    let channels = |x_m: f64, force_n: f64, channels: &mut Vec<[f64; 2]>| {
        let cell = table.cell(x_m);
        let weights = gauss_newton.weights_at(&cell, force_n);
        channels.clear();
        let mut spread = 0.0;
        table.for_each(cell, |s, f, _| {
            let weight = weights(s);
            let root = weight.sqrt();
            spread -= weight.ln();
            channels.push([root * whitened.as_flattened()[s], root * f]);
        });
        spread
    };
    let reference_force_n = search.gauss_newton.reference_force_n();
    let contacts = Contacts {
        length_m: table.length_m,
        force: match search.force {
            ForceBelief::Known(force_n) => Force::Known(force_n),
            _ => Force::AtMost(search.greatest_force_n),
        },
        widening: CALIBRATED,
        reference_force_n,
        extrapolates: false,
        channels: &channels,
    };
    let minima_m: Vec<f64> = minima.iter().map(|minimum| minimum.x_m).collect();
    contacts.confidence_region(&minima_m)
}

fn write_competing(search: &Search, minima: &[Minimum], misfits: &[f64; COARSE], estimate: &mut Estimate) {
    let shares = shares(search, minima);
    let x_95_m = interval(search, minima, &shares, misfits);
    let mut ranks: [usize; MOST_MINIMA] = std::array::from_fn(|i| i);
    let ranks = &mut ranks[..minima.len()];
    ranks.sort_by(|a, b| shares[*b].total_cmp(&shares[*a]));
    estimate.contact = contact(search, &minima[ranks[0]], x_95_m);
    estimate.status = Status::Located;
    for i in ranks[1..].iter().copied().filter(|i| shares[*i] >= OTHER_PLACE) {
        let alone = single_interval(&minima[i], search.table.length_m);
        let mode = Mode { contact: contact(search, &minima[i], alone), probability: shares[i] };
        estimate.modes.push(mode);
        estimate.status = Status::Ambiguous;
    }
}

#[inline(always)]
fn contact(search: &Search, minimum: &Minimum, x_95_m: (f64, f64)) -> ContactEstimate {
    let [xx, xf, ff] = minimum.covariance;
    // Variance of a uniform distribution over the line.
    let most = search.table.length_m.powi(2) / 12.0;
    let uncertainty = Uncertainty::on_line([xx.min(most), xf, ff], x_95_m);
    ContactEstimate {
        position: Position::along(minimum.x_m),
        force_n: Some(minimum.force_n),
        uncertainty: Some(uncertainty),
    }
}

/// Probabilities by Laplace's approximation within the ends.
fn shares(search: &Search, minima: &[Minimum]) -> [f64; MOST_MINIMA] {
    let mut shares = [0.0; MOST_MINIMA];
    if minima.len() == 1 {
        shares[0] = 1.0;
        return shares;
    }
    let length_m = search.table.length_m;
    let cost = |minimum: &Minimum| minimum.misfit + search.log_determinant(minimum.x_m, minimum.force_n);
    let best = minima.iter().map(cost).fold(f64::INFINITY, f64::min);
    for (share, minimum) in shares.iter_mut().zip(minima) {
        let sd_m = minimum.covariance[0].sqrt().min(length_m);
        *share = (0.5 * (best - cost(minimum))).exp() * sd_m * mass(minimum.x_m, sd_m, length_m);
    }
    let sum: f64 = shares.iter().sum();
    shares.map(|share| share / sum)
}

fn mass(mean_m: f64, sd_m: f64, length_m: f64) -> f64 {
    normal_cdf((length_m - mean_m) / sd_m) - normal_cdf(-mean_m / sd_m)
}

fn interval(search: &Search, minima: &[Minimum], shares: &[f64], misfits: &[f64; COARSE]) -> (f64, f64) {
    let length_m = search.table.length_m;
    let wide =
        |minimum: &Minimum| minimum.covariance[0].sqrt() > MOST_SPACINGS * search.gauss_newton.spacing.h_m;
    if minima.iter().any(wide) || !minima[0].misfit.is_finite() {
        return interval_of_profile(misfits, length_m);
    }
    if minima.len() == 1 {
        return single_interval(&minima[0], length_m);
    }
    let cumulative = |x_m: f64| {
        let parts = minima.iter().zip(shares).map(|(minimum, share)| {
            let sd_m = minimum.covariance[0].sqrt();
            let below = |x_m: f64| normal_cdf((x_m - minimum.x_m) / sd_m);
            share * (below(x_m) - below(0.0)) / mass(minimum.x_m, sd_m, length_m).max(f64::MIN_POSITIVE)
        });
        parts.sum::<f64>()
    };
    let quantile = |share: f64| bisect((0.0, length_m), 60, |x_m| cumulative(x_m) < share);
    (quantile(0.025), quantile(0.975))
}

/// 95 % interval, truncated to the line.
fn single_interval(minimum: &Minimum, length_m: f64) -> (f64, f64) {
    let sd_m = minimum.covariance[0].sqrt();
    let (left, right) = (minimum.x_m / sd_m, (length_m - minimum.x_m) / sd_m);
    if left > 4.0 && right > 4.0 {
        return normal_interval_95(minimum.x_m, sd_m);
    }
    let (low, high) = (normal_cdf(-left), normal_cdf(right));
    let cumulative = |x_m: f64| (normal_cdf((x_m - minimum.x_m) / sd_m) - low) / (high - low);
    let quantile = |share: f64| bisect((0.0, length_m), 60, |x_m| cumulative(x_m) < share);
    (quantile(0.025), quantile(0.975))
}

/// 95 % interval by the trapezoidal rule, with a prior flat in the position and in the size of the signal.
fn interval_of_profile(misfits: &[f64; COARSE], length_m: f64) -> (f64, f64) {
    /// Rise of χ² to a negligible density, e⁻⁵⁰ of the highest.
    const NOTHING_THERE: f64 = 100.0;
    let best = misfits.iter().copied().fold(f64::INFINITY, f64::min);
    let density = |misfit: f64| {
        let above = misfit - best;
        if above < NOTHING_THERE { (-0.5 * above).exp() } else { 0.0 }
    };
    let mut cumulative = [0.0; COARSE];
    let mut left = density(misfits[0]);
    for node in 1..COARSE {
        let right = density(misfits[node]);
        cumulative[node] = cumulative[node - 1] + 0.5 * (left + right);
        left = right;
    }
    let all = cumulative[COARSE - 1];
    let quantile = |share: f64| {
        let after = cumulative.partition_point(|c| *c < share * all).clamp(1, COARSE - 1);
        let (low, high) = (cumulative[after - 1], cumulative[after]);
        let part = if high > low { (share * all - low) / (high - low) } else { 0.0 };
        (after as f64 - 1.0 + part) * length_m / (COARSE - 1) as f64
    };
    (quantile(0.025), quantile(0.975))
}
