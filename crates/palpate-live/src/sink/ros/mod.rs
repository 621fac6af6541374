//! ROS 2 messages through Zenoh, for `rmw_zenoh_cpp`. Only `RosSink`, of the feature `ros`, needs Zenoh.

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
