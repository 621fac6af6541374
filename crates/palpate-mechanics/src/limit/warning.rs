//! Warnings about a limit.

use std::collections::HashMap;
use std::fmt;

use super::responses::key;
use super::twins::{AMBIGUOUS_DISTANCE, Twin, TwinSearch};
use super::zone::{Grid, Zone, zones};
use super::{CramerRaoBound, Force, LimitError, check_force};
use crate::contact::{Contact, Position};
use crate::sensing::SensorKind;
use crate::surface::Surface;
use palpate_numerics::normal_cdf;
use palpate_numerics::watch::{Cancelled, Watch};

/// Threshold of a blind limit, as a share of the length.
const BLIND_SHARE: f64 = 0.1;
/// Threshold of a faint signal, in standard deviations.
const FAINT_SIGNAL: f64 = 5.0;
/// Threshold of equal readings, in standard deviations.
const INDISTINGUISHABLE: f64 = 0.05;
/// Threshold of no signal, in standard deviations.
const NO_SIGNAL: f64 = 1e-6;
const CONSTANT_REACTION: f64 = 1e-6;

/// Warning of contacts that no estimator can locate well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LimitWarning {
    /// A large limit, or none.
    Blind {
        /// Zone.
        zone: Zone,
        /// Knowledge of the force.
        force: Force,
        /// Position with the largest limit.
        at: Position,
        /// Largest limit; `None` if undetermined.
        sd_m: Option<f64>,
        /// Threshold.
        bound_m: f64,
        /// The limit for a known force, if below the threshold.
        known_force_sd_m: Option<f64>,
        /// True when reaction sensors would help.
        reactions_would_help: bool,
    },
    /// Two contacts with nearly equal readings.
    Mirror {
        /// Zone.
        zone: Zone,
        /// Zone of their twins.
        twins: Zone,
        /// Knowledge of the force.
        force: Force,
        /// Contact with the nearest twin.
        at: Position,
        /// The twin.
        twin: Position,
        /// Their distance, in standard deviations.
        distance: f64,
    },
    /// A small signal.
    Faint {
        /// Zone.
        zone: Zone,
        /// Contact with the smallest signal.
        at: Position,
        /// Signal, in standard deviations.
        signal_to_noise: f64,
        /// Contact force.
        force_n: f64,
        /// True when reaction sensors would help.
        reactions_would_help: bool,
    },
}

/// Returns all warnings: blind, mirror, faint, each from left to right.
///
/// # Errors
/// [`LimitError::Force`] and [`LimitError::Cancelled`].
pub fn limit_warnings(
    limit: &CramerRaoBound,
    force_n: f64,
    force: Force,
    watch: Watch,
) -> Result<Vec<LimitWarning>, LimitError> {
    check_force(force_n)?;
    // Supports are added, as the grid could miss the undetermined positions next to them.
    let grid = Grid::over_surface(limit.extent).including(&force_supports(limit));
    let survey = Survey { limit, force_n, force, grid };
    let mut warnings = survey.blind_zones();
    warnings.extend(survey.mirrors(watch)?);
    warnings.extend(survey.weak_zones());
    Ok(warnings)
}

fn force_supports(limit: &CramerRaoBound) -> Vec<Position> {
    limit.model.map_or_else(Vec::new, Surface::force_supports)
}

struct Survey<'a> {
    limit: &'a CramerRaoBound<'a>,
    force_n: f64,
    force: Force,
    grid: Grid,
}

