//! Consistency check of a recording and its setup.

mod model;
mod noise;

use std::fmt;

use crate::recording::{Recording, channel_list};
use crate::setup::Setup;
use palpate_mechanics::units::{Dimension, Quantity, Unit, format_length_mm};
use palpate_numerics::median;

/// False-alarm rate, by policy.
const FALSE_ALARM: f64 = 1e-3;
/// Reported coverage, by policy, if another unit gives at least a half.
const LITTLE_COVERED: f64 = 1.0 / 8.0;
/// Reported coverage for any unit, by policy.
const HARDLY_COVERED: f64 = 1.0 / 50.0;
/// Least factor of another unit, by policy, because rigs are inaccurate.
const ROUGHLY: f64 = 3.0;
/// Greatest unexplained factor, by policy.
const UNIT_REMAINDER: f64 = 1.5;

/// Mismatch of a recording and its setup.
#[derive(Clone, Debug, PartialEq)]
pub enum Mismatch {
    /// Low coverage of the surface.
    Coverage {
        /// Axis.
        axis: Axis,
        /// Covered length.
        covered_m: f64,
        /// Surface length.
        of_m: f64,
        /// Unit of a coverage of at least a half.
        unit: Option<Unit>,
    },
    /// Different forces.
    Forces {
        /// Median force for [`ForceKey::Known`], else the greatest.
        recorded_n: f64,
        /// Setup force.
        setup_n: f64,
        /// Key of the force.
        key: ForceKey,
        /// Unit that explains the factor.
        unit: Option<ForceUnit>,
    },
    /// Better coordinates.
    Coordinates(Coordinates),
    /// Better channel order.
    ChannelOrder {
        /// Recorded and fitting channels.
        pairs: Vec<(String, String)>,
    },
    /// Opposite sign.
    Sign {
        /// Channel names.
        channels: Vec<String>,
        /// True for all channels.
        all: bool,
    },
    /// Different gain.
    Gain {
        /// Channel names.
        channels: Vec<String>,
        /// Median of reading over model.
        factor: f64,
        /// Unit of readings.
        unit: Option<Unit>,
        /// Unit of forces, for a common factor.
        force_unit: Option<ForceUnit>,
    },
    /// Different noise.
    Noise {
        /// Channel names.
        channels: Vec<String>,
        /// Compared channels.
        of: usize,
        /// Worst standard deviation.
        measured: Quantity,
        /// Standard deviation in the setup.
        setup: Quantity,
    },
}

/// Position axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Along the length.
    Along,
    /// Across the width.
    Across,
}

/// Force key in a rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForceKey {
    /// `force` of `[contact]`.
    Known,
    /// `greatest_force` of `[contact]`.
    Greatest,
}

/// Coordinates with a better fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coordinates {
    /// x → length − x.
    MirroredAlong,
    /// y → width − y.
    MirroredAcross,
    /// Both.
    Turned,
    /// x and y exchanged.
    Exchanged,
    /// Another unit.
    Unit(Unit),
}

/// Unit of force or weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceUnit {
    /// Name.
    pub name: &'static str,
    /// Newtons.
    pub newtons: f64,
    /// True if accepted as `force_unit`.
    pub is_read: bool,
}

/// Standard gravity in m/s².
const GRAVITY: f64 = 9.80665;
const FORCE_UNITS: [ForceUnit; 6] = [
    ForceUnit { name: "mN", newtons: 1e-3, is_read: true },
    ForceUnit { name: "grams", newtons: 1e-3 * GRAVITY, is_read: false },
    ForceUnit { name: "N", newtons: 1.0, is_read: true },
    ForceUnit { name: "pounds", newtons: 0.453_592_37 * GRAVITY, is_read: false },
    ForceUnit { name: "kg", newtons: GRAVITY, is_read: false },
    ForceUnit { name: "kN", newtons: 1e3, is_read: true },
];

