//! The examples and studies of the project.

pub const CANTILEVER: &str = include_str!("../../../../../examples/cantilever.toml");
pub const CONTINUOUS_BEAM: &str = include_str!("../../../../../examples/continuous-beam.toml");
pub const DIGIT: &str = include_str!("../../../../../examples/digit.toml");
pub const EFLESH: &str = include_str!("../../../../../examples/eflesh.toml");
pub const FSI_WATER: &str = include_str!("../../../../../examples/fsi-water.toml");
pub const LOAD_PROFILE: &str = include_str!("../../../../../examples/load-profile.toml");
pub const MOVING_LOAD: &str = include_str!("../../../../../examples/moving-load.toml");
pub const MOVING_PLATE: &str = include_str!("../../../../../examples/moving-plate.toml");
pub const NOISY_BEAM: &str = include_str!("../../../../../examples/noisy-beam.toml");
pub const PAPER: &str = include_str!("../../../../../examples/paper.toml");
pub const PLATE: &str = include_str!("../../../../../examples/plate.toml");
pub const PRESSURE_MAP: &str = include_str!("../../../../../examples/pressure-map.toml");
pub const REAL_FINGER: &str = include_str!("../../../../../examples/real-finger.toml");
pub const SENSOR_DESIGN: &str = include_str!("../../../../../examples/sensor-design.toml");
pub const TRAINING_POSITIONS: &str = include_str!("../../../../../examples/training-positions.toml");
pub const TWO_MOVING_LOADS: &str = include_str!("../../../../../examples/two-moving-loads.toml");

pub const LEFT_OPEN_STUDY: &str = include_str!("../../../../../studies/left-open.toml");
pub const PAPER_STUDY: &str = include_str!("../../../../../studies/paper.toml");
pub const SENSING_POSITIONS_STUDY: &str = include_str!("../../../../../studies/sensing-positions.toml");
pub const SENSOR_KINDS_STUDY: &str = include_str!("../../../../../studies/sensor-kinds.toml");
pub const SPREAD_STUDY: &str = include_str!("../../../../../studies/spread.toml");
