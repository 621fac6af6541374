//! What a tracker expects of contacts and of the surface.

/// How contacts come, move and go, and how the surface swings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackerConfig {
    /// Motions from steady to brisk: standard deviation of the acceleration, in m/s².
    pub accelerations_m_per_s2: [f64; 3],
    /// How long an acceleration lasts, in seconds: its correlation falls by e in that time.
    pub acceleration_s: f64,
    /// How long a contact keeps to one of the motions on average, in seconds.
    pub motion_s: f64,
    /// Standard deviation of the speed of a contact that has just come, in m/s.
    pub speed_sd_m_per_s: f64,
    /// How far an unknown force drifts in a second, as a share of it.
    pub force_drift: f64,
    /// How often a second a contact comes while nothing touches, and goes while something does.
    pub changes_per_s: f64,
    /// How often a second a contact goes and is at once somewhere else.
    pub jumps_per_s: f64,
    /// How the surface swings, where that is known; else it is taken to be in balance.
    pub swing: Option<Swing>,
}

/// The first mode of a surface that swings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// Its natural frequency, in hertz; greater than 0.
    pub frequency_hz: f64,
    /// The share of its critical damping, at least 0 and below 1.
    pub damping_ratio: f64,
}

impl Default for TrackerConfig {
    /// For hands, robots and wheels up to some metres a second.
    fn default() -> Self {
        Self {
            accelerations_m_per_s2: [0.03, 0.6, 6.0],
            acceleration_s: 0.3,
            motion_s: 1.0,
            speed_sd_m_per_s: 0.5,
            force_drift: 0.1,
            changes_per_s: 1.0,
            jumps_per_s: 1e-3,
            swing: None,
        }
    }
}
