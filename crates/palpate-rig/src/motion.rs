//! `[motion]`, or two `[[motion]]`

use serde::Deserialize;

use palpate_estimators::simulate::{MovingContact, MovingContacts};
use palpate_mechanics::surface::modal::ModalBeam;
use palpate_mechanics::surface::{Beam, Extent, Motion, SurfaceSpec};

use crate::document::{At, place};
use crate::error::{RigError, RigProblem};
use crate::values::{Count, Density, Force, Fraction, Frequency, Length, NotNegative, OneOrMany, Point};
use crate::values::{Positive, Speed, Time};

/// A contact that moves back and forth between two places.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MotionKeys {
    /// Position of the start.
    pub from: At<Point>,
    /// Position of the turn.
    pub to: At<Point>,
    /// Speed between turns.
    pub speed: Positive<Speed>,
    /// Distance over which the contact slows down and speeds up; a fifth of the whole by default.
    pub turn: Option<At<Positive<Length>>>,
    /// Passes from one place to the other; 1 by default.
    pub passes: Option<Count<1, 100_000>>,
    /// Time for which the contact is lifted off at each turn; 0 by default.
    pub lifted: Option<NotNegative<Time>>,
    /// Time that the contact takes to touch, and to let go; 0.1 s by default.
    pub touch: Option<At<Positive<Time>>>,
    /// Force, if it is neither known nor that of the presses.
    pub force: Option<At<Positive<Force>>>,
    /// Readings a second; a key of the first motion only.
    pub rate: Option<At<Positive<Frequency>>>,
    /// Damping ratio of the beam's modes; 1 % by default.
    pub damping: Option<At<Fraction>>,
}

/// Limit of the readings in memory.
const MOST_READINGS: f64 = 1e7;
/// Defaults: share of the way for a turn, duration of a touch.
const TURN: f64 = 0.2;
const TOUCH_S: f64 = 0.1;

pub(crate) fn build(
    sections: &At<OneOrMany<MotionKeys>>,
    surface: &SurfaceSpec,
    density: Option<&At<Positive<Density>>>,
    known_force_n: Option<f64>,
) -> Result<MovingContacts, RigError> {
    let (first, second) = match sections.sections() {
        [first] => (first, None),
        [first, second] => (first, Some(second)),
        others => {
            let place = others.get(2).map_or(&sections.place, |third| &third.place);
            let value = format!("a list of {}", others.len());
            return Err(place.refuse_value(value, "one, or a list of two"));
        }
    };
    let extent = surface.extent();
    let beam = match surface {
        SurfaceSpec::Beam(beam) => Some(first.modal_beam(*beam, density)?),
        SurfaceSpec::Plate(_) => None,
        _ => return Err(first.place.unused("a surface other than a beam on two supports or a plate")),
    };
    if let (None, Some(damping)) = (beam, &first.damping) {
        return Err(damping.place.unused("a plate, which is in balance at every reading"));
    }
    if let (Extent::Plane { .. }, Some(second)) = (extent, second) {
        return Err(second.place.refuse_value("a list of two", "one on a plane"));
    }
    let rate_hz = first.rate.as_ref().ok_or_else(|| first.place.missing("rate"))?.si;
    let moving = MovingContacts {
        first: first.contact(extent, known_force_n)?,
        second: second.map(|second| second.further(extent, known_force_n)).transpose()?,
        beam,
        rate_hz,
    };
    let readings = moving.duration_s() * rate_hz;
    if readings > MOST_READINGS || !readings.is_finite() {
        let value = format!("{readings} readings long");
        return Err(sections.place.refuse_value(value, format!("at most {MOST_READINGS}")));
    }
    Ok(moving)
}

