//! The ways in which layouts come about.

/// How a layout came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Evenly, whatever the constraints: what the others are compared with.
    Even,
    /// As the rig has it.
    #[serde(skip_deserializing)]
    Rig,
    /// Greedy choice, then exchange until nothing improves.
    GreedyExchange,
    /// The best of all layouts.
    #[serde(skip_deserializing)]
    Exhaustive,
    /// A genetic search.
    Genetic,
    /// The best of those before, moved off the candidate sites.
    Refined,
    /// The most information, by greedy choice and exchange.
    DOptimal,
    /// The best reconstruction from principal components, by greedy choice and exchange.
    PrincipalComponents,
    /// QR factorisation with column pivoting on principal components.
    QrPivoting,
}

impl Method {
    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Even => "even",
            Self::Rig => "rig",
            Self::GreedyExchange => "greedy-exchange",
            Self::Exhaustive => "exhaustive",
            Self::Genetic => "genetic",
            Self::Refined => "refined",
            Self::DOptimal => "d-optimal",
            Self::PrincipalComponents => "principal-components",
            Self::QrPivoting => "qr-pivoting",
        }
    }

    /// What can be asked for by name, in the order that messages list them.
    pub const NAMED: [Self; 7] = [
        Self::Even,
        Self::GreedyExchange,
        Self::Genetic,
        Self::Refined,
        Self::DOptimal,
        Self::PrincipalComponents,
        Self::QrPivoting,
    ];

    /// Whether it searches by the design's criterion, so that its best layout is the design.
    pub const fn is_search(self) -> bool {
        matches!(self, Self::GreedyExchange | Self::Exhaustive | Self::Genetic | Self::Refined)
    }
}
