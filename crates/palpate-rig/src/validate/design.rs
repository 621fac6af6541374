//! `[design]`

use toml::Spanned;

use super::places::{in_order, on_surface};
use crate::error::{RigError, RigProblem};
use crate::sections::{ContactsKeys, DesignSection, MustHaveKeys, OfferKeys, SitesKey, ZoneKeys};
use crate::value::{RawQuantity, choice, count, not_negative, number, positive};
use palpate_design::sensors::{
    ContactPrior, DesignCriterion, KeepOut, MustHave, SensorDesign, SensorOffer, Sites, Symmetry,
};
use palpate_estimators::setup::Bench;
use palpate_mechanics::sensing::{ChannelModel, SensorKind};
use palpate_mechanics::surface::{Extent, SurfaceSpec};
use palpate_mechanics::units::Dimension;

const SECTION: &str = "design";
/// More candidate sites than a search goes through in reasonable time.
const MOST_SITES: usize = 1_000_000;
const MOST_SITES_BOUND: &str = "at least 1 and at most 1000000";
/// More sensors than a layout has that somebody designs.
const MOST_SENSORS: usize = 1000;

pub(super) fn validate(
    section: Option<&Spanned<DesignSection>>,
    bench: &Bench,
) -> Result<Option<SensorDesign>, RigError> {
    let Some(section) = section else { return Ok(None) };
    let extent = bench.surface.extent();
    let Some(mut design) = SensorDesign::of(&bench.layout, extent) else {
        let with = "a surface without a model, which cannot tell what a sensor elsewhere would read";
        return Err(RigProblem::UnusedKey { key: SECTION, with }.at(section.span()));
    };
    let keys = section.get_ref();
    if let Some(raw) = &keys.count {
        design.count = count("count", raw, 1..=MOST_SENSORS, "at least 1 and at most 1000")?;
    }
    if let Some(raw) = &keys.kinds {
        design.offers = offers(raw, bench)?;
    }
    if let Some(raw) = &keys.sites {
        design.sites = sites(raw, extent)?;
    }
    if let Some(raw) = &keys.contacts {
        design.contacts = contacts(raw, extent)?;
    }
    if let Some(raw) = &keys.force {
        design.force_is_known = Some(choice("force", raw, &[("known", true), ("unknown", false)])?);
    }
    if let Some(raw) = &keys.criterion {
        let words = DesignCriterion::ALL.map(|criterion| (criterion.name(), criterion));
        design.criterion = choice("criterion", raw, &words)?;
    }
    if let Some(raw) = &keys.tolerance {
        design.tolerance_m = positive("tolerance", raw, Dimension::Length)?;
    }
    if let Some(raw) = &keys.spacing {
        design.spacing_m = not_negative("spacing", raw, Dimension::Length)?;
    }
    for zone in keys.keep_out.iter().flat_map(|zones| zones.get_ref()) {
        design.keep_out.push(keep_out(zone, extent)?);
    }
    for sensor in keys.must_have.iter().flat_map(|sensors| sensors.get_ref()) {
        design.must_have.push(must_have(sensor, &design.offers, extent)?);
    }
    if let Some(raw) = &keys.budget {
        design.budget = Some(number("budget", raw, |value| value >= 0.0, "at least 0")?);
    }
    if let Some(raw) = &keys.symmetry {
        let words =
            [("any", Symmetry::Any), ("wanted", Symmetry::Wanted), ("forbidden", Symmetry::Forbidden)];
        design.symmetry = choice("symmetry", raw, &words)?;
    }
    Ok(Some(design))
}

fn offers(listed: &Spanned<Vec<Spanned<OfferKeys>>>, bench: &Bench) -> Result<Vec<SensorOffer>, RigError> {
    let offers: Vec<SensorOffer> =
        listed.get_ref().iter().map(|keys| offer(keys, bench)).collect::<Result<_, _>>()?;
    if offers.is_empty() {
        let value = "a list of 0".to_owned();
        return Err(
            RigProblem::OutOfRange { key: "kinds", value, bound: "a list of at least 1" }.at(listed.span())
        );
    }
    let again = (1..offers.len()).find(|i| offers[..*i].iter().any(|other| other.kind == offers[*i].kind));
    match again {
        None => Ok(offers),
        Some(i) => {
            let value = format!("{} for the second time", offers[i].kind);
            let bound = "another kind; each is offered once";
            Err(RigProblem::OutOfRange { key: "measure", value, bound }.at(listed.get_ref()[i].span()))
        }
    }
}

