//! The keys that the player chose, and the labels on the keycaps.

use crate::input::action::{Action, LETTERS, PLACES, usual};
use jostle_game::Buttons;
use litemap::LiteMap;

/// Keys chosen by the player. An action with a chosen key has no other keys; all other actions keep their defaults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bindings {
    /// Actions and the codes of their keys (`KeyboardEvent.code`); an empty code means no key.
    own: Vec<(Action, String)>,
}

impl Bindings {
    /// Parses the output of [`Bindings::text`], skipping invalid entries.
    pub fn parse(text: &str) -> Bindings {
        let entry = |entry: &str| {
            let (id, code) = entry.split_once('=')?;
            Some((Action::of_id(id)?, code.to_owned()))
        };
        Bindings { own: text.split(',').filter_map(entry).collect() }
    }

    /// Formats the bindings as a line for storage.
    pub fn text(&self) -> String {
        let entries = self.own.iter().map(|(action, code)| format!("{}={code}", action.id()));
        entries.collect::<Vec<_>>().join(",")
    }

    /// All actions that a key triggers.
    pub fn actions(&self, place: &str, letter: &str) -> Vec<Action> {
        let own = self.own.iter().filter(|(_, code)| code == place).map(|(action, _)| *action);
        let own: Vec<Action> = own.collect();
        if !own.is_empty() {
            return own;
        }
        let usual = usual(place, letter).into_iter();
        usual.filter(|action| self.own_key(*action).is_none()).collect()
    }

    /// All game buttons that a key presses.
    pub fn buttons(&self, place: &str, letter: &str) -> Buttons {
        let actions = self.actions(place, letter).into_iter();
        Buttons(actions.fold(0, |all, action| all | action.buttons().0))
    }

    /// The code of the action's key, if any.
    pub fn place(&self, action: Action) -> Option<&str> {
        match self.own_key(action) {
            Some(own) => Some(own).filter(|own| !own.is_empty()),
            None => self.usual_places(action).next(),
        }
    }

    fn own_key(&self, action: Action) -> Option<&str> {
        self.own.iter().find(|(owner, _)| *owner == action).map(|(_, code)| code.as_str())
    }

    /// The default keys of an action that are not assigned to other actions.
    fn usual_places(&self, action: Action) -> impl Iterator<Item = &'static str> {
        let steering =
            PLACES.iter().filter(move |(_, does)| *does == action).map(|(code, _)| *code);
        let named =
            LETTERS.iter().filter(move |(.., does)| *does == action).map(|(_, code, _)| *code);
        steering.chain(named).filter(|code| !self.own.iter().any(|(_, own)| own == code))
    }

    /// Gives an action this key and no other. Actions that lose their only key as a result get this action's former
    /// key; returns the last one that changed.
    pub fn assign(&mut self, action: Action, place: &str, letter: &str) -> Option<Action> {
        let displaced = self.actions(place, letter);
        let former = self.place(action).unwrap_or_default().to_owned();
        self.set(action, place);
        let mut moved = None;
        for other in displaced.into_iter().filter(|other| *other != action) {
            let has_own = self.own_key(other).is_some();
            if has_own || self.usual_places(other).next().is_none() {
                self.set(other, &former);
                moved = Some(other);
            }
        }
        moved
    }

    fn set(&mut self, action: Action, place: &str) {
        self.own.retain(|(owner, _)| *owner != action);
        self.own.push((action, place.to_owned()));
    }
}

/// The known labels of the keyboard's keys.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeyboardLayout {
    labels: LiteMap<String, String>,
}

impl KeyboardLayout {
    /// Records the letter of a key. Longer key names are ignored.
    pub fn note(&mut self, place: &str, letter: &str) {
        if letter.chars().count() == 1 && letter != " " {
            self.labels.insert(place.to_owned(), letter.to_uppercase());
        }
    }

    /// The label of the key with this code.
    pub fn label(&self, place: &str) -> String {
        if let Some(label) = self.labels.get(place) {
            return label.clone();
        }
        match place {
            "ArrowUp" => "\u{2191}".to_owned(),
            "ArrowDown" => "\u{2193}".to_owned(),
            "ArrowLeft" => "\u{2190}".to_owned(),
            "ArrowRight" => "\u{2192}".to_owned(),
            _ => {
                let letter = place.strip_prefix("Key").or_else(|| place.strip_prefix("Digit"));
                letter.unwrap_or(place).to_owned()
            }
        }
    }

    /// The label of an action's key; `None` if it has no key.
    pub fn cap(&self, bindings: &Bindings, action: Action) -> Option<String> {
        let place = bindings.place(action)?;
        let named = LETTERS.iter().find(|(.., does)| *does == action);
        match named.filter(|_| bindings.own_key(action).is_none()) {
            Some((letter, ..)) if self.has(letter, bindings, action) => Some(letter.to_uppercase()),
            _ => Some(self.label(place)),
        }
    }

    /// Whether the key with this letter triggers the action or, if no such key is known, whether the label of the
    /// action's key is unknown.
    fn has(&self, letter: &str, bindings: &Bindings, action: Action) -> bool {
        let upper = letter.to_uppercase();
        match self.labels.iter().find(|(_, label)| **label == upper) {
            Some((place, _)) => bindings.actions(place, letter).contains(&action),
            None => !self.labels.contains_key(bindings.place(action).unwrap_or_default()),
        }
    }
}

#[cfg(test)]
mod tests;
