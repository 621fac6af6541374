//! How well a contact explains a reading, and how that changes with position and force.

use super::fitting::DigitTheory;
use super::gauges::{Gauge, Stretch};
use palpate_mechanics::contact::{Contact, Position};
use palpate_mechanics::surface::Digit;
use palpate_numerics::small::{Ldl, Matrix, add_outer};

/// A reading of a digit, to be explained.
#[derive(Clone, Copy)]
pub(super) struct Likelihood<'a> {
    pub digit: &'a Digit,
    pub theory: DigitTheory,
    pub gauges: &'a [Gauge],
    /// The force in newtons, where it is known.
    pub force_n: Option<f64>,
}

/// A contact that is tried: position along the digit in metres, and force in newtons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Guess {
    pub position_m: f64,
    pub force_n: f64,
}

/// The sums over the gauges, whitened: residual r, Jacobian J of the model by position and force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    /// |r|².
    pub chi_squared: f64,
    /// Jᵀ·r.
    pub score: [f64; 2],
    /// JᵀJ, the Fisher information.
    pub information: Matrix<2>,
}

impl Likelihood<'_> {
    /// The largest force that is looked for at a position.
    pub fn most_force_n(&self, position_m: f64) -> f64 {
        Digit::MOST_LOAD * self.digit.bending_stiffness() / (position_m * position_m)
    }

    /// |r|² of the gauges that see nothing of a contact on a stretch: no contact there does better.
    pub fn least_chi_squared(&self, stretch: Stretch) -> f64 {
        self.gauges[stretch.seeing..].iter().map(|gauge| (gauge.strain / gauge.sd).powi(2)).sum()
    }

    /// The sums at a guess on a stretch.
    pub fn at(&self, guess: Guess, stretch: Stretch) -> Sums {
        let Guess { position_m, force_n } = guess;
        let bent = match self.theory {
            DigitTheory::Exact => {
                Some(self.digit.shape(Contact { position: Position::along(position_m), force_n }))
            }
            DigitTheory::Linear => None,
        };
        let stiffness = self.digit.bending_stiffness();
        let mut sums = Sums { chi_squared: self.least_chi_squared(stretch), ..Sums::default() };
        for gauge in &self.gauges[..stretch.seeing] {
            let (curvature, [by_position, by_force]) = match &bent {
                Some(shape) => (shape.curvature(gauge.at_m), shape.curvature_gradient(gauge.at_m)),
                None => {
                    let lever_m = position_m - gauge.at_m;
                    (force_n * lever_m / stiffness, [force_n / stiffness, lever_m / stiffness])
                }
            };
            let scale = self.digit.strain_per_curvature_m() / gauge.sd;
            sums.add(gauge.strain / gauge.sd - scale * curvature, scale * by_position, scale * by_force);
        }
        if self.force_n.is_some() {
            sums.score[1] = 0.0;
            sums.information = [[sums.information[0][0], 0.0], [0.0, 0.0]];
        }
        sums
    }

    /// The force by which the linear theory explains the reading best at a position: where a search begins.
    pub fn linear_force_n(&self, position_m: f64, stretch: Stretch) -> f64 {
        let scale = self.digit.strain_per_curvature_m() / self.digit.bending_stiffness();
        let (mut n, mut d) = (0.0, 0.0);
        for gauge in &self.gauges[..stretch.seeing] {
            let by_force = scale * (position_m - gauge.at_m) / gauge.sd;
            n += by_force * gauge.strain / gauge.sd;
            d += by_force * by_force;
        }
        if d > 0.0 { n / d } else { 0.0 }
    }
}

impl Sums {
    fn add(&mut self, residual: f64, by_position: f64, by_force: f64) {
        self.chi_squared += residual * residual;
        self.score[0] += by_position * residual;
        self.score[1] += by_force * residual;
        add_outer(&mut self.information, 1.0, &[by_position, by_force]);
    }

    /// The factors of JᵀJ, whose inverse is the covariance of position and force; without the force where it is known.
    /// `None` where the reading does not tell them.
    pub fn factors(&self, force_known: bool) -> Option<Ldl<2>> {
        Ldl::of_free(&self.information, [true, !force_known])
    }

    /// The Gauss–Newton step (JᵀJ)⁻¹·Jᵀr of position and force.
    pub fn step(&self, force_known: bool) -> Option<[f64; 2]> {
        Some(self.factors(force_known)?.solve(self.score))
    }

    /// The step of the force alone.
    pub fn force_step(&self) -> f64 {
        let [_, [_, ff]] = self.information;
        if ff > 0.0 { self.score[1] / ff } else { 0.0 }
    }
}
