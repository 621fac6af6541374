//! Any text as the URL of a source: it reads back as displayed, and no message shows a password.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_live::sink::MqttUrl;
use palpate_live::source::SourceUrl;

fuzz_target!(|text: &str| {
    if let Ok(url) = text.parse::<SourceUrl>() {
        let shown = url.to_string();
        let again = shown.parse::<SourceUrl>().expect("a URL that is shown is one");
        assert_eq!(again.to_string(), shown, "{text}");
    }
    if let Ok(url) = text.parse::<MqttUrl>() {
        url.to_string().parse::<MqttUrl>().expect("a URL that is shown is one");
    }
});
