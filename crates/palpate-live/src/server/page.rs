use axum::http::{Method, StatusCode, Uri, header};
use axum::response::{Html, IntoResponse, Response};
use rust_embed::RustEmbed;

/// Output of `cargo xtask web`.
#[derive(RustEmbed)]
#[folder = "$CARGO_MANIFEST_DIR/dashboard"]
#[allow_missing = true]
struct Dashboard;

/// File of the dashboard, or instructions to build it.
pub async fn page(method: Method, uri: Uri) -> Response {
    let path = match uri.path() {
        "/" => "index.html",
        path => path.trim_start_matches('/'),
    };
    let file = Dashboard::get(path);
    let is_there = file.is_some() || path == "index.html";
    if is_there && method != Method::GET && method != Method::HEAD {
        let words = "a page accepts only GET and HEAD";
        return (StatusCode::METHOD_NOT_ALLOWED, [(header::ALLOW, "GET, HEAD")], words).into_response();
    }
    match file {
        Some(file) => ([(header::CONTENT_TYPE, content_type(path))], file.data).into_response(),
        None if path == "index.html" => Html(include_str!("without_dashboard.html")).into_response(),
        None => (StatusCode::NOT_FOUND, "the page does not exist").into_response(),
    }
}

fn content_type(path: &str) -> &'static str {
    match path.rsplit('.').next().unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "ico" => "image/x-icon",
        "json" | "webmanifest" => "application/json",
        "woff2" => "font/woff2",
        _ => "application/octet-stream",
    }
}
