//! Drafts of scenes in the browser's storage. A text may replace only the draft from which it was derived. If another
//! tab has changed that draft in the meantime, the text is stored as an additional draft and both remain.

use jostle_game::scene::SCENE_NAME_BYTES_MAX;

/// The key of a new scene's draft. For a named scene, it is followed by a dot and the name.
const KEY: &str = "jostle.draft";
/// The prefix of the names of additional drafts of a new scene.
const OWN: &str = "my-scene";
/// Highest number in the name of an additional draft; no more are stored.
const NUMBER_MAX: u32 = 99;

/// Storage provided by the browser or by a test.
pub trait DraftStore {
    /// The value stored under a key.
    fn read(&self, key: &str) -> Option<String>;
    /// Stores or removes a value; `false` if the storage is full or blocked.
    fn write(&mut self, key: &str, value: Option<&str>) -> bool;
}

/// A text to be stored for later visits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draft {
    /// The name of the scene; `None` for a new one.
    pub origin: Option<String>,
    /// The text; `None` removes the draft.
    pub text: Option<String>,
    /// The stored text from which this one was derived.
    pub base: Option<String>,
}

/// The key of a scene's draft.
pub fn key(origin: Option<&str>) -> String {
    origin.map_or(KEY.to_owned(), |name| format!("{KEY}.{name}"))
}

impl Draft {
    /// Stores the text. Returns the name of the scene under which it was stored, which differs if the existing draft is
    /// not the one from which the text was derived. `None` if the text could not be stored.
    pub fn keep(&self, store: &mut impl DraftStore) -> Option<Option<String>> {
        let wanted = key(self.origin.as_deref());
        let there = store.read(&wanted);
        let is_known = there.is_none() || there == self.base || there == self.text;
        let origin = match is_known {
            true => self.origin.clone(),
            // Without a text there is nothing to store under another name.
            false if self.text.is_none() => return None,
            false => Some(self.free_name(store)?),
        };
        store.write(&key(origin.as_deref()), self.text.as_deref()).then_some(origin)
    }

    /// A name, derived from the scene's, under which no draft is stored.
    fn free_name(&self, store: &impl DraftStore) -> Option<String> {
        let name = self.origin.as_deref().unwrap_or(OWN);
        let name = &name[..name.len().min(SCENE_NAME_BYTES_MAX - 3)];
        let mut names = (2..=NUMBER_MAX).map(|number| format!("{name}-{number}"));
        names.find(|name| store.read(&key(Some(name))).is_none())
    }
}
