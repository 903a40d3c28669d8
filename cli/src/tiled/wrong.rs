//! Mistakes in a map, and where they are.

/// A mistake at a place of the map.
pub struct Wrong {
    pub origin: Origin,
    pub field: String,
    pub found: String,
    pub allowed: String,
}

/// Where something in a scene came from.
#[derive(Clone, Debug)]
pub enum Origin {
    /// The properties of the map.
    Map,
    /// An object in a layer.
    Object { layer: String, id: i64, name: String },
}

impl Origin {
    /// The place as an error names it.
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

    /// A mistake in a field of it.
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
