//! The browser helper itself, on a good page and on bad ones.

use std::fs;

use crate::support::browser::{Measured, measure};
use tempfile::TempDir;

const PHONE: u32 = 375;

const GOOD: &str = r##"<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>Good & "quoted"</title>
<style>@media (max-width: 400px) { #narrow { width: 300px } } @media (min-width: 401px) { #narrow { width: 9000px } }</style></head>
<body><h1 id="top-of-it">µm</h1><a href="#top-of-it">up</a> <a href="#%C3%A9">é</a> <a href="https://example.org/paper">paper</a>
<p id="é" class="narrow">short</p><div id="narrow">x</div>
<svg xmlns="http://www.w3.org/2000/svg" width="20" height="10"><rect width="20" height="10"/></svg>
<script>if (1 < 2 && "a" < "b") document.title = "ran";</script></body></html>"##;

const BAD: &str = r##"<!doctype html><html><head><style>body { background: url(http://example.org/a.png) }</style></head>
<body><div style="width:2000px">wide</div><a href="#nowhere">dead</a>
<svg width="0" height="10"></svg><img src="data:image/png;base64,AAAA" width="9" height="9">
<script src="https://example.org/a.js"></script>
<script>undefinedFunction();</script><script>console.error("reported")</script></body></html>"##;

fn measured(html: &str, width: u32) -> Option<Measured> {
    let folder = TempDir::new().unwrap();
    let page = folder.path().join("page.html");
    fs::write(&page, html).unwrap();
    measure(&page, width)
}

#[test]
fn a_good_page_has_no_faults_on_a_phone() {
    let Some(page) = measured(GOOD, PHONE) else { return };
    assert_eq!((page.width, page.content_width), (PHONE, PHONE), "{page:?}");
    assert!(page.errors.is_empty() && page.empty_pictures.is_empty(), "{page:?}");
    assert!(page.outside_loads.is_empty() && page.dead_anchors.is_empty(), "{page:?}");
    assert_eq!(page.outside_links, ["https://example.org/paper"]);
}

#[test]
fn the_width_is_the_one_asked_for() {
    let Some(page) = measured(GOOD, 1200) else { return };
    assert_eq!(page.width, 1200);
    assert!(page.content_width >= 9000, "{page:?}");
}

#[test]
fn every_fault_of_a_bad_page_is_reported() {
    let Some(page) = measured(BAD, PHONE) else { return };
    assert!(page.content_width >= 2000, "{page:?}");
    assert_eq!(page.errors.len(), 2, "{page:?}");
    assert!(page.errors[0].contains("undefinedFunction") && page.errors[1] == "reported", "{page:?}");
    assert_eq!(page.empty_pictures.len(), 2, "{page:?}");
    assert_eq!(page.outside_loads.len(), 2, "{page:?}");
    assert_eq!(page.dead_anchors, ["#nowhere"]);
}