/// Returns the mismatches; compares the model only if its estimated solution time is at most a second.
///
/// ```
/// use palpate_estimators::recording_check::{Coordinates, Mismatch, check_recording};
/// use palpate_estimators::{arrangement::Training, setup::Setup};
/// use palpate_mechanics::{contact::Position, sensing::SensorKind::Deflection, surface::Beam, units::{gpa, mm, newtons, um}};
///
/// let beam = Beam::new(mm(400.0), mm(40.0), mm(1.2), gpa(200.0))?;
/// let setup = Setup::new(beam).sensors(Deflection.evenly(8).noise(um(5.0)))?.known_force(newtons(3.0))?;
/// let mut recording = setup.simulate(&Training::even(10).repeated(5), 0)?;
/// assert_eq!(check_recording(&setup, &recording), []);
/// recording.rows.iter_mut().for_each(|row| row.position = Position::along(mm(400.0) - row.position.x_m));
/// assert_eq!(check_recording(&setup, &recording), [Mismatch::Coordinates(Coordinates::MirroredAlong)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn check_recording(setup: &Setup, recording: &Recording) -> Vec<Mismatch> {
    let mut found = coverage(setup, recording);
    found.extend(forces(setup, recording));
    // Positions and forces in a wrong unit fit no model.
    if found.is_empty() {
        found.extend(model::compare(setup, recording));
    }
    // Readings in another unit scatter in another unit.
    if !found.iter().any(|mismatch| matches!(mismatch, Mismatch::Gain { .. })) {
        found.extend(noise::compare(setup, recording));
    }
    found
}

fn coverage(setup: &Setup, recording: &Recording) -> Vec<Mismatch> {
    let extent = setup.surface().extent();
    let positions = recording.distinct_positions();
    let unit = setup.recording_columns().position_unit;
    let sides = [(Axis::Along, Some(extent.length_m())), (Axis::Across, extent.width_m())];
    let sides = sides.into_iter().filter_map(|(axis, of_m)| Some((axis, of_m?)));
    sides
        .filter_map(|(axis, of_m)| {
            let values = positions.iter().map(|position| match axis {
                Axis::Along => position.x_m,
                Axis::Across => position.y_m,
            });
            let (least_m, most_m) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| (low.min(m), high.max(m)));
            let covered_m = most_m - least_m;
            // A single place does not determine a unit.
            if covered_m.is_nan() || covered_m <= 0.0 || covered_m >= LITTLE_COVERED * of_m {
                return None;
            }
            let other = Dimension::Length.units().find(|other| {
                let factor = other.factor() / unit.factor();
                covered_m * factor >= 0.5 * of_m && most_m * factor <= of_m * (1.0 + 1e-9)
            });
            let is_little = other.is_some() || covered_m < HARDLY_COVERED * of_m;
            is_little.then_some(Mismatch::Coverage { axis, covered_m, of_m, unit: other })
        })
        .collect()
}

fn forces(setup: &Setup, recording: &Recording) -> Option<Mismatch> {
    let touched = recording.rows.iter().filter(|row| row.touches());
    let forces_n: Vec<f64> = touched.filter_map(|row| row.force_n).filter(|force_n| *force_n > 0.0).collect();
    let greatest_n = forces_n.iter().copied().reduce(f64::max)?;
    let file_unit_n = force_unit_n(setup);
    if let Some(setup_n) = setup.force_n() {
        let recorded_n = median(forces_n)?;
        let factor = recorded_n / setup_n;
        let unit = ForceUnit::explaining(factor, file_unit_n);
        // A factor of 2 indicates another force.
        let is_other = factor.ln().abs() >= 2f64.ln();
        return is_other.then_some(Mismatch::Forces { recorded_n, setup_n, key: ForceKey::Known, unit });
    }
    let setup_n = setup.greatest_force_n()?;
    let unit = ForceUnit::below(greatest_n / setup_n, file_unit_n);
    let is_beyond = greatest_n > setup_n * (1.0 + 1e-9);
    let mismatch = Mismatch::Forces { recorded_n: greatest_n, setup_n, key: ForceKey::Greatest, unit };
    is_beyond.then_some(mismatch)
}

fn force_unit_n(setup: &Setup) -> f64 {
    setup.recording_columns().force.map_or(1.0, |force| force.values.unit.factor())
}

impl ForceUnit {
    /// Unit that explains forces too large by `factor`, read in units of `read_n` newtons.
    fn explaining(factor: f64, read_n: f64) -> Option<Self> {
        let remainder = |unit: &Self| (factor * unit.newtons / read_n).ln().abs();
        let best = FORCE_UNITS.into_iter().min_by(|a, b| remainder(a).total_cmp(&remainder(b)))?;
        (factor.ln().abs() >= ROUGHLY.ln() && remainder(&best) <= UNIT_REMAINDER.ln()).then_some(best)
    }

