//! Task of a sensor design, and its constraints.

use palpate_estimators::setup::Setup;
use palpate_mechanics::contact::Position;
use palpate_mechanics::limit::{Force, LimitError};
use palpate_mechanics::sensing::{ChannelModel, Layout, LayoutError, Sensor, SensorKind};
use palpate_mechanics::surface::Extent;
use palpate_mechanics::units::format_length_mm;

use crate::contacts::{ContactPrior, check_count, check_positions, spacing};
use palpate_numerics::OutOfRange;
use palpate_numerics::watch::Cancelled;

/// Default number of sites along a line: every millimetre of the paper's beam.
const SITES_ALONG_A_LINE: f64 = 400.0;
/// Default number of sites along a plane's longer side; each needs a solution.
const SITES_ALONG_A_PLANE: f64 = 30.0;
/// Default tolerance of the location error, as for the effective length.
pub(crate) const TOLERANCE_M: f64 = 2e-3;

/// Task of placing sensors. [`SensorProblem::new`](super::SensorProblem::new) checks it.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorDesign {
    /// Number of sensors, including `must_have`; at least 1.
    pub count: usize,
    /// Available kinds; at least one.
    pub offers: Vec<SensorOffer>,
    /// Candidate sites.
    pub sites: Sites,
    /// Prior of the contacts.
    pub contacts: ContactPrior,
    /// Known if the locator is given the force.
    pub force: Force,
    /// Criterion of the score.
    pub criterion: DesignCriterion,
    /// Tolerance of the limit, m; greater than 0.
    pub tolerance_m: f64,
    /// Least distance of sensors, m; at least 0. Reaction sensors are exempt.
    pub spacing_m: f64,
    /// Zones without sensors. Reaction sensors are exempt.
    pub keep_out: Vec<KeepOut>,
    /// Sensors that every layout has.
    pub must_have: Vec<RequiredSensor>,
    /// Existing sensors that stay; the first of `must_have`.
    pub fixed: Vec<Sensor>,
    /// Largest total cost; unlimited if `None`.
    pub budget: Option<f64>,
    /// Symmetry of the layouts.
    pub symmetry: Symmetry,
}

/// Available kind of sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorOffer {
    /// Measured quantity; not raw.
    pub kind: SensorKind,
    /// Noise and faults.
    pub channel: ChannelModel,
    /// Cost of one sensor, in any unit; at least 0.
    pub cost: f64,
    /// Supply of this kind.
    pub supply: Supply,
}

/// Supply of an offered kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Supply {
    /// Unlimited.
    #[default]
    Any,
    /// Only the existing sensors.
    Kept,
}

/// Candidate sites.
#[derive(Clone, Debug, PartialEq)]
pub enum Sites {
    /// Sites at multiples of this distance, m, along each side; greater than 0.
    Every(f64),
    /// Number of even sites between the ends of a line.
    Count(usize),
    /// Listed sites, on the surface.
    At(Vec<Position>),
}

impl Sites {
    /// Spacing along this length, m; `None` for listed sites.
    pub(super) fn distance_m(&self, length_m: f64) -> Option<f64> {
        match self {
            Self::Every(every_m) => Some(*every_m),
            Self::Count(count) => Some(length_m / (*count + 1) as f64),
            Self::At(_) => None,
        }
    }
}

/// Zone without sensors; its boundary is excluded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeepOut {
    /// The left end, or lower left corner.
    pub from: Position,
    /// The right end, or upper right corner.
    pub to: Position,
}

impl KeepOut {
    /// Returns true inside the zone, with a margin for rounding.
    pub fn contains(&self, position: Position, extent: Extent) -> bool {
        let slack_m = 1e-9 * extent.length_m();
        let inside = |at_m: f64, low_m: f64, high_m: f64| low_m + slack_m < at_m && at_m < high_m - slack_m;
        let across = extent.width_m().is_none_or(|_| inside(position.y_m, self.from.y_m, self.to.y_m));
        inside(position.x_m, self.from.x_m, self.to.x_m) && across
    }
}

/// A sensor that every layout has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequiredSensor {
    /// Index of the offer.
    pub offer: usize,
    /// Position.
    pub position: Position,
}

