//! `[motion]`, or two `[[motion]]`

use std::ops::Range;

use toml::Spanned;

use crate::error::{RigError, RigProblem};
use crate::sections::{MotionSection, MotionSections, SurfaceSection};
use crate::value::{bounded, count, not_negative, positive};
use palpate_estimators::simulate::{MovingContact, MovingContacts};
use palpate_mechanics::surface::modal::ModalBeam;
use palpate_mechanics::surface::{Beam, Extent, Motion, SurfaceSpec};
use palpate_mechanics::units::Dimension;

use super::places::on_surface;

const SECTION: &str = "motion";
/// More readings than a recording should hold in memory.
const MOST_READINGS: f64 = 1e7;
/// A turn takes this share of the way, and a touch this long, unless the rig says otherwise.
const TURN: f64 = 0.2;
const TOUCH_S: f64 = 0.1;

pub(super) fn validate(
    sections: Option<&Spanned<MotionSections>>,
    surface_section: Option<&Spanned<SurfaceSection>>,
    surface: &SurfaceSpec,
    known_force_n: Option<f64>,
) -> Result<Option<MovingContacts>, RigError> {
    let density = surface_section.and_then(|section| section.get_ref().density.as_ref());
    let density =
        density.map(|raw| Ok((positive("density", raw, Dimension::Density)?, raw.span()))).transpose()?;
    let Some(sections) = sections else { return Ok(None) };
    let listed = sections.get_ref().each(sections.span());
    let context = |(keys, span)| Context { keys, span, known_force_n };
    let contacts: Vec<Context> = listed.into_iter().map(context).collect();
    let (first, second) = match contacts.as_slice() {
        [first] => (first, None),
        [first, second] => (first, Some(second)),
        others => {
            let value = format!("a list of {}", others.len());
            let at = others.get(2).map_or(sections.span(), |third| third.span.clone());
            return Err(RigProblem::OutOfRange { key: SECTION, value, bound: "one, or a list of two" }.at(at));
        }
    };
    let extent = surface.extent();
    let beam = match surface {
        SurfaceSpec::Beam(beam) => Some(modal_beam(*beam, first, density)?),
        SurfaceSpec::Plate(_) => None,
        _ => {
            let with = "a surface other than a beam on two supports or a plate";
            return Err(RigProblem::UnusedKey { key: SECTION, with }.at(first.span.clone()));
        }
    };
    if let (None, Some(damping)) = (beam, &first.keys.damping) {
        let with = "a plate, which is in balance at every reading";
        return Err(RigProblem::UnusedKey { key: "damping", with }.at(damping.span()));
    }
    if let (true, Some(second)) = (extent.is_plane(), second) {
        let (value, bound) = ("a list of two".to_owned(), "one on a plane");
        return Err(RigProblem::OutOfRange { key: SECTION, value, bound }.at(second.span.clone()));
    }
    let rate_hz = positive("rate", first.need("rate", first.keys.rate.as_ref())?, Dimension::Frequency)?;
    let moving = MovingContacts {
        first: first.contact(extent)?,
        second: second.map(|second| second.further(extent)).transpose()?,
        beam,
        rate_hz,
    };
    let readings = moving.duration_s() * rate_hz;
    if readings > MOST_READINGS || !readings.is_finite() {
        return Err(RigProblem::TooManyReadings { readings, most: MOST_READINGS }.at(sections.span()));
    }
    Ok(Some(moving))
}

/// The beam that swings under its first contact; its density is the surface's.
fn modal_beam(
    beam: Beam,
    first: &Context,
    density: Option<(f64, Range<usize>)>,
) -> Result<ModalBeam, RigError> {
    let (density_kg_per_m3, span) = density.ok_or_else(|| {
        RigProblem::MissingKey { section: "surface", key: "density" }.at(first.span.clone())
    })?;
    let below_1 = |ratio: f64| (0.0..1.0).contains(&ratio);
    let damping_ratio = first.keys.damping.as_ref().map_or(Ok(ModalBeam::USUAL_DAMPING_RATIO), |raw| {
        bounded("damping", raw, Dimension::Ratio, below_1, "at least 0 and below 1")
    })?;
    let beam = ModalBeam { beam, density_kg_per_m3, damping_ratio };
    beam.validate().map_err(|error| RigProblem::ModalBeam(error).at(span))?;
    Ok(beam)
}

