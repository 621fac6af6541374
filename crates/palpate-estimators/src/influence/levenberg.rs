//! Levenberg's steps down the misfit of a contact (K. Levenberg, Quart. Appl. Math. 2, 1944, with Marquardt's scaling by the diagonal).

use super::lanes::{LANES, Lanes, sum_of};
use crate::force_prior::PriorTerms;
use palpate_numerics::simd::{Eight, InstructionSet, Kernel, Simd, Vector};
use palpate_numerics::small::{Ldl, Matrix};
use palpate_numerics::with_shared_error;

/// Position along and across, and the force or whatever else a reading depends on.
pub(super) type Unknowns = [f64; 3];

/// JᵀV⁻¹J and JᵀV⁻¹e of some unknowns, V the variances, e the residual and J the reading's derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Equations {
    /// eᵀV⁻¹e.
    pub misfit: f64,
    pub right: [f64; 3],
    pub information: Matrix<3>,
}

impl Equations {
    /// From the weights V⁻¹, the residual and the derivatives of groups of channels.
    pub fn new(channels: impl Iterator<Item = (Lanes, Lanes, [Lanes; 3])>) -> Self {
        InstructionSet::best().run(SumGroups { channels })
    }

    /// With errors g that the channels share besides: by V + g·gᵀ in place of V, from the same groups of channels and g.
    pub fn with_shared_errors(
        mut self,
        channels: impl Iterator<Item = ((Lanes, Lanes, [Lanes; 3]), Lanes)>,
    ) -> Self {
        let (mut gg, mut ge, mut gj) = (0.0, 0.0, [0.0; 3]);
        for ((weights, e, slopes), shared) in channels {
            for l in 0..LANES {
                let weighed = weights[l] * shared[l];
                gg += weighed * shared[l];
                ge += weighed * e[l];
                gj.iter_mut().zip(&slopes).for_each(|(sum, slopes)| *sum += weighed * slopes[l]);
            }
        }
        self.misfit = with_shared_error(self.misfit, ge, ge, gg);
        for i in 0..3 {
            self.right[i] = with_shared_error(self.right[i], ge, gj[i], gg);
            for j in 0..3 {
                self.information[i][j] = with_shared_error(self.information[i][j], gj[i], gj[j], gg);
            }
        }
        self
    }

    /// With a prior of the last unknown.
    pub fn with_prior(mut self, PriorTerms { cost, slope, precision }: PriorTerms) -> Self {
        self.misfit += cost;
        self.right[2] -= slope;
        self.information[2][2] += precision;
        self
    }
}

struct SumGroups<I> {
    channels: I,
}

impl<I: Iterator<Item = (Lanes, Lanes, [Lanes; 3])>> Kernel for SumGroups<I> {
    type Output = Equations;
    const FUSED: bool = true;

    #[inline(always)] // Compiled for the instructions of its caller.
    fn run<S: Simd>(self) -> Equations {
        let mut sums = EquationSums::new();
        for (weights, e, slopes) in self.channels {
            let [weights, e] = [&weights, &e].map(S::F64::load);
            sums.add(weights, e, slopes.each_ref().map(S::F64::load));
        }
        sums.equations()
    }
}

/// Products of weights, residuals and derivatives, eight channels side by side.
pub(super) struct EquationSums<V>([V; 10]);

impl<V: Eight<Real = f64>> EquationSums<V> {
    #[inline(always)] // Compiled for the instructions of its caller.
    pub fn new() -> Self {
        Self([V::splat(0.0); 10])
    }

    /// With the weights V⁻¹, the residual and the derivatives of eight channels more.
    #[inline(always)] // Compiled for the instructions of its caller.
    pub fn add(&mut self, weights: V, e: V, [x, y, t]: [V; 3]) {
        let [we, wx, wy] = [weights * e, weights * x, weights * y];
        let terms = [
            (we, e),
            (we, x),
            (we, y),
            (we, t),
            (wx, x),
            (wx, y),
            (wx, t),
            (wy, y),
            (wy, t),
            (weights * t, t),
        ];
        self.0.iter_mut().zip(terms).for_each(|(sum, (a, b))| *sum = a.mul_add(b, *sum));
    }

    #[inline(always)] // Compiled for the instructions of its caller.
    pub fn equations(self) -> Equations {
        let [misfit, ex, ey, et, xx, xy, xt, yy, yt, tt] = self.0.map(sum_of);
        Equations { misfit, right: [ex, ey, et], information: [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]] }
    }
}

/// Steps, those that were refused included.
const MOST_STEPS: usize = 40;

/// The minimum near `start`, and its equations; every unknown stays between its ends, and one whose ends are the same is not looked for. A
/// step that lowers the misfit by less than `small` is the last one.
pub(super) fn descend(
    start: Unknowns,
    ends: [(f64, f64); 3],
    small: f64,
    mut equations: impl FnMut(Unknowns) -> Equations,
) -> (Unknowns, Equations) {
    let held = |at: Unknowns| std::array::from_fn(|k| at[k].clamp(ends[k].0, ends[k].1));
    let mut at: Unknowns = held(start);
    let mut here = equations(at);
    let mut damping = 1e-3;
    for _ in 0..MOST_STEPS {
        let Some(step) = damped_step(&here, at, ends, damping) else { break };
        let next: Unknowns = held(std::array::from_fn(|k| at[k] + step[k]));
        let gain: f64 = (0..3).map(|k| (next[k] - at[k]) * here.right[k]).sum();
        let there = equations(next);
        if there.misfit <= here.misfit {
            (at, here) = (next, there);
            damping = (0.1 * damping).max(1e-9);
        } else {
            damping = (10.0 * damping).max(1e-3);
        }
        if gain.abs() <= small {
            break;
        }
    }
    (at, here)
}

/// The damped step of those unknowns that are free: at an end, the one that leads beyond it is not. `None` where no unknown is free or the
/// reading tells nothing.
fn damped_step(equations: &Equations, at: Unknowns, ends: [(f64, f64); 3], damping: f64) -> Option<Unknowns> {
    let free: [bool; 3] = std::array::from_fn(|k| {
        let ((least, most), right) = (ends[k], equations.right[k]);
        least < most && !(at[k] <= least && right < 0.0 || at[k] >= most && right > 0.0)
    });
    if free == [false; 3] {
        return None;
    }
    let mut matrix = equations.information;
    for (k, row) in matrix.iter_mut().enumerate() {
        row[k] *= 1.0 + damping;
    }
    Some(Ldl::of_free(&matrix, free)?.solve(equations.right))
}
