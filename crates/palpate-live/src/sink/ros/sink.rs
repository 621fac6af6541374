use super::keys::{Keys, TOPICS};
use super::messages::messages;
use super::url::RosUrl;
use crate::frame::Channel;
use crate::input::{Command, Input};
use crate::session::Output;
use crate::sink::{Batch, Sink};
use palpate_mechanics::surface::Extent;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::{Config, Session, Wait};

const WAITING: usize = 1024;
const AGAIN_AFTER: Duration = Duration::from_millis(500);
const LOOK_EVERY: Duration = Duration::from_millis(100);
const PATIENCE: Duration = Duration::from_secs(1);

/// Sink for ROS 2 nodes behind a Zenoh router, with reconnection.
pub struct RosSink {
    to: Option<SyncSender<Arc<Batch>>>,
    lost: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl RosSink {
    /// Node on a router, which may be offline; `reports` receives problems.
    ///
    /// # Errors
    /// The system provides no thread.
    pub fn new(
        url: &RosUrl,
        channels: &[Channel],
        extent: Extent,
        reports: SyncSender<Input>,
    ) -> std::io::Result<Self> {
        let (to, from) = sync_channel(WAITING);
        let lost = Arc::new(AtomicU64::new(0));
        let worker = Worker {
            url: url.clone(),
            channels: channels.to_vec(),
            extent,
            reports,
            lost: Arc::clone(&lost),
            was_there: None,
        };
        let thread =
            std::thread::Builder::new().name("ros-sink".to_owned()).spawn(move || worker.run(&from))?;
        Ok(Self { to: Some(to), lost, thread: Some(thread) })
    }

    /// Lost samples and events.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

impl Sink for RosSink {
    fn batch(&mut self, batch: &Arc<Batch>) {
        let Some(to) = &self.to else { return };
        if to.try_send(Arc::clone(batch)).is_err() {
            self.lost.fetch_add(batch.outputs.len() as u64, Ordering::Relaxed);
        }
    }
}

impl Drop for RosSink {
    fn drop(&mut self) {
        drop(self.to.take());
        let Some(thread) = self.thread.take() else { return };
        let until = Instant::now() + PATIENCE;
        while !thread.is_finished() && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(5));
        }
        // A thread that waits for an unresponsive host ends by itself, seconds later.
        if thread.is_finished() {
            let _ = thread.join();
        }
    }
}

struct Worker {
    url: RosUrl,
    channels: Vec<Channel>,
    extent: Extent,
    reports: SyncSender<Input>,
    lost: Arc<AtomicU64>,
    was_there: Option<bool>,
}

struct Ended;

impl Worker {
    fn run(mut self, batches: &Receiver<Arc<Batch>>) {
        let Ok(session) = self.connect(batches) else { return };
        let url = self.url.clone();
        match Node::new(&session, &url) {
            Ok(mut node) => self.publish(batches, &session, &mut node),
            Err(_) => self.report("refuses the topics; no message is published"),
        }
        // Other ROS nodes then see the end of this node at once.
        let _ = session.close().wait();
    }

    fn connect(&mut self, batches: &Receiver<Arc<Batch>>) -> Result<Session, Ended> {
        loop {
            let opened = config(&self.url.router).and_then(|config| zenoh::open(config).wait());
            // Batches that arrived meanwhile are outdated.
            while let Ok(batch) = batches.try_recv() {
                self.count_lost(&batch);
            }
            match opened {
                Ok(session) => {
                    self.report_router(true);
                    return Ok(session);
                }
                Err(_) => self.report_router(false),
            }
            let again_at = Instant::now() + AGAIN_AFTER;
            while let Some(left) = again_at.checked_duration_since(Instant::now()) {
                match batches.recv_timeout(left) {
                    Ok(batch) => self.count_lost(&batch),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => return Err(Ended),
                }
            }
        }
    }

    fn publish(&mut self, batches: &Receiver<Arc<Batch>>, session: &Session, node: &mut Node<'_>) {
        let mut look_at = Instant::now();
        loop {
            let next = batches.recv_timeout(LOOK_EVERY);
            if Instant::now() >= look_at {
                self.report_router(has_router(session));
                look_at = Instant::now() + LOOK_EVERY;
            }
            match next {
                Ok(batch) if self.was_there == Some(true) => {
                    for output in &batch.outputs {
                        if node.publish(output, &self.channels, self.extent).is_err() {
                            self.lost.fetch_add(1, Ordering::Relaxed);
                        }
                    }
                }
                Ok(batch) => self.count_lost(&batch),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn count_lost(&self, batch: &Batch) {
        self.lost.fetch_add(batch.outputs.len() as u64, Ordering::Relaxed);
    }

    fn report_router(&mut self, is_there: bool) {
        match (self.was_there, is_there) {
            (Some(false), true) => self.report("is there again"),
            (None | Some(true), false) => self.report("cannot be reached; it is tried again"),
            _ => {}
        }
        self.was_there = Some(is_there);
    }

    fn report(&self, what: &str) {
        let text = format!("the Zenoh router {} {what}", self.url.router);
        let _ = self.reports.try_send(Input::Command(Command::Trouble(text)));
    }
}

/// Without a search for other routers.
fn config(router: &str) -> zenoh::Result<Config> {
    let mut config = Config::default();
    config.insert_json5("mode", "\"client\"")?;
    config.insert_json5("connect/endpoints", &format!("[\"{router}\"]"))?;
    config.insert_json5("connect/retry", "{ period_init_ms: 500, period_max_ms: 500 }")?;
    config.insert_json5("scouting/multicast/enabled", "false")?;
    Ok(config)
}

/// True with a router, or a peer that accepts clients.
fn has_router(session: &Session) -> bool {
    let info = session.info();
    info.routers_zid().wait().next().is_some() || info.peers_zid().wait().next().is_some()
}

struct Node<'a> {
    keys: Keys<'a>,
    publishers: Vec<Publisher<'static>>,
    numbers: [i64; TOPICS.len()],
    /// Announce node and publishers.
    _tokens: Vec<LivelinessToken>,
}

impl<'a> Node<'a> {
    fn new(session: &Session, url: &'a RosUrl) -> zenoh::Result<Self> {
        let identity = session.zid();
        let keys = Keys { url, session: (identity.to_string(), identity.to_le_bytes()) };
        let mut tokens = vec![session.liveliness().declare_token(keys.node_token()).wait()?];
        let mut publishers = Vec::with_capacity(TOPICS.len());
        for topic in TOPICS {
            let publisher = session.declare_publisher(keys.data(topic));
            // On a slow network, messages are dropped instead of delaying the others.
            publishers.push(publisher.congestion_control(CongestionControl::Drop).wait()?);
            tokens.push(session.liveliness().declare_token(keys.publisher_token(topic)).wait()?);
        }
        Ok(Self { keys, publishers, numbers: [0; TOPICS.len()], _tokens: tokens })
    }

    fn publish(&mut self, output: &Output, channels: &[Channel], extent: Extent) -> zenoh::Result<()> {
        for message in messages(output, &self.keys.url.frame, channels, extent) {
            let place = message.topic as usize;
            self.numbers[place] += 1;
            let attachment = self.keys.attachment(message.topic, self.numbers[place], message.unix_ns);
            self.publishers[place].put(message.cdr).attachment(attachment.to_vec()).wait()?;
        }
        Ok(())
    }
}
