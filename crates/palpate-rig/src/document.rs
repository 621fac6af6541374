//! Deserialization of TOML with key, place and written value in every error.
//!
//! An [`At`] keeps the place of its value. The name of an enum determines the source of its variant:
//!
//! - `#[serde(rename = "by kind")]`: the key `kind` of a table; `by kind or network` adds a variant for
//!   tables without it.
//! - `#[serde(rename = "by shape")]`: the shape of the value: `Text` or `Number`, or `Scalar` for both;
//!   `List`; `Table`.
//! - Any other name: a word.

use std::marker::PhantomData;
use std::ops::Deref;

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, Expected, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, VariantAccess, Visitor,
};
use serde::{Deserialize, forward_to_deserialize_any};
use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use crate::error::{Place, RigError, RigProblem};

/// Value and its place.
#[derive(Clone, Debug)]
pub(crate) struct At<T> {
    value: T,
    pub place: Place,
}

/// Parses TOML.
///
/// # Errors
/// [`RigError`] for invalid TOML.
pub(crate) fn parse(text: &str) -> Result<Spanned<DeValue<'_>>, RigError> {
    match DeTable::parse(text) {
        Ok(table) => Ok(Spanned::new(table.span(), DeValue::Table(table.into_inner()))),
        Err(error) => Err(RigError { span: error.span(), problem: Box::new(RigProblem::Toml(error)) }),
    }
}

/// Reads a value; `path` is empty for the whole document.
///
/// # Errors
/// [`RigError`] for the first problem.
pub(crate) fn read<'de, T: Deserialize<'de>>(path: &str, value: &Spanned<DeValue>) -> Result<T, RigError> {
    Node::new(path, value).read(PhantomData)
}

impl<T> Deref for At<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

pub(crate) fn place<T>(key: &Option<At<T>>) -> Option<&Place> {
    key.as_ref().map(|key| &key.place)
}

const AT: &str = "At";

impl<'de, T: Deserialize<'de>> Deserialize<'de> for At<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(rename = "At")]
        struct Parts<T>(String, usize, usize, String, T);

        let Parts(path, start, end, written, value) = Parts::deserialize(deserializer)?;
        Ok(Self { value, place: Place { path, span: start..end, written } })
    }
}

struct Parts<'a> {
    node: Node<'a>,
    given: usize,
}

impl<'de> SeqAccess<'de> for Parts<'_> {
    type Error = RigError;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, RigError> {
        self.given += 1;
        let Place { path, span, written } = &self.node.place;
        match self.given {
            1 => seed.deserialize(path.as_str().into_deserializer()),
            2 => seed.deserialize(span.start.into_deserializer()),
            3 => seed.deserialize(span.end.into_deserializer()),
            4 => seed.deserialize(written.as_str().into_deserializer()),
            _ => seed.deserialize(self.node.clone()),
        }
        .map(Some)
    }
}

#[derive(Clone)]
struct Node<'a> {
    value: &'a DeValue<'a>,
    place: Place,
    /// Key and value that determined the variant.
    tag: Option<(&'static str, &'a str)>,
}

type Entry<'a> = (&'a Spanned<DeString<'a>>, &'a Spanned<DeValue<'a>>);

impl<'a> Node<'a> {
    fn new(path: &str, value: &'a Spanned<DeValue<'a>>) -> Self {
        let (value, span) = (value.get_ref(), value.span());
        let written = match value {
            DeValue::String(text) => text.to_string(),
            DeValue::Integer(number) => number.to_string(),
            DeValue::Float(number) => number.to_string(),
            DeValue::Boolean(boolean) => boolean.to_string(),
            DeValue::Datetime(date) => date.to_string(),
            DeValue::Array(list) => format!("a list of {}", list.len()),
            DeValue::Table(_) => "a table".to_owned(),
        };
        Self { value, place: Place { path: path.to_owned(), span, written }, tag: None }
    }

    fn read<'de, S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, RigError> {
        let place = self.place.clone();
        seed.deserialize(self).map_err(|error| error.with_place(&place))
    }

    fn child(&self, key: &str, value: &'a Spanned<DeValue<'a>>) -> Self {
        let dot = if self.place.path.is_empty() { "" } else { "." };
        Self::new(&format!("{}{dot}{key}", self.place.path), value)
    }

    /// Entries in the order of the document, without the key of the variant.
    fn entries(&self, table: &'a DeTable<'a>) -> Vec<Entry<'a>> {
        let told = self.tag.map(|(key, _)| key);
        let mut entries: Vec<_> =
            table.iter().filter(|(key, _)| told != Some(key.get_ref().as_ref())).collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        entries
    }

    /// Variant of this table; see the head of this file.
    fn tagged(
        mut self,
        table: &'a DeTable<'a>,
        tag: &'static str,
        variants: &[&str],
    ) -> Result<Variant<'a>, RigError> {
        let (key, otherwise) = tag.split_once(" or ").map_or((tag, None), |(key, word)| (key, Some(word)));
        let (word, place) = match (table.get(key), otherwise) {
            (Some(value), _) => match (value.get_ref(), self.child(key, value).place) {
                (DeValue::String(word), place) => (word.as_ref(), place),
                (_, place) => return Err(place.refuse(one_of(variants))),
            },
            (None, Some(word)) => (word, self.place.clone()),
            (None, None) => return Err(self.place.missing(key)),
        };
        self.tag = Some((key, word));
        Ok(Variant { word, place, node: self })
    }
}

