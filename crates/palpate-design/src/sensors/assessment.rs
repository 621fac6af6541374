//! What a layout is worth, whoever placed its sensors.

use serde::Serialize;

use super::error::DesignError;
use super::objective::{Block, ForceBelief};
use super::{SensorProblem, candidates::PlacedSensor, pool::exclusion};
use palpate_mechanics::limit::{CramerRaoBound, LimitCurve};
use palpate_mechanics::sensing::{Layout, Sensor, SensorKind};

/// How good a layout is for the contacts of a design.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Assessment {
    /// The criterion's value, the smaller the better: in metres of a limit, a share, or ½·ln det.
    pub score: f64,
    /// The mean limit in metres; `None` where the readings do not tell some contact at all.
    pub mean_limit_m: Option<f64>,
    /// The largest limit in metres; `None` where the readings do not tell some contact at all.
    pub worst_limit_m: Option<f64>,
    /// Mean over the contacts of the mean error of an estimator at the limit, in metres; `None` as before.
    pub mean_error_m: Option<f64>,
    /// Share of the contacts whose limit is within the tolerance, in %.
    pub within_tolerance_percent: f64,
    /// The worst score when one of the sensors dies; `None` for a single sensor.
    pub score_one_dead: Option<f64>,
    /// What the sensors cost.
    pub cost: f64,
    /// Whether it keeps all constraints.
    pub keeps_constraints: bool,
}

impl SensorProblem<'_> {
    /// Judges a layout, its own or any other of the same surface.
    ///
    /// # Errors
    /// [`DesignError::CramerRaoBound`] where a sensor has no noise or all are dead.
    pub fn assess(&self, layout: &Layout) -> Result<Assessment, DesignError> {
        let touches = &self.touches;
        let limit = CramerRaoBound::new(touches.surface, layout)?;
        let contacts = &touches.contacts;
        let curve = LimitCurve::at(&limit, touches.force_n, touches.force, &contacts.positions)?;
        let bounds: Option<Vec<_>> = curve.points.iter().map(|point| point.bound).collect();
        let good = |bound: Option<palpate_mechanics::limit::Bound>| {
            bound.is_some_and(|bound| bound.sd_position_m <= self.pool.design.tolerance_m)
        };
        let within = curve.points.iter().map(|point| if good(point.bound) { 1.0 } else { 0.0 });
        let within_tolerance_percent = 100.0 * contacts.mean(within);
        let (score, score_one_dead) = self.scores(layout);
        let limits = bounds.map(|bounds| {
            let worst = bounds.iter().map(|bound| bound.sd_position_m).fold(0.0, f64::max);
            let mean = contacts.mean(bounds.iter().map(|bound| bound.sd_position_m));
            (mean, worst, contacts.mean(bounds.iter().map(|bound| bound.mean_error_m())))
        });
        Ok(Assessment {
            score,
            mean_limit_m: limits.map(|(mean, ..)| mean),
            worst_limit_m: limits.map(|(_, worst, _)| worst),
            mean_error_m: limits.map(|(.., error)| error),
            within_tolerance_percent,
            score_one_dead,
            cost: self.cost(layout),
            keeps_constraints: self.keeps_constraints(layout),
        })
    }

    /// The criterion's value, and the worst when one sensor is dead.
    fn scores(&self, layout: &Layout) -> (f64, Option<f64>) {
        let live = || layout.sensors.iter().filter(|sensor| !sensor.channel.dead);
        let rows: Vec<Vec<Block>> =
            live().map(|sensor| self.touches.row(sensor.kind, sensor.position, &sensor.channel)).collect();
        let value = |dead: Option<usize>| {
            let left: Vec<&[Block]> = rows
                .iter()
                .enumerate()
                .filter(|(i, _)| Some(*i) != dead)
                .map(|(_, row)| row.as_slice())
                .collect();
            self.objective.value(&self.objective.state(&left, ForceBelief::Vague))
        };
        let one_dead = (0..rows.len()).map(|dead| value(Some(dead))).reduce(f64::max);
        (value(None), one_dead.filter(|_| rows.len() > 1))
    }

    /// By the costs of the kinds that are offered; other kinds cost nothing.
    fn cost(&self, layout: &Layout) -> f64 {
        layout
            .sensors
            .iter()
            .filter_map(|sensor| self.offered(sensor))
            .map(|offer| self.pool.design.offers[offer].cost)
            .sum()
    }

    fn offered(&self, sensor: &Sensor) -> Option<usize> {
        self.pool.design.offers.iter().position(|offer| offer.kind == sensor.kind)
    }

    /// Whether a layout has the wanted count and keeps spacing, zones, budget, symmetry and what every layout has. Its sites need
    /// not be candidates.
    fn keeps_constraints(&self, layout: &Layout) -> bool {
        let (design, extent) = (&self.pool.design, self.pool.extent);
        let placed: Option<Vec<PlacedSensor>> = layout
            .sensors
            .iter()
            .map(|sensor| Some(PlacedSensor { offer: self.offered(sensor)?, position: sensor.position }))
            .collect();
        let Some(placed) = placed else { return false };
        let same = |a: &PlacedSensor, b: &PlacedSensor| {
            a.offer == b.offer && a.position.distance_m(b.position) <= 1e-6 * extent.length_m
        };
        let apart = placed.iter().enumerate().all(|(i, a)| {
            placed[..i].iter().all(|b| !same(a, b) && exclusion(a, b, design, extent).is_none())
        });
        let free = placed.iter().all(|sensor| {
            design.offers[sensor.offer].kind == SensorKind::Reaction
                || design.keep_out.iter().all(|zone| !zone.holds(sensor.position, extent))
        });
        let complete = design.must_have.iter().all(|wanted| {
            let wanted = PlacedSensor { offer: wanted.offer, position: wanted.position };
            placed.iter().any(|sensor| same(sensor, &wanted))
        });
        let symmetric = design.symmetry != crate::sensors::Symmetry::Wanted
            || placed.iter().all(|sensor| {
                let position = super::candidates::mirrored(sensor.position, extent);
                placed.iter().any(|other| same(other, &PlacedSensor { position, ..*sensor }))
            });
        let paid = design.budget.is_none_or(|budget| self.cost(layout) <= budget * (1.0 + 1e-12));
        placed.len() == design.count && apart && free && complete && symmetric && paid
    }
}
