//! The gallery: scenes that an operator adds along with their pictures.

use super::response::{Answer, not_found, respond};
use hyper::StatusCode;
use hyper::body::Bytes;
use hyper::header::{self, HeaderValue};
use jostle_protocol::web::SceneCard;
use std::collections::BTreeMap;

/// The category of these scenes in the lobby, and the folder of their pictures.
const GALLERY: &str = "gallery";
/// Maximum size of a picture in bytes. Those of the built-in scenes take at most 12 kB.
pub const PICTURE_BYTES_MAX: usize = 64 << 10;
/// Pictures keep their addresses when they change, so browsers cache them for an hour only.
const AN_HOUR: HeaderValue = HeaderValue::from_static("public, max-age=3600");

/// The pictures of the gallery's scenes, in WebP, by the scenes' names. A scene may lack one.
#[derive(Clone, Debug, Default)]
pub struct Gallery(pub BTreeMap<String, Option<Bytes>>);

impl Gallery {
    /// Moves a scene's card to the gallery if the scene belongs there.
    pub fn adopt(&self, card: SceneCard) -> SceneCard {
        let Some(picture) = self.0.get(&card.name) else { return card };
        let picture = picture.as_ref().map(|_| format!("/{GALLERY}/{}.webp", card.name));
        SceneCard { category: GALLERY.to_owned(), picture, ..card }
    }

    /// Serves a picture by its file name.
    pub fn picture(&self, file: &str) -> Answer {
        let found = file.strip_suffix(".webp").and_then(|name| self.0.get(name));
        let Some(Some(picture)) = found else { return not_found() };
        let mut answer = respond(StatusCode::OK, "image/webp", picture.clone());
        answer.headers_mut().insert(header::CACHE_CONTROL, AN_HOUR);
        answer
    }
}
