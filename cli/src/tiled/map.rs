//! The parts of Tiled's JSON format that a scene needs, and mistakes in a map. Fields that are not listed do not matter
//! to a scene.

use serde::Deserialize;
use serde_json::Value;

#[derive(Debug, Deserialize)]
pub struct Map {
    #[serde(default)]
    pub orientation: String,
    #[serde(default)]
    pub infinite: bool,
    /// Size in tiles.
    pub width: f64,
    pub height: f64,
    /// Size of a tile in pixels.
    pub tilewidth: f64,
    pub tileheight: f64,
    pub layers: Vec<Layer>,
    #[serde(default)]
    pub properties: Vec<Property>,
}

/// A layer: objects, a group of layers, or a kind that means nothing to a scene.
#[derive(Debug, Deserialize)]
pub struct Layer {
    #[serde(default)]
    pub name: String,
    /// `objectgroup`, `group`, `tilelayer` or `imagelayer`.
    #[serde(rename = "type")]
    pub kind: String,
    /// Whether the layer is shown. Hidden layers hold guides and notes, which are no part of the scene.
    #[serde(default = "yes")]
    pub visible: bool,
    /// Offset of the layer's contents, pixels.
    #[serde(default)]
    pub offsetx: f64,
    #[serde(default)]
    pub offsety: f64,
    #[serde(default)]
    pub objects: Vec<Object>,
    #[serde(default)]
    pub layers: Vec<Layer>,
}

/// An object. Lengths are in pixels, y points down, and a position is the upper left corner. Hidden objects are left
/// out, like hidden layers.
#[derive(Debug, Deserialize)]
pub struct Object {
    #[serde(default)]
    pub id: i64,
    #[serde(default = "yes")]
    pub visible: bool,
    #[serde(default)]
    pub name: String,
    /// The object's class. Tiled 1.9 used this field name too.
    #[serde(default, rename = "type", alias = "class")]
    pub class: String,
    #[serde(default)]
    pub x: f64,
    #[serde(default)]
    pub y: f64,
    #[serde(default)]
    pub width: f64,
    #[serde(default)]
    pub height: f64,
    /// Degrees, clockwise.
    #[serde(default)]
    pub rotation: f64,
    #[serde(default)]
    pub ellipse: bool,
    #[serde(default)]
    pub capsule: bool,
    #[serde(default)]
    pub point: bool,
    pub polygon: Option<Vec<Corner>>,
    pub polyline: Option<Vec<Corner>>,
    /// The tile that the object shows.
    pub gid: Option<u64>,
    pub text: Option<Value>,
    pub template: Option<String>,
    #[serde(default)]
    pub properties: Vec<Property>,
}

fn yes() -> bool {
    true
}

/// A point relative to the object.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Corner {
    pub x: f64,
    pub y: f64,
}

#[derive(Debug, Deserialize)]
pub struct Property {
    pub name: String,
    pub value: Value,
}

/// An error and its location in the map.
pub struct Wrong {
    pub origin: Origin,
    pub field: String,
    pub found: String,
    pub allowed: String,
}

/// Where something in a scene comes from.
#[derive(Clone, Debug)]
pub enum Origin {
    /// The map's properties.
    Map,
    /// An object in a layer.
    Object { layer: String, id: i64, name: String },
}

impl Origin {
    /// The location, as named in an error message.
    pub fn place(&self) -> String {
        match self {
            Origin::Map => String::new(),
            Origin::Object { layer, id, name } if name.is_empty() => {
                format!("layer {layer:?}, object {id}")
            }
            Origin::Object { layer, id, name } => {
                format!("layer {layer:?}, object {id} ({name:?})")
            }
        }
    }

    /// An error in a field from this source.
    pub fn wrong(
        &self,
        field: &str,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Box<Wrong> {
        let (found, allowed) = (found.into(), allowed.into());
        Box::new(Wrong { origin: self.clone(), field: field.to_owned(), found, allowed })
    }
}
