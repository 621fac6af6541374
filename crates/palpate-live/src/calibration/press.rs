use palpate_mechanics::contact::Position;

/// Planned press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// Position.
    pub position: Position,
    /// Force in newtons, if known.
    pub force_n: Option<f64>,
    /// Depth in metres, for a machine.
    pub depth_m: Option<f64>,
}