    /// Largest unit that brings forces to 0.1–1 of their bound.
    fn below(factor: f64, read_n: f64) -> Option<Self> {
        let share = |unit: &Self| factor * unit.newtons / read_n;
        let is_off = factor >= ROUGHLY;
        FORCE_UNITS.into_iter().rev().find(|unit| is_off && (0.1..=1.0).contains(&share(unit)))
    }

    fn remedy(self) -> String {
        let Self { name, newtons, is_read } = self;
        if is_read {
            format!("set `force_unit = \"{name}\"` in [recording]")
        } else {
            format!("convert the force column from {name} to N (1 is {newtons:.5} N)")
        }
    }
}

impl fmt::Display for Coordinates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let remedy = match self {
            Self::MirroredAlong => {
                "x → length − x: measure positions from the other end, or reverse `channels`"
            }
            Self::MirroredAcross => "y → width − y: measure `y` from the other side, or reorder `channels`",
            Self::Turned => {
                "x → length − x and y → width − y: turn the coordinates by 180°, or reverse `channels`"
            }
            Self::Exchanged => "x and y exchanged: exchange the columns `x` and `y` in [recording]",
            Self::Unit(unit) => {
                return write!(f, "positions in {unit}: set `position_unit = \"{unit}\"` in [recording]");
            }
        };
        f.write_str(remedy)
    }
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Coverage { axis, covered_m, of_m, unit } => {
                let side = match axis {
                    Axis::Along => "length",
                    Axis::Across => "width",
                };
                let percent = 100.0 * covered_m / of_m;
                write!(
                    f,
                    "the positions cover {} of the surface's {side} of {} ({percent:.2} %): ",
                    format_length_mm(*covered_m),
                    format_length_mm(*of_m)
                )?;
                match unit {
                    Some(unit) => write!(f, "are they in {unit}? Set `position_unit = \"{unit}\"` in [recording]"),
                    None => f.write_str("check `position_unit` in [recording] and the size in [surface]"),
                }
            }
            Self::Forces { recorded_n, setup_n, key, unit } => {
                let newtons = |value| Quantity { value, dimension: Dimension::Force };
                let (which, key) = match key {
                    ForceKey::Known => ("in the median", "force"),
                    ForceKey::Greatest => ("at most", "greatest_force"),
                };
                write!(
                    f,
                    "the recorded forces are {} {which}, `{key}` in [contact] is {}: ",
                    newtons(*recorded_n),
                    newtons(*setup_n)
                )?;
                match unit {
                    Some(unit) => write!(f, "are they in {}? If so, {}", unit.name, unit.remedy()),
                    None => write!(f, "correct `{key}`, or `force_unit` in [recording]"),
                }
            }
            Self::Coordinates(coordinates) => {
                write!(f, "the readings fit the model better with {coordinates}")
            }
            Self::ChannelOrder { pairs } => {
                let pairs: Vec<String> =
                    pairs.iter().map(|(channel, place)| format!("`{channel}` as `{place}`")).collect();
                write!(
                    f,
                    "the readings fit the model better with {}: correct the order of `channels` in [recording]",
                    pairs.join(", ")
                )
            }
            Self::Sign { all: true, .. } => f.write_str(
                "all readings are opposite in sign to the model: forces are positive downward, deflections upward; \
                 change the sign of the force column or of the channels",
            ),
            Self::Sign { channels, .. } => write!(
                f,
                "channels of a sign opposite to the model: {}; exchange their wires or change their sign in the file",
                channel_list(channels)
            ),
            Self::Gain { channels, factor, unit, force_unit } => {
                let factor = Quantity { value: rounded(*factor), dimension: Dimension::None };
                write!(f, "readings are {factor} times the model's in {}: ", channel_list(channels))?;
                match (unit, force_unit) {
                    (Some(unit), Some(force)) => {
                        write!(f, "set `channel_unit = \"{unit}\"` in [recording], or {}", force.remedy())
                    }
                    (Some(unit), None) => write!(f, "set `channel_unit = \"{unit}\"` in [recording] for them"),
                    (None, Some(force)) => f.write_str(&force.remedy()),
                    (None, None) => f.write_str("check `channel_unit` in [recording], the forces, and the stiffness in [surface]"),
                }
            }
            Self::Noise { channels, of, measured, setup } => {
                let factor = rounded(measured.value / setup.value);
                write!(
                    f,
                    "repeats scatter {factor} times the rig's noise in {} of {of} channels ({}): {measured} where `noise` in [sensors] is {setup}",
                    channels.len(),
                    channel_list(channels)
                )
            }
        }
    }
}

/// Two significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests;
