/// Error of a reading that does not fit a tare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TareError {
    /// A wrong number of channels.
    Channels {
        /// Channels of the tare.
        needed: usize,
        /// Channels of the reading.
        found: usize,
    },
    /// A value that is not finite.
    NotFinite {
        /// Channel, from 1.
        channel: usize,
        /// Value.
        value: f64,
    },
}

impl core::fmt::Display for TareError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Channels { needed, found } => {
                write!(f, "the reading has {found} channels; the tare has {needed}")
            }
            Self::NotFinite { channel, value } => {
                write!(f, "channel {channel} reads {value}; it must be a finite number")
            }
        }
    }
}

impl core::error::Error for TareError {}

pub(super) fn check(reading: &[f64], needed: usize) -> Result<(), TareError> {
    if reading.len() != needed {
        return Err(TareError::Channels { needed, found: reading.len() });
    }
    match reading.iter().position(|value| !value.is_finite()) {
        Some(i) => Err(TareError::NotFinite { channel: i + 1, value: reading[i] }),
        None => Ok(()),
    }
}