/// A kind with its noise and cost; the faults that are not named here are those of the rig's own sensors of the kind.
fn offer(section: &Spanned<OfferKeys>, bench: &Bench) -> Result<SensorOffer, RigError> {
    let keys = section.get_ref();
    let measure = keys.measure.as_ref().ok_or_else(|| missing("measure", section))?;
    let kind = choice("measure", measure, &SensorKind::ALL.map(|kind| (kind.name(), kind)))?;
    if kind != SensorKind::Strain && matches!(bench.surface, SurfaceSpec::Digit(_)) {
        return Err(RigProblem::NotAGauge { kind }.at(measure.span()));
    }
    if kind == SensorKind::Raw {
        return Err(RigProblem::RawOnModel.at(measure.span()));
    }
    let own = bench.layout.sensors.iter().find(|sensor| sensor.kind == kind);
    let mut channel = own.map_or_else(ChannelModel::default, |sensor| sensor.channel);
    channel.dead = false;
    if let Some(raw) = &keys.noise {
        channel.noise_sd = not_negative("noise", raw, kind.dimension())?;
    }
    if let Some(raw) = &keys.resolution {
        channel.resolution = not_negative("resolution", raw, kind.dimension())?;
    }
    if channel.noise_sd == 0.0 && channel.resolution == 0.0 {
        return match &keys.noise {
            None => Err(missing("noise", section)),
            Some(raw) => {
                let bound = "greater than 0, or nothing limits what the sensor tells";
                let value = raw.get_ref().to_string();
                Err(RigProblem::OutOfRange { key: "noise", value, bound }.at(raw.span()))
            }
        };
    }
    let cost =
        keys.cost.as_ref().map_or(Ok(1.0), |raw| number("cost", raw, |cost| cost >= 0.0, "at least 0"))?;
    Ok(SensorOffer { kind, channel, cost })
}

fn sites(raw: &Spanned<SitesKey>, extent: Extent) -> Result<Sites, RigError> {
    let refuse =
        |value: String, bound| Err(RigProblem::OutOfRange { key: "sites", value, bound }.at(raw.span()));
    match raw.get_ref() {
        SitesKey::Every(text) => {
            let quantity = Spanned::new(raw.span(), RawQuantity::Text(text.clone()));
            let every_m = positive("sites", &quantity, Dimension::Length)?;
            let along = |size_m: f64| (size_m / every_m).floor() + 1.0;
            let sites = along(extent.length_m) * extent.width_m.map_or(1.0, along);
            if sites <= MOST_SITES as f64 {
                Ok(Sites::Every(every_m))
            } else {
                refuse(text.clone(), "a distance that makes at most 1000000 sites")
            }
        }
        SitesKey::Count(_) if extent.is_plane() => Err(RigProblem::CountOfSitesOnPlane.at(raw.span())),
        SitesKey::Count(sites) => {
            let sites = Spanned::new(raw.span(), *sites);
            Ok(Sites::Count(count("sites", &sites, 1..=MOST_SITES, MOST_SITES_BOUND)?))
        }
        SitesKey::List(listed) if listed.is_empty() => {
            refuse("a list of 0".to_owned(), "a list of at least 1")
        }
        SitesKey::List(listed) => {
            Ok(Sites::At(listed.iter().map(|at| on_surface("sites", at, extent)).collect::<Result<_, _>>()?))
        }
    }
}

fn contacts(section: &Spanned<ContactsKeys>, extent: Extent) -> Result<ContactPrior, RigError> {
    let keys = section.get_ref();
    let mut prior = ContactPrior::all_over(extent);
    if let Some(raw) = &keys.from {
        prior.from = on_surface("from", raw, extent)?;
    }
    if let Some(raw) = &keys.to {
        prior.to = on_surface("to", raw, extent)?;
    }
    in_order(prior.from, prior.to, extent).map_err(|problem| problem.at(section.span()))?;
    if let Some(raw) = &keys.every {
        prior.every_m = positive("every", raw, Dimension::Length)?;
        let along = |from_m: f64, to_m: f64| ((to_m - from_m) / prior.every_m).floor() + 1.0;
        let contacts = along(prior.from.x_m, prior.to.x_m) * along(prior.from.y_m, prior.to.y_m);
        if contacts > MOST_CONTACTS {
            let (value, bound) = (raw.get_ref().to_string(), "a distance that makes at most 10000 contacts");
            return Err(RigProblem::OutOfRange { key: "every", value, bound }.at(raw.span()));
        }
    }
    if let Some(raw) = &keys.weights {
        for weight in raw.get_ref() {
            prior.weights.push(number("weights", weight, |weight| weight >= 0.0, "at least 0")?);
        }
        if prior.weights.iter().sum::<f64>() <= 0.0 {
            let value = format!("a list of {}", prior.weights.len());
            let bound = "a list with at least one weight greater than 0";
            return Err(RigProblem::OutOfRange { key: "weights", value, bound }.at(raw.span()));
        }
    }
    Ok(prior)
}

