//! How a surface is held, as it is written.
#![allow(missing_docs, reason = "keys of the file, which the reference of keys describes")]

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor, value::MapAccessDeserializer};
use toml::Spanned;

use super::Key;
use crate::value::{RawPosition, RawQuantity};

/// `supports`: one word for all, or a list
#[derive(Clone, Debug)]
pub enum SupportsKey {
    Word(String),
    List(Vec<Spanned<SupportKeys>>),
}

/// One of `supports`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a support such as { at = \"0 mm\", kind = \"clamped\" }")]
pub struct SupportKeys {
    pub at: Key<RawPosition>,
    pub kind: Key<String>,
    pub stiffness: Key<RawQuantity>,
    pub rotational_stiffness: Key<RawQuantity>,
}

/// One of `sections` of a beam
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section such as { to = \"100 mm\", thickness = \"2 mm\" }")]
pub struct BeamSectionKeys {
    pub to: Key<RawQuantity>,
    pub width: Key<RawQuantity>,
    pub thickness: Key<RawQuantity>,
}

/// `edges`: one word for all, or one for each
#[derive(Clone, Debug)]
pub enum EdgesSection {
    All(String),
    Each(Box<EachEdge>),
}

/// `edges = { left = …, right = …, bottom = …, top = … }`
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EachEdge {
    pub left: Key<String>,
    pub right: Key<String>,
    pub bottom: Key<String>,
    pub top: Key<String>,
}

impl<'de> Deserialize<'de> for SupportsKey {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct WordOrList;

        impl<'de> Visitor<'de> for WordOrList {
            type Value = SupportsKey;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a word such as \"simple\", or a list of supports")
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<SupportsKey, E> {
                Ok(SupportsKey::Word(word.to_owned()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<SupportsKey, A::Error> {
                let mut supports = Vec::new();
                while let Some(support) = seq.next_element()? {
                    supports.push(support);
                }
                Ok(SupportsKey::List(supports))
            }
        }

        deserializer.deserialize_any(WordOrList)
    }
}

impl<'de> Deserialize<'de> for EdgesSection {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AllOrEach;

        impl<'de> Visitor<'de> for AllOrEach {
            type Value = EdgesSection;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a word such as \"simple\", or a table of left, right, bottom and top")
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<EdgesSection, E> {
                Ok(EdgesSection::All(word.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<EdgesSection, A::Error> {
                Box::deserialize(MapAccessDeserializer::new(map)).map(EdgesSection::Each)
            }
        }

        deserializer.deserialize_any(AllOrEach)
    }
}
