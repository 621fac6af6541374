//! How far a design has come.

/// What a design is busy with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// What each candidate tells of each contact.
    Candidates,
    /// Greedy choice and exchange.
    Exchange,
    /// All layouts, one by one.
    Exhaustive,
    /// Generations of layouts.
    Genetic,
    /// Positions between the sites.
    Refinement,
    /// Simulated calibrations.
    Verification,
}

impl Stage {
    /// As people are told of it.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Candidates => "what each site tells",
            Self::Exchange => "exchanging",
            Self::Exhaustive => "all layouts",
            Self::Genetic => "breeding",
            Self::Refinement => "refining",
            Self::Verification => "verifying",
        }
    }
}
