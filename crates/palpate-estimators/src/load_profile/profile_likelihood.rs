//! Ends of 95 % intervals by profile likelihood.
//!
//! The interval of a value v of a load includes v if some load with that value has a misfit χ² within a
//! critical increase of the minimum (Pawitan, *In All Likelihood*, 2001, section 3.4).
//!
//! The minimum of χ² + ρ²·(v − t)² has the least misfit for its own v, which follows the target t. So t moves
//! away from the best value in steps that double until the misfit exceeds the critical one; bisection of t and
//! linear interpolation in χ² give the end.

/// 95 % quantile of χ², one degree of freedom: critical increase for loads with free unknowns.
pub(super) const FREE_INCREASE: f64 = 3.84;
/// Critical increase for loads x ≥ 0 of any shape. [`FREE_INCREASE`] covers only 92 % there, because x ≥ 0
/// increases the least misfit.
pub(super) const NON_NEGATIVE_INCREASE: f64 = 5.0;

/// Beyond these doublings of a step the value is unbounded.
const MOST_DOUBLINGS: usize = 40;
const MOST_HALVINGS: usize = 20;
/// Distance from the critical misfit, for interpolation. The density of χ² is 0.03 at [`FREE_INCREASE`], so that
/// coverage errs by at most 0.003 %.
const TOLERANCE: f64 = 0.001;

/// Load of least misfit for its value.
#[derive(Clone)]
pub(super) struct ProfilePoint<L> {
    pub load: L,
    pub value: f64,
    pub chi_squared: f64,
}

/// Profile of the misfit over a value.
pub(super) struct Profile<F, S> {
    /// Greatest misfit of the interval.
    pub most: f64,
    /// Minimum of the misfit with the penalty about a target, from a load nearby.
    pub minimum: F,
    /// True if the value no longer follows the target: last two points, and distance of the target.
    pub is_stationary: S,
}

impl<F, S> Profile<F, S> {
    /// End on the side of `first_step` from the best load, or the point where the value no longer follows the
    /// target; `None` for an unbounded value.
    pub fn end<L>(&self, best: ProfilePoint<L>, first_step: f64) -> Option<ProfilePoint<L>>
    where
        F: Fn(f64, &L) -> ProfilePoint<L>,
        S: Fn(&ProfilePoint<L>, &ProfilePoint<L>, f64) -> bool,
    {
        let start = best.value;
        let (mut inside, mut step) = ((start, best), first_step);
        for _ in 0..MOST_DOUBLINGS {
            let target = start + step;
            let point = (self.minimum)(target, &inside.1.load);
            if point.chi_squared > self.most {
                return Some(self.critical_point(inside, (target, point)));
            }
            if (self.is_stationary)(&inside.1, &point, step) {
                return Some(point);
            }
            inside = (target, point);
            step *= 2.0;
        }
        None
    }

    /// Critical value between two targets, with the load inside.
    fn critical_point<L>(
        &self,
        mut inside: (f64, ProfilePoint<L>),
        mut outside: (f64, ProfilePoint<L>),
    ) -> ProfilePoint<L>
    where
        F: Fn(f64, &L) -> ProfilePoint<L>,
    {
        for _ in 0..MOST_HALVINGS {
            if outside.1.chi_squared - self.most < TOLERANCE || self.most - inside.1.chi_squared < TOLERANCE {
                break;
            }
            let target = inside.0.midpoint(outside.0);
            let point = (self.minimum)(target, &inside.1.load);
            let end = if point.chi_squared > self.most { &mut outside } else { &mut inside };
            *end = (target, point);
        }
        let (inside, outside) = (inside.1, outside.1);
        let share = (self.most - inside.chi_squared)
            / (outside.chi_squared - inside.chi_squared).max(f64::MIN_POSITIVE);
        ProfilePoint { value: inside.value + share * (outside.value - inside.value), ..inside }
    }
}
