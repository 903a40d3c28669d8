//! Panels as values. A pure function creates the [`View`] of a panel from the app's state, and `dom::patch` applies the
//! differences from the previous one, so the content of panels can be tested without a browser.

use std::borrow::Cow;

/// A text on the page; most are constants.
pub type Text = Cow<'static, str>;

/// A panel of the page, or an entry in a list.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The name of a panel, or the id of an entry's template.
    pub name: &'static str,
    /// Identifies an entry within its list; empty for a panel.
    pub key: Text,
    /// Changes, applied in this order. Everything else stays as it is.
    pub parts: Vec<Part>,
    /// Selector of the element that has the focus while the view is shown. `None` returns the focus to the element that
    /// had it before.
    pub focus: Option<&'static str>,
}

/// A selector within the document or the entry, and the change applied there. An empty selector means the root or the
/// entry itself.
pub type Part = (&'static str, Set);

/// Something that can be set on an element.
#[derive(Clone, Debug, PartialEq)]
pub enum Set {
    Text(Text),
    Attribute(&'static str, Option<Text>),
    Style(&'static str, Text),
    /// The value of a field. As with the next two, the user may have changed it since it was set.
    Value(Text),
    /// The value of a text field; it is not changed while the field has the focus.
    Typed(Text),
    Checked(bool),
    /// The value of the selected radio button in a group.
    Choice(Text),
    /// A time in milliseconds since 1970, shown as text.
    Moment(f64),
    List(Vec<View>),
}

impl View {
    pub fn panel(name: &'static str) -> View {
        View { name, key: Text::default(), parts: Vec::new(), focus: None }
    }

    /// An unchanged instance of a template.
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

    /// Sets the element's text; `None` hides the element.
    pub fn text_or_hide(self, at: &'static str, text: Option<impl Into<Text>>) -> View {
        let shown = text.is_some();
        self.text(at, text.map_or(Text::default(), Into::into)).show(at, shown)
    }

    pub fn with(self, at: &'static str, name: &'static str, value: impl Into<Text>) -> View {
        self.set(at, Set::Attribute(name, Some(value.into())))
    }

    /// Sets or removes an attribute.
    pub fn with_or_without(
        self,
        at: &'static str,
        name: &'static str,
        value: Option<impl Into<Text>>,
    ) -> View {
        self.set(at, Set::Attribute(name, value.map(Into::into)))
    }

    /// Sets or removes a boolean attribute.
    pub fn flag(self, at: &'static str, name: &'static str, on: bool) -> View {
        self.set(at, Set::Attribute(name, on.then_some(Text::Borrowed(""))))
    }

    /// Sets an attribute for the style sheet to "yes", or removes it.
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

/// "true" or "false", as in ARIA attributes.
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

    /// The value to which an attribute is set; `Some(None)` if it is removed.
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
