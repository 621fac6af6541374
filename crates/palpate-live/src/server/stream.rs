use super::body::ErrorAnswer;
use super::connections::most_open;
use super::live::Live;
use super::web_sink::{Hub, with_missed};
use axum::body::Bytes;
use axum::extract::rejection::QueryRejection;
use axum::extract::ws::{
    Message, Utf8Bytes, WebSocket, WebSocketUpgrade, rejection::WebSocketUpgradeRejection,
};
use axum::extract::{Query, State};
use axum::http::StatusCode;
use axum::response::Response;
use serde::Deserialize;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::broadcast::{Receiver, error::RecvError};

const MOST_BYTES: usize = 4096;
const MOST_WAITING: usize = 1 << 20;
/// Time before a browser that does not read is disconnected.
const PATIENCE: Duration = Duration::from_secs(30);

#[derive(Debug, Deserialize)]
pub struct StreamQuery {
    #[serde(default)]
    form: Form,
    #[serde(default)]
    rate: Rate,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Form {
    #[default]
    Json,
    Binary,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
enum Rate {
    #[default]
    #[serde(rename = "60")]
    Display,
    #[serde(rename = "all")]
    All,
}

pub async fn stream(
    State(live): State<Arc<Live>>,
    wish: Result<Query<StreamQuery>, QueryRejection>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, ErrorAnswer> {
    const HELP: &str = "form is `json` or `binary`, rate is `60` or `all`; binary has all";
    let Query(wish) =
        wish.map_err(|error| ErrorAnswer::new(StatusCode::BAD_REQUEST, error.body_text(), HELP))?;
    let upgrade = upgrade
        .map_err(|error| ErrorAnswer::new(error.status(), error.body_text(), "open it as a WebSocket"))?;
    let hub = live.hub().clone();
    let Ok(place) = Arc::clone(&hub.places).try_acquire_owned() else {
        let error = format!("{} browsers follow this session already", most_open());
        return Err(ErrorAnswer::new(StatusCode::SERVICE_UNAVAILABLE, error, "close one of them"));
    };
    let upgrade = upgrade
        .max_message_size(MOST_BYTES)
        .max_frame_size(MOST_BYTES)
        .write_buffer_size(0)
        .max_write_buffer_size(MOST_WAITING);
    Ok(upgrade.on_upgrade(move |socket| async move {
        stream_samples(socket, &hub, &wish, &live).await;
        drop(place);
    }))
}

async fn stream_samples(mut socket: WebSocket, hub: &Hub, wish: &StreamQuery, live: &Live) {
    match (wish.form, wish.rate) {
        (Form::Binary, _) => {
            let message = |packet: &Bytes, _| Message::Binary(packet.clone());
            send_all(&mut socket, hub.binary.subscribe(), message, None).await;
        }
        (Form::Json, Rate::All) => {
            let message = |text: &Utf8Bytes, _| Message::Text(text.clone());
            send_all(&mut socket, hub.json.subscribe(), message, None).await;
        }
        (Form::Json, Rate::Display) => {
            let message = |text: &_, missed| Message::Text(with_missed(text, missed));
            send_all(&mut socket, hub.states.subscribe(), message, Some(live)).await;
        }
    }
}

/// Ping interval for attendance.
const PING_EVERY: Duration = Duration::from_secs(1);

/// Sends messages while the browser reads; `page_of` adds pings for attendance.
async fn send_all<T: Clone>(
    socket: &mut WebSocket,
    mut messages: Receiver<T>,
    message: impl Fn(&T, u64) -> Message,
    page_of: Option<&Live>,
) {
    let mut missed = 0;
    let mut pings = tokio::time::interval(PING_EVERY);
    pings.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            next = messages.recv() => match next {
                Ok(next) => {
                    let sent = tokio::time::timeout(PATIENCE, socket.send(message(&next, missed))).await;
                    if !matches!(sent, Ok(Ok(()))) {
                        return;
                    }
                    missed = 0;
                }
                Err(RecvError::Lagged(count)) => missed += count,
                Err(RecvError::Closed) => return,
            },
            // The socket answers pings; messages are ignored.
            received = socket.recv() => match received {
                // The last read sends the answer to a close message.
                Some(Ok(Message::Close(_))) => {
                    let _ = tokio::time::timeout(PATIENCE, socket.recv()).await;
                    return;
                }
                Some(Err(_)) | None => return,
                Some(Ok(Message::Pong(_))) => {
                    if let Some(live) = page_of {
                        live.attend();
                    }
                }
                Some(Ok(_)) => {}
            },
            _ = pings.tick(), if page_of.is_some() => {
                let is_needed = page_of.is_some_and(Live::needs_attendance);
                let ping = Message::Ping(Bytes::new());
                if is_needed && !matches!(tokio::time::timeout(PATIENCE, socket.send(ping)).await, Ok(Ok(()))) {
                    return;
                }
            }
        }
    }
}
