//! ROS 2 through Zenoh: points, wrenches, estimates and events as messages that nodes of `rmw_zenoh_cpp` take, without an installation of ROS.
//!
//! What is published, as which bytes and under which keys is plain code; only `RosSink`, of the feature `ros`, needs Zenoh.

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
