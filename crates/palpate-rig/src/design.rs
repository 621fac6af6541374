//! `[design]`

use serde::Deserialize;

use palpate_design::sensors::{
    ContactPrior, DesignCriterion, KeepOut, RequiredSensor, SensorDesign, SensorOffer, Sites, Supply,
    Symmetry,
};
use palpate_estimators::setup::Setup;
use palpate_mechanics::limit::Force;
use palpate_mechanics::sensing::{ChannelModel, SensorKind};
use palpate_mechanics::surface::Extent;

use crate::document::{At, place};
use crate::error::RigError;
use crate::sensors::kind_on;
use crate::values::{
    AtLeastZero, Count, Length, NotNegative, Number, Point, Positive, RawQuantity, check_order,
};

/// Limit for a reasonable search time.
const MOST_SITES: i64 = 1_000_000;
const MOST_CONTACTS: f64 = 10_000.0;

/// Candidates of a sensor design, and its constraints.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DesignKeys {
    /// Sensors to place; as many as the rig has by default.
    pub count: Option<Count<1, 1000>>,
    /// Sites for sensors.
    pub sites: Option<At<SitesKeys>>,
    /// The kinds to choose from; those of the rig by default.
    pub kinds: Option<At<Vec<At<OfferKeys>>>>,
    /// Positions at which the surface will be touched; everywhere by default.
    pub contacts: Option<At<ContactsKeys>>,
    /// Whether the contact's force will be known; as in `[contact]` by default.
    pub force: Option<Force>,
    /// Criterion that scores a layout; `mean-limit` by default.
    pub criterion: Option<DesignCriterion>,
    /// Largest acceptable limit; 2 mm by default.
    pub tolerance: Option<Positive<Length>>,
    /// Least distance of two sensors; 0 by default.
    pub spacing: Option<NotNegative<Length>>,
    /// Parts of the surface without sensors.
    #[serde(default)]
    pub keep_out: Vec<At<ZoneKeys>>,
    /// Sensors that every layout has.
    #[serde(default)]
    pub must_have: Vec<At<RequiredSensorKeys>>,
    /// Greatest cost of all sensors together.
    pub budget: Option<NotNegative<Number>>,
    /// Symmetry of layouts; `any` by default.
    pub symmetry: Option<Symmetry>,
}

/// Candidate sites.
#[derive(Clone, Debug, Deserialize)]
#[serde(
    rename = "by shape",
    expecting = "a distance such as \"5 mm\", a number of sites, or a list of positions"
)]
pub(crate) enum SitesKeys {
    /// Distance of neighbouring sites.
    Text(Positive<Length>),
    /// Number of sites, evenly along a line.
    Number(Count<1, MOST_SITES>),
    /// The sites one by one.
    List(Vec<At<Point>>),
}

/// An available kind of sensor.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a kind such as { measure = \"strain\", noise = \"1 ue\" }")]
pub(crate) struct OfferKeys {
    /// Kind.
    pub measure: At<SensorKind>,
    /// Standard deviation of a reading's noise; that of the rig's own sensors of the kind by default.
    pub noise: Option<At<RawQuantity>>,
    /// Step to which a reading is rounded; that of the rig's own sensors of the kind by default.
    pub resolution: Option<At<RawQuantity>>,
    /// Cost of one; 1 by default.
    pub cost: Option<NotNegative<Number>>,
}

/// Positions at which the surface will be touched.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a range such as { from = \"20 mm\", to = \"380 mm\" }")]
pub(crate) struct ContactsKeys {
    /// The left end, or lower left corner.
    pub from: Option<At<Point>>,
    /// The right end, or upper right corner.
    pub to: Option<At<Point>>,
    /// The distance of neighbours.
    pub every: Option<At<Positive<Length>>>,
    /// Relative frequency of contacts in equal stretches along the length, from left to right.
    pub weights: Option<At<Vec<NotNegative<Number>>>>,
}

/// A part of the surface without sensors.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a zone such as { from = \"100 mm\", to = \"120 mm\" }")]
pub(crate) struct ZoneKeys {
    /// The left end, or lower left corner.
    pub from: At<Point>,
    /// The right end, or upper right corner.
    pub to: At<Point>,
}

