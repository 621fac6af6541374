//! `[imperfections]`: deviations from the model of the surface in simulations.

use serde::Deserialize;

use palpate_estimators::imperfections::{Amount, Imperfections, OffsetDrift, Relaxation, Schedule};
use palpate_mechanics::surface::SurfaceSpec;
use palpate_mechanics::units::{Dimension, format_length_mm};

use crate::document::At;
use crate::error::RigError;
use crate::values::{
    AtLeastZero, Bound, Count, Finite, Force, Fraction, Frequency, Length, NotNegative, Number, OneOrMany,
};
use crate::values::{Positive, Quantity, Ratio, ShareOrQuantity, TailFreedom, Time};

/// Imperfections of a real bench in simulated recordings and boards; see docs/explanation/imperfections.md. An empty section adds only untouched
/// rows and times.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ImperfectionsKeys {
    /// Width of the hysteresis of each channel as a share of its range; 0 by default.
    pub hysteresis: Option<Fraction>,
    /// Creep: one or two shares of a deviation that follow with their time constants; none by default.
    pub creep: Option<At<OneOrMany<RelaxationKeys>>>,
    /// Share of the largest deviation of a touch that remains after it, and the time constant in which it fades; none by default.
    pub residue: Option<RelaxationKeys>,
    /// Drift of the offset of each channel in an hour, up and down in channels in turn, as a share of the channel's range or in the unit of
    /// the sensors; 0 by default.
    pub drift_per_hour: Option<At<ShareOrQuantity>>,
    /// Drift of the offset that all channels share in an hour; 0 by default.
    pub common_drift_per_hour: Option<At<ShareOrQuantity>>,
    /// Random walk of the offset of each channel: its standard deviation after an hour; 0 by default.
    pub walk_in_hour: Option<At<ShareOrQuantity>>,
    /// Random walk of the offset that all channels share: its standard deviation after an hour; 0 by default.
    pub common_walk_in_hour: Option<At<ShareOrQuantity>>,
    /// Drift of the gain of each channel in an hour, up and down in channels in turn; 0 by default.
    pub gain_drift_per_hour: Option<Quantity<Ratio>>,
    /// Drift of the gain that all channels share in an hour; 0 by default.
    pub common_gain_drift_per_hour: Option<Quantity<Ratio>>,
    /// Correlation of the noise of any two channels; 0 by default.
    pub noise_correlation: Option<Fraction>,
    /// Degrees of freedom, greater than 2, of the noise of each channel, which follows Student's t distribution; normal noise by default.
    pub noise_freedom: Option<Quantity<Number, TailFreedom>>,
    /// Rows that repeat each reading, as a logger writes that is faster than its sensors; 0 by default.
    pub repeated_readings: Option<Count<0, 1000>>,
    /// Width over which a soft layer spreads a touch; 0 by default.
    pub touch_width: Option<At<NotNegative<Length>>>,
    /// Share by which a deviation as large as the range falls short of a linear one; 0 by default.
    pub saturation: Option<Fraction>,
    /// Force at which the largest deviation over the surface is the range of a channel; that of the presses by default.
    pub range_force: Option<Positive<Force>>,
    /// Untouched time before each press and after the last; 4 s by default.
    pub rest: Option<Positive<Time>>,
    /// Rows of force 0 that are recorded at the end of each rest; 1 by default.
    pub untouched_rows: Option<Count<0, 1000>>,
    /// Time for which a press rests before its `repeats` rows are read; 2 s by default.
    pub settle: Option<Positive<Time>>,
    /// Rows a second within a press or a rest; 10 Hz by default.
    pub rate: Option<Positive<Frequency>>,
    /// Time from the end of a calibration to the first contact in use; 0 by default.
    pub pause: Option<NotNegative<Time>>,
}

/// A share of a deviation that follows with a time constant.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RelaxationKeys {
    /// The share.
    pub share: Fraction,
    /// The time constant.
    pub time: Positive<Time>,
}

impl RelaxationKeys {
    fn build(&self) -> Relaxation {
        Relaxation { share: self.share.si, time_s: self.time.si }
    }
}

const HOUR_S: f64 = 3600.0;

