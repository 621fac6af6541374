//! JSON objects without a type for each; keys are in the order of the source.

use serde::ser::{Serialize, SerializeMap, Serializer};

/// A JSON object. `"key"?: value` omits the key of a `None`; `..fields` includes the keys of
/// another object, none for a `None`.
macro_rules! object {
    ($($fields:tt)*) => { $crate::json::Object($crate::json::fields!($($fields)*)) };
}

/// Keys and values of [`object`] without the object.
macro_rules! fields {
    () => { $crate::json::End };
    (..$fields:expr $(, $($rest:tt)*)?) => { $crate::json::Joined($fields, $crate::json::fields!($($($rest)*)?)) };
    ($key:literal: $value:expr $(, $($rest:tt)*)?) => {
        $crate::json::Field($key, Some($value), $crate::json::fields!($($($rest)*)?))
    };
    ($key:literal?: $value:expr $(, $($rest:tt)*)?) => {
        $crate::json::Field($key, $value, $crate::json::fields!($($($rest)*)?))
    };
}
pub(crate) use {fields, object};

pub trait Fields {
    fn write<M: SerializeMap>(&self, map: &mut M) -> Result<(), M::Error>;
}

pub struct Object<F>(pub F);
/// A key with its optional value, and the fields after it.
pub struct Field<V, R>(pub &'static str, pub Option<V>, pub R);
/// Fields, and the fields after them.
pub struct Joined<F, R>(pub F, pub R);
pub struct End;

impl<F: Fields> Serialize for Object<F> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        self.0.write(&mut map)?;
        map.end()
    }
}

impl<V: Serialize, R: Fields> Fields for Field<V, R> {
    fn write<M: SerializeMap>(&self, map: &mut M) -> Result<(), M::Error> {
        if let Some(value) = &self.1 {
            map.serialize_entry(self.0, value)?;
        }
        self.2.write(map)
    }
}

impl<F: Fields, R: Fields> Fields for Joined<F, R> {
    fn write<M: SerializeMap>(&self, map: &mut M) -> Result<(), M::Error> {
        self.0.write(map)?;
        self.1.write(map)
    }
}

impl<F: Fields> Fields for Option<F> {
    fn write<M: SerializeMap>(&self, map: &mut M) -> Result<(), M::Error> {
        self.as_ref().map_or(Ok(()), |fields| fields.write(map))
    }
}

impl Fields for End {
    fn write<M: SerializeMap>(&self, _: &mut M) -> Result<(), M::Error> {
        Ok(())
    }
}