/// A sensor that every layout has.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a sensor such as { measure = \"deflection\", at = \"200 mm\" }")]
pub(crate) struct RequiredSensorKeys {
    /// Kind; optional if there is only one kind.
    pub measure: Option<At<SensorKind>>,
    /// Position.
    pub at: At<Point>,
}

impl At<DesignKeys> {
    pub fn build(&self, setup: &Setup) -> Result<SensorDesign, RigError> {
        let extent = setup.surface().extent();
        let Ok(default) = SensorDesign::for_setup(setup) else {
            let with = "a surface without a model, which cannot predict the reading of a sensor elsewhere";
            return Err(self.place.unused(with));
        };
        let offers = match &self.kinds {
            Some(kinds) => offers(kinds, setup)?,
            None => default.offers,
        };
        let must_have = self.must_have.iter().map(|keys| keys.build(&offers, extent));
        Ok(SensorDesign {
            count: self.count.map_or(default.count, Count::get),
            sites: self.sites.as_ref().map_or(Ok(default.sites), |sites| sites.build(extent))?,
            contacts: self
                .contacts
                .as_ref()
                .map_or(Ok(default.contacts), |contacts| contacts.build(extent))?,
            force: self.force.unwrap_or(default.force),
            criterion: self.criterion.unwrap_or(default.criterion),
            tolerance_m: self.tolerance.map_or(default.tolerance_m, |tolerance| tolerance.si),
            spacing_m: self.spacing.map_or(default.spacing_m, |spacing| spacing.si),
            keep_out: self.keep_out.iter().map(|zone| zone.build(extent)).collect::<Result<_, _>>()?,
            must_have: must_have.collect::<Result<_, _>>()?,
            fixed: default.fixed,
            budget: self.budget.map(|budget| budget.si),
            symmetry: self.symmetry.unwrap_or(default.symmetry),
            offers,
        })
    }
}

fn offers(listed: &At<Vec<At<OfferKeys>>>, setup: &Setup) -> Result<Vec<SensorOffer>, RigError> {
    if listed.is_empty() {
        return Err(listed.place.refuse("a list of at least 1"));
    }
    let mut offers: Vec<SensorOffer> = Vec::new();
    for keys in listed.iter() {
        let offer = keys.build(setup)?;
        if offers.iter().any(|other| other.kind == offer.kind) {
            let value = format!("{} for the second time", offer.kind);
            return Err(keys.measure.place.refuse_value(value, "another kind; each is offered once"));
        }
        offers.push(offer);
    }
    Ok(offers)
}

impl At<OfferKeys> {
    /// Missing faults are those of the rig's sensors of the kind.
    fn build(&self, setup: &Setup) -> Result<SensorOffer, RigError> {
        let kind = kind_on(setup.surface(), &self.measure)?;
        let own = setup.layout().sensors().iter().find(|sensor| sensor.kind == kind);
        let own = own.map_or_else(ChannelModel::default, |sensor| sensor.channel);
        let size = |key: &Option<At<RawQuantity>>, own| {
            key.as_ref().map_or(Ok(own), |written| written.si::<AtLeastZero>(kind.dimension()))
        };
        let channel = ChannelModel {
            noise_sd: size(&self.noise, own.noise_sd)?,
            resolution: size(&self.resolution, own.resolution)?,
            disabled: false,
            ..own
        };
        if channel.noise_sd == 0.0 && channel.resolution == 0.0 {
            return Err(match &self.noise {
                None => self.place.missing("noise"),
                Some(noise) => {
                    noise.place.refuse("greater than 0, otherwise the precision of the sensor is unlimited")
                }
            });
        }
        Ok(SensorOffer { kind, channel, cost: self.cost.map_or(1.0, |cost| cost.si), supply: Supply::Any })
    }
}

