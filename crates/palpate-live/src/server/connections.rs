//! Connections of the server, limited in time and number.
//!
//! Idle clients must not block the stop of a machine: at the limit, a new connection replaces the oldest
//! incomplete one. Streams (`stream.rs`) have their own limit.

use axum::Router;
use axum::extract::Request;
use hyper::body::{Body, Incoming};
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::convert::Infallible;
use std::io::ErrorKind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream};
use tokio::task::AbortHandle;

/// Time for the head of a request, or for idling: one or two packets arrive within a second, even with a
/// retransmission.
const HEAD_WITHIN: Duration = Duration::from_secs(10);
/// Time for a body: 64 kB take a second at 0.5 Mbit/s.
const BODY_WITHIN: Duration = Duration::from_secs(10);
/// Limit on connections, and on streams; browsers open six each.
const MOST: usize = 256;
/// Time for a closed connection to free its files.
const TAKE_AGAIN: Duration = Duration::from_millis(20);

/// Limit on connections, and on streams: each at most a quarter of the process's file limit.
pub fn most_open() -> usize {
    (most_files() / 4).clamp(1, MOST)
}

#[cfg(unix)]
fn most_files() -> usize {
    use nix::sys::resource::{Resource, getrlimit};
    let most = getrlimit(Resource::RLIMIT_NOFILE).map(|(soft, _)| soft).ok();
    most.and_then(|most| usize::try_from(most).ok()).unwrap_or(usize::MAX)
}

#[cfg(not(unix))]
fn most_files() -> usize {
    usize::MAX
}

#[derive(Clone, Copy, Debug)]
pub struct ConnectionLimits {
    head_within: Duration,
    body_within: Duration,
    most: usize,
}

impl Default for ConnectionLimits {
    fn default() -> Self {
        Self { head_within: HEAD_WITHIN, body_within: BODY_WITHIN, most: most_open() }
    }
}

/// Connection, as an extension of its requests.
#[derive(Clone, Debug)]
pub struct Connection {
    pub body_within: Duration,
    has_asked: Arc<AtomicBool>,
}

impl Connection {
    pub fn note_whole_request(&self) {
        self.has_asked.store(true, Ordering::Relaxed);
    }
}

pub async fn serve(listener: TcpListener, router: Router, bounds: ConnectionLimits) -> Infallible {
    let mut open = Open::default();
    loop {
        match listener.accept().await {
            Ok((stream, _)) => {
                open.make_room(bounds.most);
                open.take(stream, router.clone(), bounds);
                // Reads this connection before the next accept; many simultaneous ones could otherwise close
                // it unread.
                tokio::task::yield_now().await;
            }
            // Closed by the client.
            Err(error) if is_of_the_other_end(error.kind()) => {}
            // An immediate retry would be a busy loop.
            Err(_) => {
                open.close_one();
                tokio::time::sleep(TAKE_AGAIN).await;
            }
        }
    }
}

fn is_of_the_other_end(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::ConnectionAborted | ErrorKind::ConnectionReset | ErrorKind::ConnectionRefused)
}

/// Active connections, the oldest first.
#[derive(Default)]
struct Open(Vec<(AbortHandle, Connection)>);

impl Open {
    fn make_room(&mut self, most: usize) {
        self.0.retain(|(task, _)| !task.is_finished());
        if self.0.len() >= most {
            self.close_one();
        }
    }

    /// Closes the oldest incomplete connection, or else the oldest.
    fn close_one(&mut self) {
        let asks = |(_, connection): &(_, Connection)| !connection.has_asked.load(Ordering::Relaxed);
        let oldest = self.0.iter().position(asks).unwrap_or(0);
        if oldest < self.0.len() {
            self.0.remove(oldest).0.abort();
        }
    }

    fn take(&mut self, stream: TcpStream, router: Router, bounds: ConnectionLimits) {
        // Does not wait for acknowledgements.
        let _ = stream.set_nodelay(true);
        let connection =
            Connection { body_within: bounds.body_within, has_asked: Arc::new(AtomicBool::new(false)) };
        let task = tokio::spawn(serve_connection(stream, router, bounds.head_within, connection.clone()));
        self.0.push((task.abort_handle(), connection));
    }
}

