//! Drafts of scenes in the browser, by one rule: a text is written over the text that it was made from, and over no
//! other. Another tab may have changed that; then this one's text becomes a further draft, and both are there.

use jostle_game::scene::SCENE_NAME_BYTES_MAX;

/// The draft of a scene of one's own; that of a scene with a name has a dot and the name behind it.
const KEY: &str = "jostle.draft";
/// Name that the further drafts of a scene of one's own begin with.
const OWN: &str = "my-scene";
/// The number behind the name of a further draft; past it no more are kept.
const NUMBER_MAX: u32 = 99;

/// A storage of the browser, or of a test.
pub trait DraftStore {
    /// The value under a key.
    fn read(&self, key: &str) -> Option<String>;
    /// Keeps a value, or forgets it; `false` if the storage is full or forbidden.
    fn write(&mut self, key: &str, value: Option<&str>) -> bool;
}

/// A text to be kept for later visits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draft {
    /// Name of the scene; none for one of one's own.
    pub origin: Option<String>,
    /// Without any the draft is forgotten.
    pub text: Option<String>,
    /// The kept text that it was made from.
    pub base: Option<String>,
}

/// The key of the draft of a scene.
pub fn key(origin: Option<&str>) -> String {
    origin.map_or(KEY.to_owned(), |name| format!("{KEY}.{name}"))
}

impl Draft {
    /// Keeps the text. Returns the name of the scene as whose draft it is there: another one than wanted if that draft is
    /// not the known one. `None` if the storage does not take it.
    pub fn keep(&self, store: &mut impl DraftStore) -> Option<Option<String>> {
        let wanted = key(self.origin.as_deref());
        let there = store.read(&wanted);
        let is_known = there.is_none() || there == self.base || there == self.text;
        let origin = match is_known {
            true => self.origin.clone(),
            // Nothing is no draft.
            false if self.text.is_none() => return None,
            false => Some(self.free_name(store)?),
        };
        store.write(&key(origin.as_deref()), self.text.as_deref()).then_some(origin)
    }

    /// A name like that of the scene under which no draft is kept.
    fn free_name(&self, store: &impl DraftStore) -> Option<String> {
        let name = self.origin.as_deref().unwrap_or(OWN);
        let name = &name[..name.len().min(SCENE_NAME_BYTES_MAX - 3)];
        let mut names = (2..=NUMBER_MAX).map(|number| format!("{name}-{number}"));
        names.find(|name| store.read(&key(Some(name))).is_none())
    }
}
