//! Layouts that keep all constraints, for searches to start from; and the complaint when there is none.

use super::candidates::Pool;
use super::design::Symmetry;
use super::error::DesignError;
use palpate_numerics::random_order;

/// A layout that is filled from the left, the cheapest kinds first.
///
/// # Errors
/// The constraint that leaves no room for as many sensors as are wanted.
pub(super) fn feasible(pool: &Pool, among: &[usize]) -> Result<Vec<usize>, DesignError> {
    let mut order = among.to_vec();
    let cost = |unit: &usize| pool.cost(&[*unit]) / pool.units[*unit].size() as f64;
    let place = |unit: &usize| pool.sensors[pool.units[*unit].first].position;
    order.sort_by(|a, b| cost(a).total_cmp(&cost(b)).then(place(a).cmp_by_x_then_y(&place(b))));
    let selection = joined(pool, &order);
    let (most, count) = (pool.size(&selection), pool.design.count);
    if most == count {
        return Ok(selection);
    }
    Err(why_not(pool, &order, count))
}

/// Adds units in this order, each that may join.
fn joined(pool: &Pool, order: &[usize]) -> Vec<usize> {
    let mut selection = pool.fixed.clone();
    for unit in order {
        if pool.size(&selection) == pool.design.count {
            break;
        }
        if pool.may_join(&selection, *unit) {
            selection.push(*unit);
        }
    }
    selection
}

/// The constraint that such a layout fails by: the budget, when without it there is one.
fn why_not(pool: &Pool, order: &[usize], count: usize) -> DesignError {
    let mut most = pool.fixed.clone();
    for unit in order {
        let fits = pool.size(&most) + pool.units[*unit].size() <= count;
        if fits && most.iter().all(|other| pool.go_together(*other, *unit)) {
            most.push(*unit);
        }
    }
    let found = pool.size(&most);
    match pool.design.budget {
        Some(budget) if found == count => DesignError::Budget { budget, count, least: pool.cost(&most) },
        _ if pool.design.symmetry == Symmetry::Forbidden && pool.design.spacing_m == 0.0 => {
            DesignError::NoMirror { count, most: found }
        }
        _ => DesignError::Spacing { count, spacing_m: pool.design.spacing_m, most: found },
    }
}

/// A layout spread evenly along the surface, as far as the sites and constraints let it; `None` where it gets stuck.
pub(super) fn spread(pool: &Pool, among: &[usize]) -> Option<Vec<usize>> {
    let mut selection = pool.fixed.clone();
    let place = |unit: usize| pool.sensors[pool.units[unit].first].position;
    // Units that mirror each other are known by their left halves.
    let paired = pool.design.symmetry == Symmetry::Wanted;
    let room_m = if paired { 0.5 * pool.extent.length_m() } else { pool.extent.length_m() };
    let left = pool.design.count - pool.size(&selection);
    let steps = if paired { left.div_ceil(2) } else { left };
    for step in 1..=steps {
        let wanted_m = room_m * step as f64 / (steps + 1) as f64;
        let off_m = |unit: usize| {
            let at = place(unit);
            let beside_m = pool.extent.width_m().map_or(0.0, |width_m| (at.y_m - 0.5 * width_m).abs());
            (at.x_m - wanted_m).abs() + beside_m
        };
        let joinable = pool.joinable(&selection, among, None);
        selection.push(joinable.into_iter().min_by(|a, b| off_m(*a).total_cmp(&off_m(*b)))?);
        if pool.size(&selection) == pool.design.count {
            break;
        }
    }
    (pool.size(&selection) == pool.design.count).then_some(selection)
}

/// A random layout; `None` where it gets stuck.
pub(super) fn random(pool: &Pool, among: &[usize], seed: u64) -> Option<Vec<usize>> {
    let order: Vec<usize> = random_order(among.len(), seed).into_iter().map(|i| among[i]).collect();
    let selection = joined(pool, &order);
    (pool.size(&selection) == pool.design.count).then_some(selection)
}