/// Criterion by which layouts are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DesignCriterion {
    /// Minimizes the mean limit.
    MeanLimit,
    /// Minimizes the largest limit.
    WorstLimit,
    /// Minimizes the share of contacts with a limit above the tolerance.
    WithinTolerance,
    /// Maximizes the information on all unknowns of a contact: the mean of ½·ln det of the bound of their covariance is minimized.
    DOptimality,
}

impl DesignCriterion {
    /// Name in files and tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::MeanLimit => "mean-limit",
            Self::WorstLimit => "worst-limit",
            Self::WithinTolerance => "within-tolerance",
            Self::DOptimality => "d-optimality",
        }
    }

    /// Factor from a score to its displayed unit: mm or %.
    pub const fn score_scale(self) -> f64 {
        match self {
            Self::MeanLimit | Self::WorstLimit => 1e3,
            Self::WithinTolerance => 100.0,
            Self::DOptimality => 1.0,
        }
    }
}

/// Symmetry of a layout across the middle of the length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Symmetry {
    /// No condition.
    Any,
    /// Every sensor has a mirror image of its kind, or lies in the middle.
    Wanted,
    /// The mirror image of a sensor keeps the least distance of two sensors from every other sensor of its kind.
    Forbidden,
}

impl SensorDesign {
    /// Creates a design with the sensors of a setup and contacts on its whole surface.
    ///
    /// # Errors
    /// [`LimitError::NoModel`] without a model.
    pub fn for_setup(setup: &Setup) -> Result<Self, DesignError> {
        let mut offers: Vec<SensorOffer> = Vec::new();
        for sensor in setup.layout().sensors() {
            if sensor.kind != SensorKind::Raw && offers.iter().all(|offer| offer.kind != sensor.kind) {
                let channel = ChannelModel { disabled: false, ..sensor.channel };
                offers.push(SensorOffer { kind: sensor.kind, channel, cost: 1.0, supply: Supply::Any });
            }
        }
        if offers.is_empty() {
            return Err(LimitError::NoModel.into());
        }
        let extent = setup.surface().extent();
        Ok(Self {
            count: setup.layout().len(),
            offers,
            sites: Sites::Every(spacing(extent, SITES_ALONG_A_LINE, SITES_ALONG_A_PLANE)),
            contacts: ContactPrior::over_surface(extent),
            force: setup.force(),
            criterion: DesignCriterion::MeanLimit,
            tolerance_m: TOLERANCE_M,
            spacing_m: 0.0,
            keep_out: Vec::new(),
            must_have: Vec::new(),
            fixed: Vec::new(),
            budget: None,
            symmetry: Symmetry::Any,
        })
    }

    /// Sets the number of sensors.
    #[must_use]
    pub fn count(self, count: usize) -> Self {
        Self { count, ..self }
    }

    /// Keeps the enabled sensors of `today` and adds `count`.
    ///
    /// # Errors
    /// [`DesignError::KeptDiffers`] for a sensor with other noise than its offer; [`LimitError::NoModel`] for
    /// a raw channel.
    pub fn adding(mut self, count: usize, today: &Layout) -> Result<Self, DesignError> {
        let living = |sensor: &&Sensor| !sensor.channel.disabled;
        let mut kept = Vec::new();
        for (sensor, number) in today.sensors().iter().zip(1..).filter(|(sensor, _)| living(sensor)) {
            let Sensor { kind, position, channel, .. } = *sensor;
            if kind == SensorKind::Raw {
                return Err(LimitError::NoModel.into());
            }
            let offered = self.offers.iter().position(|offer| offer.kind == kind);
            let offer = offered.unwrap_or_else(|| {
                // An existing sensor costs 0 if the design does not offer its kind.
                self.offers.push(SensorOffer { kind, channel, cost: 0.0, supply: Supply::Kept });
                self.offers.len() - 1
            });
            if self.offers[offer].channel != channel {
                return Err(DesignError::KeptDiffers { number, kind });
            }
            kept.push(RequiredSensor { offer, position });
        }
        let others = std::mem::take(&mut self.must_have);
        self.fixed = today.sensors().iter().filter(living).cloned().collect();
        self.count = kept.len() + count;
        self.must_have = kept;
        for wanted in others {
            if !self.must_have.contains(&wanted) {
                self.must_have.push(wanted);
            }
        }
        Ok(self)
    }

    pub(super) fn list_of(&self, index: usize) -> FixedList {
        if index < self.fixed.len() { FixedList::Kept } else { FixedList::MustHave }
    }

