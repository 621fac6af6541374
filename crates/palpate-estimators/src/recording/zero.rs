//! Zero of readings.

use super::Recording;
use serde::{Deserialize, Serialize};

/// Zero of readings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Zero {
    /// As recorded; calibration estimates offsets.
    #[default]
    None,
    /// Latest untouched reading, for surfaces without a stable offset.
    Last,
}

impl Zero {
    /// True for readings as recorded.
    pub fn is_none(&self) -> bool {
        *self == Self::None
    }
}

/// Zero without untouched rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`zero = \"last\"` needs untouched rows, and the recording has none: add rows of force 0")]
pub struct NoUntouchedRow;

impl Recording {
    /// Subtracts from each reading the latest earlier untouched one, or else the first one, in order of time.
    /// Untouched rows are then differences, which scatter as after a tare.
    ///
    /// # Errors
    /// [`NoUntouchedRow`].
    pub fn subtract_zero(mut self, zero: Zero) -> Result<Self, NoUntouchedRow> {
        match zero {
            Zero::None => return Ok(self),
            Zero::Last => {}
        }
        let mut order: Vec<usize> = (0..self.rows.len()).collect();
        if let Some(times_s) = self.times_s() {
            order.sort_by(|a, b| times_s[*a].total_cmp(&times_s[*b]));
        }
        let first = order.iter().find(|i| !self.rows[**i].touches()).ok_or(NoUntouchedRow)?;
        let mut last = self.rows[*first].reading.clone();
        for i in order {
            let row = &mut self.rows[i];
            let recorded = row.reading.clone();
            row.reading.iter_mut().zip(&last).for_each(|(value, zero)| *value -= zero);
            if !row.touches() {
                last = recorded;
            }
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Row;
    use palpate_mechanics::contact::Position;
    use palpate_mechanics::sensing::{Layout, SensorKind};

    fn recording(rows: &[(Option<f64>, f64, f64)]) -> Recording {
        let layout = Layout::even(SensorKind::Raw, 1, 0.2);
        let row = |&(time_s, force_n, value): &(Option<f64>, f64, f64)| Row {
            time_s,
            force_n: Some(force_n),
            position: Position::along(0.1),
            nuisances: Vec::new(),
            reading: vec![value],
        };
        Recording::new(&layout, "test", rows.iter().map(row).collect())
    }

    fn zeroed(rows: &[(Option<f64>, f64, f64)]) -> Vec<f64> {
        recording(rows).subtract_zero(Zero::Last).unwrap().rows.iter().map(|row| row.reading[0]).collect()
    }

    #[test]
    fn subtracts_the_latest_untouched_reading_before_each_row() {
        let rows =
            [(None, 1.0, 11.0), (None, 0.0, 2.0), (None, 1.0, 12.0), (None, 0.0, 6.0), (None, 1.0, 17.0)];
        assert_eq!(zeroed(&rows), [9.0, 0.0, 10.0, 4.0, 11.0]);
    }

    #[test]
    fn follows_times_where_all_rows_have_them() {
        let rows =
            [(Some(3.0), 1.0, 17.0), (Some(2.0), 0.0, 6.0), (Some(1.0), 1.0, 12.0), (Some(0.0), 0.0, 2.0)];
        assert_eq!(zeroed(&rows), [11.0, 4.0, 10.0, 0.0]);
    }

    #[test]
    fn keeps_or_refuses_a_recording_without_untouched_rows() {
        let touched = recording(&[(None, 1.0, 11.0)]);
        assert_eq!(touched.clone().subtract_zero(Zero::None), Ok(touched.clone()));
        assert_eq!(touched.subtract_zero(Zero::Last), Err(NoUntouchedRow));
    }
}