impl At<SitesKeys> {
    fn build(&self, extent: Extent) -> Result<Sites, RigError> {
        match &**self {
            SitesKeys::Text(every) => {
                let along = |size_m: f64| (size_m / every.si).floor() + 1.0;
                let sites = along(extent.length_m()) * extent.width_m().map_or(1.0, along);
                if sites > MOST_SITES as f64 {
                    return Err(self
                        .place
                        .refuse(format!("a distance that makes at most {MOST_SITES} sites")));
                }
                Ok(Sites::Every(every.si))
            }
            SitesKeys::Number(_) if let Extent::Plane { .. } = extent => {
                Err(self.place.refuse("a distance such as \"10 mm\", or a list of pairs, on a plane"))
            }
            SitesKeys::Number(count) => Ok(Sites::Count(count.get())),
            SitesKeys::List(listed) if listed.is_empty() => Err(self.place.refuse("a list of at least 1")),
            SitesKeys::List(listed) => {
                listed.iter().map(|point| point.on_surface(extent)).collect::<Result<_, _>>().map(Sites::At)
            }
        }
    }
}

impl At<ContactsKeys> {
    fn build(&self, extent: Extent) -> Result<ContactPrior, RigError> {
        let default = ContactPrior::over_surface(extent);
        let end = |key: &Option<At<Point>>, default| {
            key.as_ref().map_or(Ok(default), |point| point.on_surface(extent))
        };
        let (from, to) = (end(&self.from, default.from)?, end(&self.to, default.to)?);
        check_order(from, to, extent, place(&self.to).unwrap_or(&self.place))?;
        if let Some(every) = &self.every {
            let along = |from_m: f64, to_m: f64| ((to_m - from_m) / every.si).floor() + 1.0;
            if along(from.x_m, to.x_m) * along(from.y_m, to.y_m) > MOST_CONTACTS {
                let bound = format!("a distance that makes at most {MOST_CONTACTS} contacts");
                return Err(every.place.refuse(bound));
            }
        }
        let weights: Vec<f64> =
            self.weights.iter().flat_map(|weights| weights.iter()).map(|weight| weight.si).collect();
        if let (Some(key), true) = (&self.weights, weights.iter().sum::<f64>() <= 0.0) {
            return Err(key.place.refuse("a list with at least one weight greater than 0"));
        }
        let every_m = self.every.as_ref().map_or(default.every_m, |every| every.si);
        Ok(ContactPrior { from, to, every_m, weights })
    }
}

impl At<ZoneKeys> {
    fn build(&self, extent: Extent) -> Result<KeepOut, RigError> {
        let (from, to) = (self.from.on_surface(extent)?, self.to.on_surface(extent)?);
        check_order(from, to, extent, &self.to.place)?;
        Ok(KeepOut { from, to })
    }
}

