//! Positions with the least posterior variance of the influence functions.
//!
//! A reading has noise variance 1, and its expectation the posterior variance v. It contributes 1/(1 + v) of
//! the information at the limit, besides the prior of the surface. Greedy choice and exchange minimize the
//! mean over the contacts (Krause, Singh and Guestrin, *Journal of Machine Learning Research* 9, 2008).

use ndarray::Array2;

use super::design::PositionDesign;
use super::forward::{ForwardModel, Information};
use crate::contacts::WeightedContacts;
use palpate_estimators::arrangement::cells;
use palpate_mechanics::contact::Position;
use palpate_mechanics::surface::Extent;
use palpate_numerics::watch::{Cancelled, Watch};

/// Candidate sites along a line, and along each side of a plane.
const SITES: usize = 200;
const SITES_ON_A_PLANE: usize = 20;
const MOST_CONTACTS: usize = 400;
const MOST_ROUNDS: usize = 50;

pub(super) struct ExpectedError {
    /// Sites, then contacts.
    pub places: Vec<Position>,
    sites: usize,
    weights: Vec<f64>,
    information: Vec<Information>,
    extent: Extent,
}

impl ExpectedError {
    pub fn new(forward: &ForwardModel, contacts: &WeightedContacts, extent: Extent) -> Self {
        let side = match extent {
            Extent::Line { .. } => SITES,
            Extent::Plane { .. } => SITES_ON_A_PLANE,
        };
        let mut places = cells(extent, side, side);
        let sites = places.len();
        let WeightedContacts { positions, weights } = contacts.sample(MOST_CONTACTS);
        places.extend(positions);
        Self {
            sites,
            weights,
            information: places[sites..].iter().map(|at| forward.information(*at)).collect(),
            places,
            extent,
        }
    }

    pub fn sites(&self) -> std::ops::Range<usize> {
        0..self.sites
    }

    /// Mean standard deviation of positions, m, with the posterior `variance` at a place.
    pub fn error_m(&self, variance: impl Fn(usize) -> f64) -> f64 {
        let contacts = self.weights.iter().zip(&self.information).enumerate();
        contacts
            .map(|(i, (weight, told))| weight * told.sd_m(1.0 + variance(self.sites + i), self.extent))
            .sum()
    }

    /// Best site and the error after a press of variance `noise`.
    pub fn best(&self, posterior: &Posterior, noise: impl Fn(usize) -> f64) -> (usize, f64) {
        let after = |site: usize| self.error_m(|place| posterior.variance_after(place, site, noise(site)));
        let all = self.sites().map(|site| (site, after(site)));
        all.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY))
    }
}

/// Posterior covariances of a whitened reading's function.
#[derive(Clone)]
pub(super) struct Posterior {
    covariance: Array2<f64>,
}

impl Posterior {
    pub fn prior(forward: &ForwardModel, places: &[Position]) -> Self {
        let covariance = Array2::from_shape_fn((places.len(), places.len()), |(a, b)| {
            forward.covariance(places[a], places[b])
        });
        Self { covariance }
    }

    /// Conditions on a press: C − c·cᵀ/(C_pp + variance), with c the column of the place in C.
    pub fn condition(&mut self, place: usize, variance: f64) {
        let column = self.covariance.column(place).to_owned();
        let scale = 1.0 / (column[place] + variance);
        for (mut row, c) in self.covariance.outer_iter_mut().zip(&column) {
            row.scaled_add(-scale * c, &column);
        }
    }

    pub fn variance(&self, place: usize) -> f64 {
        self.covariance[[place, place]].max(0.0)
    }

    pub fn variance_after(&self, place: usize, pressed: usize, variance: f64) -> f64 {
        let c = self.covariance[[place, pressed]];
        (self.variance(place) - c * c / (self.variance(pressed) + variance)).max(0.0)
    }
}

pub(super) fn least(
    forward: &ForwardModel,
    contacts: &WeightedContacts,
    extent: Extent,
    design: &PositionDesign,
    watch: Watch,
) -> Result<Vec<Position>, Cancelled> {
    let expected = ExpectedError::new(forward, contacts, extent);
    let prior = Posterior::prior(forward, &expected.places);
    let noise = 1.0 / design.repeats as f64;
    let after = |sites: &[usize]| {
        let mut posterior = prior.clone();
        sites.iter().for_each(|site| posterior.condition(*site, noise));
        posterior
    };
    let (mut chosen, mut posterior) = (Vec::new(), prior.clone());
    let mut error_m = f64::INFINITY;
    while chosen.len() < design.count {
        watch.round()?;
        let (site, left_m) = expected.best(&posterior, |_| noise);
        posterior.condition(site, noise);
        chosen.push(site);
        error_m = left_m;
    }
    let mut unchanged = 0;
    for step in 0..MOST_ROUNDS * design.count {
        if unchanged == design.count {
            break;
        }
        watch.round()?;
        let slot = step % design.count;
        let mut others = chosen.clone();
        let leaving = others.remove(slot);
        let (site, left_m) = expected.best(&after(&others), |_| noise);
        let improves = site != leaving && left_m < error_m * (1.0 - 1e-9);
        if improves {
            (chosen[slot], error_m) = (site, left_m);
        }
        unchanged = if improves { 0 } else { unchanged + 1 };
    }
    chosen.sort_unstable();
    Ok(chosen.into_iter().map(|site| expected.places[site]).collect())
}