impl At<MotionKeys> {
    fn modal_beam(&self, beam: Beam, density: Option<&At<Positive<Density>>>) -> Result<ModalBeam, RigError> {
        let missing = || RigProblem::MissingKey { section: "surface".to_owned(), key: "density".to_owned() };
        let density = density.ok_or_else(|| missing().at_place(&self.place))?;
        let damping_ratio = self.damping.as_ref().map_or(ModalBeam::USUAL_DAMPING_RATIO, |ratio| ratio.si);
        ModalBeam::new(beam, density.si, damping_ratio)
            .map_err(|error| RigProblem::ModalBeam(error).at_place(&density.place))
    }

    fn further(&self, extent: Extent, known_force_n: Option<f64>) -> Result<MovingContact, RigError> {
        match place(&self.rate).or(place(&self.damping)) {
            Some(key) => Err(key.unused("a second [[motion]]; the first sets it for both")),
            None => self.contact(extent, known_force_n),
        }
    }

    fn contact(&self, extent: Extent, known_force_n: Option<f64>) -> Result<MovingContact, RigError> {
        if let (Some(force), Some(_)) = (&self.force, known_force_n) {
            return Err(force.place.unused("a [contact] of known force"));
        }
        let force_n = self.force.as_ref().map(|force| force.si);
        Ok(MovingContact { motion: self.motion(extent)?, force_n })
    }

