use palpate_estimators::recording::Column;
use palpate_estimators::setup::Setup;
use palpate_mechanics::units::Unit;

/// Channel of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name of the sensor.
    pub name: String,
    /// Name in frames: that of the column in the calibration recordings, else of the sensor.
    pub label: String,
    /// Unit in frames and recordings.
    pub unit: Unit,
}

impl Channel {
    /// Channels of a setup in order.
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
