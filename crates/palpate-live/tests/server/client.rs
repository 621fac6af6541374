//! A client of the server.

use palpate_live::server::Server;
use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;
use tungstenite::WebSocket;
use tungstenite::client::IntoClientRequest;

/// Status, head and body of an answer.
pub fn ask(
    server: &Server,
    method: &str,
    path: &str,
    headers: &[(&str, &str)],
    body: &str,
) -> (u16, String, String) {
    let mut stream = TcpStream::connect(server.address()).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let mut request =
        format!("{method} {path} HTTP/1.1\r\nConnection: close\r\nContent-Length: {}\r\n", body.len());
    if !headers.iter().any(|(name, _)| *name == "Host") {
        request += &format!("Host: {}\r\n", server.address());
    }
    headers.iter().for_each(|(name, value)| request += &format!("{name}: {value}\r\n"));
    // A server that refuses a body does not read all of it.
    let _ = stream.write_all(format!("{request}\r\n{body}").as_bytes());
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let answer = String::from_utf8_lossy(&answer).into_owned();
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or_default();
    (head.split(' ').nth(1).unwrap_or("0").parse().unwrap(), head.to_ascii_lowercase(), body.to_owned())
}

/// Status and JSON of an answer.
pub fn get(server: &Server, path: &str) -> (u16, Value) {
    let (status, _, body) = ask(server, "GET", path, &[], "");
    (status, serde_json::from_str(&body).unwrap_or_default())
}

pub fn post(server: &Server, path: &str, body: &str) -> (u16, Value) {
    let (status, _, body) = ask(server, "POST", path, &[], body);
    (status, serde_json::from_str(&body).unwrap_or_default())
}

/// A browser that follows the stream.
pub fn follow(
    server: &Server,
    query: &str,
    origin: Option<&str>,
) -> tungstenite::Result<WebSocket<TcpStream>> {
    let mut request = format!("ws://{}/api/stream{query}", server.address()).into_client_request()?;
    if let Some(origin) = origin {
        request.headers_mut().insert("Origin", origin.parse().unwrap());
    }
    let stream = TcpStream::connect(server.address())?;
    stream.set_read_timeout(Some(Duration::from_secs(20)))?;
    let (socket, _) = tungstenite::client(request, stream).map_err(|error| match error {
        tungstenite::HandshakeError::Failure(error) => error,
        tungstenite::HandshakeError::Interrupted(_) => tungstenite::Error::ConnectionClosed,
    })?;
    Ok(socket)
}

pub fn next(socket: &mut WebSocket<TcpStream>) -> Value {
    serde_json::from_str(socket.read().unwrap().to_text().unwrap()).unwrap()
}
