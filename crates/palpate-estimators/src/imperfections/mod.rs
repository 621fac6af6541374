//! Imperfections of real benches, which simulations of recordings and boards add to the model of the surface: soft layers, saturation,
//! hysteresis, creep, residue, drift of offset and gain, noise that is correlated or has heavy tails, and loggers that repeat readings.
//!
//! A reading passes through them in this order: a [soft layer](Imperfections::touch_width_m) spreads the contact; the deviation x of each
//! channel from its untouched reading [saturates](Imperfections::saturation), passes a [play operator](Imperfections::hysteresis),
//! [creeps](Imperfections::creep), leaves a [residue](Imperfections::residue), is multiplied by the drifting gain, and is shifted by the
//! drifting offset; then come noise, steps and limits of the channel
//! ([`ChannelModel`](palpate_mechanics::sensing::ChannelModel)). Displacements of sensors and presses are numbers of the channel model
//! (`position_error_m`) and of the training (`placement_sd_m`).

mod channels;
mod noise;
mod soft_layer;

pub use channels::{BenchState, ChannelState, ImperfectChannels};
pub(crate) use noise::StandardNoise;
pub(crate) use soft_layer::spread_contact;

use palpate_mechanics::contact::Extent;
use palpate_numerics::OutOfRange;
use serde::{Deserialize, Serialize};

/// Imperfections of a bench; none by default. Plain data: a [`Setup`](crate::setup::Setup::with_imperfections) refuses a number out of its range.
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
    /// Width w of each channel's hysteresis as a share of its range, at least 0 and below 1: a play operator,
    /// y ← min(max(y, x − w/2), x + w/2) (Visintin, *Differential Models of Hysteresis*, 1994, ch. III).
    pub hysteresis: f64,
    /// Shares of a deviation that follow the contact slowly, each with a time constant: a Prony series of a linear viscoelastic body
    /// (Ferry, *Viscoelastic Properties of Polymers*, 3rd ed. 1980, ch. 3). Their sum is below 1.
    pub creep: [Relaxation; 2],
    /// Share of the largest deviation of a touch that remains after it, and the time constant in which it fades; below 1.
    pub residue: Relaxation,
    /// Drift of the offset of each channel by itself; the line goes up and down in channels in turn.
    pub drift: OffsetDrift,
    /// Drift of the offset that all channels share, as of the temperature.
    pub common_drift: OffsetDrift,
    /// Drift of the gain of each channel by itself in a second: a line, up and down in channels in turn.
    pub gain_drift_per_s: f64,
    /// Drift of the gain that all channels share in a second: a line.
    pub common_gain_drift_per_s: f64,
    /// Correlation ρ of the noise of any two channels, at least 0 and below 1: √ρ·z₀ + √(1 − ρ)·zᵢ.
    pub noise_correlation: f64,
    /// Degrees of freedom ν of Student's t distribution, greater than 2, that the noise of each channel by itself has, scaled to the
    /// standard deviation of the channel (Lange, Little and Taylor, *J. Am. Stat. Assoc.* 84, 1989); `None` for normal noise.
    pub noise_freedom: Option<f64>,
    /// Rows that repeat each reading after the first, as of a logger that is faster than its sensors.
    pub repeated_readings: u32,
    /// Width over which a soft layer spreads a contact, in metres, at least 0 and less than the shortest side of the surface; see
    /// docs/explanation/imperfections.md. About the diameter 2·√(d·R) of Hertz's contact (Johnson, *Contact Mechanics*, 1985, ch. 4) plus the thickness of
    /// the layer.
    pub touch_width_m: f64,
    /// Share s by which a deviation as large as the channel's range R falls short of a linear one, at least 0 and below 1:
    /// x/(1 + s/(1 − s)·|x|/R), the hyperbolic law of a Langmuir isotherm and of resistive foams.
    pub saturation: f64,
    /// Force, in newtons, that sets a channel's range: its largest deviation over the surface under this force. `None` for the force of the presses.
    pub range_force_n: Option<f64>,
    /// Times of presses and rests.
    pub schedule: Schedule,
}

/// A share of a deviation that follows with a time constant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relaxation {
    /// The share, at least 0 and below 1.
    pub share: f64,
    /// The time constant in seconds, greater than 0 where the share is.
    pub time_s: f64,
}

/// A size in the unit of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Amount {
    /// As a share of the channel's range.
    Share(f64),
    /// In the SI unit of the channel, or raw.
    Value(f64),
}

/// Drift of an offset: a line and a random walk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OffsetDrift {
    /// Slope of the line, in a second.
    pub line_per_s: Amount,
    /// Standard deviation of the walk after a second; it grows with the root of the time.
    pub walk_per_root_s: Amount,
}

/// Times of a simulated recording: presses with untouched rests before them, between them and after them.
///
/// The times of the default are a policy: those of a person who follows a guided calibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Schedule {
    /// Time for which the surface is untouched before each press, and after the last, in seconds; greater than 0.
    pub rest_s: f64,
    /// Rows that are recorded at the end of each of these rests.
    pub untouched_rows: u32,
    /// Time for which a press rests before it is read, in seconds; greater than 0.
    pub settle_s: f64,
    /// Rows a second, in hertz; greater than 0.
    pub rate_hz: f64,
    /// Time from the end of a calibration to the first contact in use, in seconds; at least 0.
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
    /// The size in the unit of a channel of this range.
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
    /// Share of the way to a constant value that is left after a step of time: exp(−t/τ).
    fn remainder(self, step_s: f64) -> f64 {
        (-step_s / self.time_s).exp()
    }
}

impl Imperfections {
    /// Checks that every number is in its range on a surface of this extent.
    ///
    /// # Errors
    /// [`OutOfRange`], for the first that is not.
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
    /// Seconds between two rows of one press or rest.
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