    /// Sets the candidate sites.
    #[must_use]
    pub fn sites(self, sites: Sites) -> Self {
        Self { sites, ..self }
    }

    /// Sets the contacts.
    #[must_use]
    pub fn contacts(self, contacts: ContactPrior) -> Self {
        Self { contacts, ..self }
    }

    /// Hides the force from the locator.
    #[must_use]
    pub fn unknown_force(self) -> Self {
        Self { force: Force::Unknown, ..self }
    }

    /// Returns true if costs distinguish layouts.
    pub fn has_costs(&self) -> bool {
        self.budget.is_some() || self.offers.windows(2).any(|pair| pair[0].cost != pair[1].cost)
    }

    pub(super) fn keeps_out(&self, position: Position, extent: Extent) -> bool {
        self.keep_out.iter().any(|zone| zone.contains(position, extent))
    }

    pub(super) fn affords(&self, cost: f64) -> bool {
        self.budget.is_none_or(|budget| cost <= budget * (1.0 + 1e-12))
    }

    pub(super) fn check(&self, extent: Extent) -> Result<(), OutOfRange> {
        OutOfRange::check_positive([
            ("the number of sensors", self.count as f64),
            ("the number of kinds to choose from", self.offers.len() as f64),
            ("the tolerance in m", self.tolerance_m),
        ])?;
        let costs = self.offers.iter().map(|offer| ("the cost of a sensor", offer.cost));
        let budget = self.budget.map(|budget| ("the budget", budget));
        let spacing = [("the spacing in m", self.spacing_m)];
        let numbers = costs.chain(budget).chain(spacing);
        OutOfRange::check("at least 0", numbers, |value| value.is_finite() && value >= 0.0)?;
        let offers =
            self.must_have.iter().map(|wanted| ("the offer of a `must_have` sensor", wanted.offer as f64));
        OutOfRange::check("less than the number of offers", offers, |offer| {
            offer < self.offers.len() as f64
        })?;
        let must_have = self.must_have.iter().map(|wanted| wanted.position);
        check_positions("the position of a `must_have` sensor, in m,", must_have, extent)?;
        match &self.sites {
            Sites::Every(every_m) => {
                OutOfRange::check_positive([("the distance of sites in m", *every_m)])?;
                let count = extent.sides_m().map(|size_m| size_m / every_m + 1.0).product();
                check_count("the number of sites", count)
            }
            Sites::At(sites) => check_positions("a site, in m,", sites.iter().copied(), extent),
            Sites::Count(count) => check_count("the number of sites", *count as f64),
        }
    }
}

