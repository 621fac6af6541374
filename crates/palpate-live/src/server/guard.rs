//! Guard: access control.

use super::body::ErrorAnswer;
use super::lock::locked;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const SHORTEST_TOKEN: usize = 16;
const POSTS_A_SECOND: u32 = 50;

/// Stop of a machine, exempt from the limit on posts.
pub const EMERGENCY_STOP: &str = "/api/emergency-stop";

const HEADERS: [(HeaderName, &str); 5] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'self'; img-src 'self' data:; object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::CACHE_CONTROL, "no-cache"),
];

/// Error of an access configuration.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// A reachable address needs a token.
    #[error("{address} can be reached from other machines, but no token is set")]
    NoToken {
        /// Address.
        address: IpAddr,
    },
    /// Invalid token.
    #[error(
        "the token has {length} characters; it must have at least {SHORTEST_TOKEN}, each a letter, a digit, `-`, `.`, `_` or `~`"
    )]
    Token {
        /// Number of characters.
        length: usize,
    },
}

/// Access permissions of a server.
#[derive(Clone, Debug, Default)]
pub struct Access {
    token: Option<String>,
    host_names: Vec<String>,
    address: Option<IpAddr>,
}

impl Access {
    /// Permissions at an address. `host_names` are further names of this machine.
    ///
    /// # Errors
    /// [`AccessError`] for an invalid token, or a reachable address without one.
    pub fn new(
        address: SocketAddr,
        token: Option<String>,
        host_names: Vec<String>,
    ) -> Result<Self, AccessError> {
        let of_a_url = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
        match &token {
            Some(token) if token.len() < SHORTEST_TOKEN || !token.bytes().all(of_a_url) => {
                Err(AccessError::Token { length: token.len() })
            }
            None if !address.ip().is_loopback() => Err(AccessError::NoToken { address: address.ip() }),
            _ => Ok(Self { token, host_names, address: None }),
        }
    }

    pub(super) fn listening_at(self, address: IpAddr) -> Self {
        Self { address: Some(address), ..self }
    }

    fn check(&self, request: &Request) -> Result<(), ErrorAnswer> {
        let headers = request.headers();
        check_single(headers)?;
        let host = text(headers, header::HOST).unwrap_or_default();
        // A request line with a whole URL also names the server.
        let authority = request.uri().authority().map(|authority| authority.as_str());
        if let Some(host) = [host].into_iter().chain(authority).find(|name| !self.is_own(name)) {
            return Err(ErrorAnswer::new(
                StatusCode::FORBIDDEN,
                format!("this server is not called `{host}`"),
                "call it by its address, or start it with --host-name NAME",
            ));
        }
        let changes = request.method() != Method::GET && request.method() != Method::HEAD;
        let is_stream = headers.contains_key(header::UPGRADE);
        if let (true, Some(origin)) = (changes || is_stream, text(headers, header::ORIGIN)) {
            let same = origin.split_once("://").is_some_and(|(_, rest)| rest.eq_ignore_ascii_case(host));
            if !same {
                return Err(ErrorAnswer::new(
                    StatusCode::FORBIDDEN,
                    format!("a page of {origin} may not control this server"),
                    "open the page that this server itself serves",
                ));
            }
        }
        match &self.token {
            Some(token)
                if !token_of(request).is_some_and(|given| equal(given.as_bytes(), token.as_bytes())) =>
            {
                Err(ErrorAnswer::new(
                    StatusCode::UNAUTHORIZED,
                    "the token is missing or wrong",
                    "give it as `?token=T`, or as the header `Authorization: Bearer T`",
                ))
            }
            _ => Ok(()),
        }
    }

    /// True for a name of this server; prevents DNS rebinding.
    fn is_own(&self, host: &str) -> bool {
        let name = match host.strip_prefix('[') {
            Some(rest) => rest.split(']').next().unwrap_or_default(),
            None => host.split(':').next().unwrap_or_default(),
        };
        if let Ok(address) = name.parse::<IpAddr>() {
            // 0.0.0.0 includes all addresses.
            let own = self.address.is_some_and(|own| own == address || own.is_unspecified());
            return own || address.is_loopback();
        }
        let named = |own: &String| own.eq_ignore_ascii_case(name);
        name.eq_ignore_ascii_case("localhost") || self.host_names.iter().any(named)
    }
}

