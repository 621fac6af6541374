//! Any bytes as the replies of a machine: it is sent one line for each `ok`, and no more once it has refused one or has gone.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_live::stage::GcodeStage;
use palpate_mechanics::contact::Position;
use palpate_rig::{Rig, Stage};
use std::cell::RefCell;
use std::io::{self, Read, Write};
use std::rc::Rc;
use std::sync::{Arc, LazyLock};

static STAGE: LazyLock<Stage> = LazyLock::new(|| {
    let rig = Rig::from_toml(include_str!("../../examples/fsi-like.toml")).expect("the example is a rig");
    rig.stage.expect("it has a machine")
});

/// Most bytes of a line that the stage keeps.
const LONGEST: usize = 1024;

/// A line to a machine whose replies are known beforehand; at their end it has gone.
#[derive(Clone)]
struct Line<'a> {
    replies: Rc<RefCell<&'a [u8]>>,
    sent: Rc<RefCell<Vec<u8>>>,
}

impl Read for Line<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.replies.borrow_mut().read(buffer)
    }
}

impl Write for Line<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.sent.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fuzz_target!(|replies: &[u8]| {
    let line = Line { replies: Rc::new(RefCell::new(replies)), sent: Rc::default() };
    if let Ok(mut stage) = GcodeStage::connect(line.clone(), STAGE.clone(), Arc::default()) {
        let _ = stage
            .home()
            .and_then(|()| stage.travel(Position::along(0.05)))
            .and_then(|()| stage.press(1e-3))
            .and_then(|()| stage.lift());
    }
    let read = &replies[..replies.len() - line.replies.borrow().len()];
    let answers = read.split(|byte| *byte == b'\n').map(|answer| {
        String::from_utf8_lossy(&answer[..answer.len().min(LONGEST)]).trim().to_owned()
    });
    let confirmed = answers.filter(|answer| answer == "ok" || answer.starts_with("ok ")).count();
    let sent = String::from_utf8(line.sent.borrow().clone()).expect("G-code is text");
    assert!(sent.is_empty() || sent.ends_with('\n'), "{sent:?}");
    // Questions at the greeting wait for no `ok`.
    let orders = sent.lines().filter(|order| !["M115", "$I"].contains(order)).count();
    assert!(orders <= confirmed + 1, "{orders} lines for {confirmed} times `ok`: {sent:?}");
});
