//! Reads what the browser's JSON parser has made of an answer, for the types of [`jostle_protocol::web`].
//!
//! A struct is read as the sequence of its fields, so that the code that serde derives for it compares no names. That
//! and an error without a text take a fraction of the space of a reader that knows every kind of value.

use js_sys::{Array, JSON, Reflect};
use serde::de::{DeserializeOwned, DeserializeSeed, Deserializer, Error, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;
use std::fmt::{self, Display, Formatter};
use wasm_bindgen::JsValue;

/// Parses an answer; `None` if it is not JSON or has other fields than expected.
pub fn parse<T: DeserializeOwned>(answer: &str) -> Option<T> {
    T::deserialize(Value(JSON::parse(answer).ok()?)).ok()
}

/// A value that the answer should not have. No one would read where it is: the page then does without the answer.
#[derive(Debug)]
struct Unexpected;

impl Display for Unexpected {
    fn fmt(&self, _: &mut Formatter) -> fmt::Result {
        Ok(())
    }
}

impl std::error::Error for Unexpected {}

impl Error for Unexpected {
    fn custom<T: Display>(_: T) -> Unexpected {
        Unexpected
    }

    fn invalid_type(_: serde::de::Unexpected, _: &dyn serde::de::Expected) -> Unexpected {
        Unexpected
    }

    fn invalid_value(_: serde::de::Unexpected, _: &dyn serde::de::Expected) -> Unexpected {
        Unexpected
    }

    fn invalid_length(_: usize, _: &dyn serde::de::Expected) -> Unexpected {
        Unexpected
    }
}

struct Value(JsValue);

/// Reads a whole number; a fraction is cut off.
macro_rules! numbers {
    ($($read:ident)+) => {$(
        fn $read<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unexpected> {
            visitor.visit_i64(self.0.as_f64().ok_or(Unexpected)? as i64)
        }
    )+};
}

impl<'de> Deserializer<'de> for Value {
    type Error = Unexpected;

    numbers! { deserialize_i32 deserialize_u16 deserialize_u32 deserialize_u64 }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unexpected> {
        visitor.visit_bool(self.0.as_bool().ok_or(Unexpected)?)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unexpected> {
        visitor.visit_string(self.0.as_string().ok_or(Unexpected)?)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unexpected> {
        if self.0.is_null() || self.0.is_undefined() {
            visitor.visit_none()
        } else {
            visitor.visit_some(self)
        }
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unexpected> {
        if !Array::is_array(&self.0) {
            return Err(Unexpected);
        }
        visitor.visit_seq(Elements(Array::from(&self.0).into_iter()))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Unexpected> {
        visitor.visit_seq(Fields { of: self.0, names: fields.iter() })
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Unexpected> {
        Err(Unexpected)
    }

    forward_to_deserialize_any! {
        i8 i16 i64 i128 u8 u128 f32 f64 char str bytes byte_buf unit unit_struct newtype_struct tuple tuple_struct map
        enum identifier ignored_any
    }
}

struct Elements(js_sys::ArrayIntoIter);

impl<'de> SeqAccess<'de> for Elements {
    type Error = Unexpected;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Unexpected> {
        self.0.next().map(|element| seed.deserialize(Value(element))).transpose()
    }
}

/// The fields of an object, in the order in which their struct declares them.
struct Fields {
    of: JsValue,
    names: std::slice::Iter<'static, &'static str>,
}

impl<'de> SeqAccess<'de> for Fields {
    type Error = Unexpected;

    /// A missing field is passed on as none at all, for which serde takes the field's default, if it has one.
    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Unexpected> {
        let Some(name) = self.names.next() else { return Ok(None) };
        let value = Reflect::get(&self.of, &JsValue::from_str(name)).map_err(|_| Unexpected)?;
        if value.is_undefined() {
            return Ok(None);
        }
        seed.deserialize(Value(value)).map(Some)
    }
}
