//! Memory for locating a reading.

use super::coarse::Profile;

/// Memory for locating readings, to be used again; up to sixteen channels it lies in place, without allocation.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) whitened: Whitened,
    pub(super) profile: Profile,
    pub(super) eight: ForEight,
}

/// The same for eight readings, one after the other; empty until there is a batch.
#[derive(Clone, Debug, Default)]
pub(super) struct ForEight {
    pub whitened: Vec<[f64; 8]>,
    pub profiles: Vec<Profile>,
}

impl ForEight {
    /// Room for so many groups of channels in each reading.
    #[inline(always)]
    pub fn resize(&mut self, groups: usize) {
        self.whitened.resize(8 * groups, [0.0; 8]);
        self.profiles.resize_with(8, Profile::default);
    }
}

/// d, in groups of eight channels, padded with zeros.
#[derive(Clone, Debug, Default)]
pub(super) struct Whitened {
    near: [[f64; 8]; 2],
    far: Vec<[f64; 8]>,
}

impl Whitened {
    /// Room for so many groups.
    #[inline(always)]
    pub fn room(&mut self, groups: usize) -> &mut [[f64; 8]] {
        if groups <= 2 {
            return &mut self.near[..groups];
        }
        self.far.resize(groups, [0.0; 8]);
        &mut self.far
    }

    /// So many groups.
    #[inline(always)]
    pub fn groups(&self, groups: usize) -> &[[f64; 8]] {
        if groups <= 2 { &self.near[..groups] } else { &self.far[..groups] }
    }

    /// d of so many channels.
    pub fn channels(&self, channels: usize) -> &[f64] {
        &self.groups(channels.div_ceil(8)).as_flattened()[..channels]
    }
}
