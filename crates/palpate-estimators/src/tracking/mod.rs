//! Moving contacts: a Bayesian filter over position, speed and force, and a smoother over the whole recording.
//!
//! What is hidden is how many contacts touch, where, how fast and how hard each does, and how the surface swings. A belief
//! about it is a few hypotheses, each with a weight: no contact, one or two, which came at some time and have moved since. A
//! hypothesis is a bank of Gaussians in the joint state of surface and contacts, one for each choice of a few motions from
//! steady to brisk, which mix as motions change (interacting multiple models: H. Blom and Y. Bar-Shalom, IEEE Trans. Autom.
//! Control 33, 1988). A reading moves them by its likelihood, expanded about the places that they expect (an iterated
//! extended Kalman filter), and weighs them by how well they explain it. Hypotheses are born where the reading by itself could
//! have come from, so a mirror image or a wide valley is several of them (a Gaussian sum: D. Alspach and H. Sorenson, same
//! Trans. 17, 1972); a second contact is born beside the one that is followed; and each contact of a hypothesis may let go,
//! which makes another hypothesis. Those that readings contradict fade and are dropped.
//!
//! A surface that swings has two numbers of its own in the state, the force of its first mode and how fast that changes:
//! they drive nothing but the readings, are driven by the contacts, and outlast them.
//!
//! A grid of positions and speeds that resolves what a track reaches would have some 10⁵ cells; within a valley of the
//! likelihood a Gaussian says the same to good approximation, as soon as a contact has been seen for some readings.
//!
//! On a plane there is one contact, whose motions along and across are alike and independent, and the surface
//! is taken to be in balance; the rest is the same.
//!
//! The smoother goes back over a hypothesis with what came later, by the recursion of H. Rauch, F. Tung and C. Striebel (AIAA
//! Journal 3, 1965) for each motion.

mod bank;
mod belief;
mod birth;
mod config;
mod gaussian;
mod on_plane;
mod smoother;
mod step;
mod track;
mod tracker;

pub use config::{Swing, TrackerConfig};
pub use smoother::SmoothTracker;
pub use track::{Across, Track, TrackError, Tracked};
pub use tracker::Tracker;

#[cfg(test)]
mod tests;
