//! Several contacts at once.
//!
//! A reading of K contacts is Σ W_k·f(a_k). Given the places, the forces are a linear least-squares problem, so places
//! are searched over pairs and triples of nodes with the forces worked out, then refined by Gauss–Newton on all 2K
//! numbers. How many there are is decided by the extended Bayesian information criterion (Chen and Chen, Biometrika 95,
//! 2008), which also charges for the number of places that a contact could have been at.

use super::coarse::{COARSE, STRIDE};
use super::scratch::Scratch;
use super::search::Search;
use ndarray::{Array1, Array2};
use palpate_core::{ContactEstimate, Uncertainty};
use palpate_mechanics::contact::Position;
use palpate_numerics::{Cholesky, NORMAL_95};

/// The most contacts that are told apart.
pub(super) const MOST_CONTACTS: usize = 3;

/// Contacts that explain a reading together.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Together {
    /// Place and force of each.
    places: Vec<(f64, f64)>,
    /// χ² that is left.
    pub misfit: f64,
    /// Covariance of all places, then all forces; `None` where the reading does not tell them.
    covariance: Option<Array2<f64>>,
}

impl Together {
    /// What it costs by the extended Bayesian information criterion: χ² + 2K·ln S + 2K·ln P, for S channels and P
    /// places that can be told apart.
    pub fn criterion(&self, search: &Search) -> f64 {
        criterion(self.misfit, self.places.len(), 2, search)
    }

    /// The contacts, strongest first, held to the surface.
    pub fn contacts(&self, length_m: f64) -> Vec<ContactEstimate> {
        let count = self.places.len();
        let contact = |k: usize| {
            let (x_m, force_n) = self.places[k];
            let uncertainty = self.covariance.as_ref().map(|covariance| {
                let (xx, xf, ff) =
                    (covariance[[k, k]], covariance[[k, count + k]], covariance[[count + k, count + k]]);
                let half_m = NORMAL_95 * xx.sqrt();
                Uncertainty {
                    covariance: [xx, 0.0, xf, 0.0, 0.0, ff],
                    x_95_m: ((x_m - half_m).max(0.0), (x_m + half_m).min(length_m)),
                    y_95_m: (0.0, 0.0),
                }
            });
            ContactEstimate { position: Position::along(x_m), force_n: Some(force_n), uncertainty }
        };
        let mut contacts: Vec<ContactEstimate> = (0..count).map(contact).collect();
        contacts.sort_by(|a, b| b.force_n.unwrap_or(0.0).total_cmp(&a.force_n.unwrap_or(0.0)));
        contacts
    }
}

/// The criterion of [`Together::criterion`] for `contacts` with `unknowns` each.
pub(super) fn criterion(misfit: f64, contacts: usize, unknowns: usize, search: &Search) -> f64 {
    misfit + contacts as f64 * charge(unknowns, search.live.len())
}

/// What a contact with `unknowns` costs by the criterion, for `channels` channels.
pub(super) fn charge(unknowns: usize, channels: usize) -> f64 {
    unknowns as f64 * (channels as f64).ln() + 2.0 * (COARSE as f64).ln()
}

/// The best explanation of a whitened reading by `count` contacts, where that can be told at all.
pub(super) fn explain(search: &Search, scratch: &Scratch, count: usize) -> Option<Together> {
    if 2 * count > search.live.len() {
        return None;
    }
    let whitened = scratch.whitened.channels(search.live.len());
    let start = best_nodes(search, whitened, count)?;
    let spacing_m = STRIDE as f64 * search.table.spacing_m();
    refine(search, whitened, start.into_iter().map(|node| node as f64 * spacing_m).collect())
}

/// The nodes whose influences explain the most, with every force at least 0.
fn best_nodes(search: &Search, whitened: &[f64], count: usize) -> Option<Vec<usize>> {
    let nodes = COARSE;
    let column = |node: usize| search.table.at_node(STRIDE * node);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let gram = Array2::from_shape_fn((nodes, nodes), |(i, j)| dot(column(i), column(j)));
    let pull: Vec<f64> = (0..nodes).map(|node| dot(column(node), whitened)).collect();
    let mut best: Option<(f64, Vec<usize>)> = None;
    let mut consider = |chosen: &[usize]| {
        if let Some(gain) = gain(&gram, &pull, chosen)
            && best.as_ref().is_none_or(|(most, _)| gain > *most)
        {
            best = Some((gain, chosen.to_vec()));
        }
    };
    for i in 0..nodes {
        for j in i + 1..nodes {
            match count {
                2 => consider(&[i, j]),
                _ => (j + 1..nodes).for_each(|k| consider(&[i, j, k])),
            }
        }
    }
    best.map(|(_, chosen)| chosen)
}

