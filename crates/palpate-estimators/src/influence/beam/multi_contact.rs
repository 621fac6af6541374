//! Several simultaneous contacts.
//!
//! A reading is Σ W_k·f(a_k). Linear least squares gives the forces at all pairs or triples of nodes;
//! Gauss–Newton refines the best. The extended Bayesian information criterion (Chen and Chen, Biometrika 95,
//! 2008) selects their number.

use super::coarse::{COARSE, STRIDE};
use super::search::Search;
use super::table::InfluenceTable;
use crate::likelihood::ContactFit;
use crate::status::{LINE_PLACES, chi_squared_bound, contact_cost};
use ndarray::Array2;
use palpate_core::{ContactEstimate, Estimate, Status, Uncertainty};
use palpate_mechanics::contact::{Contact, Position};
use palpate_numerics::small::{Ldl, dot};
use palpate_numerics::{clamped_interval, normal_interval_95};
use std::f64::consts::PI;

/// Estimates two to `most` contacts; `None` where one contact with χ² `misfit` is preferable.
pub(super) fn locate_several(
    search: &Search,
    most: usize,
    whitened: &[f64],
    misfit: f64,
) -> Option<Estimate> {
    let channels = search.live.len();
    let one_more = contact_cost(2, channels, LINE_PLACES);
    let mut least = misfit + search.rule.contact_cost();
    let mut best = None;
    for count in 2..=most {
        let Some(together) = fit_contacts(search, whitened, count) else { break };
        let (cost, misfit) = (together.misfit + count as f64 * one_more, together.misfit);
        if cost < least {
            (least, best) = (cost, Some(together));
        }
        // One more contact costs more than the remaining χ².
        if one_more > misfit {
            break;
        }
    }
    let together = best?;
    let (strongest, further) = together.contacts.split_first()?;
    let mut estimate = Estimate::of_contact(*strongest, Status::Located);
    for contact in further {
        estimate.further.push(*contact);
    }
    if together.misfit > chi_squared_bound(channels - 2 * together.contacts.len()) {
        estimate.status = Status::OutsideModel;
    }
    Some(estimate)
}

#[derive(Clone, Debug, PartialEq)]
struct MultiContact {
    /// Strongest first; without uncertainty where undetermined.
    contacts: Vec<ContactEstimate>,
    misfit: f64,
}

/// Fits `count` contacts; `None` where they are unidentifiable.
fn fit_contacts(search: &Search, whitened: &[f64], count: usize) -> Option<MultiContact> {
    if 2 * count > search.live.len() {
        return None;
    }
    match count {
        2 => refine::<2, 5>(search, whitened, best_nodes(search, whitened, pairs())?),
        _ => refine::<3, 7>(search, whitened, best_nodes(search, whitened, triples())?),
    }
}

fn best_nodes<const K: usize>(
    search: &Search,
    whitened: &[f64],
    choices: impl Iterator<Item = [usize; K]>,
) -> Option<[usize; K]> {
    let column = |node: usize| search.table.at_node(STRIDE * node);
    let gram = Array2::from_shape_fn((COARSE, COARSE), |(i, j)| dot(column(i), column(j)));
    let score: Vec<f64> = (0..COARSE).map(|node| dot(column(node), whitened)).collect();
    let gains = choices.filter_map(|chosen| Some((gain(&gram, &score, chosen)?, chosen)));
    let best = gains.reduce(|best, next| if next.0 > best.0 { next } else { best });
    best.map(|(_, chosen)| chosen)
}

fn pairs() -> impl Iterator<Item = [usize; 2]> {
    (0..COARSE).flat_map(|i| (i + 1..COARSE).map(move |j| [i, j]))
}

fn triples() -> impl Iterator<Item = [usize; 3]> {
    pairs().flat_map(|[i, j]| (j + 1..COARSE).map(move |k| [i, j, k]))
}

/// Reduction of χ², pᵀG⁻¹p; `None` with a negative force or collinear nodes.
#[inline]
fn gain<const K: usize>(gram: &Array2<f64>, score: &[f64], chosen: [usize; K]) -> Option<f64> {
    let (mut own_gram, mut own_score) = ([[0.0; K]; K], [0.0; K]);
    for (k, i) in chosen.into_iter().enumerate() {
        own_score[k] = score[i];
        for (entry, j) in own_gram[k].iter_mut().zip(chosen) {
            *entry = gram[[i, j]];
        }
    }
    let force = Ldl::new(&own_gram)?.solve(own_score);
    force.iter().all(|force| *force > 0.0).then(|| dot(&force, &own_score))
}

