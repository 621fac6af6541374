//! The sensor, its bench drawn, and how a network learns on it.

use maud::{Markup, html};

use super::Paper;
use crate::numbers::{counted, mm, number, stated};
use palpate_mechanics::sensing::SensorKind;
use palpate_mechanics::surface::{Beam, Surface, SurfaceSpec};
use palpate_rig::Rig;

impl Paper<'_> {
    /// What is on the bench, where the surface is a beam. All arms of the paper share it.
    pub(super) fn setup(&self) -> Option<(&Rig, Beam, f64)> {
        let rig = &self.report.study.study.arms.first()?.rig;
        let SurfaceSpec::Beam(beam) = rig.setup.surface else { return None };
        Some((rig, beam, rig.setup.force_n?))
    }

    /// Distance of neighbouring sensors in mm, where it is the same for all.
    pub(super) fn sensor_pitch_mm(&self) -> Option<String> {
        let (rig, ..) = self.setup()?;
        let positions: Vec<f64> =
            rig.setup.layout.sensors().iter().map(|sensor| sensor.position.x_m).collect();
        let pitches: Vec<f64> = positions.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let first = *pitches.first()?;
        pitches.iter().all(|pitch| (pitch - first).abs() < 1e-6).then(|| number(first * 1e3))
    }

    pub(super) fn sensor(&self) -> Markup {
        html! {
            p {
                "A distributive tactile sensor has few sensors and they all stand under one elastic surface. Wherever the \
                 surface is touched, all of it bends, and every sensor notices. No sensor is in charge of a place of its \
                 own: the place is in the pattern across all of them. How finely it can be told is therefore a matter of \
                 how the pattern is interpreted more than of how many sensors there are, and there is no dead area between \
                 two of them."
            }
            @if let Some((rig, beam, force_n)) = self.setup() { (bench_in_words(rig, beam, force_n)) }
        }
    }

    pub(super) fn starting_point(&self) -> Markup {
        html! {
            p {
                "The paper begins with the position output and ten equally spaced training positions. "
                @if self.report.outcome("position-10").is_none() { "That arm was not run." }
            }
        }
    }
}

pub(super) fn training() -> Markup {
    html! {
        p {
            "The interpreter is a small feed-forward network. Its inputs are the sensors' readings; its single output \
             stands for the position of the load. It is trained by back-propagation: a load is put at a few known "
            b { "training positions" } ", the network is shown the readings again and again, and each time its weights \
             move so that its output comes nearer to the known position. After that it has to locate loads at places \
             that it never saw."
        }
        p {
            "The paper asks three things. What should the output stand for: the plain position in metres, or the \
             position divided by the beam's length, which uses the whole range of the output? How many training \
             positions are enough? And does it help to crowd them towards the supports?"
        }
        p {
            "Each way to train is an " b { "arm" } " of the study, named after what the output stands for or where the \
             training positions are, and after their number: " code { "position-10" } " has the plain position as its output \
             and ten training positions, " code { "normalized-20" } " the position divided by the length and twenty, "
            code { "middle4-30" } " thirty, four of which lie in the middle portion, and again a normalized output."
        }
    }
}

pub(super) fn arrangements() -> Markup {
    html! {
        p {
            "Equally spaced training positions leave the network to guess beyond the first and the last of them. So the \
             paper tries arrangements with the same number of positions, but fewer of them in the middle portion and \
             more near the supports. All networks of these arrangements have the normalized output."
        }
    }
}

fn bench_in_words(rig: &Rig, beam: Beam, force_n: f64) -> Markup {
    let sag_mm = force_n * beam.full_scale(SensorKind::Deflection) * 1e3;
    html! {
        p {
            "The surface here is a beam, " (mm(beam.length_m())) " mm long, " (mm(beam.width_m())) " mm wide and "
            (mm(beam.thickness_m())) " mm thick, with a Young's modulus of " (stated(beam.youngs_modulus_pa() / 1e9))
            " GPa, on two wedges at its ends. "
            (counted(rig.setup.layout.len(), "sensor measures", "sensors measure")) " its " (kinds(rig)) " while a load of "
            (stated(force_n)) " N, whose force is known, stands on it. With the load in the middle the beam sags by "
            (number(sag_mm)) " mm there."
        }
    }
}

/// "deflection", or more where the sensors differ.
fn kinds(rig: &Rig) -> String {
    let mut names: Vec<&str> = rig.setup.layout.sensors().iter().map(|sensor| sensor.kind.name()).collect();
    names.dedup();
    names.join(", ")
}