/// More contact positions than a layout needs to be judged by.
const MOST_CONTACTS: f64 = 10_000.0;

fn keep_out(section: &Spanned<ZoneKeys>, extent: Extent) -> Result<KeepOut, RigError> {
    let keys = section.get_ref();
    let from = keys.from.as_ref().ok_or_else(|| missing("from", section))?;
    let to = keys.to.as_ref().ok_or_else(|| missing("to", section))?;
    let zone = KeepOut { from: on_surface("from", from, extent)?, to: on_surface("to", to, extent)? };
    in_order(zone.from, zone.to, extent).map_err(|problem| problem.at(section.span()))?;
    Ok(zone)
}

fn must_have(
    section: &Spanned<MustHaveKeys>,
    offers: &[SensorOffer],
    extent: Extent,
) -> Result<MustHave, RigError> {
    let keys = section.get_ref();
    let at = keys.at.as_ref().ok_or_else(|| missing("at", section))?;
    let position = on_surface("at", at, extent)?;
    let offer = match &keys.measure {
        // With a single kind to choose from there is nothing to say.
        None if offers.len() == 1 => 0,
        None => return Err(missing("measure", section)),
        Some(raw) => {
            let kind = choice("measure", raw, &SensorKind::ALL.map(|kind| (kind.name(), kind)))?;
            let offer = offers.iter().position(|offer| offer.kind == kind);
            offer.ok_or_else(|| RigProblem::NotOffered { kind }.at(raw.span()))?
        }
    };
    Ok(MustHave { offer, position })
}

fn missing<T>(key: &'static str, section: &Spanned<T>) -> RigError {
    RigProblem::MissingKey { section: SECTION, key }.at(section.span())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rig;
    use palpate_mechanics::contact::Position;

    const RIG: &str = include_str!("../../../../examples/sensor-design.toml");
    const PLATE: &str = include_str!("../../../../examples/plate.toml");

    fn designed(keys: &str) -> Result<Rig, RigError> {
        let (head, _) = RIG.split_once("[design]").unwrap_or_default();
        Rig::from_toml(&format!("{head}[design]\n{keys}\n"))
    }

    #[test]
    fn the_example_says_what_it_says() {
        let design = Rig::from_toml(RIG).unwrap().design.unwrap();
        assert_eq!(
            (design.count, design.sites, design.force_is_known),
            (8, Sites::Every(0.005), Some(false))
        );
        assert_eq!(design.contacts.from, Position::along(0.02));
        assert_eq!(design.offers.len(), 1);
        assert_eq!(design.offers[0].channel.noise_sd, 5e-6);
    }

    #[test]
    fn a_silent_section_takes_the_rigs_sensors_all_over_the_surface() {
        let rig = designed("").unwrap();
        assert_eq!(rig.design, SensorDesign::of(&rig.bench.layout, rig.bench.surface.extent()));
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
        assert_eq!(design.must_have, [MustHave { offer: 1, position: Position::along(0.03) }]);
        assert_eq!((design.criterion, design.symmetry), (DesignCriterion::WorstLimit, Symmetry::Forbidden));
        assert_eq!((design.budget, design.spacing_m, design.tolerance_m), (Some(12.5), 0.005, 0.001));
        assert_eq!((design.offers[0].cost, design.offers[1].channel.noise_sd), (3.0, 5e-6));
        assert_eq!(design.contacts.weights, [1.0, 3.0]);
    }

    #[test]
    fn what_is_wrong_with_a_design_is_said_with_its_place() {
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
        assert_eq!(told[0], "a number of `sites` does not say where on a plane they are");
        assert!(told[1].starts_with("`sites` has a single length where a pair"), "{}", told[1]);
    }
}