/// Gauss–Newton on N = 1 + 2K unknowns; the first one, the force of the first mode, is fixed.
fn refine<const K: usize, const N: usize>(
    search: &Search,
    whitened: &[f64],
    nodes: [usize; K],
) -> Option<MultiContact> {
    const MOST_STEPS: usize = 40;
    let table = &search.table;
    let fit = |contacts: [Contact; K]| -> ContactFit<N> {
        contact_fit(
            table,
            whitened,
            contacts,
            |contact| search.gauss_newton.variance_scale(contact.force_n),
            None,
        )
    };
    let moved = |contacts: [Contact; K], step: [f64; N], share: f64| {
        std::array::from_fn(|k| {
            let Contact { position, force_n } = contacts[k];
            let x_m = (position.x_m + share * step[1 + 2 * k]).clamp(0.0, table.length_m);
            Contact { position: Position::along(x_m), force_n: force_n + share * step[2 + 2 * k] }
        })
    };
    let spacing_m = STRIDE as f64 * table.spacing_m();
    let pressed_by_nothing =
        nodes.map(|node| Contact { position: Position::along(node as f64 * spacing_m), force_n: 0.0 });
    let start = fit(pressed_by_nothing);
    let forces = std::array::from_fn(|i| i > 0 && i % 2 == 0);
    let step = Ldl::of_free(&start.information, forces)?.solve(start.score);
    let mut contacts = moved(pressed_by_nothing, step, 1.0);
    let mut here = fit(contacts);
    let free = std::array::from_fn(|i| i > 0);
    for _ in 0..MOST_STEPS {
        // Damping for nearly collinear places and forces.
        let mut damped = here.information;
        (0..N).for_each(|i| damped[i][i] *= 1.0 + 1e-9);
        let step = Ldl::of_free(&damped, free)?.solve(here.score);
        let mut share = 1.0;
        let next = loop {
            let candidate = moved(contacts, step, share);
            let next = fit(candidate);
            if next.misfit <= here.misfit || share < 1e-3 {
                break (candidate, next);
            }
            share *= 0.5;
        };
        let fell = here.misfit - next.1.misfit;
        if fell < 0.0 {
            break;
        }
        (contacts, here) = next;
        if fell < 1e-6 {
            break;
        }
    }
    if contacts.iter().any(|contact| contact.force_n <= 0.0) {
        return None;
    }
    let covariance = Ldl::of_free(&here.information, free).map(|factors| factors.inverse());
    let estimate = |k: usize| {
        let Contact { position, force_n } = contacts[k];
        let (x, w) = (1 + 2 * k, 2 + 2 * k);
        let uncertainty = covariance.map(|covariance| Uncertainty {
            covariance: [covariance[x][x], 0.0, covariance[x][w], 0.0, 0.0, covariance[w][w]],
            x_95_m: clamped_interval(
                normal_interval_95(position.x_m, covariance[x][x].sqrt()),
                table.length_m,
            ),
            y_95_m: (0.0, 0.0),
            force_95_n: None,
        });
        ContactEstimate { position, force_n: Some(force_n), uncertainty }
    };
    let mut contacts: Vec<ContactEstimate> = (0..K).map(estimate).collect();
    contacts.sort_by(|a, b| b.force_n.unwrap_or(0.0).total_cmp(&a.force_n.unwrap_or(0.0)));
    Some(MultiContact { contacts, misfit: here.misfit })
}

/// Fit of contacts: `scale` multiplies v, and `mode` is u with g of each sensor.
///
/// Unknowns are u, then place and force of each contact.
#[inline]
pub(super) fn contact_fit<const C: usize, const K: usize>(
    table: &InfluenceTable,
    whitened: &[f64],
    contacts: [Contact; C],
    scale: impl Fn(Contact) -> f64,
    mode: Option<(f64, &[f64])>,
) -> ContactFit<K> {
    let at = contacts.map(|contact| {
        let x_m = contact.position.x_m;
        (contact.force_n, table.cell(x_m), table.variances_near(x_m), scale(contact))
    });
    let shapes = contacts.map(|contact| first_mode(table.length_m, contact.position.x_m));
    let balance_n: f64 =
        contacts.iter().zip(shapes).map(|(contact, [shape, _])| contact.force_n * shape).sum();
    let departure_n = mode.map_or(0.0, |(mode_n, _)| mode_n - balance_n);
    let mut fit = ContactFit::NOTHING;
    for (s, d) in whitened.iter().enumerate() {
        let g = mode.map_or(0.0, |(_, g)| g[s]);
        let mut residual = d - departure_n * g;
        let mut variance = 1.0;
        let mut derivatives = [0.0; K];
        derivatives[0] = g;
        for k in 0..C {
            let (force_n, cell, variances, scale) = &at[k];
            let (f, slope) = table.value_and_slope(cell, s);
            residual -= force_n * f;
            variance += scale * variances[s];
            derivatives[1 + 2 * k] = force_n * (slope - shapes[k][1] * g);
            derivatives[2 + 2 * k] = f - shapes[k][0] * g;
        }
        fit.add(residual, &derivatives, 1.0 / variance);
    }
    fit.mirrored()
}

pub(super) fn first_mode(length_m: f64, x_m: f64) -> [f64; 2] {
    let wave = PI / length_m;
    let (sin, cos) = (wave * x_m).sin_cos();
    [sin, wave * cos]
}
