use super::touches;
use crate::event::Event;
use palpate_core::{ContactEstimate, Estimate, Position, Status};
use palpate_estimators::estimate_record::ContactRecord;
use palpate_mechanics::surface::Extent;
use std::time::Duration;

/// The false-alarm rate of a reading is 0.001.
const IN_A_ROW: u32 = 2;
/// 0.003 of the readings of a contact are `outside_model`.
const DOUBTS_IN_A_ROW: u32 = 3;
/// Shortest move as a share of the length.
const MOVE: f64 = 0.01;
const BETWEEN_MOVES: Duration = Duration::from_millis(50);

#[derive(Debug)]
pub struct ContactWatch {
    extent: Extent,
    state: State,
    recent: (State, u32),
    since: Option<Duration>,
    reported: (Position, Duration),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Untouched,
    Touched { contacts: usize },
    OutsideModel,
}

impl ContactWatch {
    pub fn new(extent: Extent) -> Self {
        Self {
            extent,
            state: State::Untouched,
            recent: (State::Untouched, 0),
            since: None,
            reported: (Position::default(), Duration::ZERO),
        }
    }

    pub fn is_touched(&self) -> bool {
        self.state != State::Untouched
    }

    pub fn add(&mut self, now: Duration, estimate: &Estimate, mut tell: impl FnMut(Event)) {
        let next = match estimate.status {
            status if touches(status) => State::Touched { contacts: 1 + estimate.further.as_slice().len() },
            Status::NoContact => State::Untouched,
            _ => State::OutsideModel,
        };
        self.recent = if self.recent.0 == next { (next, self.recent.1.saturating_add(1)) } else { (next, 1) };
        let needed = if next == State::OutsideModel { DOUBTS_IN_A_ROW } else { IN_A_ROW };
        if next != self.state && self.recent.1 >= needed {
            self.change(now, next, estimate, &mut tell);
        } else if next == self.state && touches(estimate.status) {
            self.report_change(now, &estimate.contact, &mut tell);
        }
    }

    fn change(&mut self, now: Duration, next: State, estimate: &Estimate, tell: &mut impl FnMut(Event)) {
        let before = std::mem::replace(&mut self.state, next);
        match next {
            State::Untouched => {
                // A signal that no contact explains has neither a touch-down nor a lift-off.
                if let Some(since) = self.since.take() {
                    tell(Event::LiftOff { seconds: now.saturating_sub(since).as_secs_f64() });
                }
            }
            State::OutsideModel => tell(Event::OutsideModel),
            State::Touched { contacts } => {
                if self.since.is_none() {
                    self.since = Some(now);
                    tell(Event::TouchDown { contact: self.record(&estimate.contact) });
                }
                let had_second = matches!(before, State::Touched { contacts } if contacts > 1);
                if let (true, false, Some(second)) =
                    (contacts > 1, had_second, estimate.further.as_slice().first())
                {
                    tell(Event::SecondContact { contact: self.record(second) });
                }
                self.reported = (estimate.contact.position, now);
            }
        }
    }

    fn report_change(&mut self, now: Duration, contact: &ContactEstimate, tell: &mut impl FnMut(Event)) {
        let (position, at) = self.reported;
        let uncertain_m = contact.uncertainty.map_or(0.0, |u| {
            let across = |(low, high): (f64, f64)| 0.5 * (high - low);
            across(u.x_95_m).max(across(u.y_95_m))
        });
        let least_m = (MOVE * self.extent.length_m()).max(uncertain_m);
        if now.saturating_sub(at) >= BETWEEN_MOVES && position.distance_m(contact.position) > least_m {
            self.reported = (contact.position, now);
            tell(Event::Move { contact: self.record(contact) });
        }
    }

    fn record(&self, contact: &ContactEstimate) -> ContactRecord {
        ContactRecord::new(contact, self.extent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lift_off_has_a_touch_down_before_it() {
        let mut watch = ContactWatch::new(Extent::new(0.3, None).unwrap());
        let mut kinds = Vec::new();
        let mut add = |status: Status| {
            for i in 0..5 {
                let estimate = Estimate::of_position(Position::along(0.1), status);
                watch.add(Duration::from_millis(i), &estimate, |event| kinds.push(event.name()));
            }
        };
        [Status::OutsideModel, Status::NoContact, Status::OutsideModel, Status::Located]
            .into_iter()
            .for_each(&mut add);
        [Status::OutsideModel, Status::Located, Status::OutsideModel, Status::NoContact]
            .into_iter()
            .for_each(&mut add);
        let expected =
            ["outside_model", "outside_model", "touch_down", "outside_model", "outside_model", "lift_off"];
        assert_eq!(kinds, expected);
    }
}
