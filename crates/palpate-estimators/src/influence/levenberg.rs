//! Levenberg–Marquardt steps for a contact (K. Levenberg, Quart. Appl. Math. 2, 1944, with Marquardt's
//! scaling by the diagonal).

use super::lanes::{LANES, Lanes, sum_of};
use crate::force_prior::PriorTerms;
use palpate_numerics::simd::{EightLanes, InstructionSet, Kernel, Simd, Vector};
use palpate_numerics::small::{Ldl, Matrix};
use palpate_numerics::with_shared_error;

pub(super) type Unknowns = [f64; 3];

/// Normal equations JᵀV⁻¹J and JᵀV⁻¹e: variances V, residual e, derivatives J of the reading.
#[derive(Clone, Copy, Debug)]
pub(super) struct Equations {
    /// eᵀV⁻¹e.
    pub misfit: f64,
    pub right: [f64; 3],
    pub information: Matrix<3>,
}

impl Equations {
    pub fn new(channels: impl Iterator<Item = (Lanes, Lanes, [Lanes; 3])>) -> Self {
        InstructionSet::best().run(SumGroups { channels })
    }

    /// Replaces V by V + g·gᵀ for common-mode errors g.
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

pub(super) struct EquationSums<V>([V; 10]);

impl<V: EightLanes<Real = f64>> EquationSums<V> {
    #[inline(always)] // Compiled for the instructions of its caller.
    pub fn new() -> Self {
        Self([V::splat(0.0); 10])
    }

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

const MOST_STEPS: usize = 40;

/// Returns the local minimum near `start` within `ends`, and its normal equations.
///
/// Equal ends fix an unknown. The iteration stops when the predicted decrease is at most `small`.
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

/// Damped step; an unknown at an end with an outward step is fixed. `None` where the information is singular.
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