impl At<RequiredSensorKeys> {
    fn build(&self, offers: &[SensorOffer], extent: Extent) -> Result<RequiredSensor, RigError> {
        let position = self.at.on_surface(extent)?;
        let offer = match &self.measure {
            None if offers.len() == 1 => 0,
            None => return Err(self.place.missing("measure")),
            Some(measure) => {
                let offer = offers.iter().position(|offer| offer.kind == **measure);
                offer.ok_or_else(|| {
                    let one = format!("{{ measure = \"{}\", noise = … }}", **measure);
                    measure.place.refuse(format!("one of `kinds`; add {one} there"))
                })?
            }
        };
        Ok(RequiredSensor { offer, position })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rig;
    use palpate_mechanics::contact::Position;

    const RIG: &str = include_str!("../../../examples/sensor-design.toml");
    const PLATE: &str = include_str!("../../../examples/plate.toml");

    fn designed(keys: &str) -> Result<Rig, RigError> {
        let (head, _) = RIG.split_once("[design]").unwrap_or_default();
        Rig::from_toml(&format!("{head}[design]\n{keys}\n"))
    }

    #[test]
    fn example_has_its_values() {
        let design = Rig::from_toml(RIG).unwrap().design.unwrap();
        assert_eq!((design.count, design.sites, design.force), (8, Sites::Every(0.005), Force::Unknown));
        assert_eq!(design.contacts.from, Position::along(0.02));
        assert_eq!(design.offers.len(), 1);
        assert_eq!(design.offers[0].channel.noise_sd, 5e-6);
    }

    #[test]
    fn a_silent_section_takes_the_rigs_sensors_all_over_the_surface() {
        let rig = designed("").unwrap();
        assert_eq!(rig.design, SensorDesign::for_setup(&rig.setup).ok());
    }

    #[test]
    fn every_key_is_read() {
        let design = designed(
            "kinds = [{ measure = \"strain\", noise = \"1 ue\", cost = 3 }, { measure = \"deflection\" }]\n\
             sites = [\"10 mm\", \"30 mm\"]\ncontacts = { from = \"50 mm\", weights = [1, 3] }\n\
             criterion = \"worst-limit\"\ntolerance = \"1 mm\"\nspacing = \"5 mm\"\n\
             keep_out = [{ from = \"20 mm\", to = \"25 mm\" }]\n\
             must_have = [{ measure = \"deflection\", at = \"30 mm\" }]\nbudget = 12.5\nsymmetry = \"forbidden\"",
        );
        let design = design.unwrap().design.unwrap();
        assert_eq!(design.sites, Sites::At(vec![Position::along(0.01), Position::along(0.03)]));
        assert_eq!(design.must_have, [RequiredSensor { offer: 1, position: Position::along(0.03) }]);
        assert_eq!((design.criterion, design.symmetry), (DesignCriterion::WorstLimit, Symmetry::Forbidden));
        assert_eq!((design.budget, design.spacing_m, design.tolerance_m), (Some(12.5), 0.005, 0.001));
        assert_eq!((design.offers[0].cost, design.offers[1].channel.noise_sd), (3.0, 5e-6));
        assert_eq!(design.contacts.weights, [1.0, 3.0]);
    }

    #[test]
    fn invalid_design_is_refused_at_its_place() {
        let cases = [
            "count = 0",
            "sites = \"5 N\"",
            "sites = \"1 nm\"",
            "sites = 0",
            "sites = []",
            "sites = [\"500 mm\"]",
            "kinds = []",
            "kinds = [{ noise = \"5 um\" }]",
            "kinds = [{ measure = \"strain\" }]",
            "kinds = [{ measure = \"strain\", noise = \"0 ue\" }]",
            "kinds = [{ measure = \"deflection\" }, { measure = \"deflection\" }]",
            "kinds = [{ measure = \"raw\", noise = 1 }]",
            "kinds = [{ measure = \"strain\", noise = \"1 ue\", cost = -1 }]",
            "contacts = { from = \"380 mm\", to = \"20 mm\" }",
            "contacts = { to = \"401 mm\" }",
            "contacts = { every = \"1 nm\" }",
            "contacts = { weights = [0, 0] }",
            "contacts = { weights = [-1] }",
            "force = \"3 N\"",
            "criterion = \"mean\"",
            "tolerance = \"0 mm\"",
            "spacing = \"-1 mm\"",
            "keep_out = [{ from = \"20 mm\" }]",
            "keep_out = [{ from = \"20 mm\", to = \"20 mm\" }]",
            "must_have = [{ at = \"500 mm\" }]",
            "must_have = [{ measure = \"strain\", at = \"50 mm\" }]",
            "budget = nan",
            "symmetry = \"no\"",
            "spaces = \"5 mm\"",
        ];
        let told = cases.map(|keys| {
            let error = designed(keys).unwrap_err();
            format!("{keys} | {error}")
        });
        insta::assert_snapshot!(told.join("\n"));
    }

    #[test]
    fn sites_on_a_plane_are_spaced_or_listed() {
        let plate = |sites: &str| Rig::from_toml(&format!("{PLATE}\n[design]\nsites = {sites}\n"));
        assert!(plate("\"50 mm\"").is_ok());
        assert!(plate("[[\"50 mm\", \"60 mm\"]]").is_ok());
        let told = [plate("20"), plate("[\"50 mm\"]")].map(|rig| rig.unwrap_err().to_string());
        assert_eq!(
            told[0],
            "`sites` is 20; it must be a distance such as \"10 mm\", or a list of pairs, on a plane"
        );
        assert!(told[1].starts_with("`sites` is 50 mm; it must be a pair of lengths"), "{}", told[1]);
    }
}
