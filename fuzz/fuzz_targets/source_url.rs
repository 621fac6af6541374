//! Any text, read as the URL of a source: what is one reads back as it is shown.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_live::source::SourceUrl;

fuzz_target!(|text: &str| {
    if let Ok(url) = text.parse::<SourceUrl>() {
        assert_eq!(url.to_string().parse(), Ok(url), "{text}");
    }
});
