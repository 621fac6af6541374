//! Disabling of a channel of a force-linear surface.

use super::locator::{ForceLinearContents, ForceLinearLocator};
use crate::influence::missing_channel::residual_limit_after;

impl ForceLinearLocator {
    /// Disables channel `channel` (from 0); returns false, without a change, when no channel would remain.
    ///
    /// Channels are independent but for common-mode errors, so that the others keep their functions.
    pub fn leave_out(&mut self, channel: usize) -> bool {
        let live = &self.stored.live;
        let Some(removed) = live.iter().position(|other| *other == channel) else { return !live.is_empty() };
        if live.len() == 1 {
            return false;
        }
        let freedom = live.len().saturating_sub(self.unknowns());
        *self = self.stored.clone().without_channel(removed, freedom).into_locator();
        true
    }
}

impl ForceLinearContents {
    /// Removes a channel, counted from 0 among those in use; `freedom` is that of the residual before.
    fn without_channel(mut self, removed: usize, freedom: usize) -> Self {
        self.live.remove(removed);
        let ranges = self.saturation.as_mut().map(|saturation| &mut saturation.ranges);
        for list in [Some(&mut self.shared_errors), Some(&mut self.drifts), ranges].into_iter().flatten() {
            if removed < list.len() {
                list.remove(removed);
            }
        }
        self.functions = self.functions.without_channel(removed);
        self.residual_limit = residual_limit_after(self.residual_limit, freedom, freedom.saturating_sub(1));
        self
    }
}
