//! A moving contact: a Bayesian filter over position, speed and force, and a smoother over the whole recording.
//!
//! What is hidden is whether anything touches, and if so where, how fast and how hard. A belief about it is a weight for
//! "nothing touches" and a few hypotheses, each with a weight: a contact that came at some time and has moved since. A
//! hypothesis is a bank of Gaussians in (x, v, W), one for each of a few motions from steady to brisk, which mix as
//! motions change (interacting multiple models: H. Blom and Y. Bar-Shalom, IEEE Trans. Autom. Control 33, 1988). A reading
//! moves them by its likelihood, expanded about the place that they expect (an iterated extended Kalman filter), and
//! weighs them by how well they explain it. Hypotheses are born where the reading by itself could have come from, so a
//! mirror image or a wide valley is several of them (a Gaussian sum: D. Alspach and H. Sorenson, same Trans. 17, 1972);
//! those that readings contradict fade and are dropped.
//!
//! A grid of positions and speeds that resolves what a track reaches would have some 10⁵ cells; within a valley of the
//! likelihood a Gaussian says the same to good approximation, as soon as a contact has been seen for some readings.
//!
//! The smoother goes back over a hypothesis with what came later, by the recursion of H. Rauch, F. Tung and C. Striebel (AIAA
//! Journal 3, 1965) on the bank as one Gaussian.

mod bank;
mod config;
mod gaussian;
mod hypothesis;
mod smoother;
mod tracker;

pub use config::TrackerConfig;
pub use smoother::SmoothTracker;
pub use tracker::{Track, TrackError, Tracked, Tracker};

#[cfg(test)]
mod tests;
