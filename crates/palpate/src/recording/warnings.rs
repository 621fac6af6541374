//! What looks wrong with a recording, though it can be used.
use std::fmt;

/// Something about a recording that its owner should look at.
#[derive(Clone, Debug, PartialEq)]
pub enum Warning {
    /// A channel has the same value in every row.
    Dead {
        /// The channel's name.
        channel: String,
        /// The value, in the SI unit of its kind (or raw).
        value: f64,
    },
}
impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Dead { channel, value } => {
                write!(f, "channel `{channel}` reads {value} in every row; is it connected?")
            }
        }
    }
}
