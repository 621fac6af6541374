//! A beam on supports in words, for people.

use super::spec::{BeamSection, BeamSupport, BeamSupportKind, SupportedBeamSpec};
use crate::units::{Dimension, Quantity, format_length_mm};

impl SupportedBeamSpec {
    /// "clamped at 0 mm, elastic (2 N/mm) at 300 mm", from left to right.
    pub fn supports_in_words(&self) -> String {
        let mut supports = self.supports.clone();
        supports.sort_by(|a, b| a.at_m.total_cmp(&b.at_m));
        let words = |BeamSupport { at_m, kind }: &BeamSupport| {
            format!("{} at {}", kind_in_words(*kind), format_length_mm(*at_m))
        };
        supports.iter().map(words).collect::<Vec<_>>().join(", ")
    }

    /// "40 mm × 1.2 mm", or "40 mm × 2 mm up to 100 mm, 40 mm × 1.2 mm up to 300 mm": width × thickness.
    pub fn sections_in_words(&self) -> String {
        let size = |section: &BeamSection| {
            format!("{} × {}", format_length_mm(section.width_m), format_length_mm(section.thickness_m))
        };
        match self.sections.as_slice() {
            [only] => size(only),
            sections => {
                let words = |section: &BeamSection| {
                    format!("{} up to {}", size(section), format_length_mm(section.to_m))
                };
                sections.iter().map(words).collect::<Vec<_>>().join(", ")
            }
        }
    }
}

fn kind_in_words(kind: BeamSupportKind) -> String {
    let BeamSupportKind::Elastic { stiffness_n_per_m, rotational_stiffness_nm_per_rad } = kind else {
        return kind.name().to_owned();
    };
    let spring = Quantity { value: stiffness_n_per_m, dimension: Dimension::Stiffness };
    match rotational_stiffness_nm_per_rad {
        Some(value) => {
            let turning = Quantity { value, dimension: Dimension::RotationalStiffness };
            format!("elastic ({spring} and {turning})")
        }
        None => format!("elastic ({spring})"),
    }
}