impl At<ImperfectionsKeys> {
    pub fn build(
        &self,
        surface: &SurfaceSpec,
        dimension: Option<Dimension>,
    ) -> Result<Imperfections, RigError> {
        if surface.model().is_none() {
            return Err(self.place.unused("a `measured` surface, which has no model to simulate"));
        }
        let share = |key: &Option<Fraction>| key.map_or(0.0, |share| share.si);
        let gain = |key: &Option<Quantity<Ratio>>| key.map_or(0.0, |drift| drift.si / HOUR_S);
        let drift = |line: &Option<At<ShareOrQuantity>>, random: &Option<At<ShareOrQuantity>>| {
            let line_per_s = amount::<Finite>(line, dimension, 1.0 / HOUR_S)?;
            let walk_per_root_s = amount::<AtLeastZero>(random, dimension, 1.0 / HOUR_S.sqrt())?;
            Ok::<_, RigError>(OffsetDrift { line_per_s, walk_per_root_s })
        };
        Ok(Imperfections {
            hysteresis: share(&self.hysteresis),
            creep: self.creep()?,
            residue: self.residue.map_or(Relaxation::default(), |residue| residue.build()),
            drift: drift(&self.drift_per_hour, &self.walk_in_hour)?,
            common_drift: drift(&self.common_drift_per_hour, &self.common_walk_in_hour)?,
            gain_drift_per_s: gain(&self.gain_drift_per_hour),
            common_gain_drift_per_s: gain(&self.common_gain_drift_per_hour),
            noise_correlation: share(&self.noise_correlation),
            noise_freedom: self.noise_freedom.map(|freedom| freedom.si),
            repeated_readings: self.repeated_readings.map_or(0, |rows| rows.get() as u32),
            touch_width_m: self.touch_width_m(surface)?,
            saturation: share(&self.saturation),
            range_force_n: self.range_force.map(|force| force.si),
            schedule: self.schedule(),
        })
    }

    fn creep(&self) -> Result<[Relaxation; 2], RigError> {
        let Some(keys) = &self.creep else { return Ok([Relaxation::default(); 2]) };
        match keys.sections() {
            [one] => Ok([one.build(), Relaxation::default()]),
            [one, two] => Ok([one.build(), two.build()]),
            others => {
                Err(keys.place.refuse_value(format!("a list of {}", others.len()), "one, or a list of two"))
            }
        }
    }

    fn touch_width_m(&self, surface: &SurfaceSpec) -> Result<f64, RigError> {
        match &self.touch_width {
            None => Ok(0.0),
            Some(width) if width.si > 0.0 && matches!(surface, SurfaceSpec::Digit(_)) => {
                Err(width.place.unused("a digit: its readings under several forces do not add up"))
            }
            Some(width) => {
                let shortest_m = surface.extent().sides_m().fold(f64::INFINITY, f64::min);
                let bound =
                    format!("less than {}, the shortest side of the surface", format_length_mm(shortest_m));
                if width.si < shortest_m { Ok(width.si) } else { Err(width.place.refuse(bound)) }
            }
        }
    }

    fn schedule(&self) -> Schedule {
        let usual = Schedule::default();
        Schedule {
            rest_s: self.rest.map_or(usual.rest_s, |rest| rest.si),
            untouched_rows: self.untouched_rows.map_or(usual.untouched_rows, |rows| rows.get() as u32),
            settle_s: self.settle.map_or(usual.settle_s, |settle| settle.si),
            rate_hz: self.rate.map_or(usual.rate_hz, |rate| rate.si),
            pause_s: self.pause.map_or(usual.pause_s, |pause| pause.si),
        }
    }
}

/// Share of a channel's range, or quantity of the sensors, times a factor.
fn amount<B: Bound>(
    key: &Option<At<ShareOrQuantity>>,
    dimension: Option<Dimension>,
    factor: f64,
) -> Result<Amount, RigError> {
    let Some(written) = key else { return Ok(Amount::default()) };
    match (written.si::<B>(Dimension::Ratio), dimension) {
        (Ok(share), _) => Ok(Amount::Share(factor * share)),
        (Err(refused), None) => Err(refused),
        (Err(_), Some(dimension)) => Ok(Amount::Value(factor * written.si::<B>(dimension)?)),
    }
}
