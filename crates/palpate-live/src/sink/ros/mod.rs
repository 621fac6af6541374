//! ROS 2 through Zenoh: points, wrenches, estimates and events as messages for nodes of `rmw_zenoh_cpp`, without an installation of ROS.
//!
//! The messages, their bytes and their keys are made without Zenoh; only `RosSink`, of the feature `ros`, needs it.

mod cdr;
mod keys;
mod messages;
#[cfg(feature = "ros")]
mod sink;
mod url;

pub use keys::{Keys, TOPICS, Topic};
pub use messages::{RosMessage, messages};
#[cfg(feature = "ros")]
pub use sink::RosSink;
pub use url::{RosUrl, RosUrlError};
