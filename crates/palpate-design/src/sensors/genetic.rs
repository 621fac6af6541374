//! Genetic search, after Elliott et al.
//!
//! Parents from tournaments have a child with units of both, as far as the constraints allow. A mutation
//! exchanges a unit. The best layouts survive.

use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::candidates::Pool;
use super::exchange::{Search, SearchResult, random_start};
use palpate_numerics::watch::Cancelled;

pub(super) const STAGE: &str = "genetic search";
const POPULATION: usize = 60;
const GENERATIONS: usize = 120;
/// Number of layouts that survive unchanged.
const ELITE: usize = 4;
/// Number of layouts in a tournament.
const TOURNAMENT: usize = 3;
/// Probability of a mutation.
const MUTATION: f64 = 0.4;

pub(super) fn search(search: &Search, feasible: &[usize], seed: u64) -> Result<SearchResult, Cancelled> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let (pool, all) = (search.pool, search.pool.all());
    let mut population: Vec<SearchResult> = (0..POPULATION)
        .map(|_| {
            let layout = random_start(pool, &all, rng.random()).unwrap_or_else(|| feasible.to_vec());
            search.scored(layout)
        })
        .collect();
    for generation in 0..GENERATIONS {
        search.watch.stage(STAGE, generation as f64 / GENERATIONS as f64)?;
        population.sort_by(|a, b| a.score.total_cmp(&b.score));
        let mut next: Vec<SearchResult> = population[..ELITE].to_vec();
        while next.len() < POPULATION {
            let [one, other] = [parent(&population, &mut rng), parent(&population, &mut rng)];
            // If the constraints leave no way to complete a child, a parent survives.
            let layout = child(pool, one, other, &mut rng).unwrap_or_else(|| one.selection.clone());
            next.push(search.scored(layout));
        }
        population = next;
    }
    population.sort_by(|a, b| a.score.total_cmp(&b.score));
    Ok(population.swap_remove(0))
}

fn parent<'a>(population: &'a [SearchResult], rng: &mut impl Rng) -> &'a SearchResult {
    let drawn = (0..TOURNAMENT).map(|_| rng.random_range(0..population.len())).collect::<Vec<_>>();
    let best = drawn.into_iter().min_by(|a, b| population[*a].score.total_cmp(&population[*b].score));
    &population[best.unwrap_or(0)]
}

fn child(pool: &Pool, one: &SearchResult, other: &SearchResult, rng: &mut impl Rng) -> Option<Vec<usize>> {
    let fixed = pool.fixed.len();
    let mut inherited: Vec<usize> = [&one.selection[fixed..], &other.selection[fixed..]].concat();
    for i in (1..inherited.len()).rev() {
        inherited.swap(i, rng.random_range(0..=i));
    }
    if rng.random::<f64>() < MUTATION {
        inherited.insert(0, rng.random_range(0..pool.units.len()));
    }
    let mut layout = pool.fixed.clone();
    for unit in inherited {
        if !pool.is_whole(&layout) && pool.may_join(&layout, unit) {
            layout.push(unit);
        }
    }
    // Random units fill the slots that the parents do not fill.
    for _ in 0..20 * pool.design.count {
        if pool.is_whole(&layout) {
            return Some(layout);
        }
        let unit = rng.random_range(0..pool.units.len());
        if pool.may_join(&layout, unit) {
            layout.push(unit);
        }
    }
    pool.is_whole(&layout).then_some(layout)
}
