//! Routes of the server.

use super::body::{JsonAnswer, JsonBody, Refusal};
use super::guard::{Access, Guard, guarded};
use super::live::{Live, LiveError};
use super::session_info::SessionInfo;
use super::{page, stream};
use crate::input::Command;
use axum::extract::{DefaultBodyLimit, State};
use axum::http::StatusCode;
use axum::routing::{get, post};
use axum::{Router, middleware};
use serde::Deserialize;
use serde_json::{Value, json};
use std::sync::Arc;

/// Most bytes of a body.
const MOST_BYTES: usize = 1 << 16;
/// Most characters of a mark.
const MOST_OF_A_MARK: usize = 200;

type Answer = Result<JsonAnswer<Value>, Refusal>;

/// All routes, guarded.
pub fn router(access: Access, live: Arc<Live>) -> Router {
    let guard = Arc::new(Guard::new(access));
    Router::new()
        .route("/api/session", get(session))
        .route("/api/stream", get(stream::stream))
        .route("/api/tare", post(tare))
        .route("/api/mark", post(mark))
        .route("/api/source", post(source))
        .route("/api/record", post(not_recorded))
        .route("/api/recordings", get(not_recorded))
        .route("/api/recordings/{name}", get(not_recorded))
        .route("/api/recordings/{name}/file", get(not_recorded))
        .route("/api/{*unknown}", get(unknown).post(unknown))
        .fallback(get(page::page))
        .layer(DefaultBodyLimit::max(MOST_BYTES))
        .layer(middleware::from_fn_with_state(guard, guarded))
        .with_state(live)
}

async fn session(State(live): State<Arc<Live>>) -> JsonAnswer<SessionInfo> {
    JsonAnswer(live.info())
}

/// An object without fields that matter.
#[derive(Deserialize)]
struct Nothing {}

async fn tare(State(live): State<Arc<Live>>, JsonBody(Nothing {}): JsonBody<Nothing>) -> Answer {
    done(live.command(Command::Tare))
}

#[derive(Deserialize)]
struct Mark {
    text: String,
}

async fn mark(State(live): State<Arc<Live>>, JsonBody(Mark { text }): JsonBody<Mark>) -> Answer {
    let length = text.chars().count();
    if length == 0 || length > MOST_OF_A_MARK || text.chars().any(char::is_control) {
        let error =
            format!("a mark of {length} characters; it may have 1 to {MOST_OF_A_MARK}, none of control");
        return Err(Refusal::new(StatusCode::BAD_REQUEST, error, "write less, on one line"));
    }
    done(live.command(Command::Mark(text)))
}

#[derive(Deserialize)]
struct Source {
    url: String,
}

async fn source(State(live): State<Arc<Live>>, JsonBody(Source { url }): JsonBody<Source>) -> Answer {
    if url != "simulated" {
        return Err(Refusal::new(
            StatusCode::FORBIDDEN,
            "a browser may choose the source `simulated` only",
            "name other sources by `palpate serve LOCATOR --from URL`",
        ));
    }
    // A session that ends is waited for, and a board is prepared.
    let begun = tokio::task::spawn_blocking(move || live.begin_simulated()).await;
    match begun {
        Ok(result) => done(result),
        Err(error) => {
            Err(Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, error.to_string(), "start palpate again"))
        }
    }
}

fn done(result: Result<(), LiveError>) -> Answer {
    result.map(|()| JsonAnswer(json!({}))).map_err(|error| {
        let (status, help) = match error {
            LiveError::NoSession => (StatusCode::CONFLICT, "choose a source first"),
            LiveError::Behind => (StatusCode::SERVICE_UNAVAILABLE, "try it again"),
            LiveError::NotSimulated => (StatusCode::CONFLICT, "start `palpate serve` with a rig"),
            LiveError::Source(_) => (StatusCode::BAD_REQUEST, "start `palpate serve` with another source"),
            LiveError::Thread(_) => (StatusCode::INTERNAL_SERVER_ERROR, "start palpate again"),
        };
        Refusal::new(status, error.to_string(), help)
    })
}

async fn not_recorded() -> Refusal {
    Refusal::new(
        StatusCode::NOT_IMPLEMENTED,
        "this version of palpate does not record sessions from the browser",
        "take the samples from /api/stream?rate=all",
    )
}

async fn unknown() -> Refusal {
    Refusal::new(StatusCode::NOT_FOUND, "there is no such request", "docs/live-server.md lists them")
}