/// One section.
struct Context<'a> {
    keys: &'a MotionSection,
    span: Range<usize>,
    known_force_n: Option<f64>,
}

impl<'a> Context<'a> {
    /// A contact beside another one, which says what both share.
    fn further(&self, extent: Extent) -> Result<MovingContact, RigError> {
        for (key, value) in [("rate", &self.keys.rate), ("damping", &self.keys.damping)] {
            if let Some(value) = value {
                let with = "a second [[motion]]; the first says it for both";
                return Err(RigProblem::UnusedKey { key, with }.at(value.span()));
            }
        }
        self.contact(extent)
    }

    fn contact(&self, extent: Extent) -> Result<MovingContact, RigError> {
        let force = self.keys.force.as_ref();
        if let (Some(raw), Some(_)) = (force, self.known_force_n) {
            let with = "a [contact] whose force is known";
            return Err(RigProblem::UnusedKey { key: "force", with }.at(raw.span()));
        }
        let force_n = force.map(|raw| positive("force", raw, Dimension::Force)).transpose()?;
        Ok(MovingContact { motion: self.motion(extent)?, force_n })
    }

    fn motion(&self, extent: Extent) -> Result<Motion, RigError> {
        let keys = self.keys;
        let (raw_from, raw_to) = (self.need("from", keys.from.as_ref())?, self.need("to", keys.to.as_ref())?);
        let (from, to) = (on_surface("from", raw_from, extent)?, on_surface("to", raw_to, extent)?);
        let way_m = from.distance_m(to);
        if way_m == 0.0 {
            let value = extent.place_in_words(to);
            let bound = "elsewhere than `from`";
            return Err(RigProblem::OutOfRange { key: "to", value, bound }.at(raw_to.span()));
        }
        let half_way = |turn_m: f64| turn_m > 0.0 && turn_m <= 0.5 * way_m;
        let turn_m = keys.turn.as_ref().map_or(Ok(TURN * way_m), |raw| {
            bounded("turn", raw, Dimension::Length, half_way, "greater than 0 and at most half the way")
        })?;
        let passes = keys
            .passes
            .as_ref()
            .map_or(Ok(1), |raw| count("passes", raw, 1..=100_000, "at least 1 and at most 100000"))?;
        let lifted_s =
            keys.lifted.as_ref().map_or(Ok(0.0), |raw| not_negative("lifted", raw, Dimension::Time))?;
        let touch_s =
            keys.touch.as_ref().map_or(Ok(TOUCH_S), |raw| positive("touch", raw, Dimension::Time))?;
        if let (Some(touch), true) = (&keys.touch, lifted_s == 0.0) {
            let with = "a contact that is never `lifted`";
            return Err(RigProblem::UnusedKey { key: "touch", with }.at(touch.span()));
        }
        let speed_m_per_s = positive("speed", self.need("speed", keys.speed.as_ref())?, Dimension::Speed)?;
        Ok(Motion { from, to, speed_m_per_s, turn_m, passes, lifted_s, touch_s })
    }

    fn need<T>(&self, key: &'static str, value: Option<&'a Spanned<T>>) -> Result<&'a Spanned<T>, RigError> {
        value.ok_or_else(|| RigProblem::MissingKey { section: SECTION, key }.at(self.span.clone()))
    }
}

#[cfg(test)]
mod tests {
    use crate::Rig;

    const RIG: &str = include_str!("../../../../examples/moving-load.toml");

    #[test]
    fn a_motion_is_read_with_its_beam() {
        let moving = Rig::from_toml(RIG).unwrap().motion.unwrap();
        assert_eq!(
            (moving.first.motion.passes, moving.rate_hz, moving.beam.unwrap().damping_ratio),
            (4, 1000.0, 0.01)
        );
        assert!((moving.first.motion.speed_m_per_s, moving.beam.unwrap().density_kg_per_m3) == (0.5, 7850.0));
    }

