//! Column headings.

use palpate_mechanics::units::Unit;

/// Name and unit of a column: `Position [mm]`, `Kraft (N)`, `X / mm`, `Kraft in N`, `Force, N`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heading<'a> {
    /// Bare name.
    pub name: &'a str,
    /// Unit text.
    pub unit: Option<&'a str>,
}

impl<'a> Heading<'a> {
    /// Splits a heading. Text in brackets, parentheses or after ` / ` is the unit; after `/`, `,` or `in`
    /// only a known symbol is.
    pub fn parse(text: &'a str) -> Self {
        let text = text.trim();
        let parts = Self::enclosed(text, '[', ']').or_else(|| Self::enclosed(text, '(', ')'));
        let parts = parts.or_else(|| text.split_once(" / ").filter(|(_, unit)| !unit.contains(' ')));
        let parts = parts.or_else(|| {
            ["/", ", ", " in "].into_iter().find_map(|mark| {
                let (name, unit) = text.split_once(mark)?;
                Unit::from_symbol(unit.trim()).filter(|unit| *unit != Unit::NONE).map(|_| (name, unit))
            })
        });
        match parts.map(|(name, unit)| (name.trim(), unit.trim())) {
            Some((name, unit)) if !name.is_empty() && !unit.is_empty() => Self { name, unit: Some(unit) },
            _ => Self { name: text, unit: None },
        }
    }

    /// Unit, if known.
    pub fn known_unit(&self) -> Option<Unit> {
        self.unit.and_then(Unit::from_symbol)
    }

    fn enclosed(text: &'a str, open: char, close: char) -> Option<(&'a str, &'a str)> {
        text.strip_suffix(close)?.rsplit_once(open)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_cut_off() {
        let parts = |text| {
            let heading = Heading::parse(text);
            (heading.name, heading.unit)
        };
        assert_eq!(parts("Position [mm]"), ("Position", Some("mm")));
        assert_eq!(parts(" Kraft(N) "), ("Kraft", Some("N")));
        assert_eq!(parts("X / mm"), ("X", Some("mm")));
        assert_eq!(parts("U1 / mV"), ("U1", Some("mV")));
        assert_eq!(parts("v/mm/s"), ("v", Some("mm/s")));
        assert_eq!(parts("Kraft in kN"), ("Kraft", Some("kN")));
        assert_eq!(parts("Force, N"), ("Force", Some("N")));
        assert_eq!(parts("Kanal 1 [counts]"), ("Kanal 1", Some("counts")));
        for whole in
            ["left/right", "a / b or c", "Pl", "", "[mm]", "a []", "in mm", "Signal in counts", "a, b", "mm"]
        {
            assert_eq!(parts(whole), (whole.trim(), None));
        }
    }
}
