//! An MQTT client that publishes frames.

use crate::broker::explain;
use crate::sink::MqttUrl;
use rumqttc::{Client, Connection, ConnectionError, Event, Packet, QoS};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

/// Most messages that wait for the broker.
const WAITING: usize = 256;
/// Time between two attempts to reach the broker.
const AGAIN_AFTER: Duration = Duration::from_millis(500);

/// A publisher on a topic.
pub struct Publisher {
    client: Client,
    topic: String,
    /// Messages that the broker was lost or is there again.
    news: Receiver<String>,
}

impl Publisher {
    pub fn open(url: &MqttUrl) -> std::io::Result<Self> {
        let (client, connection) = Client::new(url.options("board").map_err(std::io::Error::other)?, WAITING);
        let (tell, news) = channel();
        let broker = url.broker.to_string();
        std::thread::Builder::new()
            .name("mqtt".to_owned())
            .spawn(move || drive(connection, &broker, &tell))?;
        Ok(Self { client, topic: url.topic.clone(), news })
    }

    /// The next message that the broker was lost or is there again.
    pub fn news(&self) -> Option<String> {
        self.news.try_recv().ok()
    }

    /// Publishes a frame; false if too many wait for the broker.
    pub fn publish(&self, frame: &[u8]) -> bool {
        self.client.try_publish(&self.topic, QoS::AtMostOnce, false, frame).is_ok()
    }
}

/// Keeps the connection until the client has gone, and reports once when the broker is lost and when it is there again.
fn drive(mut connection: Connection, broker: &str, tell: &Sender<String>) {
    let mut is_away = false;
    for event in connection.iter() {
        let words = match event {
            Err(ConnectionError::RequestsDone) => return,
            Err(error) if !is_away => {
                is_away = true;
                format!("{}, it is tried again", explain(broker, &error))
            }
            Err(_) => {
                std::thread::sleep(AGAIN_AFTER);
                continue;
            }
            Ok(Event::Incoming(Packet::ConnAck(_))) if is_away => {
                is_away = false;
                format!("the broker {broker} is there")
            }
            Ok(_) => continue,
        };
        // The receiver is gone once the board has ended.
        let _ = tell.send(words);
    }
}