impl Survey<'_> {
    fn sd_m(&self, position: Position, force: Force) -> Option<f64> {
        self.limit
            .bound_at(Contact { position, force_n: self.force_n }, force)
            .map(|bound| bound.sd_position_m)
    }

    fn signal(&self, position: Position) -> f64 {
        self.limit.signal_to_noise(Contact { position, force_n: self.force_n })
    }

    fn blind_from_m(&self) -> f64 {
        BLIND_SHARE * self.limit.extent.length_m()
    }

    fn blind_zones(&self) -> Vec<LimitWarning> {
        let extent = self.limit.extent;
        let bound_m = self.blind_from_m();
        let told = |position: Position| self.sd_m(position, self.force);
        let size = |position: Position| told(position).unwrap_or(f64::INFINITY);
        let found = zones(extent, &self.grid, |position| size(position) > bound_m);
        let warning = |(zone, inside): (Zone, Vec<Position>)| {
            // In a zone with few undetermined positions, as one over a support, the largest finite limit.
            let (told, not): (Vec<_>, Vec<_>) = inside.into_iter().partition(|at| told(*at).is_some());
            let most = if told.len() > not.len() { told } else { not };
            let at = most.into_iter().max_by(|a, b| size(*a).total_cmp(&size(*b)))?;
            let known = (self.force == Force::Unknown).then(|| self.sd_m(at, Force::Known)).flatten();
            Some(LimitWarning::Blind {
                zone,
                force: self.force,
                at,
                sd_m: self.sd_m(at, self.force),
                bound_m,
                known_force_sd_m: known.filter(|sd_m| *sd_m <= bound_m),
                reactions_would_help: self.lacks_reactions() && self.reactions_tell(at),
            })
        };
        found.into_iter().filter_map(warning).collect()
    }

    fn lacks_reactions(&self) -> bool {
        let reacts = |channel: &super::Channel| channel.kind == SensorKind::Reaction;
        let has_reactions = |model: &dyn Surface| model.full_scale(SensorKind::Reaction) > 0.0;
        self.limit.model.is_some_and(has_reactions) && !self.limit.channels.iter().any(reacts)
    }

    /// Reactions help unless they are constant, as that of a single clamp.
    fn reactions_tell(&self, at: Position) -> bool {
        let Some(surface) = self.limit.model else { return false };
        let supports = surface.force_supports();
        let changes = |support: &Position| {
            let [along, across] = surface.influence_function(SensorKind::Reaction, *support).gradient(at);
            along.hypot(across) * surface.length_m() > CONSTANT_REACTION
        };
        self.force == Force::Unknown || supports.is_empty() || supports.iter().any(changes)
    }

    fn mirrors(&self, watch: Watch) -> Result<Vec<LimitWarning>, Cancelled> {
        let search = TwinSearch::new(self.limit, self.force_n, self.force);
        // Around a faint or blind contact all readings are similar.
        let clear = |position: Position| {
            self.signal(position) >= FAINT_SIGNAL
                && self.sd_m(position, self.force).is_some_and(|sd_m| sd_m <= self.blind_from_m())
        };
        let mut found = HashMap::new();
        let count = self.grid.positions.len();
        for (done, &position) in self.grid.positions.iter().enumerate() {
            watch.counted("contacts that read alike", "positions", done, count)?;
            found.insert(key(position), clear(position).then(|| search.twin_of(position)).flatten());
        }
        let twin = |position: Position| match found.get(&key(position)) {
            Some(twin) => *twin,
            None => clear(position).then(|| search.twin_of(position)).flatten(),
        };
        let zones = zones(self.limit.extent, &self.grid, |position| twin(position).is_some());
        let mut warnings: Vec<LimitWarning> = Vec::new();
        for (zone, inside) in zones {
            let pairs: Vec<(Position, Twin)> =
                inside.into_iter().filter_map(|at| Some((at, twin(at)?))).collect();
            let nearest = pairs.iter().min_by(|a, b| a.1.distance.total_cmp(&b.1.distance));
            // On a plane the ends are corners of a rectangle, which need not be in the zone.
            let is_line = zone.from.y_m == 0.0 && zone.to.y_m == 0.0;
            let ends = [zone.from, zone.to].into_iter().filter(|_| is_line).filter_map(twin);
            let twins =
                Zone::bounding(pairs.iter().map(|(_, twin)| *twin).chain(ends).map(|twin| twin.position));
            let (Some(&(at, nearest)), Some(twins)) = (nearest, twins) else { continue };
            let said = |warning: &LimitWarning| match warning {
                LimitWarning::Mirror { zone, twins, .. } => {
                    twins.contains(at) || zone.contains(nearest.position)
                }
                _ => false,
            };
            if !warnings.iter().any(said) {
                let (twin, distance) = (nearest.position, nearest.distance);
                warnings.push(LimitWarning::Mirror { zone, twins, force: self.force, at, twin, distance });
            }
        }
        Ok(warnings)
    }

    fn weak_zones(&self) -> Vec<LimitWarning> {
        let extent = self.limit.extent;
        let found = zones(extent, &self.grid, |position| self.signal(position) < FAINT_SIGNAL);
        let warning = |(zone, inside): (Zone, Vec<Position>)| {
            let at = inside.into_iter().min_by(|a, b| self.signal(*a).total_cmp(&self.signal(*b)))?;
            let signal_to_noise = self.signal(at);
            let reactions_would_help = self.lacks_reactions();
            Some(LimitWarning::Faint {
                zone,
                at,
                signal_to_noise,
                force_n: self.force_n,
                reactions_would_help,
            })
        };
        found.into_iter().filter_map(warning).collect()
    }
}

