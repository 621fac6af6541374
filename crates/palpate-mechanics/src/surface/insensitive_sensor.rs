//! Why a sensor would read nothing, wherever the surface is touched.

use crate::sensing::SensorKind;

/// Why a sensor reads nothing, wherever the surface is touched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InsensitiveSensor {
    /// A support of a beam holds what it measures.
    #[error("{} there", held(*kind))]
    Held {
        /// What the sensor measures.
        kind: SensorKind,
    },
    /// The edge of a plate cannot move so.
    #[error("the {edge} edge, which is {held}, has no {kind} wherever the plate is touched")]
    AtEdge {
        /// Which edge.
        edge: &'static str,
        /// How it is held.
        held: &'static str,
        /// What the sensor measures.
        kind: SensorKind,
    },
    /// The deflection of a plate over a support that does not give.
    #[error("simple support {number} keeps the plate from deflecting there")]
    AtSupport {
        /// Which support, from 1.
        number: usize,
    },
}

/// What keeps a sensor of this kind still.
fn held(kind: SensorKind) -> &'static str {
    match kind {
        SensorKind::Deflection => "a support holds the surface",
        SensorKind::Slope => "a support holds the slope",
        SensorKind::Strain => "nothing bends the surface",
        SensorKind::Reaction | SensorKind::Raw => "nothing acts",
    }
}
