//! One mode: a damped oscillator, exactly integrated while its force changes evenly.

/// A damped oscillator q̈ + 2ζω·q̇ + ω²·q = p over steps of one length.
///
/// While p is linear in time, q_p = A + B·t with B = ṗ/ω² and A = p₀/ω² − 2ζṗ/ω³ solves the equation, and what is left of
/// place and velocity swings freely; both are known in closed form, so a step is exact however long it is (N. C. Nigam
/// and P. C. Jennings, Bull. Seismol. Soc. Am. 59, 1969).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oscillator {
    /// ω, in rad/s.
    omega: f64,
    /// ζ, below 1.
    zeta: f64,
    step_s: f64,
    /// What free swinging makes of (q, q̇) in one step, by rows.
    free: [[f64; 2]; 2],
}

/// Where an oscillator is and how fast it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct State {
    /// q.
    pub place: f64,
    /// q̇.
    pub speed: f64,
}

impl Oscillator {
    /// An oscillator with angular frequency ω = `omega`, in rad/s, and damping ratio ζ = `zeta`, at least 0 and below 1, in
    /// steps of `step_s` seconds.
    pub fn new(omega: f64, zeta: f64, step_s: f64) -> Self {
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let decay = (-zeta * omega * step_s).exp();
        let (sin, cos) = (damped * step_s).sin_cos();
        let lag = zeta * omega / damped;
        let free = [
            [decay * (cos + lag * sin), decay * sin / damped],
            [-decay * omega * omega / damped * sin, decay * (cos - lag * sin)],
        ];
        Self { omega, zeta, step_s, free }
    }

    /// What free swinging makes of (q, q̇) in one step, by rows.
    pub fn free(&self) -> [[f64; 2]; 2] {
        self.free
    }

    /// One step, over which p goes evenly from `from` to `to`.
    pub(super) fn step(&self, state: State, from: f64, to: f64) -> State {
        let square = self.omega * self.omega;
        let slope = (to - from) / self.step_s;
        let b = slope / square;
        let a = from / square - 2.0 * self.zeta * b / self.omega;
        let (place, speed) = (state.place - a, state.speed - b);
        let [[pp, ps], [sp, ss]] = self.free;
        State { place: a + b * self.step_s + pp * place + ps * speed, speed: b + sp * place + ss * speed }
    }
}
