use super::{Batch, Sink};
use crate::address::Address;
use crate::broker::{broker_and_login, explain};
use crate::frame::Channel;
use crate::input::{Command, Input};
use crate::login::{Login, LoginError, without_passwords};
use crate::rules::{Action, Rule, RuleWatch, Rules};
use crate::sample::SampleRecord;
use crate::session::Output;
use palpate_mechanics::surface::Extent;
use rumqttc::{Client, Connection, ConnectionError, Event, LastWill, MqttOptions, Packet, QoS};
use serde::Serialize;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// URL of a broker with a topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MqttUrl {
    /// Broker.
    pub broker: Address,
    /// User name and password.
    pub login: Option<Login>,
    /// Topic.
    pub topic: String,
}

/// Error of a URL.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}` is not a broker with a topic, as in `mqtt://user@host:1883/bench/contact`: {problem}")]
pub struct MqttUrlError {
    /// Text.
    pub text: String,
    /// Problem.
    pub problem: String,
}

impl FromStr for MqttUrl {
    type Err = MqttUrlError;

    fn from_str(text: &str) -> Result<Self, MqttUrlError> {
        let error =
            |problem: &str| MqttUrlError { text: without_passwords(text), problem: problem.to_owned() };
        let (body, query) = text.split_once('?').unwrap_or((text, ""));
        let rest = body.strip_prefix("mqtt://").ok_or_else(|| error("it does not begin with mqtt://"))?;
        let (server, topic) = rest.split_once('/').ok_or_else(|| error("it has no topic"))?;
        let topic = topic.trim_end_matches('/');
        if topic.is_empty() || topic.len() > 1000 || topic.contains(['+', '#', '\0']) {
            return Err(error("a topic has 1 to 1000 bytes, without + and #"));
        }
        let file = match query.strip_prefix("password-file=") {
            _ if query.is_empty() => None,
            Some(file) => Some(file),
            None => return Err(error("its only parameter is `password-file`")),
        };
        let (broker, login) = broker_and_login(server, topic, file).map_err(|problem| error(&problem))?;
        Ok(Self { broker, login, topic: topic.to_owned() })
    }
}

/// URL without the login.
impl fmt::Display for MqttUrl {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "mqtt://{}/{}", self.broker, self.topic)
    }
}

impl MqttUrl {
    pub(crate) fn options(&self, role: &str) -> Result<MqttOptions, LoginError> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let identity = format!("palpate-{role}-{}-{number}", std::process::id());
        let mut options = MqttOptions::new(identity, &self.broker.host, self.broker.port);
        options.set_keep_alive(Duration::from_secs(5));
        if let Some(login) = &self.login {
            let (user, password) = login.credentials()?;
            options.set_credentials(user, password);
        }
        Ok(options)
    }
}

const WAITING: usize = 1024;
const MESSAGES: usize = 1024;
const AGAIN_AFTER: Duration = Duration::from_millis(500);
const PATIENCE: Duration = Duration::from_millis(150);