    fn motion(&self, extent: Extent) -> Result<Motion, RigError> {
        let (from, to) = (self.from.on_surface(extent)?, self.to.on_surface(extent)?);
        let way_m = from.distance_m(to);
        if way_m == 0.0 {
            return Err(self.to.place.refuse_value(extent.place_in_words(to), "elsewhere than `from`"));
        }
        let turn_m = match &self.turn {
            Some(turn) if turn.si > 0.5 * way_m => {
                return Err(turn.place.refuse("greater than 0 and at most half the way"));
            }
            Some(turn) => turn.si,
            None => TURN * way_m,
        };
        let lifted_s = self.lifted.map_or(0.0, |lifted| lifted.si);
        if let (Some(touch), true) = (&self.touch, lifted_s == 0.0) {
            return Err(touch.place.unused("a contact that is never `lifted`"));
        }
        let touch_s = self.touch.as_ref().map_or(TOUCH_S, |touch| touch.si);
        Motion::new(from, to, self.speed.si, turn_m)
            .and_then(|motion| motion.with_passes(self.passes.map_or(1, Count::get)))
            .and_then(|motion| motion.with_lifts(lifted_s, touch_s))
            .map_err(|problem| RigProblem::Motion(problem).at_place(&self.place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rig;
    use palpate_mechanics::contact::Position;

    const RIG: &str = include_str!("../../../examples/moving-load.toml");

    fn complaint(text: &str) -> String {
        let error = Rig::from_toml(text).unwrap_err();
        let place = error.span.clone().map_or("", |span| text[span].lines().next().unwrap_or(""));
        format!("{error} | {place}")
    }

    #[test]
    fn a_motion_is_read_with_its_beam() {
        let moving = Rig::from_toml(RIG).unwrap().motion.unwrap();
        let motion = Motion::new(Position::along(0.05), Position::along(0.35), 0.5, 0.1).unwrap();
        let motion = motion.with_passes(4).and_then(|motion| motion.with_lifts(0.0, TOUCH_S)).unwrap();
        assert_eq!((moving.first.motion, moving.rate_hz), (motion, 1000.0));
        let beam = Beam::new(0.4, 0.04, 0.0012, 200e9).unwrap();
        assert_eq!(moving.beam.unwrap(), ModalBeam::new(beam, 7850.0, 0.01).unwrap());
    }

    const PLATE: &str = include_str!("../../../examples/moving-plate.toml");

    #[test]
    fn a_motion_on_a_plate_is_between_two_points_of_it() {
        let moving = Rig::from_toml(PLATE).unwrap().motion.unwrap();
        assert_eq!((moving.beam, moving.second), (None, None));
        let (start, end) = (moving.contacts_at(0.0, 3.0), moving.contacts_at(1e9, 3.0));
        assert_eq!((start[0].position.x_m, start[0].position.y_m), (0.05, 0.08));
        assert!((end[0].position.x_m - 0.05).abs() < 1e-12, "{end:?}");
    }

    #[test]
    fn invalid_motion_on_a_plate_is_refused_at_its_place() {
        let from = "from = [\"50 mm\", \"80 mm\"]";
        let cases = [
            (from, "from = \"50 mm\"".to_owned()),
            (from, "from = [\"50 mm\", \"310 mm\"]".to_owned()),
            (from, "from = [\"250 mm\", \"210 mm\"]".to_owned()),
            (from, format!("{from}\ndamping = 0.01")),
        ];
        let told = cases.map(|(good, bad)| {
            assert!(PLATE.contains(good));
            complaint(&PLATE.replacen(good, &bad, 1))
        });
        insta::assert_snapshot!(told.join("\n"));
    }

    fn with_second(keys: &str) -> String {
        let contact = RIG.find("[contact]").unwrap()..RIG.find("\n[training]\n").unwrap();
        let text = RIG.replacen("[motion]", "[[motion]]", 1).replacen(&RIG[contact], "", 1);
        let second = "[[motion]]\nfrom = \"300 mm\"\nto = \"200 mm\"\nspeed = \"0.2 m/s\"\n";
        text.replacen("[training]", "[training]\nforce = \"3 N\"", 1) + second + keys
    }

    #[test]
    fn second_contact_has_a_separate_force() {
        let moving = Rig::from_toml(&with_second("force = \"2 N\"")).unwrap().motion.unwrap();
        let forces = |time_s| moving.contacts_at(time_s, 3.0).into_iter().map(|contact| contact.force_n);
        assert!(forces(0.0).eq([3.0, 2.0]));
        assert_eq!(moving.duration_s(), moving.first.motion.duration_s());
    }

    #[test]
    fn invalid_second_contact_is_refused_at_its_place() {
        let third = "[[motion]]\nfrom = \"1 mm\"\nto = \"9 mm\"\nspeed = \"1 m/s\"";
        let told = ["rate = \"1 kHz\"", "damping = 0.1", "force = \"-1 N\"", third]
            .map(|keys| complaint(&with_second(keys)));
        insta::assert_snapshot!(told.join("\n"), @r#"
        `rate` does not go with a second [[motion]]; the first sets it for both | "1 kHz"
        `damping` does not go with a second [[motion]]; the first sets it for both | 0.1
        `force` is -1 N; it must be greater than 0 | "-1 N"
        `motion` is a list of 3; it must be one, or a list of two | [[motion]]
        "#);
        let known = RIG.replacen("passes = 4", "force = \"2 N\"", 1);
        let told = Rig::from_toml(&known).unwrap_err().to_string();
        assert_eq!(told, "`force` does not go with a [contact] of known force");
    }

    #[test]
    fn invalid_motion_is_refused_at_its_place() {
        let cases = [
            ("density = \"7850 kg/m3\"", ""),
            ("density = \"7850 kg/m3\"", "density = \"7850 kg\""),
            ("to = \"350 mm\"", "to = \"450 mm\""),
            ("to = \"350 mm\"", "to = \"50 mm\""),
            ("turn = \"100 mm\"", "turn = \"200 mm\""),
            ("rate = \"1 kHz\"", "rate = \"1 MHz\""),
            ("rate = \"1 kHz\"", "rate = \"10000000 kHz\""),
            ("damping = 0.01", "damping = 1"),
            ("passes = 4", "passes = 0"),
            ("passes = 4", "touch = \"10 ms\""),
            ("speed = \"0.5 m/s\"", "speed = \"0.5 m\""),
        ];
        let told = cases.map(|(good, bad)| complaint(&RIG.replacen(good, bad, 1)));
        insta::assert_snapshot!(told.join("\n"));
    }
}
