//! What a sensor design may choose from, and what it must keep to.

use palpate_mechanics::contact::Position;
use palpate_mechanics::sensing::{ChannelModel, Layout, SensorKind};
use palpate_mechanics::surface::Extent;

/// Candidate sites a line has unless the rig says otherwise: every millimetre of the paper's beam.
const SITES_ALONG: f64 = 400.0;
/// The same along the longer side of a plane, where each site is a solution of the plate.
const SITES_ALONG_A_PLANE: f64 = 30.0;
/// Contact positions along a line, and along the longer side of a plane, unless the rig says otherwise.
const CONTACTS_ALONG: f64 = 400.0;
const CONTACTS_ALONG_A_PLANE: f64 = 30.0;
/// An error up to this is good enough, as for the effective length.
const TOLERANCE_M: f64 = 2e-3;

/// `[design]`: where sensors may sit, which and how many, for which contacts.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorDesign {
    /// Sensors to place, those that the layout must have included; at least 1.
    pub count: usize,
    /// The kinds to choose from; at least one.
    pub offers: Vec<SensorOffer>,
    /// Where sensors may sit.
    pub sites: Sites,
    /// Where the surface will be touched.
    pub contacts: ContactPrior,
    /// Whether the contact's force will be known; `None` for what `[contact]` says.
    pub force_is_known: Option<bool>,
    /// What makes a layout good.
    pub criterion: DesignCriterion,
    /// A limit up to this is good enough, in metres; greater than 0.
    pub tolerance_m: f64,
    /// Least distance of two sensors, in metres; at least 0. A reaction sensor is part of its support and takes no room.
    pub spacing_m: f64,
    /// Where nothing may sit. A reaction sensor is asked for by its kind, and may.
    pub keep_out: Vec<KeepOut>,
    /// Sensors that every layout has.
    pub must_have: Vec<MustHave>,
    /// What all sensors together may cost, in the unit of their costs.
    pub budget: Option<f64>,
    /// Whether layouts are to be their own mirror image.
    pub symmetry: Symmetry,
}

/// A kind of sensor that can be had.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorOffer {
    /// What it measures; never raw.
    pub kind: SensorKind,
    /// Its noise and faults.
    pub channel: ChannelModel,
    /// What one costs; at least 0, in any unit.
    pub cost: f64,
}

/// Candidate sites.
#[derive(Clone, Debug, PartialEq)]
pub enum Sites {
    /// At 0 and every so many metres from there, along each side of the surface; greater than 0.
    Every(f64),
    /// As many, evenly between the ends of a line and not on them.
    Count(usize),
    /// These, each on the surface.
    At(Vec<Position>),
}

/// Where the surface will be touched: every so far from one place to the other, both included.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactPrior {
    /// The left end, or lower left corner.
    pub from: Position,
    /// The right end, or upper right corner.
    pub to: Position,
    /// The distance of neighbours, in metres; greater than 0.
    pub every_m: f64,
    /// How often contacts fall into equal stretches along the length, from left to right; empty where they do so evenly.
    pub weights: Vec<f64>,
}

/// Part of the surface where no sensor may sit, its boundary excluded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KeepOut {
    /// The left end, or lower left corner.
    pub from: Position,
    /// The right end, or upper right corner.
    pub to: Position,
}

impl KeepOut {
    /// Whether a position lies inside it; rounding errors are forgiven.
    pub fn holds(&self, position: Position, extent: Extent) -> bool {
        let slack_m = 1e-9 * extent.length_m;
        let inside = |at_m: f64, low_m: f64, high_m: f64| low_m + slack_m < at_m && at_m < high_m - slack_m;
        let across = extent.width_m.is_none() || inside(position.y_m, self.from.y_m, self.to.y_m);
        inside(position.x_m, self.from.x_m, self.to.x_m) && across
    }
}

/// A sensor that every layout has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MustHave {
    /// Which of the offers.
    pub offer: usize,
    /// Where it sits.
    pub position: Position,
}

