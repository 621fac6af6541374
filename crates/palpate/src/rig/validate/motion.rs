//! `[motion]`

use toml::Spanned;

use crate::mechanics::modal::ModalBeam;
use crate::mechanics::{Motion, SurfaceSpec};
use crate::rig::MotionRig;
use crate::rig::error::{RigError, RigProblem};
use crate::rig::sections::{MotionSection, SurfaceSection};
use crate::rig::value::{RawQuantity, bounded, count, not_negative, positive, quantity};
use crate::units::Dimension;

const SECTION: &str = "motion";
/// More readings than a recording should hold in memory.
const MOST_READINGS: f64 = 1e7;
/// A turn takes this share of the way, and a touch this long, unless the rig says otherwise.
const TURN: f64 = 0.2;
const TOUCH_S: f64 = 0.1;
/// Of the critical damping, as of a thin steel beam on wedges.
const DAMPING: f64 = 0.01;

pub(super) fn validate(
    section: Option<&Spanned<MotionSection>>,
    surface_section: Option<&Spanned<SurfaceSection>>,
    surface: &SurfaceSpec,
) -> Result<Option<MotionRig>, RigError> {
    let density = surface_section.and_then(|section| section.get_ref().density.as_ref());
    let density =
        density.map(|raw| Ok((positive("density", raw, Dimension::Density)?, raw.span()))).transpose()?;
    let Some(section) = section else { return Ok(None) };
    let SurfaceSpec::Beam(beam) = surface else {
        return Err(
            RigProblem::UnusedKey { key: SECTION, with: "a surface other than a beam" }.at(section.span())
        );
    };
    let (density_kg_per_m3, span) = density
        .ok_or_else(|| RigProblem::MissingKey { section: "surface", key: "density" }.at(section.span()))?;
    let keys = section.get_ref();
    let below_1 = |ratio: f64| (0.0..1.0).contains(&ratio);
    let damping = keys.damping.as_ref();
    let damping_ratio = damping.map_or(Ok(DAMPING), |raw| {
        bounded("damping", raw, Dimension::Ratio, below_1, "at least 0 and below 1")
    })?;
    let beam = ModalBeam { beam: *beam, density_kg_per_m3, damping_ratio };
    beam.validate().map_err(|error| RigProblem::ModalBeam(error).at(span))?;
    let motion = motion(section, beam.beam.length_m)?;
    let rate_hz = positive("rate", need("rate", keys.rate.as_ref(), section)?, Dimension::Frequency)?;
    let readings = motion.duration_s() * rate_hz;
    if readings > MOST_READINGS || !readings.is_finite() {
        return Err(RigProblem::TooManyReadings { readings, most: MOST_READINGS }.at(section.span()));
    }
    Ok(Some(MotionRig { motion, beam, rate_hz }))
}

fn motion(section: &Spanned<MotionSection>, length_m: f64) -> Result<Motion, RigError> {
    let keys = section.get_ref();
    let place = |key, raw: &Option<Spanned<RawQuantity>>| {
        let raw = need(key, raw.as_ref(), section)?;
        let x_m = quantity(key, raw, Dimension::Length)?;
        let inside = (0.0..=length_m).contains(&x_m);
        if inside { Ok(x_m) } else { Err(RigProblem::MotionOffSurface { key, x_m, length_m }.at(raw.span())) }
    };
    let (from_m, to_m) = (place("from", &keys.from)?, place("to", &keys.to)?);
    let way_m = (to_m - from_m).abs();
    if way_m == 0.0 {
        let to = need("to", keys.to.as_ref(), section)?;
        let value = to.get_ref().to_string();
        return Err(RigProblem::OutOfRange { key: "to", value, bound: "elsewhere than `from`" }.at(to.span()));
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
    let touch_s = keys.touch.as_ref().map_or(Ok(TOUCH_S), |raw| positive("touch", raw, Dimension::Time))?;
    if let (Some(touch), true) = (&keys.touch, lifted_s == 0.0) {
        return Err(
            RigProblem::UnusedKey { key: "touch", with: "a contact that is never `lifted`" }.at(touch.span())
        );
    }
    let speed_m_per_s = positive("speed", need("speed", keys.speed.as_ref(), section)?, Dimension::Speed)?;
    Ok(Motion { from_m, to_m, speed_m_per_s, turn_m, passes, lifted_s, touch_s })
}

fn need<'a>(
    key: &'static str,
    value: Option<&'a Spanned<RawQuantity>>,
    section: &Spanned<MotionSection>,
) -> Result<&'a Spanned<RawQuantity>, RigError> {
    value.ok_or_else(|| RigProblem::MissingKey { section: SECTION, key }.at(section.span()))
}

#[cfg(test)]
mod tests {
    use crate::rig::Rig;

    const RIG: &str = include_str!("../../../../../examples/moving-load.toml");

    #[test]
    fn a_motion_is_read_with_its_beam() {
        let moving = Rig::from_toml(RIG).unwrap().motion.unwrap();
        assert_eq!((moving.motion.passes, moving.rate_hz, moving.beam.damping_ratio), (4, 1000.0, 0.01));
        assert!((moving.motion.speed_m_per_s, moving.beam.density_kg_per_m3) == (0.5, 7850.0));
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
