//! `[design]`, as it is written.
#![allow(missing_docs, reason = "keys of the file, which the reference of keys describes")]

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, SeqAccess, Visitor};
use toml::Spanned;

use super::Key;
use crate::value::{RawPosition, RawQuantity};

/// `[design]`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DesignSection {
    pub count: Key<i64>,
    pub sites: Key<SitesKey>,
    pub kinds: Key<Vec<Spanned<OfferKeys>>>,
    pub contacts: Key<ContactsKeys>,
    pub force: Key<String>,
    pub criterion: Key<String>,
    pub tolerance: Key<RawQuantity>,
    pub spacing: Key<RawQuantity>,
    pub keep_out: Key<Vec<Spanned<ZoneKeys>>>,
    pub must_have: Key<Vec<Spanned<MustHaveKeys>>>,
    pub budget: Key<f64>,
    pub symmetry: Key<String>,
}

/// `sites`: so far apart, so many, or these
#[derive(Clone, Debug)]
pub enum SitesKey {
    Every(String),
    Count(i64),
    List(Vec<Spanned<RawPosition>>),
}

/// One of `kinds`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a kind such as { measure = \"strain\", noise = \"1 ue\" }")]
pub struct OfferKeys {
    pub measure: Key<String>,
    pub noise: Key<RawQuantity>,
    pub resolution: Key<RawQuantity>,
    pub cost: Key<f64>,
}

/// `contacts = { from = …, to = …, every = …, weights = […] }`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a range such as { from = \"20 mm\", to = \"380 mm\" }")]
pub struct ContactsKeys {
    pub from: Key<RawPosition>,
    pub to: Key<RawPosition>,
    pub every: Key<RawQuantity>,
    pub weights: Key<Vec<Spanned<f64>>>,
}

/// One of `keep_out`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a zone such as { from = \"100 mm\", to = \"120 mm\" }")]
pub struct ZoneKeys {
    pub from: Key<RawPosition>,
    pub to: Key<RawPosition>,
}

/// One of `must_have`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a sensor such as { measure = \"deflection\", at = \"200 mm\" }")]
pub struct MustHaveKeys {
    pub measure: Key<String>,
    pub at: Key<RawPosition>,
}

impl<'de> Deserialize<'de> for SitesKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct LengthCountOrList;

        impl<'de> Visitor<'de> for LengthCountOrList {
            type Value = SitesKey;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a distance such as \"5 mm\", a number of sites, or a list of positions")
            }

            fn visit_str<E>(self, text: &str) -> Result<SitesKey, E> {
                Ok(SitesKey::Every(text.to_owned()))
            }

            fn visit_i64<E>(self, count: i64) -> Result<SitesKey, E> {
                Ok(SitesKey::Count(count))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<SitesKey, A::Error> {
                let mut positions = Vec::new();
                while let Some(position) = seq.next_element()? {
                    positions.push(position);
                }
                Ok(SitesKey::List(positions))
            }
        }

        deserializer.deserialize_any(LengthCountOrList)
    }
}
