//! `[stage]`: the machine that presses the surface.

use serde::Deserialize;

use palpate_numerics::OutOfRange;

use crate::document::At;
use crate::error::RigError;
use crate::values::{Force, Length, Positive, Quantity, Speed};

/// Machine that presses a surface; lengths in metres in its coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// x and y of the finger over the left support or lower left corner.
    pub origin_m: (f64, f64),
    /// z of the finger at the first touch.
    pub touch_z_m: f64,
    /// Height of travel above `touch_z_m`; greater than 0.
    pub clearance_m: f64,
    /// Depths below `touch_z_m`, at least one; greater than 0.
    pub depths_m: Vec<f64>,
    /// Speed of travel, m/s; greater than 0.
    pub travel_m_per_s: f64,
    /// Speed of pressing, m/s; greater than 0.
    pub press_m_per_s: f64,
    /// Name of the load cell's values (N) in the frames.
    pub load_cell: Option<String>,
    /// Force above which the machine stops, N; greater than 0.
    pub force_limit_n: Option<f64>,
    /// True if a stop can reset the machine by the DTR line.
    pub dtr_reset: bool,
}

impl Stage {
    /// Checks the range of every number.
    ///
    /// # Errors
    /// [`OutOfRange`] for the first invalid number.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let (x_m, y_m) = self.origin_m;
        let places = [("x of the origin", x_m), ("y of the origin", y_m), ("z of the touch", self.touch_z_m)];
        OutOfRange::check("finite", places, f64::is_finite)?;
        let positive = [
            ("the clearance", self.clearance_m),
            ("the speed of travel", self.travel_m_per_s),
            ("the speed of pressing", self.press_m_per_s),
        ];
        let depths = self.depths_m.iter().map(|depth_m| ("the depth", *depth_m));
        let limit = self.force_limit_n.map(|limit_n| ("the limit of the force", limit_n));
        OutOfRange::check_positive(positive.into_iter().chain(depths).chain(limit))
    }

    /// Largest depth, m.
    pub fn deepest_m(&self) -> f64 {
        self.depths_m.iter().copied().fold(0.0, f64::max)
    }

    /// z of travel, m.
    pub fn travel_z_m(&self) -> f64 {
        self.touch_z_m + self.clearance_m
    }

    /// z of the deepest press, m.
    pub fn lowest_z_m(&self) -> f64 {
        self.touch_z_m - self.deepest_m()
    }
}

/// The machine that presses the surface; see docs/how-to/press-with-a-machine.md.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StageKeys {
    /// The machine's x and y with the finger over the surface's left support, or over its lower left corner.
    pub origin: OriginKeys,
    /// The machine's z as the finger touches the untouched surface.
    pub touch: Quantity<Length>,
    /// Height of travel above `touch`; 5 mm by default.
    pub clearance: Option<Positive<Length>>,
    /// Depths below `touch` to which every position is pressed, one after the other.
    pub depths: At<Vec<Positive<Length>>>,
    /// Speed of travel; 20 mm/s by default.
    pub travel_speed: Option<Positive<Speed>>,
    /// Speed of pressing; 1 mm/s by default.
    pub press_speed: Option<Positive<Speed>>,
    /// Name of the load cell's values in the frames of the board, in newtons.
    pub load_cell: Option<String>,
    /// Largest force at the load cell; the machine stops above it.
    pub force_limit: Option<At<Positive<Force>>>,
    /// Stop the machine by a reset over the DTR line of its serial port, for firmware that reads no stop during a move; `false` by default.
    pub dtr_reset: Option<bool>,
}

/// x and y in a machine.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(expecting = "a list of 2, x and y in the machine")]
pub(crate) struct OriginKeys(Quantity<Length>, Quantity<Length>);

const MOST_DEPTHS: usize = 1000;
const CLEARANCE_M: f64 = 5e-3;
const TRAVEL_M_PER_S: f64 = 20e-3;
const PRESS_M_PER_S: f64 = 1e-3;

impl StageKeys {
    pub fn build(&self) -> Result<Stage, RigError> {
        if self.depths.is_empty() || self.depths.len() > MOST_DEPTHS {
            return Err(self.depths.place.refuse(format!("a list of at least 1 and at most {MOST_DEPTHS}")));
        }
        if let (Some(limit), None) = (&self.force_limit, &self.load_cell) {
            return Err(limit.place.unused("a machine without a `load_cell`, which measures the force"));
        }
        Ok(Stage {
            origin_m: (self.origin.0.si, self.origin.1.si),
            touch_z_m: self.touch.si,
            clearance_m: self.clearance.map_or(CLEARANCE_M, |clearance| clearance.si),
            depths_m: self.depths.iter().map(|depth| depth.si).collect(),
            travel_m_per_s: self.travel_speed.map_or(TRAVEL_M_PER_S, |speed| speed.si),
            press_m_per_s: self.press_speed.map_or(PRESS_M_PER_S, |speed| speed.si),
            load_cell: self.load_cell.clone(),
            force_limit_n: self.force_limit.as_ref().map(|limit| limit.si),
            dtr_reset: self.dtr_reset.unwrap_or(false),
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::Rig;

    const RIG: &str = include_str!("../../../examples/noisy-beam.toml");

    fn rig(stage: &str) -> Result<Rig, String> {
        Rig::from_toml(&format!("{RIG}\n[stage]\n{stage}")).map_err(|error| error.to_string())
    }

    #[test]
    fn a_stage_has_its_defaults() {
        let said = r#"origin = ["15 mm", "40 mm"]
touch = "52 mm"
depths = ["1 mm", "1.5 mm"]"#;
        let stage = rig(said).unwrap().stage.unwrap();
        assert_eq!((stage.origin_m, stage.touch_z_m, stage.clearance_m), ((0.015, 0.04), 0.052, 5e-3));
        assert_eq!((stage.deepest_m(), stage.depths_m.len()), (1.5e-3, 2));
        assert_eq!((stage.travel_m_per_s, stage.press_m_per_s), (20e-3, 1e-3));
        assert!(stage.check().is_ok());
    }

    #[test]
    fn impossible_machine_settings_are_refused_with_the_bound() {
        let start = "origin = [\"0 mm\", \"0 mm\"]\ntouch = \"1 mm\"\n";
        for (rest, words) in [
            ("", "has no `depths`"),
            ("depths = []", "a list of at least 1"),
            ("depths = [\"0 mm\"]", "greater than 0"),
            ("depths = [\"1 mm\"]\nforce_limit = \"5 N\"", "without a `load_cell`"),
            ("depths = [\"1 mm\"]\npress_speed = \"1 mm\"", "wrong unit `mm`"),
        ] {
            let error = rig(&format!("{start}{rest}")).unwrap_err();
            assert!(error.contains(words), "{rest}: {error}");
        }
    }
}
