//! Opens an HTML file in headless Chromium and measures what a reader would notice.

use std::env;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde::Deserialize;
use tempfile::TempDir;

use palpate_testing::skip::skip;

/// Measurements of a page that has loaded. Lists hold the offenders, each by the head of its markup.
#[derive(Debug, Deserialize)]
pub struct Measured {
    /// Uncaught errors, unhandled rejections and what scripts report by `console.error`.
    pub errors: Vec<String>,
    /// The width to lay the page out in, without the scroll bar, in CSS pixels.
    pub width: u32,
    /// The width that the page takes; more than `width` when it overflows to the side.
    pub content_width: u32,
    /// Pictures (`img`, outermost `svg`) of no size, and `img` that did not load.
    pub empty_pictures: Vec<String>,
    /// Elements and styles that fetch from another host: a self-contained page has none.
    pub outside_loads: Vec<String>,
    /// Addresses of other hosts that a reader may follow.
    pub outside_links: Vec<String>,
    /// Links into the page (`#name`) that lead nowhere.
    pub dead_anchors: Vec<String>,
}

/// Longest time that the browser may take, start included.
const LIMIT: Duration = Duration::from_secs(60);

/// Keeps the browser to this page: no start-up screens, no graphics card, nothing fetched in the background.
const FLAGS: [&str; 11] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--virtual-time-budget=10000",
    "--dump-dom",
];

/// Opens a page at a viewport width in CSS pixels. `None`, said in one line, when Chromium is not there.
///
/// # Panics
/// When the page cannot be read, or the browser gives no measurement in time.
pub fn measure(page: &Path, width: u32) -> Option<Measured> {
    let Some(browser) = browser() else {
        skip("Chromium", "install Debian's chromium, or name the program in PALPATE_CHROMIUM");
        return None;
    };
    let html =
        fs::read_to_string(page).unwrap_or_else(|error| panic!("cannot read {}: {error}", page.display()));
    let folder = TempDir::new().expect("a temporary folder can be made");
    let framed = folder.path().join("framed.html");
    fs::write(&framed, frame(&html, width)).expect("the temporary folder can be written");
    let dom = dump(&browser, &framed, width, folder.path());
    Some(read(&dom).unwrap_or_else(|| {
        panic!("{} gave no measurement; the browser said: {}", page.display(), said(folder.path()))
    }))
}

fn browser() -> Option<PathBuf> {
    let path = env::var_os("PALPATE_CHROMIUM").map_or_else(|| "/usr/bin/chromium".into(), PathBuf::from);
    path.is_file().then_some(path)
}

/// A page that holds the given one, with the measuring script before it, in a frame: Chromium's own window cannot be
/// narrower than 500 pixels, and a phone is.
fn frame(html: &str, width: u32) -> String {
    let script = concat!("<script>", include_str!("measure.js"), "</script>");
    // After the document type, which must stay first.
    let at =
        html.get(..9).filter(|start| start.eq_ignore_ascii_case("<!doctype")).and_then(|_| html.find('>'));
    let (kind, rest) = html.split_at(at.map_or(0, |at| at + 1));
    let inner = format!("{kind}{script}{rest}").replace('&', "&amp;").replace('"', "&quot;");
    format!(
        "<!doctype html><meta charset=utf-8><body style=margin:0>\
         <iframe style=\"border:0;width:{width}px;height:900px\" srcdoc=\"{inner}\"></iframe>"
    )
}

/// HTML of the page once the browser has loaded it.
fn dump(browser: &Path, page: &Path, width: u32, folder: &Path) -> String {
    let file = |name: &str| File::create(folder.join(name)).expect("the temporary folder can be written");
    let mut child = Command::new(browser)
        .args(FLAGS)
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg(format!("--window-size={},1000", width.max(500)))
        .arg(format!("file://{}", page.display()))
        .stdin(Stdio::null())
        .stdout(file("dom.html"))
        .stderr(file("said.txt"))
        .spawn()
        .unwrap_or_else(|error| panic!("cannot start {}: {error}", browser.display()));
    let start = Instant::now();
    while child.try_wait().expect("the browser can be waited for").is_none() {
        if start.elapsed() > LIMIT {
            child.kill().and_then(|()| child.wait()).expect("the browser can be ended");
            panic!("the browser took over {} s; it said: {}", LIMIT.as_secs(), said(folder));
        }
        thread::sleep(Duration::from_millis(20));
    }
    fs::read_to_string(folder.join("dom.html")).expect("the browser writes text")
}

/// The measurement is the last element of its kind, whatever the page itself holds.
fn read(dom: &str) -> Option<Measured> {
    let (_, rest) = dom.rsplit_once("<pre id=\"palpate-measured\">")?;
    let (json, _) = rest.split_once("</pre>")?;
    serde_json::from_str(json).ok()
}

fn said(folder: &Path) -> String {
    let text = fs::read(folder.join("said.txt")).unwrap_or_default();
    String::from_utf8_lossy(&text).trim().to_owned()
}
