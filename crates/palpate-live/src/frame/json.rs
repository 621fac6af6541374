//! JSON frames: one array or object per line.

use super::names::{Filling, Names, Role};
use super::{BadFrame, Frame};
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;

pub fn array(line: &[u8], names: &Names, columns: &[Role]) -> Result<Frame, BadFrame> {
    let mut frame = Filling::new(names);
    verdict(line, |json| json.deserialize_seq(Values { frame: &mut frame, columns }))?;
    frame.finish()
}

pub fn object(line: &[u8], names: &Names, role: impl FnMut(usize, &[u8]) -> Role) -> Result<Frame, BadFrame> {
    let mut frame = Filling::new(names);
    verdict(line, |json| json.deserialize_map(Members { frame: &mut frame, role }))?;
    frame.finish()
}

type Json<'de> = serde_json::Deserializer<serde_json::de::SliceRead<'de>>;

fn verdict<'de>(
    line: &'de [u8],
    read: impl FnOnce(&mut Json<'de>) -> serde_json::Result<Result<(), BadFrame>>,
) -> Result<(), BadFrame> {
    let mut json = serde_json::Deserializer::from_slice(line);
    let verdict = read(&mut json).map_err(|_| BadFrame::Malformed)?;
    json.end().map_err(|_| BadFrame::Malformed)?;
    verdict
}

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
        loop {
            let role = roles.next();
            let value = Value { frame: self.frame, role: role.copied().unwrap_or(Role::Ignored) };
            let Some(outcome) = values.next_element_seed(value)? else {
                let complete = if role.is_none() { Ok(()) } else { Err(BadFrame::Channels) };
                return Ok(verdict.and(complete));
            };
            verdict = verdict.and(if role.is_some() { outcome } else { Err(BadFrame::Channels) });
        }
    }
}

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
            verdict = verdict.and(members.next_value_seed(Value { frame: self.frame, role })?);
        }
        Ok(verdict)
    }
}

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

struct Value<'a, 'f> {
    frame: &'a mut Filling<'f>,
    role: Role,
}

impl Value<'_, '_> {
    fn no_number(&self) -> Result<(), BadFrame> {
        if self.role == Role::Ignored { Ok(()) } else { Err(BadFrame::NotANumber) }
    }
}

impl<'de> DeserializeSeed<'de> for Value<'_, '_> {
    type Value = Result<(), BadFrame>;

    fn deserialize<D: Deserializer<'de>>(self, json: D) -> Result<Self::Value, D::Error> {
        json.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Value<'_, '_> {
    type Value = Result<(), BadFrame>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_f64<E>(self, value: f64) -> Result<Self::Value, E> {
        Ok(self.frame.set(self.role, value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Self::Value, E> {
        Ok(self.frame.set(self.role, value as f64))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Self::Value, E> {
        Ok(self.frame.set(self.role, value as f64))
    }

    fn visit_bool<E>(self, _: bool) -> Result<Self::Value, E> {
        Ok(self.no_number())
    }

    fn visit_unit<E>(self) -> Result<Self::Value, E> {
        Ok(self.no_number())
    }

    fn visit_str<E>(self, text: &str) -> Result<Self::Value, E> {
        if matches!(self.role, Role::Time(_)) && self.frame.set_time_text(text.as_bytes()) {
            return Ok(Ok(()));
        }
        match text.trim().parse() {
            Ok(value) => Ok(self.frame.set(self.role, value)),
            Err(_) => Ok(self.no_number()),
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<Self::Value, A::Error> {
        while values.next_element::<IgnoredAny>()?.is_some() {}
        Ok(self.no_number())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<Self::Value, A::Error> {
        while members.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
        Ok(self.no_number())
    }
}
