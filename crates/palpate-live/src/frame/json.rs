//! Frames of JSON: an array or an object a line.

use super::names::{Filling, Names, Role};
use super::{BadFrame, Frame};
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// Reads an array of values, whose roles are those of `columns`.
pub fn array(line: &[u8], names: &Names, columns: &[Role]) -> Result<Frame, BadFrame> {
    let mut frame = Filling::new(names);
    verdict(line, |json| json.deserialize_seq(Values { frame: &mut frame, columns }))?;
    frame.finish()
}

/// Reads an object; `role` tells what the name of the `i`-th value is.
pub fn object(line: &[u8], names: &Names, role: impl FnMut(usize, &[u8]) -> Role) -> Result<Frame, BadFrame> {
    let mut frame = Filling::new(names);
    verdict(line, |json| json.deserialize_map(Members { frame: &mut frame, role }))?;
    frame.finish()
}

type Json<'de> = serde_json::Deserializer<serde_json::de::SliceRead<'de>>;

/// Outcome of reading the values of a line; bytes that are no JSON, or more than one value, are malformed.
fn verdict<'de>(
    line: &'de [u8],
    read: impl FnOnce(&mut Json<'de>) -> serde_json::Result<Result<(), BadFrame>>,
) -> Result<(), BadFrame> {
    let mut json = serde_json::Deserializer::from_slice(line);
    let verdict = read(&mut json).map_err(|_| BadFrame::Malformed)?;
    json.end().map_err(|_| BadFrame::Malformed)?;
    verdict
}

/// Reader of the values of an array.
struct Values<'a, 'f> {
    frame: &'a mut Filling<'f>,
    columns: &'a [Role],
}

impl<'de> Visitor<'de> for Values<'_, '_> {
    type Value = Result<(), BadFrame>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an array of numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<Self::Value, A::Error> {
        let mut verdict = Ok(());
        let mut roles = self.columns.iter();
        while let Some(value) = values.next_element::<Value>()? {
            let role = roles.next().ok_or(BadFrame::Channels);
            verdict = verdict.and(role.and_then(|role| set(self.frame, *role, &value)));
        }
        let complete = if roles.next().is_none() { Ok(()) } else { Err(BadFrame::Channels) };
        Ok(verdict.and(complete))
    }
}

/// Reader of the members of an object.
struct Members<'a, 'f, R> {
    frame: &'a mut Filling<'f>,
    role: R,
}

impl<'de, R: FnMut(usize, &[u8]) -> Role> Visitor<'de> for Members<'_, '_, R> {
    type Value = Result<(), BadFrame>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an object of numbers")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut members: A) -> Result<Self::Value, A::Error> {
        let mut verdict = Ok(());
        for i in 0.. {
            let name = Name { i, role: &mut self.role };
            let Some(role) = members.next_key_seed(name)? else { break };
            let value: Value = members.next_value()?;
            verdict = verdict.and(set(self.frame, role, &value));
        }
        Ok(verdict)
    }
}

fn set(frame: &mut Filling, role: Role, value: &Value) -> Result<(), BadFrame> {
    match (role, value) {
        (Role::Ignored, _) => Ok(()),
        (Role::Time(_), Value::Text(text)) if frame.set_time_text(text.as_bytes()) => Ok(()),
        (_, Value::Other) => Err(BadFrame::NotANumber),
        (role, Value::Number(value)) => frame.set(role, *value),
        (role, Value::Text(text)) => frame.set(role, text.trim().parse().map_err(|_| BadFrame::NotANumber)?),
    }
}

/// Reader of the name of the `i`-th member.
struct Name<'a, R> {
    i: usize,
    role: &'a mut R,
}

impl<'de, R: FnMut(usize, &[u8]) -> Role> DeserializeSeed<'de> for Name<'_, R> {
    type Value = Role;

    fn deserialize<D: Deserializer<'de>>(self, json: D) -> Result<Role, D::Error> {
        json.deserialize_str(self)
    }
}

impl<R: FnMut(usize, &[u8]) -> Role> Visitor<'_> for Name<'_, R> {
    type Value = Role;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a name")
    }

    fn visit_str<E>(self, name: &str) -> Result<Role, E> {
        Ok((self.role)(self.i, name.as_bytes()))
    }
}

/// A value of JSON.
enum Value {
    Number(f64),
    /// Text, which may be a number in quotes or a time.
    Text(String),
    Other,
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(json: D) -> Result<Self, D::Error> {
        json.deserialize_any(AnyValue)
    }
}

struct AnyValue;

impl<'de> Visitor<'de> for AnyValue {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(Value::Number(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value::Number(value as f64))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(Value::Number(value as f64))
    }

    fn visit_bool<E>(self, _: bool) -> Result<Value, E> {
        Ok(Value::Other)
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Other)
    }

    fn visit_str<E>(self, text: &str) -> Result<Value, E> {
        Ok(Value::Text(text.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<Value, A::Error> {
        while values.next_element::<IgnoredAny>()?.is_some() {}
        Ok(Value::Other)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<Value, A::Error> {
        while members.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        Ok(Value::Other)
    }
}
