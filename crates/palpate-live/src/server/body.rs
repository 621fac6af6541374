use super::connections::Connection;
use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::extract::{FromRequest, Request};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde::de::DeserializeOwned;

#[derive(Debug)]
pub struct ErrorAnswer {
    status: StatusCode,
    error: String,
    help: &'static str,
    field: Option<&'static str>,
}

impl ErrorAnswer {
    pub fn new(status: StatusCode, error: impl Into<String>, help: &'static str) -> Self {
        Self { status, error: error.into(), help, field: None }
    }

    pub fn with_field(self, field: Option<&'static str>) -> Self {
        Self { field, ..self }
    }
}

impl IntoResponse for ErrorAnswer {
    fn into_response(self) -> Response {
        let mut body = serde_json::json!({ "error": self.error, "help": self.help });
        if let Some(field) = self.field {
            body["field"] = field.into();
        }
        (self.status, JsonAnswer(body)).into_response()
    }
}

pub struct JsonAnswer<T>(pub T);

impl<T: Serialize> IntoResponse for JsonAnswer<T> {
    fn into_response(self) -> Response {
        match serde_json::to_vec(&self.0) {
            Ok(body) => ([(header::CONTENT_TYPE, "application/json")], body).into_response(),
            Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
        }
    }
}

async fn whole_body<S: Send + Sync>(request: Request, state: &S) -> Result<Bytes, ErrorAnswer> {
    let connection = request.extensions().get::<Connection>().cloned();
    let bytes = Bytes::from_request(request, state);
    let Some(connection) = connection else { return bytes.await.map_err(|error| unreadable_body(&error)) };
    let Ok(bytes) = tokio::time::timeout(connection.body_within, bytes).await else {
        let error = format!("the body did not come within {} s", connection.body_within.as_secs_f64());
        return Err(ErrorAnswer::new(
            StatusCode::REQUEST_TIMEOUT,
            error,
            "send as many bytes as Content-Length states",
        ));
    };
    connection.note_whole_request();
    bytes.map_err(|error| unreadable_body(&error))
}

fn unreadable_body(error: &BytesRejection) -> ErrorAnswer {
    ErrorAnswer::new(error.status(), error.body_text(), "send at most 64 kB of JSON")
}

pub struct JsonBody<T>(pub T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for JsonBody<T> {
    type Rejection = ErrorAnswer;

    async fn from_request(request: Request, state: &S) -> Result<Self, ErrorAnswer> {
        let bytes = whole_body(request, state).await?;
        let refused = |error: String| {
            ErrorAnswer::new(StatusCode::BAD_REQUEST, error, "docs/reference/server.md describes the body")
        };
        let body = serde_json::from_slice(&bytes).map_err(|error| refused(error.to_string()))?;
        // serde accepts a list of values as a struct.
        if bytes.trim_ascii_start().first() != Some(&b'{') {
            return Err(refused("the body is not a JSON object".to_owned()));
        }
        Ok(Self(body))
    }
}
