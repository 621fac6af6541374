//! The guide of a calibration: which press comes next, and when its reading is taken.
//!
//! Means of a stretch tell that a surface is at rest; what is taken of it is its last reading alone. A locator learns from the rows how noisy a reading
//! is, and readings in use are single ones: from means it would learn noise that is too small by the root of their number.

use super::settling::{Baseline, Stretch};
use palpate_estimators::recording::Row;
use palpate_mechanics::contact::Position;
use serde::Serialize;
use std::time::Duration;

/// A press that is planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// Its position.
    pub position: Position,
    /// Its force in newtons, where it is known.
    pub force_n: Option<f64>,
    /// Its depth in metres, where a machine presses.
    pub depth_m: Option<f64>,
}

/// Next step that a guide waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Waiting {
    /// The surface is to be left alone, so that its untouched reading is learnt.
    Untouched,
    /// The next press.
    Press,
    /// The reading is to come to rest.
    Rest,
    /// The surface is to be let go.
    Release,
    /// Nothing: all presses are done, or somebody ended it.
    Nothing,
}

/// Outcome of a reading.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// No change.
    None,
    /// Something else is waited for.
    Waits(Waiting),
    /// A row of the recording was taken: of a press, or of the untouched surface.
    Taken {
        /// The row, whose reading is the last of the stretch at rest.
        row: Row,
        /// Mean reading of that stretch.
        mean: Vec<f64>,
    },
}

/// The guide of a calibration.
#[derive(Clone, Debug)]
pub struct Guide {
    plan: Vec<Press>,
    /// Press of the plan that is next.
    next: usize,
    waiting: Waiting,
    stretch: Stretch,
    baseline: Option<Baseline>,
    /// Mean reading of the press that is held or was let go last.
    pressed: Vec<f64>,
}

impl Guide {
    /// A guide through a plan.
    pub fn new(plan: Vec<Press>) -> Self {
        let waiting = if plan.is_empty() { Waiting::Nothing } else { Waiting::Untouched };
        Self { plan, next: 0, waiting, stretch: Stretch::default(), baseline: None, pressed: Vec::new() }
    }

    /// The press that is next, and how many are planned; `None` after the last.
    pub fn next_press(&self) -> Option<(usize, Press)> {
        self.plan.get(self.next).map(|press| (self.next, *press))
    }

    /// Presses of the plan.
    pub fn plan(&self) -> &[Press] {
        &self.plan
    }

    /// The step that it waits for.
    pub fn waiting(&self) -> Waiting {
        self.waiting
    }

    /// Takes a reading at an instant.
    pub fn add(&mut self, at: Duration, reading: &[f64]) -> Progress {
        self.stretch.add(at, reading);
        match (self.waiting, &self.baseline) {
            (Waiting::Untouched, _) => self.learn_baseline(at, reading),
            (Waiting::Press, Some(baseline)) if baseline.is_pressed(reading) => self.wait(Waiting::Rest),
            (Waiting::Rest, Some(baseline)) => match baseline.settled(&self.stretch) {
                // A press that was let go before it came to rest.
                Some(mean) if !baseline.is_pressed(&mean) => self.wait(Waiting::Press),
                Some(mean) => self.take_press(at, reading, mean),
                None => Progress::None,
            },
            (Waiting::Release, Some(baseline)) => match baseline.released(&self.stretch, &self.pressed) {
                Some(mean) => self.take_untouched(at, reading, mean),
                None => Progress::None,
            },
            _ => Progress::None,
        }
    }

    /// Takes back the last press, which is asked for again; false where there is none.
    pub fn redo(&mut self) -> bool {
        if self.next == 0 {
            return false;
        }
        self.next -= 1;
        self.restart();
        true
    }

    /// Leaves out the press that is next.
    pub fn skip(&mut self) {
        if self.next < self.plan.len() {
            self.plan.remove(self.next);
            self.restart();
        }
    }

    /// Ends the calibration early.
    pub fn stop(&mut self) {
        self.plan.truncate(self.next);
        self.waiting = Waiting::Nothing;
    }

    /// Adds presses to the plan.
    pub fn extend(&mut self, presses: impl IntoIterator<Item = Press>) {
        self.plan.extend(presses);
        if self.waiting == Waiting::Nothing {
            self.restart();
        }
    }

    /// Forgets the readings of the last stretch of time, as those before a machine moved; what is learnt stays.
    pub fn forget_readings(&mut self) {
        self.stretch.clear();
    }

    /// Waits for what the next press needs first.
    fn restart(&mut self) {
        self.waiting = match self.waiting {
            _ if self.next >= self.plan.len() => Waiting::Nothing,
            _ if self.baseline.is_none() => Waiting::Untouched,
            // What is pressed now is no press of the plan.
            Waiting::Rest | Waiting::Release => Waiting::Release,
            Waiting::Untouched | Waiting::Press | Waiting::Nothing => Waiting::Press,
        };
    }

    fn wait(&mut self, waiting: Waiting) -> Progress {
        self.waiting = waiting;
        self.stretch.clear();
        Progress::Waits(waiting)
    }

    fn learn_baseline(&mut self, at: Duration, reading: &[f64]) -> Progress {
        match Baseline::learn(&self.stretch) {
            Some(baseline) => {
                let mean = baseline.mean.clone();
                self.baseline = Some(baseline);
                self.take_untouched(at, reading, mean)
            }
            None => Progress::None,
        }
    }

    fn take_press(&mut self, at: Duration, reading: &[f64], mean: Vec<f64>) -> Progress {
        let Some(press) = self.plan.get(self.next).copied() else { return Progress::None };
        self.next += 1;
        self.pressed.clone_from(&mean);
        self.wait(Waiting::Release);
        Progress::Taken { row: row(press.position, press.force_n, at, reading), mean }
    }

    /// The untouched surface: its row, and the baseline from now on.
    fn take_untouched(&mut self, at: Duration, reading: &[f64], mean: Vec<f64>) -> Progress {
        if let Some(baseline) = &mut self.baseline {
            baseline.mean.clone_from(&mean);
        }
        self.wait(if self.next < self.plan.len() { Waiting::Press } else { Waiting::Nothing });
        Progress::Taken { row: row(Position::default(), Some(0.0), at, reading), mean }
    }
}

fn row(position: Position, force_n: Option<f64>, at: Duration, reading: &[f64]) -> Row {
    let (time_s, reading) = (Some(at.as_secs_f64()), reading.to_vec());
    Row { position, force_n, nuisances: Vec::new(), time_s, reading }
}
