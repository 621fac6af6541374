//! A recording as an influence fit sees it: presses at the same place with the same force, averaged.

use super::InfluenceFitError;
use crate::recording::Recording;
use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::Layout;
use palpate_numerics::mean;

/// Presses at one position with one force.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Press {
    pub position: Position,
    pub force_n: f64,
    /// How many readings were averaged.
    pub count: f64,
    /// Their mean, a value a sensor.
    pub mean: Vec<f64>,
}

/// All presses of a recording, and how much repeats disagree.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Presses {
    pub presses: Vec<Press>,
    /// Sum of squared deviations of repeats from their mean, a value a sensor.
    scatter: Vec<f64>,
    /// Degrees of freedom of the scatter: readings less presses.
    freedom: f64,
}

/// How many readings' worth of belief the rig's stated noise has, beside the repeats.
const STATED_FREEDOM: f64 = 20.0;

impl Presses {
    /// Averages repeats.
    ///
    /// # Errors
    /// [`InfluenceFitError::NoForce`] for a row whose force nobody knows, or is not greater than 0.
    pub fn of(recording: &Recording) -> Result<Self, InfluenceFitError> {
        let sensors = recording.channels.len();
        let mut rows: Vec<(Position, f64, &[f64])> = Vec::with_capacity(recording.rows.len());
        for (i, row) in recording.rows.iter().enumerate() {
            let force_n = row.force_n.filter(|force_n| *force_n > 0.0);
            let force_n = force_n.ok_or(InfluenceFitError::NoForce { row: i + 1 })?;
            rows.push((row.position, force_n, &row.reading));
        }
        rows.sort_by(|a, b| a.0.cmp_by_x_then_y(&b.0).then(a.1.total_cmp(&b.1)));
        let mut presses = Vec::new();
        let (mut scatter, mut freedom) = (vec![0.0; sensors], 0.0);
        for group in rows.chunk_by(|a, b| a.0 == b.0 && a.1 == b.1) {
            let count = group.len() as f64;
            let column = |s: usize| group.iter().map(move |(_, _, reading)| reading[s]);
            let mean: Vec<f64> = (0..sensors).map(|s| column(s).sum::<f64>() / count).collect();
            for (s, scatter) in scatter.iter_mut().enumerate() {
                *scatter += column(s).map(|value| (value - mean[s]).powi(2)).sum::<f64>();
            }
            freedom += count - 1.0;
            presses.push(Press { position: group[0].0, force_n: group[0].1, count, mean });
        }
        Ok(Self { presses, scatter, freedom })
    }

    /// How many positions there are, whatever the force.
    pub fn distinct_positions(&self) -> usize {
        self.presses.chunk_by(|a, b| a.position == b.position).count()
    }

    /// The mean force, in newtons.
    pub fn mean_force_n(&self) -> f64 {
        mean(self.presses.iter().map(|press| press.force_n))
    }

    /// The variance of a sensor's noise from its repeats and the noise that its rig states, or `None` where neither
    /// says anything. Quantisation to steps q adds q²/12 where there are no repeats that show it.
    pub fn noise_variance(&self, layout: &Layout, sensor: usize) -> Option<f64> {
        let channel = &layout.sensors[sensor].channel;
        let stated = channel.noise_sd.powi(2) + channel.resolution.powi(2) / 12.0;
        let belief = if stated > 0.0 { STATED_FREEDOM } else { 0.0 };
        let freedom = self.freedom + belief;
        (freedom > 0.0).then(|| (self.scatter[sensor] + belief * stated) / freedom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Provenance, Row};
    use palpate_mechanics::sensing::SensorKind;

    fn recording(rows: &[(f64, f64, f64)]) -> Recording {
        let rows = rows.iter().map(|(x_m, force_n, value)| Row {
            position: Position::along(*x_m),
            force_n: (*force_n > 0.0).then_some(*force_n),
            nuisance: None,
            reading: vec![*value],
        });
        let provenance = Provenance { source: "test".into(), rows: 0, digests: vec![], seed: None };
        let kinds = vec![SensorKind::Deflection];
        Recording { channels: vec!["d".into()], kinds, rows: rows.collect(), provenance }
    }

    #[test]
    fn repeats_are_averaged_and_their_scatter_kept() {
        let rows = [(0.1, 3.0, 1.0), (0.2, 3.0, 5.0), (0.1, 3.0, 3.0), (0.1, 2.0, 9.0)];
        let presses = Presses::of(&recording(&rows)).unwrap();
        let found: Vec<_> =
            presses.presses.iter().map(|p| (p.position.x_m, p.force_n, p.count, p.mean[0])).collect();
        assert_eq!(found, [(0.1, 2.0, 1.0, 9.0), (0.1, 3.0, 2.0, 2.0), (0.2, 3.0, 1.0, 5.0)]);
        let mut layout = Layout::even(SensorKind::Deflection, 1, 0.4);
        assert_eq!(presses.noise_variance(&layout, 0), Some(2.0));
        layout.sensors[0].channel.noise_sd = 1.0;
        let blended = presses.noise_variance(&layout, 0).unwrap();
        assert!((blended - 22.0 / 21.0).abs() < 1e-15);
    }

    #[test]
    fn a_press_without_force_is_refused() {
        let error = Presses::of(&recording(&[(0.1, 3.0, 1.0), (0.2, -1.0, 1.0)])).unwrap_err();
        assert_eq!(error, InfluenceFitError::NoForce { row: 2 });
    }

    #[test]
    fn nothing_is_known_of_noise_without_repeats() {
        let presses = Presses::of(&recording(&[(0.1, 3.0, 1.0)])).unwrap();
        assert_eq!(presses.noise_variance(&Layout::even(SensorKind::Deflection, 1, 0.4), 0), None);
    }
}