/// What makes a layout good.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DesignCriterion {
    /// A small mean limit.
    MeanLimit,
    /// A small largest limit.
    WorstLimit,
    /// BoundedList contacts whose limit is above the tolerance.
    WithinTolerance,
    /// Much information on all that is unknown of a contact: a small mean of ½·ln det of its least covariance.
    DOptimality,
}

impl DesignCriterion {
    /// Every criterion, in the order that messages list them.
    pub const ALL: [Self; 4] = [Self::MeanLimit, Self::WorstLimit, Self::WithinTolerance, Self::DOptimality];

    /// Its name in a rig.
    pub const fn name(self) -> &'static str {
        match self {
            Self::MeanLimit => "mean-limit",
            Self::WorstLimit => "worst-limit",
            Self::WithinTolerance => "within-tolerance",
            Self::DOptimality => "d-optimality",
        }
    }

    /// What a score is multiplied by for people: limits in millimetres, shares in %.
    pub const fn score_scale(self) -> f64 {
        match self {
            Self::MeanLimit | Self::WorstLimit => 1e3,
            Self::WithinTolerance => 100.0,
            Self::DOptimality => 1.0,
        }
    }
}

/// Whether a layout is its own image in the mirror across the middle of the length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Symmetry {
    /// It may be, or not.
    Any,
    /// It is: every sensor has a twin of its kind, or sits in the middle.
    Wanted,
    /// No sensor comes as close to the mirror image of another of its kind as sensors may come to each other.
    Forbidden,
}

impl SensorDesign {
    /// Whether costs tell layouts apart: sensors differ in theirs, or a budget limits them.
    pub fn has_costs(&self) -> bool {
        self.budget.is_some() || self.offers.windows(2).any(|pair| pair[0].cost != pair[1].cost)
    }

    /// What is designed when a rig does not say: as many sensors of the kinds of `layout`, for contacts all over the surface.
    /// `None` where no model explains the sensors.
    pub fn of(layout: &Layout, extent: Extent) -> Option<Self> {
        let mut offers: Vec<SensorOffer> = Vec::new();
        for sensor in &layout.sensors {
            if sensor.kind != SensorKind::Raw && offers.iter().all(|offer| offer.kind != sensor.kind) {
                let channel = ChannelModel { dead: false, ..sensor.channel };
                offers.push(SensorOffer { kind: sensor.kind, channel, cost: 1.0 });
            }
        }
        let design = Self {
            count: layout.len(),
            offers,
            sites: Sites::Every(pitch(extent, SITES_ALONG, SITES_ALONG_A_PLANE)),
            contacts: ContactPrior::all_over(extent),
            force_is_known: None,
            criterion: DesignCriterion::MeanLimit,
            tolerance_m: TOLERANCE_M,
            spacing_m: 0.0,
            keep_out: Vec::new(),
            must_have: Vec::new(),
            budget: None,
            symmetry: Symmetry::Any,
        };
        (!design.offers.is_empty()).then_some(design)
    }
}

impl ContactPrior {
    /// Contacts all over a surface, but not on its edge: on a line 1/400 of its length apart.
    pub fn all_over(extent: Extent) -> Self {
        let every_m = pitch(extent, CONTACTS_ALONG, CONTACTS_ALONG_A_PLANE);
        let last = |size_m: f64| (size_m - every_m).max(0.5 * size_m);
        let first = |size_m: f64| every_m.min(0.5 * size_m);
        Self {
            from: Position { x_m: first(extent.length_m), y_m: extent.width_m.map_or(0.0, first) },
            to: Position { x_m: last(extent.length_m), y_m: extent.width_m.map_or(0.0, last) },
            every_m,
            weights: Vec::new(),
        }
    }
}

fn pitch(extent: Extent, along: f64, along_a_plane: f64) -> f64 {
    match extent.width_m {
        None => extent.length_m / along,
        Some(width_m) => extent.length_m.max(width_m) / along_a_plane,
    }
}