/// Serves a connection until a WebSocket or the end.
async fn serve_connection(stream: TcpStream, router: Router, head_within: Duration, connection: Connection) {
    let router = TowerToHyperService::new(router);
    let service = service_fn(move |mut request: Request<Incoming>| {
        if request.body().is_end_stream() {
            connection.note_whole_request();
        }
        request.extensions_mut().insert(connection.clone());
        router.call(request)
    });
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(head_within);
    // The recipient of the error is gone.
    let _ = http.serve_connection(TokioIo::new(stream), service).with_upgrades().await;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::server::body::JsonBody;
    use axum::routing::{get, post};
    use serde_json::Value;
    use std::io::{Read, Write};
    use std::net::SocketAddr;
    use std::time::Instant;

    const GET: &str = "GET / HTTP/1.1\r\nHost: here\r\n\r\n";

    fn served(bounds: ConnectionLimits) -> SocketAddr {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let address = listener.local_addr().unwrap();
        let router = Router::new().route("/", get(async || "well"));
        let router = router.route("/body", post(async |JsonBody(body): JsonBody<Value>| body.to_string()));
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
            runtime.block_on(async {
                serve(TcpListener::from_std(listener).unwrap(), router, bounds).await;
            });
        });
        address
    }

    fn bounds() -> ConnectionLimits {
        let time = Duration::from_millis(300);
        ConnectionLimits { head_within: time, body_within: time, most: 3 }
    }

    fn asked(address: SocketAddr, request: &str) -> std::net::TcpStream {
        let mut stream = std::net::TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        stream
    }

    fn until_closed(mut stream: std::net::TcpStream) -> (String, Duration) {
        let (start, mut answer) = (Instant::now(), Vec::new());
        // Unread bytes cause a reset.
        let ended = stream.read_to_end(&mut answer);
        assert!(ended.is_ok() || start.elapsed() < Duration::from_secs(9), "it is still open");
        (String::from_utf8(answer).unwrap(), start.elapsed())
    }

    #[test]
    fn late_requests_are_closed() {
        let address = served(bounds());
        for (request, answer) in [
            ("", ""),
            ("GET / HTTP/1.1\r\nHost:", ""),
            ("POST /body HTTP/1.1\r\nHost: here\r\nContent-Length: 9\r\n\r\n[1,", "HTTP/1.1 408"),
            // Idle after an answered request.
            (GET, "HTTP/1.1 200"),
        ] {
            let (told, elapsed) = until_closed(asked(address, request));
            assert!(told.starts_with(answer) && told.is_empty() == answer.is_empty(), "{request}: {told}");
            assert!(elapsed > Duration::from_millis(200), "{request}: {elapsed:?}");
        }
    }

    #[test]
    fn a_connection_too_many_closes_the_oldest_that_has_not_asked() {
        let address = served(ConnectionLimits { head_within: Duration::from_secs(60), ..bounds() });
        let whole = |stream: &mut std::net::TcpStream| {
            let mut answer = [0; 12];
            stream.read_exact(&mut answer).map(|()| assert_eq!(&answer, b"HTTP/1.1 200"))
        };
        let mut first = asked(address, GET);
        whole(&mut first).unwrap();
        let [second, third] = ["", "GET /"].map(|begin| asked(address, begin));
        let mut fourth = asked(address, GET);
        whole(&mut fourth).unwrap();
        assert_eq!(until_closed(second).0, "");
        let mut fifth = asked(address, GET);
        whole(&mut fifth).unwrap();
        assert_eq!(until_closed(third).0, "");
        // All are complete: the oldest is closed.
        let mut sixth = asked(address, GET);
        whole(&mut sixth).unwrap();
        until_closed(first);
        for mut stays in [fourth, fifth, sixth] {
            stays.write_all(GET.as_bytes()).unwrap();
            let mut answer = [0; 300];
            assert!(stays.read(&mut answer).unwrap() > 0);
        }
    }
}