/// Refuses repeated headers, which a proxy may interpret differently.
fn check_single(headers: &HeaderMap) -> Result<(), ErrorAnswer> {
    let decisive = [header::HOST, header::ORIGIN, header::AUTHORIZATION];
    match decisive.iter().find(|name| headers.get_all(*name).iter().count() > 1) {
        None => Ok(()),
        Some(name) => Err(ErrorAnswer::new(
            StatusCode::BAD_REQUEST,
            format!("the request has more than one header `{name}`"),
            "send it once",
        )),
    }
}

fn text(headers: &HeaderMap, name: HeaderName) -> Option<&str> {
    headers.get(name).map(|value| value.to_str().unwrap_or("?"))
}

fn token_of(request: &Request) -> Option<&str> {
    let bearer =
        text(request.headers(), header::AUTHORIZATION).and_then(|value| value.strip_prefix("Bearer "));
    let query = request.uri().query().unwrap_or_default();
    bearer.or_else(|| query.split('&').find_map(|pair| pair.strip_prefix("token=")))
}

/// Constant-time equality.
fn equal(given: &[u8], token: &[u8]) -> bool {
    let differ = given.iter().zip(token).fold(0, |differ, (a, b)| differ | (a ^ b));
    given.len() == token.len() && std::hint::black_box(differ) == 0
}

#[derive(Debug)]
pub struct Guard {
    access: Access,
    /// Present second, and its posts.
    posts: Mutex<(Instant, u32)>,
}

impl Guard {
    pub fn new(access: Access) -> Self {
        Self { access, posts: Mutex::new((Instant::now(), 0)) }
    }

    fn check(&self, request: &Request) -> Result<(), ErrorAnswer> {
        self.access.check(request)?;
        if request.method() != Method::POST || request.uri().path() == EMERGENCY_STOP {
            return Ok(());
        }
        let mut posts = locked(&self.posts);
        if posts.0.elapsed() > Duration::from_secs(1) {
            *posts = (Instant::now(), 0);
        }
        posts.1 += 1;
        if posts.1 > POSTS_A_SECOND {
            let error = format!("more than {POSTS_A_SECOND} commands in a second");
            return Err(ErrorAnswer::new(StatusCode::TOO_MANY_REQUESTS, error, "wait a second"));
        }
        Ok(())
    }
}

/// Answers a permitted request, with security headers.
pub async fn guarded(State(guard): State<Arc<Guard>>, request: Request, next: Next) -> Response {
    // Parts of the page have addresses without a token, and no session data.
    let mut response = match guard.check_for(&request) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    for (name, value) in HEADERS {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

impl Guard {
    fn check_for(&self, request: &Request) -> Result<(), ErrorAnswer> {
        if request.uri().path().starts_with("/api/") {
            return self.check(request);
        }
        let without_token = Access { token: None, ..self.access.clone() };
        without_token.check(request)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn access(address: &str, token: Option<&str>) -> Result<Access, AccessError> {
        let address: SocketAddr = address.parse().unwrap();
        let access = Access::new(address, token.map(str::to_owned), vec!["bench.lab".to_owned()]);
        access.map(|access| access.listening_at(address.ip()))
    }

    #[test]
    fn other_machines_need_a_token() {
        assert!(access("127.0.0.1:0", None).is_ok() && access("[::1]:0", None).is_ok());
        assert!(matches!(access("0.0.0.0:0", None), Err(AccessError::NoToken { .. })));
        assert!(matches!(access("192.168.1.5:0", None), Err(AccessError::NoToken { .. })));
        assert_eq!(access("0.0.0.0:0", Some("short")).unwrap_err(), AccessError::Token { length: 5 });
        assert!(access("0.0.0.0:0", Some("0123456789abcdef")).is_ok());
    }

    #[test]
    fn only_own_names_are_answered() {
        let own = access("127.0.0.1:0", None).unwrap();
        for host in ["localhost:8377", "127.0.0.1:8377", "[::1]:8377", "bench.lab", "BENCH.LAB:80"] {
            assert!(own.is_own(host), "{host}");
        }
        for host in
            ["", "evil.example:8377", "localhost.evil.example", "192.168.1.5", "127.0.0.1.evil.example"]
        {
            assert!(!own.is_own(host), "{host}");
        }
        let anywhere = access("0.0.0.0:0", Some("0123456789abcdef")).unwrap();
        assert!(anywhere.is_own("192.168.1.5:8377") && !anywhere.is_own("evil.example"));
    }

    #[test]
    fn tokens_are_compared_whole() {
        assert!(equal(b"abc", b"abc"));
        assert!(
            !equal(b"abd", b"abc") && !equal(b"ab", b"abc") && !equal(b"abcd", b"abc") && !equal(b"", b"abc")
        );
    }
}
