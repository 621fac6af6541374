//! A board of one's own by known physics: a strip on two supports over raw deflection sensors, read in counts.

use super::toml::Toml;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The board's rig.
pub const RIG: &str = r#"[surface]
kind = "measured"
length = "300 mm"

[sensors]
measure = "raw"
count = 6

[recording]
position = "Position"
position_unit = "mm"
force = "Force"
channels = ["g1", "g2", "g3", "g4", "g5", "g6"]

[estimator]
kind = "influence"
"#;

/// The board's rig with readings in proportion to the force, which saves the comparison of structures.
pub fn linear_rig() -> String {
    format!("{RIG}structure = \"force-linear\"\n")
}

/// Sets the estimator of a rig file to readings in proportion to the force, which saves the comparison of structures.
pub fn set_force_linear(rig: &Path) {
    let toml = Toml::parse(&fs::read_to_string(rig).unwrap()).estimator("influence");
    fs::write(rig, toml.add("estimator.structure", "force-linear").to_string()).unwrap();
}

const LENGTH_MM: f64 = 300.0;
const SENSORS: usize = 6;

/// Sensors with offsets and a count of noise each.
pub struct Board {
    offsets: [f64; SENSORS],
    /// Loads that lie on it.
    loads: Vec<Touch>,
    state: u64,
}

/// Position and force of a touch; a force of 0 is none.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    pub position_mm: f64,
    pub force_n: f64,
}

impl Touch {
    pub const NONE: Self = Self { position_mm: 0.0, force_n: 0.0 };
}

impl Board {
    pub fn new(seed: u64) -> Self {
        let mut board = Self { offsets: [0.0; SENSORS], loads: Vec::new(), state: seed };
        board.move_offsets(300.0);
        board
    }

    /// Moves every offset by up to so many counts.
    pub fn move_offsets(&mut self, most: f64) {
        for c in 0..SENSORS {
            self.offsets[c] += most * (2.0 * self.uniform() - 1.0);
        }
    }

    /// Moves every offset by so many counts, every second one downwards.
    pub fn move_steadily(&mut self, counts: f64) {
        self.offsets.iter_mut().enumerate().for_each(|(c, offset)| {
            *offset += if c % 2 == 0 { counts } else { -counts };
        });
    }

    /// Lays loads on the board, in place of those that lie there.
    pub fn lay_on(&mut self, loads: &[Touch]) {
        self.loads = loads.to_vec();
    }

    /// A number between 0 and 1 (D. Knuth's linear congruential generator, its upper half).
    pub fn uniform(&mut self) -> f64 {
        self.state =
            self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.state >> 33) as f64 / (1u64 << 31) as f64
    }

    /// Noise of one count: twelve uniform numbers less their mean.
    fn noise(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    pub fn reading(&mut self, touch: Touch) -> [f64; SENSORS] {
        std::array::from_fn(|c| {
            let sensor_mm = LENGTH_MM * (c as f64 + 0.7) / (SENSORS as f64 + 0.4);
            let gain = 40.0 + 3.0 * c as f64;
            let load = |load: &Touch| load.force_n * gain * deflection(sensor_mm, load.position_mm);
            let loads: f64 = self.loads.iter().map(load).sum();
            self.offsets[c] + loads + load(&touch) + self.noise()
        })
    }

    /// A touch anywhere but next to the supports.
    pub fn touch(&mut self) -> Touch {
        let position_mm = 30.0 + 240.0 * self.uniform();
        Touch { position_mm, force_n: 0.5 + 4.0 * self.uniform() }
    }

    /// Presses of recorded force at 18 places, and untouched rows between them. At 19 places a fit would check its intervals, which takes twenty times
    /// as long.
    pub fn calibration(&mut self, presses: usize) -> String {
        let place_mm = |i: usize| 15.0 + 15.8 * (i % 18) as f64;
        let mut touches = Vec::new();
        for i in 0..presses {
            let force_n = 0.5 + 4.0 * self.uniform();
            touches.push(Touch { position_mm: place_mm(i), force_n });
            touches.push(Touch::NONE);
        }
        self.recording(&touches)
    }

    /// Readings of touches, with their contacts.
    pub fn recording(&mut self, touches: &[Touch]) -> String {
        let mut csv = "Position,Force,g1,g2,g3,g4,g5,g6\n".to_owned();
        for touch in touches {
            let reading = self.reading(*touch).map(|value| format!("{value:.3}")).join(",");
            writeln!(csv, "{:.3},{:.4},{reading}", touch.position_mm, touch.force_n)
                .expect("text can be written");
        }
        csv
    }
}

/// Deflection of a simply supported beam at one place under a force at another, over the most there is.
fn deflection(at_mm: f64, force_mm: f64) -> f64 {
    let (x, a) = if at_mm < force_mm { (at_mm, force_mm) } else { (force_mm, at_mm) };
    let (x, b) = (x / LENGTH_MM, 1.0 - a / LENGTH_MM);
    8.0 * x * b * (1.0 - x * x - b * b)
}
