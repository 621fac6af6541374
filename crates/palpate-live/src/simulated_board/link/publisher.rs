use crate::broker::explain;
use crate::sink::MqttUrl;
use rumqttc::{Client, Connection, ConnectionError, Event, Packet, QoS};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

const WAITING: usize = 256;
const AGAIN_AFTER: Duration = Duration::from_millis(500);

pub struct Publisher {
    client: Client,
    topic: String,
    messages: Receiver<String>,
}

impl Publisher {
    pub fn open(url: &MqttUrl) -> std::io::Result<Self> {
        let (client, connection) = Client::new(url.options("board").map_err(std::io::Error::other)?, WAITING);
        let (tell, news) = channel();
        let broker = url.broker.to_string();
        std::thread::Builder::new()
            .name("mqtt".to_owned())
            .spawn(move || drive(connection, &broker, &tell))?;
        Ok(Self { client, topic: url.topic.clone(), messages: news })
    }

    pub fn next_message(&self) -> Option<String> {
        self.messages.try_recv().ok()
    }

    /// Publishes a frame; false if too many wait.
    pub fn publish(&self, frame: &[u8]) -> bool {
        self.client.try_publish(&self.topic, QoS::AtMostOnce, false, frame).is_ok()
    }
}

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
        // The receiver is dropped at the end of the board.
        let _ = tell.send(words);
    }
}
