//! `mqtt://host/topic`: messages of an MQTT broker.

use super::{Address, BackOff, CONNECT, InputSender, LOOK, forget};
use crate::broker::explain;
use crate::frame::LONGEST_MESSAGE;
use crate::input::Arrival;
use rumqttc::{
    AsyncClient, ConnectionError, Event, EventLoop, MqttOptions, NetworkOptions, Packet, QoS,
    SubscribeReasonCode,
};
use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::pin::pin;
use std::sync::mpsc::Receiver;
use std::time::Duration;

/// Limit of MQTT, because the client disconnects beyond it; longer frames are truncated to a bad one.
const LARGEST: usize = 256 << 20;
type Credentials = (String, String);
/// The broker is lost after twice as much. The client requires 1 s.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

pub fn run(
    outlet: &InputSender,
    commands: &Receiver<Vec<u8>>,
    broker: &Address,
    login: Option<Credentials>,
    topic: &str,
) {
    match tokio::runtime::Builder::new_current_thread().enable_all().build() {
        Ok(runtime) => {
            runtime.block_on(read_broker(outlet, commands, broker, login, topic));
            // This does not wait for a pending name lookup.
            runtime.shutdown_background();
        }
        Err(error) => {
            outlet.send(Arrival::Lost(error.to_string()));
        }
    }
}

async fn read_broker(
    outlet: &InputSender,
    commands: &Receiver<Vec<u8>>,
    broker: &Address,
    login: Option<Credentials>,
    topic: &str,
) {
    let (client, mut events) = connection(broker, login);
    let command_topic = format!("{topic}/command");
    let mut back_off = BackOff::new();
    let mut said = String::new();
    while let Some(event) = next(outlet, &mut events, || {
        while let Ok(command) = commands.try_recv() {
            // The queue of the client is longer than that of commands.
            let _ = client.try_publish(&command_topic, QoS::AtMostOnce, false, command);
        }
    })
    .await
    {
        let why = match event {
            Ok(Event::Incoming(Packet::ConnAck(_))) => {
                // A restarted broker has lost the subscriptions.
                let asked = client.try_subscribe(topic, QoS::AtMostOnce);
                asked.err().map(|error| error.to_string())
            }
            Ok(Event::Incoming(Packet::SubAck(answer))) => {
                if answer.return_codes.contains(&SubscribeReasonCode::Failure) {
                    Some(format!("the broker {broker} refuses the topic {topic}"))
                } else {
                    said.clear();
                    forget(commands);
                    if !outlet.send(Arrival::Opened(format!("mqtt://{broker}/{topic}"))) {
                        return;
                    }
                    None
                }
            }
            // A retained message is an old reading.
            Ok(Event::Incoming(Packet::Publish(message))) if !message.retain => {
                back_off = BackOff::new();
                let length = message.payload.len().min(LONGEST_MESSAGE + 1);
                if !outlet.send(Arrival::Message(message.payload[..length].to_vec())) {
                    return;
                }
                None
            }
            Ok(_) => None,
            Err(error) => Some(explain(&broker.to_string(), &error)),
        };
        if let Some(why) = why {
            // Each cause is reported once.
            if why != said && !outlet.send(Arrival::Lost(why.clone())) {
                return;
            }
            said = why;
            outlet.pause(back_off.next());
        }
    }
}

fn connection(broker: &Address, login: Option<Credentials>) -> (AsyncClient, EventLoop) {
    // Two clients with one name would disconnect each other.
    let name = format!("palpate-{:016x}", RandomState::new().hash_one(0));
    let mut options = MqttOptions::new(name, &broker.host, broker.port);
    options.set_keep_alive(KEEP_ALIVE).set_max_packet_size(LARGEST, LARGEST);
    if let Some((user, password)) = login {
        options.set_credentials(user, password);
    }
    let (client, mut events) = AsyncClient::new(options, 64);
    let mut network = NetworkOptions::new();
    network.set_tcp_nodelay(true);
    network.set_connection_timeout(CONNECT.as_secs());
    events.set_network_options(network);
    (client, events)
}

/// Waits for a packet, and calls `look` repeatedly.
async fn next(
    outlet: &InputSender,
    events: &mut EventLoop,
    look: impl Fn(),
) -> Option<Result<Event, ConnectionError>> {
    // One future for all iterations: to drop it would lose a pending connection.
    let mut event = pin!(events.poll());
    loop {
        if outlet.is_stopped() {
            return None;
        }
        look();
        if let Ok(event) = tokio::time::timeout(LOOK, &mut event).await {
            return Some(event);
        }
    }
}