impl<'de> Deserializer<'de> for Node<'_> {
    type Error = RigError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, RigError> {
        match self.value {
            DeValue::String(text) => visitor.visit_str(text),
            DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
                Ok(number) => visitor.visit_i64(number),
                Err(_) => Err(self.place.refuse("a number of at most 64 bits")),
            },
            DeValue::Float(number) => match number.as_str().parse() {
                Ok(number) => visitor.visit_f64(number),
                Err(_) => Err(self.place.refuse("a number")),
            },
            DeValue::Boolean(boolean) => visitor.visit_bool(*boolean),
            DeValue::Datetime(_) => Err(RigError::invalid_type(Unexpected::Other("a date"), &visitor)),
            DeValue::Array(list) => {
                let expected = (&visitor as &dyn Expected).to_string();
                let mut elements = Elements { node: &self, rest: list.iter() };
                match visitor.visit_seq(&mut elements) {
                    Ok(_) if elements.rest.len() > 0 => Err(self.place.refuse(expected)),
                    result => result,
                }
            }
            DeValue::Table(table) => {
                visitor.visit_map(Entries { rest: self.entries(table).into_iter(), node: &self, value: None })
            }
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, RigError> {
        visitor.visit_some(self)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        _: usize,
        visitor: V,
    ) -> Result<V::Value, RigError> {
        if name == AT {
            visitor.visit_seq(Parts { node: self, given: 0 })
        } else {
            self.deserialize_any(visitor)
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, RigError> {
        let place = self.place.clone();
        let variant = match (name.strip_prefix("by "), self.value) {
            (None, DeValue::String(word)) => Variant { word, place, node: self },
            (None, _) => return Err(place.refuse(one_of(variants))),
            (Some("shape"), value) => match shapes(value).iter().find(|shape| variants.contains(shape)) {
                Some(word) => Variant { word, place, node: self },
                None => return Err(RigError::invalid_type(Unexpected::Enum, &visitor)),
            },
            (Some(tag), DeValue::Table(table)) => self.tagged(table, tag, variants)?,
            (Some(_), _) => return Err(RigError::invalid_type(Unexpected::Enum, &visitor)),
        };
        visitor.visit_enum(variant)
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, RigError> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        bool u8 u16 u32 u64 u128 i8 i16 i32 i64 i128 f32 f64 char str string seq bytes byte_buf map struct unit unit_struct tuple
        newtype_struct identifier
    }
}

fn one_of(words: &[&str]) -> String {
    format!("one of {}", words.join(", "))
}

fn shapes(value: &DeValue) -> &'static [&'static str] {
    match value {
        DeValue::String(_) => &["Text", "Scalar"],
        DeValue::Integer(_) | DeValue::Float(_) => &["Number", "Scalar"],
        DeValue::Array(_) => &["List"],
        DeValue::Table(_) => &["Table"],
        DeValue::Boolean(_) | DeValue::Datetime(_) => &[],
    }
}

struct Elements<'n, 'a> {
    node: &'n Node<'a>,
    rest: std::slice::Iter<'a, Spanned<DeValue<'a>>>,
}

impl<'de> SeqAccess<'de> for Elements<'_, '_> {
    type Error = RigError;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, RigError> {
        let Some(value) = self.rest.next() else { return Ok(None) };
        Node::new(&self.node.place.path, value).read(seed).map(Some)
    }
}

struct Entries<'n, 'a> {
    node: &'n Node<'a>,
    rest: std::vec::IntoIter<Entry<'a>>,
    /// Value of the last key.
    value: Option<Node<'a>>,
}

impl<'de> MapAccess<'de> for Entries<'_, '_> {
    type Error = RigError;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, RigError> {
        let Some((key, value)) = self.rest.next() else { return Ok(None) };
        self.value = Some(self.node.child(key.get_ref(), value));
        let name: StrDeserializer<RigError> = key.get_ref().as_ref().into_deserializer();
        seed.deserialize(name).map(Some).map_err(|error| error.at_key(key.span(), self.node.tag))
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, RigError> {
        let value = self.value.take().ok_or_else(|| RigError::custom("a value was asked for before its key"));
        value?.read(seed)
    }
}

struct Variant<'a> {
    word: &'a str,
    place: Place,
    node: Node<'a>,
}

impl<'de, 'a> EnumAccess<'de> for Variant<'a> {
    type Error = RigError;
    type Variant = Node<'a>;

    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Node<'a>), RigError> {
        let word: StrDeserializer<RigError> = self.word.into_deserializer();
        let variant = seed.deserialize(word).map_err(|error| error.with_place(&self.place))?;
        Ok((variant, self.node))
    }
}

impl<'de> VariantAccess<'de> for Node<'_> {
    type Error = RigError;

    /// Reads a word, or a table without keys.
    fn unit_variant(self) -> Result<(), RigError> {
        if let (DeValue::Table(table), Some(_)) = (self.value, self.tag)
            && let Some((key, _)) = self.entries(table).first()
        {
            return Err(RigError::unknown_field(key.get_ref(), &[]).at_key(key.span(), self.tag));
        }
        Ok(())
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, RigError> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, RigError> {
        self.deserialize_any(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, RigError> {
        self.deserialize_any(visitor)
    }
}