    const PLATE: &str = include_str!("../../../../examples/moving-plate.toml");

    #[test]
    fn a_motion_on_a_plate_is_between_two_points_of_it() {
        let moving = Rig::from_toml(PLATE).unwrap().motion.unwrap();
        assert_eq!((moving.beam, moving.second), (None, None));
        let motion = moving.first.motion;
        assert_eq!((motion.from.x_m, motion.from.y_m), (0.05, 0.08));
        assert_eq!((motion.to.x_m, motion.to.y_m), (0.25, 0.21));
    }

    #[test]
    fn what_is_wrong_with_a_motion_on_a_plate_is_said_with_its_place() {
        let from = "from = [\"50 mm\", \"80 mm\"]";
        let cases = [
            (from, "from = \"50 mm\"".to_owned()),
            (from, "from = [\"50 mm\", \"310 mm\"]".to_owned()),
            (from, "from = [\"250 mm\", \"210 mm\"]".to_owned()),
            (from, format!("{from}\ndamping = 0.01")),
        ];
        let told = cases.map(|(good, bad)| {
            assert!(PLATE.contains(good));
            let text = PLATE.replacen(good, &bad, 1);
            let error = Rig::from_toml(&text).unwrap_err();
            let place = error.span.clone().map_or("", |span| text[span].lines().next().unwrap_or(""));
            format!("{error} | {place}")
        });
        insta::assert_snapshot!(told.join("\n"));
    }

    /// The example with an unknown force and a second contact that says `keys`.
    fn with_second(keys: &str) -> String {
        let contact = RIG.find("[contact]").unwrap()..RIG.find("\n[training]\n").unwrap();
        let text = RIG.replacen("[motion]", "[[motion]]", 1).replacen(&RIG[contact], "", 1);
        let second = "[[motion]]\nfrom = \"300 mm\"\nto = \"200 mm\"\nspeed = \"0.2 m/s\"\n";
        text.replacen("[training]", "[training]\nforce = \"3 N\"", 1) + second + keys
    }

    #[test]
    fn a_second_contact_has_a_force_of_its_own() {
        let moving = Rig::from_toml(&with_second("force = \"2 N\"")).unwrap().motion.unwrap();
        let forces = |time_s| moving.contacts_at(time_s, 3.0).into_iter().map(|contact| contact.force_n);
        assert!(forces(0.0).eq([3.0, 2.0]));
        assert_eq!(moving.duration_s(), moving.first.motion.duration_s());
    }

    #[test]
    fn what_is_wrong_with_a_second_contact_is_said_with_its_place() {
        let third = "[[motion]]\nfrom = \"1 mm\"";
        let told = ["rate = \"1 kHz\"", "damping = 0.1", "force = \"-1 N\"", third].map(|keys| {
            let text = with_second(keys);
            let error = Rig::from_toml(&text).unwrap_err();
            format!(
                "{error} | {}",
                error.span.clone().map_or("", |span| text[span].lines().next().unwrap_or(""))
            )
        });
        insta::assert_snapshot!(told.join("\n"), @r#"
        `rate` does not go with a second [[motion]]; the first says it for both | "1 kHz"
        `damping` does not go with a second [[motion]]; the first says it for both | 0.1
        `force` is -1 N; it must be greater than 0 | "-1 N"
        `motion` is a list of 3; it must be one, or a list of two | [[motion]]
        "#);
        let known = RIG.replacen("passes = 4", "force = \"2 N\"", 1);
        let told = Rig::from_toml(&known).unwrap_err().to_string();
        assert_eq!(told, "`force` does not go with a [contact] whose force is known");
    }

    #[test]
    fn what_is_wrong_with_a_motion_is_said_with_its_place() {
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
        let told = cases.map(|(good, bad)| {
            let text = RIG.replacen(good, bad, 1);
            let error = Rig::from_toml(&text).unwrap_err();
            let place = error.span.clone().map_or("", |span| text[span].lines().next().unwrap_or(""));
            format!("{error} | {place}")
        });
        insta::assert_snapshot!(told.join("\n"));
    }
}