/// How much the chosen nodes lower |d|², pᵀG⁻¹p by Gaussian elimination; `None` where a force would be negative or the
/// nodes cannot be told apart.
fn gain(gram: &Array2<f64>, pull: &[f64], chosen: &[usize]) -> Option<f64> {
    let n = chosen.len();
    let mut a = [[0.0; MOST_CONTACTS + 1]; MOST_CONTACTS];
    for r in 0..n {
        for c in 0..n {
            a[r][c] = gram[[chosen[r], chosen[c]]];
        }
        a[r][n] = pull[chosen[r]];
    }
    for p in 0..n {
        if a[p][p] <= 1e-10 * gram[[chosen[p], chosen[p]]] {
            return None;
        }
        for r in p + 1..n {
            let factor = a[r][p] / a[p][p];
            let pivot = a[p];
            a[r][p..=n].iter_mut().zip(&pivot[p..=n]).for_each(|(value, above)| *value -= factor * above);
        }
    }
    let mut force = [0.0; MOST_CONTACTS];
    for r in (0..n).rev() {
        let known: f64 = (r + 1..n).map(|c| a[r][c] * force[c]).sum();
        force[r] = (a[r][n] - known) / a[r][r];
    }
    force[..n].iter().all(|force| *force > 0.0).then(|| (0..n).map(|r| force[r] * pull[chosen[r]]).sum())
}

/// Gauss–Newton on all places and forces, with steps halved until the misfit falls.
fn refine(search: &Search, whitened: &[f64], places: Vec<f64>) -> Option<Together> {
    const MOST_STEPS: usize = 40;
    let count = places.len();
    let length_m = search.table.length_m;
    let mut x: Array1<f64> = places.into_iter().chain(std::iter::repeat_n(0.0, count)).collect();
    let start = Equations::at(search, whitened, &x);
    let forces = start.forces(count)?;
    x.slice_mut(ndarray::s![count..]).assign(&forces);
    let mut here = Equations::at(search, whitened, &x);
    for _ in 0..MOST_STEPS {
        let step = here.step()?;
        let mut share = 1.0;
        let next = loop {
            let mut candidate = &x + &(&step * share);
            candidate.slice_mut(ndarray::s![..count]).mapv_inplace(|x_m| x_m.clamp(0.0, length_m));
            let next = Equations::at(search, whitened, &candidate);
            if next.misfit <= here.misfit || share < 1e-3 {
                break (candidate, next);
            }
            share *= 0.5;
        };
        let fell = here.misfit - next.1.misfit;
        if fell < 0.0 {
            break;
        }
        (x, here) = next;
        if fell < 1e-6 {
            break;
        }
    }
    let places: Vec<(f64, f64)> = (0..count).map(|k| (x[k], x[count + k])).collect();
    if places.iter().any(|(_, force_n)| *force_n <= 0.0) {
        return None;
    }
    Some(Together { places, misfit: here.misfit, covariance: here.covariance() })
}

/// The normal equations of K places and K forces.
struct Equations {
    misfit: f64,
    /// JᵀJ and Jᵀe, places first, with e = d − Σ W·f the residual and J its derivative with the sign changed.
    normal: Array2<f64>,
    right: Array1<f64>,
}

impl Equations {
    fn at(search: &Search, whitened: &[f64], x: &Array1<f64>) -> Self {
        let (count, channels) = (x.len() / 2, whitened.len());
        let mut jacobian = Array2::zeros((channels, 2 * count));
        let mut residual = Array1::from(whitened.to_vec());
        let mut variance = Array1::<f64>::ones(channels);
        for k in 0..count {
            let (x_m, force_n) = (x[k], x[count + k]);
            let near = search.table.variances_near(x_m);
            let scale = search.variance_scale(force_n);
            search.table.for_each(search.table.cell(x_m), |s, f, slope| {
                residual[s] -= force_n * f;
                jacobian[[s, k]] = force_n * slope;
                jacobian[[s, count + k]] = f;
                variance[s] += scale * near[s];
            });
        }
        let weight = variance.mapv(|v| v.sqrt().recip());
        residual *= &weight;
        jacobian *= &weight.insert_axis(ndarray::Axis(1));
        Self {
            misfit: residual.dot(&residual),
            normal: jacobian.t().dot(&jacobian),
            right: jacobian.t().dot(&residual),
        }
    }

    /// The best forces at these places, from equations in which all forces are 0.
    fn forces(&self, count: usize) -> Option<Array1<f64>> {
        let normal = self.normal.slice(ndarray::s![count.., count..]).to_owned();
        let right = self.right.slice(ndarray::s![count..]).to_owned();
        Cholesky::factor(normal).ok().map(|cholesky| cholesky.solve(&right))
    }

    /// The Gauss–Newton step, scaled so that places and forces weigh alike, and damped where they cannot be told apart.
    fn step(&self) -> Option<Array1<f64>> {
        let (scaled, scale) = self.scaled()?;
        let damped = scaled + Array2::<f64>::eye(scale.len()) * 1e-9;
        Some(Cholesky::factor(damped).ok()?.solve(&(&self.right / &scale)) / &scale)
    }

    fn covariance(&self) -> Option<Array2<f64>> {
        let (scaled, scale) = self.scaled()?;
        let inverse = Cholesky::factor(scaled).ok()?.inverse();
        Some(Array2::from_shape_fn(inverse.dim(), |(i, j)| inverse[[i, j]] / (scale[i] * scale[j])))
    }

    /// JᵀJ with a diagonal of ones, and the roots of its diagonal.
    fn scaled(&self) -> Option<(Array2<f64>, Array1<f64>)> {
        let scale = self.normal.diag().mapv(f64::sqrt);
        let usable = scale.iter().all(|root| *root > 0.0 && root.is_finite());
        usable.then(|| {
            let scaled = Array2::from_shape_fn(self.normal.dim(), |(i, j)| {
                self.normal[[i, j]] / (scale[i] * scale[j])
            });
            (scaled, scale)
        })
    }
}
