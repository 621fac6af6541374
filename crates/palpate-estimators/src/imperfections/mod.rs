//! Imperfections of benches in simulations.
//!
//! Order: [soft layer](Imperfections::touch_width_m); for deviations from the untouched reading
//! [saturation](Imperfections::saturation), [play operator](Imperfections::hysteresis),
//! [creep](Imperfections::creep), [residue](Imperfections::residue), gain drift and offset drift; then the
//! [`ChannelModel`](palpate_mechanics::sensing::ChannelModel).

mod channels;
mod noise;
mod soft_layer;

pub use channels::{BenchState, ChannelState, ImperfectChannels};
pub(crate) use noise::StandardNoise;
pub(crate) use soft_layer::distribute_contact;

use palpate_mechanics::contact::Extent;
use palpate_numerics::OutOfRange;
use serde::{Deserialize, Serialize};

/// Imperfections of a bench, checked by
/// [`Setup::with_imperfections`](crate::setup::Setup::with_imperfections).
///
/// ```
/// use palpate_estimators::arrangement::Training;
/// use palpate_estimators::imperfections::{Amount, OffsetDrift, Imperfections, Relaxation};
/// use palpate_estimators::setup::Setup;
/// use palpate_mechanics::{sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let worn = setup.with_imperfections(Imperfections {
///     hysteresis: 0.01,
///     residue: Relaxation { share: 0.02, time_s: 20.0 },
///     common_drift: OffsetDrift { line_per_s: Amount::Share(0.02 / 3600.0), ..OffsetDrift::default() },
///     ..Imperfections::default()
/// })?;
/// let recording = worn.simulate(&Training::even(10), 0)?;
/// assert_eq!(recording.rows.iter().filter(|row| !row.touches()).count(), 11); // one before each press, and one after the last
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Imperfections {
    /// Hysteresis width w relative to the channel's range, in [0, 1). Play operator y ← min(max(y, x − w/2),
    /// x + w/2) (Visintin, *Differential Models of Hysteresis*, 1994, ch. III).
    pub hysteresis: f64,
    /// Creep shares with time constants; sum below 1. Prony series (Ferry, *Viscoelastic Properties of
    /// Polymers*, 3rd ed. 1980, ch. 3).
    pub creep: [Relaxation; 2],
    /// Remaining share of a touch's largest deviation, in [0, 1), and its time constant.
    pub residue: Relaxation,
    /// Independent offset drift, with a line of alternating sign.
    pub drift: OffsetDrift,
    /// Common offset drift, as of temperature.
    pub common_drift: OffsetDrift,
    /// Independent linear gain drift, of alternating sign.
    pub gain_drift_per_s: f64,
    /// Common linear gain drift.
    pub common_gain_drift_per_s: f64,
    /// Noise correlation ρ in [0, 1): √ρ·z₀ + √(1 − ρ)·zᵢ.
    pub noise_correlation: f64,
    /// Degrees of freedom ν > 2 of Student's t noise at the given standard deviation (Lange, Little and
    /// Taylor, *J. Am. Stat. Assoc.* 84, 1989); `None` for normal noise.
    pub noise_freedom: Option<f64>,
    /// Repeats of each reading, as of a fast logger.
    pub repeated_readings: u32,
    /// Width of a soft layer's contact, from 0 to below the shortest side; see
    /// docs/explanation/imperfections.md. About Hertz's 2·√(d·R) (Johnson, *Contact Mechanics*, 1985, ch. 4)
    /// plus the layer thickness.
    pub touch_width_m: f64,
    /// Saturation s in [0, 1) over the range R: x/(1 + s/(1 − s)·|x|/R), the hyperbolic law of Langmuir
    /// isotherms and resistive foams.
    pub saturation: f64,
    /// Force of the channels' ranges (largest deviations); `None` for that of the presses.
    pub range_force_n: Option<f64>,
    /// Times of presses and rests.
    pub schedule: Schedule,
}

/// A share of a deviation that follows with a time constant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relaxation {
    /// Share in [0, 1).
    pub share: f64,
    /// Time constant, positive for a positive share.
    pub time_s: f64,
}

/// Amount in the unit of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Amount {
    /// As a share of the channel's range.
    Share(f64),
    /// SI or raw value.
    Value(f64),
}

