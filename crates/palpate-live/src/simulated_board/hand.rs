//! Hand in a guided calibration, with human imperfections.

use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Extent;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Instruction to a hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Instruction {
    /// Press with this force.
    Press(Contact),
    /// Keep the state.
    Hold,
    /// Lift.
    Lift,
}

/// Style of a hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandStyle {
    /// Standard deviation of the position per axis in metres.
    pub placement_m: f64,
    /// Rise time of the force in seconds.
    pub press_s: f64,
    /// Fall time of the force in seconds.
    pub lift_s: f64,
    /// Reaction time in seconds.
    pub reaction_s: f64,
    /// Share of the force while hovering around a press.
    pub hover_share: f64,
    /// Duration of hovering in seconds.
    pub hover_s: f64,
    /// Quick taps per press.
    pub taps: u32,
    /// Share of presses that end too early, 0 to 1.
    pub early_lift: f64,
}

impl Default for HandStyle {
    /// A hand that is exact and quick.
    fn default() -> Self {
        Self {
            placement_m: 0.0,
            press_s: 0.2,
            lift_s: 0.1,
            reaction_s: 0.4,
            hover_share: 0.0,
            hover_s: 0.0,
            taps: 0,
            early_lift: 0.0,
        }
    }
}

const TAP_S: f64 = 0.12;
/// Time from the onset.
const EARLY_LIFT_S: f64 = 0.15;

/// Hand in the course of a calibration.
#[derive(Clone, Debug)]
pub struct SimulatedHand {
    style: HandStyle,
    extent: Extent,
    rng: Xoshiro256PlusPlus,
    position: Position,
    force_n: f64,
    motion: Vec<Leg>,
    begun_s: f64,
    presses: bool,
}

/// Change to `share` within `for_s`.
#[derive(Clone, Copy, Debug)]
struct Leg {
    for_s: f64,
    share: f64,
}

impl SimulatedHand {
    /// Lifted hand.
    pub fn new(style: HandStyle, extent: Extent, seed: u64) -> Self {
        Self {
            style,
            extent,
            rng: Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x4A_4D),
            position: Position::default(),
            force_n: 0.0,
            motion: Vec::new(),
            begun_s: 0.0,
            presses: false,
        }
    }

    /// Contact at a time in seconds, which must not decrease.
    pub fn contact_at(&mut self, time_s: f64, instruction: Instruction) -> Option<Contact> {
        if self.is_over(time_s) {
            let share = self.share_at(time_s);
            match instruction {
                Instruction::Press(contact) if !self.presses => {
                    self.presses = true;
                    self.begun_s = time_s;
                    self.position = self.place_with_error(contact.position);
                    self.force_n = contact.force_n;
                    self.motion = self.pressing();
                }
                // After an early lift the press is requested again.
                Instruction::Press(_) if share <= 0.0 => self.presses = false,
                Instruction::Lift if self.presses => {
                    self.presses = false;
                    self.begun_s = time_s;
                    self.motion = if share > 0.0 { self.lifting(share) } else { Vec::new() };
                }
                _ => {}
            }
        }
        let share = self.share_at(time_s);
        (share > 0.0).then_some(Contact { position: self.position, force_n: self.force_n * share })
    }

    fn pressing(&mut self) -> Vec<Leg> {
        let HandStyle { press_s, lift_s, reaction_s, hover_share, hover_s, taps, early_lift, .. } =
            self.style;
        let mut legs = vec![Leg { for_s: reaction_s, share: 0.0 }];
        for _ in 0..taps {
            legs.extend(
                [(0.4, 0.8), (0.6, 0.0), (1.0, 0.0)].map(|(part, share)| Leg { for_s: part * TAP_S, share }),
            );
        }
        if hover_share > 0.0 {
            legs.extend([Leg { for_s: 0.1, share: hover_share }, Leg { for_s: hover_s, share: hover_share }]);
        }
        legs.push(Leg { for_s: press_s, share: 1.0 });
        if self.rng.random::<f64>() < early_lift {
            legs.extend([Leg { for_s: EARLY_LIFT_S, share: 1.0 }, Leg { for_s: lift_s, share: 0.0 }]);
        }
        legs
    }

    fn lifting(&self, share: f64) -> Vec<Leg> {
        let HandStyle { lift_s, reaction_s, hover_share, hover_s, .. } = self.style;
        let mut legs = vec![Leg { for_s: reaction_s, share }];
        if hover_share > 0.0 {
            legs.extend([
                Leg { for_s: lift_s, share: hover_share },
                Leg { for_s: hover_s, share: hover_share },
            ]);
        }
        legs.push(Leg { for_s: lift_s, share: 0.0 });
        legs
    }

    fn is_over(&self, time_s: f64) -> bool {
        time_s - self.begun_s >= self.motion.iter().map(|leg| leg.for_s).sum()
    }

    fn share_at(&self, time_s: f64) -> f64 {
        let mut left_s = time_s - self.begun_s;
        let mut from = match self.motion.first() {
            Some(first) => first.share,
            None => return 0.0,
        };
        for leg in &self.motion {
            if left_s < leg.for_s {
                let part = left_s / leg.for_s;
                return from + part * part * (3.0 - 2.0 * part) * (leg.share - from);
            }
            (from, left_s) = (leg.share, left_s - leg.for_s);
        }
        from
    }

    fn place_with_error(&mut self, position: Position) -> Position {
        let mut off = |at_m: f64, side_m: f64| {
            let drawn: f64 = StandardNormal.sample(&mut self.rng);
            (at_m + self.style.placement_m * drawn).clamp(0.0, side_m)
        };
        let x_m = off(position.x_m, self.extent.length_m());
        let y_m = self.extent.width_m().map_or(0.0, |width_m| off(position.y_m, width_m));
        Position { x_m, y_m }
    }
}