impl LimitWarning {
    /// "blind", "mirror" or "faint".
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Blind { .. } => "blind",
            Self::Mirror { .. } => "mirror",
            Self::Faint { .. } => "faint",
        }
    }

    /// Zone of the warning.
    pub const fn zone(&self) -> Zone {
        match self {
            Self::Blind { zone, .. } | Self::Mirror { zone, .. } | Self::Faint { zone, .. } => *zone,
        }
    }

    /// Worst value and threshold, in metres if blind, otherwise in standard deviations.
    pub const fn value_and_bound(&self) -> (Option<f64>, f64) {
        match self {
            Self::Blind { sd_m, bound_m, .. } => (*sd_m, *bound_m),
            Self::Mirror { distance, .. } => (Some(*distance), AMBIGUOUS_DISTANCE),
            Self::Faint { signal_to_noise, .. } => (Some(*signal_to_noise), FAINT_SIGNAL),
        }
    }

    /// Suggested remedy.
    pub fn help(&self) -> String {
        let (value, bound) = self.value_and_bound();
        match self {
            Self::Blind { known_force_sd_m, reactions_would_help, .. } => {
                let mut ways = Vec::new();
                if let Some(sd_m) = known_force_sd_m {
                    ways.push(format!("a known force (the limit would be {} mm)", figure(sd_m * 1e3)));
                }
                if *reactions_would_help {
                    ways.push("reaction sensors at the supports".to_owned());
                }
                ways.push(match value {
                    Some(sd_m) => less_noise(sd_m / bound),
                    None => "a sensor that notices a contact there".to_owned(),
                });
                ways.join(", or ")
            }
            // Equal readings stay equal without noise.
            Self::Mirror { distance, .. } if *distance < INDISTINGUISHABLE => {
                "a sensor that breaks the symmetry; less noise does not help".to_owned()
            }
            Self::Mirror { distance, .. } => {
                format!("{}, or a sensor that distinguishes the two", less_noise(bound / distance))
            }
            // Over a rigid support no force deflects the surface.
            Self::Faint { signal_to_noise, reactions_would_help, .. } if *signal_to_noise < NO_SIGNAL => {
                let sensor = if *reactions_would_help {
                    "reaction sensors at the supports"
                } else {
                    "a sensor that notices a contact there"
                };
                format!("{sensor}; less noise or a larger force does not help")
            }
            Self::Faint { signal_to_noise, .. } => {
                let factor = bound / signal_to_noise;
                format!("{}, a larger force, or a nearer sensor", less_noise(factor))
            }
        }
    }
}

fn less_noise(factor: f64) -> String {
    if factor.is_finite() {
        format!("noise {} times smaller", figure(factor))
    } else {
        "sensors that notice a contact there".to_owned()
    }
}

impl fmt::Display for LimitWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Blind { zone, force, at, sd_m: Some(sd_m), bound_m, .. } => write!(
                f,
                "blind at {zone} with {} force: the limit is up to {} mm (at {}), more than {} mm, a tenth of the length",
                force.name(),
                figure(sd_m * 1e3),
                place(*at),
                figure(bound_m * 1e3)
            ),
            Self::Blind { zone, force, sd_m: None, .. } => {
                write!(
                    f,
                    "blind at {zone} with {} force: the readings do not determine the position",
                    force.name()
                )
            }
            Self::Mirror { zone, twins, force, at, twin, distance } => {
                let (at, twin, force) = (place(*at), place(*twin), force.name());
                write!(
                    f,
                    "ambiguous at {zone} with {force} force: contacts there read like contacts at {twins}; "
                )?;
                if *distance < INDISTINGUISHABLE {
                    return write!(f, "{at} and {twin} read the same");
                }
                // A reading is nearer to the other contact's when its noise exceeds half their distance.
                let mistaken = figure(100.0 * normal_cdf(-0.5 * distance));
                let (distance, bound) = (figure(*distance), figure(AMBIGUOUS_DISTANCE));
                write!(
                    f,
                    "{at} and {twin} differ by {distance} standard deviations, fewer than {bound}, and are mistaken for each \
                     other with a probability of up to {mistaken} %"
                )
            }
            Self::Faint { zone, at, signal_to_noise, force_n, .. } => write!(
                f,
                "faint at {zone}: {force_n} N at {} stand out of the noise by {} standard deviations, fewer than \
                 {FAINT_SIGNAL}",
                place(*at),
                figure(*signal_to_noise)
            ),
        }
    }
}

fn place(position: Position) -> String {
    Zone::point(position).to_string()
}

/// Two significant digits: "0.087", "3.3", "8300".
fn figure(value: f64) -> String {
    let digits = 1 - value.abs().max(1e-6).log10().floor() as i32;
    let unit = 10f64.powi(-digits);
    let decimals = digits.max(0) as usize;
    format!("{:.decimals$}", (value / unit).round() * unit)
}
