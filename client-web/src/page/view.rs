//! Panels as values: a pure function makes the [`View`] of a panel from the state of the app, and `dom::patch` applies
//! what differs from the one before. What a panel says can thus be tested without a browser.

use std::borrow::Cow;

/// A text of the page: most are sentences of the program.
pub type Text = Cow<'static, str>;

/// A panel of the page, or an entry of a list.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Name of the panel, or id of the entry's template.
    pub name: &'static str,
    /// What tells the entry from the others of its list; empty for a panel.
    pub key: Text,
    /// In this order they are applied. What is left out stays as it is.
    pub parts: Vec<Part>,
    /// Selector of the element that has the focus while the view is so; without one the focus goes back to where it was.
    pub focus: Option<&'static str>,
}

/// Selector of an element, in the document or in the entry, and what is set there. An empty one is the root or the entry
/// itself.
pub type Part = (&'static str, Set);

/// Something that can be set on an element.
#[derive(Clone, Debug, PartialEq)]
pub enum Set {
    Text(Text),
    Attribute(&'static str, Option<Text>),
    Style(&'static str, Text),
    /// The value of a field. The player may have changed it since it was set; so it is with the next two.
    Value(Text),
    /// The value of a field that is typed into; it stays while the field has the focus.
    Typed(Text),
    Checked(bool),
    /// The value of the radio button that is chosen in a group.
    Choice(Text),
    /// A time in milliseconds since 1970, as text.
    Moment(f64),
    List(Vec<View>),
}

impl View {
    /// A panel about which nothing is said yet.
    pub fn panel(name: &'static str) -> View {
        View { name, key: Text::default(), parts: Vec::new(), focus: None }
    }

    /// An entry as its template has it.
    pub fn item(template: &'static str, key: impl ToString) -> View {
        View { key: Text::Owned(key.to_string()), ..View::panel(template) }
    }

    pub fn set(mut self, at: &'static str, set: Set) -> View {
        self.parts.push((at, set));
        self
    }

    pub fn text(self, at: &'static str, text: impl Into<Text>) -> View {
        self.set(at, Set::Text(text.into()))
    }

    /// Sets a text, and hides the element without any.
    pub fn text_or_hide(self, at: &'static str, text: Option<impl Into<Text>>) -> View {
        let shown = text.is_some();
        self.text(at, text.map_or(Text::default(), Into::into)).show(at, shown)
    }

    pub fn with(self, at: &'static str, name: &'static str, value: impl Into<Text>) -> View {
        self.set(at, Set::Attribute(name, Some(value.into())))
    }

    /// Sets an attribute, or removes it.
    pub fn with_or_without(
        self,
        at: &'static str,
        name: &'static str,
        value: Option<impl Into<Text>>,
    ) -> View {
        self.set(at, Set::Attribute(name, value.map(Into::into)))
    }

    /// Sets an attribute that says something by being there.
    pub fn flag(self, at: &'static str, name: &'static str, on: bool) -> View {
        self.set(at, Set::Attribute(name, on.then_some(Text::Borrowed(""))))
    }

    /// Sets a mark for the style sheet, "yes", or removes it.
    pub fn yes(self, at: &'static str, name: &'static str, on: bool) -> View {
        self.with_or_without(at, name, on.then_some("yes"))
    }

    pub fn show(self, at: &'static str, shown: bool) -> View {
        self.flag(at, "hidden", !shown)
    }

    pub fn style(self, at: &'static str, name: &'static str, value: impl Into<Text>) -> View {
        self.set(at, Set::Style(name, value.into()))
    }

    pub fn list(self, at: &'static str, items: impl IntoIterator<Item = View>) -> View {
        self.set(at, Set::List(items.into_iter().collect()))
    }
}

/// "true" or "false", as attributes of accessibility have them.
pub fn word(on: bool) -> &'static str {
    if on { "true" } else { "false" }
}

#[cfg(test)]
impl View {
    pub fn text_of(&self, at: &str) -> Option<&str> {
        self.parts.iter().find_map(|part| match part {
            (found, Set::Text(text)) if *found == at => Some(&**text),
            _ => None,
        })
    }

    /// The value of an attribute that is set or, in `Some(None)`, removed.
    pub fn attribute_of(&self, at: &str, name: &str) -> Option<Option<&str>> {
        self.parts.iter().find_map(|part| match part {
            (found, Set::Attribute(set, value)) if *found == at && *set == name => {
                Some(value.as_deref())
            }
            _ => None,
        })
    }

    pub fn items_of(&self, at: &str) -> Option<&[View]> {
        self.parts.iter().find_map(|part| match part {
            (found, Set::List(items)) if *found == at => Some(&items[..]),
            _ => None,
        })
    }
}
