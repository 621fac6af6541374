//! Channels of frames.

use palpate_estimators::recording::Column;
use palpate_estimators::setup::Setup;
use palpate_mechanics::units::Unit;

/// Channel of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name of the sensor.
    pub name: String,
    /// Name in the frames of a board: the column of the locator's calibration recordings, if it has a name.
    pub label: String,
    /// Unit of the numbers of the board, which is that of the recordings.
    pub unit: Unit,
}

impl Channel {
    /// Channels of the boards of a setup, in the order of its sensors.
    pub fn all_of(setup: &Setup) -> Vec<Self> {
        let columns = setup.recording_columns().channels;
        let sensors = setup.layout().sensors().iter();
        sensors
            .zip(columns)
            .map(|(sensor, column)| Self {
                name: sensor.name.clone(),
                label: match column.column {
                    Column::Name(label) => label,
                    Column::Number(_) => sensor.name.clone(),
                },
                unit: column.unit,
            })
            .collect()
    }
}