/// Sink that publishes samples to `TOPIC/estimate`, events to `TOPIC/event`, and the retained `online` or
/// `offline` to `TOPIC/status`.
pub struct MqttSink {
    to: Option<SyncSender<Arc<Batch>>>,
    lost: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl MqttSink {
    /// Client of a broker, which may be offline; `reports` receives problems.
    ///
    /// # Errors
    /// The system provides no thread.
    pub fn new(
        url: &MqttUrl,
        channels: &[Channel],
        extent: Extent,
        rules: Rules,
        reports: SyncSender<Input>,
    ) -> std::io::Result<Self> {
        let (to, from) = sync_channel(WAITING);
        let lost = Arc::new(AtomicU64::new(0));
        let publisher = Publisher::open(url, reports, Arc::clone(&lost))?;
        let channels = channels.to_vec();
        let rules = RuleWatch::new(rules);
        let work = move || publisher.run(&from, &channels, extent, rules);
        let thread = std::thread::Builder::new().name("mqtt-sink".to_owned()).spawn(work)?;
        Ok(Self { to: Some(to), lost, thread: Some(thread) })
    }

    /// Lost messages, counted until the end.
    pub fn lost(&self) -> Arc<AtomicU64> {
        Arc::clone(&self.lost)
    }
}

impl Sink for MqttSink {
    fn batch(&mut self, batch: &Arc<Batch>) {
        let Some(to) = &self.to else { return };
        if to.try_send(Arc::clone(batch)).is_err() {
            self.lost.fetch_add(batch.outputs.len() as u64, Ordering::Relaxed);
        }
    }
}

impl Drop for MqttSink {
    fn drop(&mut self) {
        drop(self.to.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Publisher {
    client: Client,
    topic: String,
    online: Arc<AtomicBool>,
    done: Arc<AtomicBool>,
    lost: Arc<AtomicU64>,
}

impl Publisher {
    fn open(url: &MqttUrl, reports: SyncSender<Input>, lost: Arc<AtomicU64>) -> std::io::Result<Self> {
        let status = format!("{}/status", url.topic);
        let mut options = url.options("session").map_err(std::io::Error::other)?;
        options.set_last_will(LastWill::new(&status, "offline", QoS::AtLeastOnce, true));
        let (client, connection) = Client::new(options, MESSAGES);
        let (online, done) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        let driver = Driver {
            client: client.clone(),
            status,
            name: url.to_string(),
            online: Arc::clone(&online),
            done: Arc::clone(&done),
            reports,
        };
        std::thread::Builder::new().name("mqtt".to_owned()).spawn(move || driver.run(connection))?;
        Ok(Self { client, topic: url.topic.clone(), online, done, lost })
    }

    fn run(self, batches: &Receiver<Arc<Batch>>, channels: &[Channel], extent: Extent, mut rules: RuleWatch) {
        loop {
            let batch = match batches.recv_timeout(AGAIN_AFTER) {
                Ok(batch) => batch,
                Err(RecvTimeoutError::Timeout) => continue,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            for output in &batch.outputs {
                rules.add(output, |rule| self.act(rule));
                match output {
                    Output::Sample(sample) => {
                        self.publish("estimate", &SampleRecord::new(sample, channels, extent));
                    }
                    Output::Event(event) => self.publish("event", event),
                }
            }
        }
        self.publish_offline();
    }

    fn publish(&self, topic: &str, record: &impl Serialize) {
        let sent = self.online.load(Ordering::Relaxed)
            && serde_json::to_vec(record).is_ok_and(|json| {
                self.client
                    .try_publish(format!("{}/{topic}", self.topic), QoS::AtMostOnce, false, json)
                    .is_ok()
            });
        if !sent {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The message waits for a disconnected broker.
    fn act(&self, rule: &Rule) {
        let Action::Publish { topic, message } = &rule.action else { return };
        if self.client.try_publish(topic, QoS::AtLeastOnce, false, message.as_bytes()).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn publish_offline(&self) {
        if !self.online.load(Ordering::Relaxed) {
            // The broker has published the last will of this client; the driver ends with the process.
            self.done.store(true, Ordering::Relaxed);
            return;
        }
        let status = format!("{}/status", self.topic);
        let _ = self.client.try_publish(status, QoS::AtLeastOnce, true, "offline");
        let _ = self.client.try_disconnect();
        let until = Instant::now() + PATIENCE;
        while !self.done.load(Ordering::Relaxed) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(5));
        }
        self.done.store(true, Ordering::Relaxed);
    }
}

/// Connection in a separate thread, because it waits for the broker.
struct Driver {
    client: Client,
    status: String,
    name: String,
    online: Arc<AtomicBool>,
    done: Arc<AtomicBool>,
    reports: SyncSender<Input>,
}

impl Driver {
    fn run(self, mut connection: Connection) {
        // True if the broker was available at the last event.
        let mut was_there = None;
        for event in connection.iter() {
            match event {
                Ok(Event::Incoming(Packet::ConnAck(_))) => {
                    let _ = self.client.try_publish(&self.status, QoS::AtLeastOnce, true, "online");
                    self.online.store(true, Ordering::Relaxed);
                    if was_there == Some(false) {
                        self.report("is there again");
                    }
                    was_there = Some(true);
                }
                Ok(Event::Outgoing(rumqttc::Outgoing::Disconnect)) | Err(ConnectionError::RequestsDone) => {
                    break;
                }
                Ok(_) => {}
                Err(error) => {
                    self.online.store(false, Ordering::Relaxed);
                    if self.done.load(Ordering::Relaxed) {
                        break;
                    }
                    if was_there != Some(false) {
                        let text = format!("{}; it is tried again", explain(&self.name, &error));
                        let _ = self.reports.try_send(Input::Command(Command::Trouble(text)));
                    }
                    was_there = Some(false);
                    std::thread::sleep(AGAIN_AFTER);
                }
            }
        }
        self.done.store(true, Ordering::Relaxed);
    }

    fn report(&self, what: &str) {
        let text = format!("the broker {} {what}", self.name);
        let _ = self.reports.try_send(Input::Command(Command::Trouble(text)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn urls_give_broker_login_and_topic() {
        let url: MqttUrl = "mqtt://me:secret@bench.local:1884/left/contact".parse().unwrap();
        assert_eq!((url.broker.host.as_str(), url.broker.port), ("bench.local", 1884));
        assert_eq!(url.topic, "left/contact");
        let login = url.login.as_ref().unwrap().credentials().unwrap();
        assert_eq!(login, ("me".to_owned(), "secret".to_owned()));
        assert!(!format!("{url:?}").contains("secret"));
        assert_eq!(url.to_string(), "mqtt://bench.local:1884/left/contact");
        assert_eq!("mqtt://h/t".parse::<MqttUrl>().unwrap().broker.port, 1883);
        let error = "mqtt://me:secret@h/a/#".parse::<MqttUrl>().unwrap_err().to_string();
        assert!(error.contains("mqtt://me:***@h/a/#") && !error.contains("secret"), "{error}");
        for wrong in ["mqtt://h", "mqtt:///t", "mqtt://h:x/t", "mqtt://h/a/#", "http://h/t", "mqtt://h/"] {
            assert!(wrong.parse::<MqttUrl>().is_err(), "{wrong}");
        }
    }
}
