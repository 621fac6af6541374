//! A client of an MQTT broker that publishes frames.

use crate::sink::MqttUrl;
use rumqttc::{Client, QoS};
use std::time::Duration;

/// Messages that wait for the broker at most.
const WAITING: usize = 256;
/// Time before it is tried again to reach the broker.
const AGAIN_AFTER: Duration = Duration::from_millis(500);

/// A publisher on a topic.
pub struct Publisher {
    client: Client,
    topic: String,
}

impl Publisher {
    pub fn open(url: &MqttUrl) -> std::io::Result<Self> {
        let (client, mut connection) = Client::new(url.options("board"), WAITING);
        std::thread::Builder::new().name("mqtt".to_owned()).spawn(move || {
            // It ends when the client has gone.
            for event in connection.iter() {
                if let Err(error) = event {
                    if matches!(error, rumqttc::ConnectionError::RequestsDone) {
                        return;
                    }
                    std::thread::sleep(AGAIN_AFTER);
                }
            }
        })?;
        Ok(Self { client, topic: url.topic.clone() })
    }

    /// Publishes a frame; false where too many wait for the broker.
    pub fn publish(&self, frame: &[u8]) -> bool {
        self.client.try_publish(&self.topic, QoS::AtMostOnce, false, frame).is_ok()
    }
}
