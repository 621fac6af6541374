use super::plan::Weights;
use palpate_estimators::recording::{Row, is_same_force};
use palpate_numerics::OutOfRange;
use palpate_rig::Rig;

/// Statements of the operator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statements {
    /// Standard deviation of the placement, in metres.
    pub placement_sd_m: Option<f64>,
    /// Second force, in newtons.
    pub second_force_n: Option<f64>,
    /// True if contacts in use have this force.
    pub force_is_known: bool,
}

impl Statements {
    /// Checks that the numbers are finite and positive.
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn check(&self) -> Result<(), OutOfRange> {
        let placement = self.placement_sd_m.map(|sd_m| ("the placement in metres", sd_m));
        OutOfRange::check_positive(
            placement.into_iter().chain(self.second_force_n.map(|n| ("the second force in newtons", n))),
        )
    }

    /// Adds values from the rig and a file of presses.
    #[must_use]
    pub fn with_known_values(
        self,
        rig: &Rig,
        force_n: Option<f64>,
        in_file_m: Option<f64>,
        before: &[Row],
    ) -> Self {
        let of_rig = rig.training.as_ref().and_then(|training| training.placement_sd_m);
        let first_n = Weights { force_n, second_n: None }.first_n(rig);
        let mut forces = before.iter().filter(|row| row.touches()).filter_map(|row| row.force_n);
        let pressed_n = first_n.and_then(|first_n| forces.find(|row_n| !is_same_force(first_n, *row_n)));
        Self {
            placement_sd_m: self.placement_sd_m.or(of_rig).or(in_file_m),
            second_force_n: self.second_force_n.or(pressed_n),
            ..self
        }
    }

    /// Rig with the force of the presses, if stated as known.
    #[must_use]
    pub fn applied_to(&self, rig: &Rig, force_n: Option<f64>) -> Rig {
        let mut rig = rig.clone();
        let first_n = Weights { force_n, second_n: None }.first_n(&rig).filter(|_| self.force_is_known);
        if let Some(Ok(setup)) = first_n.map(|force_n| rig.setup.clone().known_force(force_n)) {
            rig.setup = setup;
        }
        rig
    }

    /// Weights of the presses.
    pub fn weights(&self, force_n: Option<f64>) -> Weights {
        Weights { force_n, second_n: self.second_force_n.filter(|_| !self.force_is_known) }
    }

    /// Single force of all presses in newtons, if a second is necessary: without a model, unknown forces
    /// require two.
    pub fn single_weight_n(&self, rig: &Rig, force_n: Option<f64>) -> Option<f64> {
        let has_forces = rig.setup.recording_columns().force.is_some();
        let asks = rig.setup.surface().model().is_none()
            && rig.setup.force_n().is_none()
            && has_forces
            && self.second_force_n.is_none()
            && !self.force_is_known;
        Weights { force_n, second_n: None }.first_n(rig).filter(|_| asks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_mechanics::contact::Position;

    const BOARD: &str = r#"
[surface]
kind = "measured"
length = "300 mm"

[sensors]
measure = "raw"
count = 2

[recording]
position = "position"
position_unit = "mm"
force = "force"
channels = ["a", "b"]

[training]
count = 11
force = "2 N"

[estimator]
kind = "influence"
"#;

    fn row(force_n: f64) -> Row {
        let position = Position::along(0.1);
        Row { position, force_n: Some(force_n), nuisances: Vec::new(), time_s: None, reading: vec![1.0, 2.0] }
    }

    #[test]
    fn asks_for_a_second_weight_where_one_cannot_tell_the_force() {
        let rig = Rig::from_toml(BOARD).unwrap();
        let stated = Statements::default();
        assert_eq!(stated.single_weight_n(&rig, None), Some(2.0));
        assert_eq!(stated.single_weight_n(&rig, Some(3.0)), Some(3.0));
        for answered in [
            Statements { second_force_n: Some(4.0), ..stated },
            Statements { force_is_known: true, ..stated },
            stated.with_known_values(&rig, None, None, &[row(0.0), row(2.0), row(4.0)]),
        ] {
            assert_eq!(answered.single_weight_n(&rig, None), None, "{answered:?}");
        }
        let known = BOARD.replace("[training]", "[contact]\nforce = \"2 N\"\n[training]");
        let model = include_str!("../../../../examples/fsi-like.toml").to_owned();
        let unweighed = BOARD.replace("force = \"2 N\"\n", "");
        for text in [known, model, unweighed] {
            assert_eq!(stated.single_weight_n(&Rig::from_toml(&text).unwrap(), None), None, "{text}");
        }
    }

    #[test]
    fn force_that_is_stated_known_is_known_to_the_locator() {
        let rig = Rig::from_toml(BOARD).unwrap();
        let stated = Statements { force_is_known: true, second_force_n: Some(4.0), ..Statements::default() };
        assert_eq!(stated.applied_to(&rig, None).setup.force_n(), Some(2.0));
        assert_eq!(stated.weights(None).second_n, None);
        assert_eq!(Statements::default().applied_to(&rig, None).setup.force_n(), None);
    }

    #[test]
    fn placement_is_the_stated_one_then_that_of_the_rig_then_that_of_the_file() {
        let stated = Statements { placement_sd_m: Some(1e-3), ..Statements::default() };
        let with = Rig::from_toml(&BOARD.replace("count = 11", "count = 11\nplacement = \"2 mm\"")).unwrap();
        let without = Rig::from_toml(BOARD).unwrap();
        let placement = |stated: Statements, rig: &Rig| {
            stated.with_known_values(rig, None, Some(3e-3), &[]).placement_sd_m
        };
        assert_eq!(placement(stated, &with), Some(1e-3));
        assert_eq!(placement(Statements::default(), &with), Some(2e-3));
        assert_eq!(placement(Statements::default(), &without), Some(3e-3));
    }

    #[test]
    fn refuses_numbers_that_are_no_lengths_and_forces() {
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Statements { placement_sd_m: Some(wrong), ..Statements::default() }.check().is_err());
            assert!(Statements { second_force_n: Some(wrong), ..Statements::default() }.check().is_err());
        }
        assert!(
            Statements { placement_sd_m: Some(2e-3), second_force_n: Some(1.0), force_is_known: false }
                .check()
                .is_ok()
        );
    }
}
