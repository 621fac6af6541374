//! What a description of a beam on supports must say.

use super::error::{RigidMotion, SupportedBeamError};
use super::spec::{BeamSection, BeamSupport, BeamSupportKind, SupportedBeamSpec};
use crate::surface::first_not_positive;

/// More sections, and more supports, than a bench has.
const MOST: usize = 100;
/// Places nearer than this share of the length are one.
pub(super) const SAME_PLACE: f64 = 1e-9;

impl SupportedBeamSpec {
    /// Checks that the beam can be computed: numbers in their bounds, sections that cover it, supports on it and apart, and
    /// enough of them.
    ///
    /// # Errors
    /// [`SupportedBeamError`], for the first thing that is wrong.
    pub fn check(&self) -> Result<(), SupportedBeamError> {
        let dimensions = [("length", self.length_m), ("youngs_modulus", self.youngs_modulus_pa)];
        if let Some((name, value)) = first_not_positive(&dimensions) {
            return Err(SupportedBeamError::NotPositive { name, value });
        }
        self.check_sections()?;
        self.check_supports()?;
        self.check_held()
    }

    fn check_sections(&self) -> Result<(), SupportedBeamError> {
        let found = self.sections.len();
        if found > MOST {
            return Err(SupportedBeamError::TooManySections { found, most: MOST });
        }
        let (length_m, slack_m) = (self.length_m, SAME_PLACE * self.length_m);
        let mut from_m = 0.0;
        for (i, &BeamSection { to_m, width_m, thickness_m }) in self.sections.iter().enumerate() {
            let number = i + 1;
            if let Some((name, value)) = first_not_positive(&[("width", width_m), ("thickness", thickness_m)])
            {
                return Err(SupportedBeamError::Section { number, name, value });
            }
            if to_m.is_nan() || to_m <= from_m + slack_m {
                return Err(SupportedBeamError::SectionsOverlap { number, from_m, to_m });
            }
            if to_m > length_m + slack_m {
                return Err(SupportedBeamError::SectionBeyond { number, to_m, length_m });
            }
            from_m = to_m;
        }
        if from_m < length_m - slack_m {
            return Err(SupportedBeamError::SectionsEnd { to_m: from_m, length_m });
        }
        Ok(())
    }

    fn check_supports(&self) -> Result<(), SupportedBeamError> {
        let found = self.supports.len();
        if found > MOST {
            return Err(SupportedBeamError::TooManySupports { found, most: MOST });
        }
        let (length_m, slack_m) = (self.length_m, SAME_PLACE * self.length_m);
        for (i, &BeamSupport { at_m, kind }) in self.supports.iter().enumerate() {
            let number = i + 1;
            if !(-slack_m..=length_m + slack_m).contains(&at_m) {
                return Err(SupportedBeamError::SupportOffBeam { number, at_m, length_m });
            }
            if kind == BeamSupportKind::Free && (slack_m..=length_m - slack_m).contains(&at_m) {
                return Err(SupportedBeamError::FreeWithin { number, at_m, length_m });
            }
            if let BeamSupportKind::Elastic { stiffness_n_per_m, rotational_stiffness_nm_per_rad } = kind {
                let turning = rotational_stiffness_nm_per_rad.map(|value| ("rotational_stiffness", value));
                let springs = [Some(("stiffness", stiffness_n_per_m)), turning];
                if let Some((name, value)) = springs.into_iter().flatten().find(|(_, v)| !is_positive(*v)) {
                    return Err(SupportedBeamError::Stiffness { number, name, value });
                }
            }
            let together = |other: &BeamSupport| (other.at_m - at_m).abs() <= slack_m;
            if let Some(first) = self.supports[..i].iter().position(together) {
                return Err(SupportedBeamError::SupportsTogether { first: first + 1, second: number, at_m });
            }
        }
        Ok(())
    }

    /// Moving up and down and turning must both be held.
    fn check_held(&self) -> Result<(), SupportedBeamError> {
        let mut forces = self.supports.iter().filter(|support| support.kind.takes_force());
        let couples = self.supports.iter().any(|support| support.kind.takes_couple());
        let motion = match (forces.next(), forces.next(), couples) {
            (Some(_), Some(_), _) | (Some(_), None, true) => return Ok(()),
            (Some(only), None, false) => RigidMotion::Turning { about_m: only.at_m },
            (None, _, true) => RigidMotion::UpAndDown,
            (None, _, false) => RigidMotion::Any,
        };
        Err(SupportedBeamError::Mechanism { motion })
    }
}

fn is_positive(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}
