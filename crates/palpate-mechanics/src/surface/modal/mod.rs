//! Loads that move along the simply supported beam, with its inertia and damping: modal superposition.
//!
//! The beam's downward deflection is w(x, t) = Σ_k φ_k(x)·q_k(t) over the modes φ_k(x) = sin(kπx/l), and loads W_j(t) at
//! a_j(t) drive each of them alone (L. Frýba, *Vibration of Solids and Structures under Moving Loads*, 3rd ed. 1999,
//! chapter 1):
//!
//! q̈_k + 2ζω_k·q̇_k + ω_k²·q_k = Σ_j W_j·φ_k(a_j)/m_k, with ω_k = (kπ/l)²·√(E·I/(ρ·A)) and m_k = ρ·A·l/2.
//!
//! What finitely many modes leave out follows the load without delay, so it is added in closed form: a sensor reads its
//! static value, plus its share of each mode's departure from that mode's static value (the mode acceleration method of
//! D. Williams, 1945). A load that creeps is then read as exactly as by [`Beam`](super::Beam) itself.
//!
//! The load has a force and no mass; the weight of the beam itself is tared away.

mod beam;
mod oscillator;
mod response;

pub use beam::{ModalBeam, ModalBeamError};
pub use oscillator::Oscillator;
pub use response::ModalResponse;

#[cfg(test)]
mod tests;