/// Offset drift: a line and a random walk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OffsetDrift {
    /// Slope of the line per second.
    pub line_per_s: Amount,
    /// Standard deviation of the walk after 1 s.
    pub walk_per_root_s: Amount,
}

/// Times of a simulated recording; by default those of a guided manual calibration, a policy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Schedule {
    /// Rest before and after presses; greater than 0.
    pub rest_s: f64,
    /// Rows at the end of each rest.
    pub untouched_rows: u32,
    /// Time from contact to the first row; greater than 0.
    pub settle_s: f64,
    /// Rows per second; greater than 0.
    pub rate_hz: f64,
    /// Time from calibration to use; at least 0.
    pub pause_s: f64,
}

impl Default for Schedule {
    fn default() -> Self {
        Self { rest_s: 4.0, untouched_rows: 1, settle_s: 2.0, rate_hz: 10.0, pause_s: 0.0 }
    }
}

impl Default for Amount {
    fn default() -> Self {
        Self::Share(0.0)
    }
}

impl Amount {
    /// Returns the amount for a channel's range.
    pub fn of_range(self, range: f64) -> f64 {
        match self {
            Self::Share(share) => share * range,
            Self::Value(value) => value,
        }
    }

    fn number(self) -> f64 {
        match self {
            Self::Share(number) | Self::Value(number) => number,
        }
    }
}

impl Relaxation {
    /// exp(−t/τ).
    fn remainder(self, step_s: f64) -> f64 {
        (-step_s / self.time_s).exp()
    }
}

impl Imperfections {
    /// Checks every range.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn check(&self, extent: Extent) -> Result<(), OutOfRange> {
        let [first, second] = self.creep;
        let shares = [
            ("the hysteresis", self.hysteresis),
            ("the creep", first.share),
            ("the second creep", second.share),
            ("the sum of the creeps", first.share + second.share),
            ("the residue", self.residue.share),
            ("the correlation of the noise", self.noise_correlation),
            ("the saturation", self.saturation),
        ];
        OutOfRange::check("at least 0 and below 1", shares, |share| (0.0..1.0).contains(&share))?;
        let relaxations = [
            ("the time constant of the creep in seconds", first),
            ("the time constant of the second creep in seconds", second),
            ("the time constant of the residue in seconds", self.residue),
        ];
        let used = relaxations.into_iter().filter(|(_, relaxation)| relaxation.share > 0.0);
        OutOfRange::check_positive(used.map(|(name, relaxation)| (name, relaxation.time_s)))?;
        self.check_drift()?;
        let freedom = self.noise_freedom.map(|freedom| ("the degrees of freedom of the noise", freedom));
        OutOfRange::check("greater than 2 and finite", freedom, |freedom| {
            freedom > 2.0 && freedom.is_finite()
        })?;
        let shortest_m = extent.sides_m().fold(f64::INFINITY, f64::min);
        let width = [("the width of a touch in metres", self.touch_width_m)];
        OutOfRange::check("at least 0 and less than the shortest side of the surface", width, |width_m| {
            (0.0..shortest_m).contains(&width_m)
        })?;
        OutOfRange::check_positive(
            self.range_force_n.map(|force_n| ("the force of the range in newtons", force_n)),
        )?;
        self.schedule.check()
    }

    fn check_drift(&self) -> Result<(), OutOfRange> {
        let lines = [
            ("the drift in a second", self.drift.line_per_s.number()),
            ("the common drift in a second", self.common_drift.line_per_s.number()),
            ("the drift of the gain in a second", self.gain_drift_per_s),
            ("the common drift of the gain in a second", self.common_gain_drift_per_s),
        ];
        OutOfRange::check("finite", lines, f64::is_finite)?;
        OutOfRange::check_not_negative([
            ("the random walk after a second", self.drift.walk_per_root_s.number()),
            ("the common random walk after a second", self.common_drift.walk_per_root_s.number()),
        ])
    }
}

impl Schedule {
    /// Seconds between rows.
    pub fn row_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    fn check(&self) -> Result<(), OutOfRange> {
        OutOfRange::check_positive([
            ("the rest in seconds", self.rest_s),
            ("the time before a press is read in seconds", self.settle_s),
            ("the rate of rows in hertz", self.rate_hz),
        ])?;
        OutOfRange::check_not_negative([("the pause before use in seconds", self.pause_s)])
    }
}

#[cfg(test)]
mod tests;
