//! Connections of the server: how long each may take to ask, and how many are open at once.
//!
//! Who opens connections and asks nothing must not shut out the others, least of all the request that stops a machine. A request has its
//! time; and where as many connections are open as may be, the next one is taken all the same, and another is closed for it: the oldest that
//! has not brought a whole request yet. A WebSocket is none of them any more, as it has a place of its own (`stream.rs`).

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

/// Time in which the head of a request must come, and for which a connection may stay open between two requests. A head is a packet or two; on a
/// network that carries the stream they come within a second, also where one is lost and sent again.
const HEAD_WITHIN: Duration = Duration::from_secs(10);
/// Time in which the body of a request must come: at most 64 kB, a second at 0.5 Mbit/s.
const BODY_WITHIN: Duration = Duration::from_secs(10);
/// Most connections that are open at once, and most streams: more than the browsers of a bench need, which open six each.
const MOST: usize = 256;
/// Wait after a connection that could not be taken as no file descriptor was left, until those of a connection that is closed for it are.
const TAKE_AGAIN: Duration = Duration::from_millis(20);

/// Most connections that are open at once, and most streams beside them: each has at most a quarter of the files that the process may have open, so
/// that sources, recordings and locators always have some.
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

/// Bounds of connections.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    head_within: Duration,
    body_within: Duration,
    most: usize,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { head_within: HEAD_WITHIN, body_within: BODY_WITHIN, most: most_open() }
    }
}

/// Connection of a request, which carries it as an extension.
#[derive(Clone, Debug)]
pub struct Connection {
    /// Time in which a body must come.
    pub body_within: Duration,
    /// True once a whole request has come on it.
    has_asked: Arc<AtomicBool>,
}

impl Connection {
    /// Notes that a request has come to the end of its body.
    pub fn note_whole_request(&self) {
        self.has_asked.store(true, Ordering::Relaxed);
    }
}

/// Takes connections and answers their requests, for ever.
pub async fn serve(listener: TcpListener, router: Router, bounds: Bounds) -> Infallible {
    let mut open = Open::default();
    loop {
        match listener.accept().await {
            Ok((stream, _)) => {
                open.make_room(bounds.most);
                open.take(stream, router.clone(), bounds);
                // It is read before the next one is taken, lest many that come at once close it unread.
                tokio::task::yield_now().await;
            }
            // The other end has gone before it was taken.
            Err(error) if is_of_the_other_end(error.kind()) => {}
            // Tried at once it would fail again, for ever and as fast as the machine can.
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

/// Connections that are open, the oldest first.
#[derive(Default)]
struct Open(Vec<(AbortHandle, Connection)>);

impl Open {
    /// Forgets connections that have ended, and closes one where `most` are open.
    fn make_room(&mut self, most: usize) {
        self.0.retain(|(task, _)| !task.is_finished());
        if self.0.len() >= most {
            self.close_one();
        }
    }

    /// Closes the oldest connection that has not brought a whole request; where all have, the oldest.
    fn close_one(&mut self) {
        let asks = |(_, connection): &(_, Connection)| !connection.has_asked.load(Ordering::Relaxed);
        let oldest = self.0.iter().position(asks).unwrap_or(0);
        if oldest < self.0.len() {
            self.0.remove(oldest).0.abort();
        }
    }

    fn take(&mut self, stream: TcpStream, router: Router, bounds: Bounds) {
        // A message leaves at once, whatever the one before it became of.
        let _ = stream.set_nodelay(true);
        let connection =
            Connection { body_within: bounds.body_within, has_asked: Arc::new(AtomicBool::new(false)) };
        let task = tokio::spawn(answer(stream, router, bounds.head_within, connection.clone()));
        self.0.push((task.abort_handle(), connection));
    }
}

/// Answers the requests of a connection, until it is closed or becomes a WebSocket.
async fn answer(stream: TcpStream, router: Router, head_within: Duration, connection: Connection) {
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
    // What ends a connection is nothing that anybody could be told of.
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

    /// A server of these bounds in a thread that ends with the test, and its address.
    fn served(bounds: Bounds) -> SocketAddr {
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

    fn bounds() -> Bounds {
        let time = Duration::from_millis(300);
        Bounds { head_within: time, body_within: time, most: 3 }
    }

    fn asked(address: SocketAddr, request: &str) -> std::net::TcpStream {
        let mut stream = std::net::TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        stream
    }

    /// Bytes that come until the connection is closed, and the time until then.
    fn until_closed(mut stream: std::net::TcpStream) -> (String, Duration) {
        let (start, mut answer) = (Instant::now(), Vec::new());
        // An end that is closed with bytes unread is a reset.
        let ended = stream.read_to_end(&mut answer);
        assert!(ended.is_ok() || start.elapsed() < Duration::from_secs(9), "it is still open");
        (String::from_utf8(answer).unwrap(), start.elapsed())
    }

    #[test]
    fn what_does_not_come_in_its_time_is_not_waited_for() {
        let address = served(bounds());
        for (request, answer) in [
            ("", ""),
            ("GET / HTTP/1.1\r\nHost:", ""),
            ("POST /body HTTP/1.1\r\nHost: here\r\nContent-Length: 9\r\n\r\n[1,", "HTTP/1.1 408"),
            // One that was answered and asks nothing more.
            (GET, "HTTP/1.1 200"),
        ] {
            let (told, elapsed) = until_closed(asked(address, request));
            assert!(told.starts_with(answer) && told.is_empty() == answer.is_empty(), "{request}: {told}");
            assert!(elapsed > Duration::from_millis(200), "{request}: {elapsed:?}");
        }
    }

    #[test]
    fn a_connection_too_many_closes_the_oldest_that_has_not_asked() {
        let address = served(Bounds { head_within: Duration::from_secs(60), ..bounds() });
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
        // All that are open have asked: the oldest goes.
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