/// Reason why no sensors can be placed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// The limit does not exist.
    #[error(transparent)]
    Limit(#[from] LimitError),
    /// Cancelled.
    #[error("{0}")]
    Cancelled(#[from] Cancelled),
    /// Value out of range.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// Invalid sensor of an offer.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// A kind without noise.
    #[error(
        "{kind} sensors have no noise and no resolution; one of them must be greater than 0, otherwise the limit is 0 for every layout"
    )]
    SingularNoise {
        /// Measured quantity.
        kind: SensorKind,
    },
    /// All contacts are over supports.
    #[error("all {contacts} contacts are over supports, where an unknown force is unidentifiable")]
    OverSupports {
        /// Number of contacts.
        contacts: usize,
    },
    /// Fewer sites than sensors.
    #[error("{count} sensors are requested, but only {sites} sites are available")]
    TooFewSites {
        /// Requested number.
        count: usize,
        /// Available sites.
        sites: usize,
    },
    /// The spacing leaves too little room.
    #[error(
        "{count} sensors at least {} apart do not fit: {} found place",
        format_length_mm(*spacing_m),
        if *most == 0 { "none".to_owned() } else { format!("at most {most}") }
    )]
    Spacing {
        /// Requested number.
        count: usize,
        /// Least distance, m.
        spacing_m: f64,
        /// Largest possible number.
        most: usize,
    },
    /// Too few sites without mirror images.
    #[error("{count} sensors do not fit when none may mirror another: at most {most} found place")]
    NoMirror {
        /// Requested number.
        count: usize,
        /// Largest possible number.
        most: usize,
    },
    /// Insufficient budget.
    #[error("the budget is {budget}; the cheapest {count} sensors cost {least}")]
    Budget {
        /// Budget.
        budget: f64,
        /// Requested number.
        count: usize,
        /// Least cost.
        least: f64,
    },
    /// More fixed sensors than requested.
    #[error("`must_have` lists {listed} sensors{}, but only {count} are requested", if *mirrored { " with their mirror images" } else { "" })]
    TooManyMustHaves {
        /// Listed number.
        listed: usize,
        /// Requested number.
        count: usize,
        /// True if mirror images are included.
        mirrored: bool,
    },
    /// An insensitive fixed sensor.
    #[error("the {kind} sensor of {list} at {} would always read 0 there", extent.place_in_words(*position))]
    MustHaveReadsNothing {
        /// List of the sensor.
        list: FixedList,
        /// Measured quantity.
        kind: SensorKind,
        /// Position.
        position: Position,
        /// The surface.
        extent: Extent,
    },
    /// A fixed sensor in a `keep_out` zone.
    #[error("the {kind} sensor of {list} at {} lies in a `keep_out` zone", extent.place_in_words(*position))]
    MustHaveKeptOut {
        /// List of the sensor.
        list: FixedList,
        /// Measured quantity.
        kind: SensorKind,
        /// Position.
        position: Position,
        /// The surface.
        extent: Extent,
    },
    /// Two fixed sensors that exclude each other.
    #[error("the sensors of {list} at {} and {} exclude each other: {}", extent.place_in_words(*first), extent.place_in_words(*second), reason)]
    MustHavesExclude {
        /// List of the sensors.
        list: FixedList,
        /// First position.
        first: Position,
        /// Second position.
        second: Position,
        /// Reason.
        reason: Exclusion,
        /// The surface.
        extent: Extent,
    },
    /// A fixed sensor without a possible mirror image.
    #[error("symmetry is requested, but the mirror image of the {kind} sensor of {list} at {} is not a possible position", extent.place_in_words(*position))]
    MustHaveWithoutTwin {
        /// List of the sensor.
        list: FixedList,
        /// Measured quantity.
        kind: SensorKind,
        /// Position.
        position: Position,
        /// The surface.
        extent: Extent,
    },
    /// An existing sensor with other noise than the offer.
    #[error(
        "sensor {number} of today's layout is a {kind} sensor of another noise, resolution or fault than the {kind} sensors that are offered"
    )]
    KeptDiffers {
        /// Sensor number, from 1.
        number: usize,
        /// Measured quantity.
        kind: SensorKind,
    },
    /// Too few pairs of mirrored sites.
    #[error(
        "symmetry is requested, but {count} sensors cannot be placed symmetrically: {pairs} pairs of sites mirror each other, {middle} sites lie in the middle"
    )]
    Symmetry {
        /// Requested number.
        count: usize,
        /// Pairs of sites.
        pairs: usize,
        /// Sites in the middle.
        middle: usize,
    },
    /// A method without a layout.
    #[error("the method `{method}` has no layout for these sensors and constraints")]
    NoLayout {
        /// Name of the method.
        method: &'static str,
    },
    /// Insufficient memory.
    #[error("{sites} candidate sites and {contacts} contacts need {:.1} GB; at most {:.1} GB can be used", bytes / 1e9, most / 1e9)]
    TooLarge {
        /// Number of candidates.
        sites: usize,
        /// Number of contacts.
        contacts: usize,
        /// Required bytes.
        bytes: f64,
        /// Available bytes.
        most: f64,
    },
}

/// List of fixed sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FixedList {
    /// Requested sensors.
    MustHave,
    /// Existing sensors.
    Kept,
}

impl std::fmt::Display for FixedList {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::MustHave => "`must_have`",
            Self::Kept => "today's layout",
        })
    }
}

/// Reason why two sensors exclude each other.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Exclusion {
    /// Equal sensors.
    #[error("they are the same sensor")]
    Same,
    /// Closer than the spacing.
    #[error("they are {} apart, and `spacing` is {}", format_length_mm(*distance_m), format_length_mm(*spacing_m))]
    Spacing {
        /// Distance, m.
        distance_m: f64,
        /// Least distance, m.
        spacing_m: f64,
    },
    /// Forbidden mirror images.
    #[error("they mirror each other, and `symmetry` is forbidden")]
    Mirror,
}
