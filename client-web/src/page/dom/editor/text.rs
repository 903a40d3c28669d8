//! The text field of the editor. It lies over a copy of its text that underlines the error and highlights the
//! selection.

use crate::editor::history::changed;
use crate::editor::state::Editor;
use crate::editor::update::EditorEvent;
use crate::page::dom;
use crate::page::event::Event;
use crate::page::queue::Events;
use jostle_game::scene::line_at;
use jostle_sim::short_sort::sort_few;
use std::ops::Range;
use web_sys::{Element, HtmlElement, HtmlTextAreaElement};

/// The most recently shown text.
#[derive(Default)]
pub struct TextView {
    version: Option<(u32, u32)>,
    marked: Option<((u32, u32), Marks)>,
    /// The byte to scroll to once the field is shown.
    unseen: Option<usize>,
}

/// The byte ranges of the text that are marked.
#[derive(Clone, PartialEq, Eq)]
struct Marks {
    error: Option<Range<usize>>,
    chosen: Vec<Range<usize>>,
}

impl TextView {
    /// Shows a text that was changed by means other than typing.
    pub fn show(&mut self, editor: &Editor) {
        if self.version == Some(editor.version()) {
            return;
        }
        self.version = Some(editor.version());
        let area = area();
        if area.value() == editor.text() {
            return;
        }
        let changed = changed(&area.value(), editor.text());
        let scroll = (area.scroll_top(), area.scroll_left());
        area.set_value(editor.text());
        area.set_scroll_top(scroll.0);
        area.set_scroll_left(scroll.1);
        // Otherwise the cursor would be at the end of the text.
        let had_focus = is_focused();
        place_cursor(&area, editor.text(), changed.end);
        if !had_focus && is_focused() {
            // Some browsers give the field the focus along with a cursor.
            let _ = area.blur();
        }
        self.unseen = Some(changed.start);
        self.scroll(editor.text());
    }

    /// Scrolls to what has not been seen, unless the field is hidden.
    fn scroll(&mut self, text: &str) {
        if let Some(at) = self.unseen.take_if(|_| area().client_height() > 0) {
            reveal(text, at);
        }
    }

    /// Underlines the error and highlights the lines of the selection.
    pub fn underline(&mut self, editor: &Editor) {
        let chosen = editor.selected().map(|piece| piece.bytes.clone()).collect();
        let marks = Marks { error: editor.doc.error_bytes(), chosen };
        let shown = (editor.version(), marks);
        self.scroll(editor.text());
        if self.marked.as_ref() == Some(&shown) {
            return;
        }
        let before = self.marked.as_ref().map(|(_, marks)| marks.chosen.first().cloned());
        let first = shown.1.chosen.first().cloned();
        fill(editor.text(), &shown.1);
        self.marked = Some(shown);
        if let Some(at) = first.filter(|at| before != Some(Some(at.clone())))
            && !is_focused()
        {
            self.unseen = Some(at.start);
            self.scroll(editor.text());
        }
        follow();
    }

    /// Focuses the text field and places the cursor at this byte.
    pub fn focus(&self, at: usize) {
        let area = area();
        let text = area.value();
        let at = at.min(text.len());
        let _ = area.focus();
        place_cursor(&area, &text, at);
        reveal(&text, at);
        follow();
    }
}

fn area() -> HtmlTextAreaElement {
    dom::by_id("text")
}

/// Places the cursor at a byte of the field's text.
fn place_cursor(area: &HtmlTextAreaElement, text: &str, at: usize) {
    let units = text.get(..at).map_or(0, |before| before.encode_utf16().count()) as u32;
    let _ = area.set_selection_range(units, units);
}

fn is_focused() -> bool {
    dom::document().active_element().is_some_and(|element| element.id() == "text")
}

/// Scrolls the line that contains a byte into view.
fn reveal(text: &str, at: usize) {
    let area = area();
    let lines = text.lines().count().max(1) as f64;
    let line = line_at(text.as_bytes(), at) - 1;
    let line_height = f64::from(area.scroll_height()) / lines;
    let (top, height) = (area.scroll_top(), area.client_height());
    let place = (line as f64 * line_height) as i32;
    if place < top || place > top + height - 3 * line_height as i32 {
        area.set_scroll_top((place - height / 3).max(0));
    }
}

/// Scrolls the copy to the position of the field.
fn follow() {
    let (area, below) = (area(), dom::html("underlay"));
    below.set_scroll_top(area.scroll_top());
    below.set_scroll_left(area.scroll_left());
}

/// Fills the copy with spans of text, some of them marked.
fn fill(text: &str, marks: &Marks) {
    let below: HtmlElement = dom::html("underlay");
    below.set_text_content(None);
    let mut cuts: Vec<usize> = vec![0, text.len()];
    let ranges = marks.chosen.iter().chain(&marks.error);
    cuts.extend(ranges.flat_map(|range| [range.start, range.end]).filter(|at| *at < text.len()));
    sort_few(&mut cuts, |one, other| one < other);
    cuts.dedup();
    for pair in cuts.windows(2) {
        let part = text.get(pair[0]..pair[1]).unwrap_or_default();
        let within = |range: &Range<usize>| range.start <= pair[0] && pair[1] <= range.end;
        let is_wrong = marks.error.as_ref().is_some_and(within);
        let element = span(if is_wrong { "mark" } else { "span" }, part);
        if marks.chosen.iter().any(within) {
            dom::set(&element, "class", Some("chosen"));
        }
        let _ = below.append_child(&element);
    }
    // In the field, a final newline is also followed by an empty line.
    let _ = below.append_child(&span("span", "\n\n"));
}

fn span(tag: &str, text: &str) -> Element {
    let element = dom::document().create_element(tag).expect("both are tags");
    element.set_text_content(Some(text));
    element
}

pub fn listen(events: Events) {
    let field = area();
    dom::listen(&field, "input", move |_: web_sys::Event| {
        events.push(Event::Edited(EditorEvent::Typed(area().value())));
    });
    dom::listen(&field, "scroll", |_: web_sys::Event| follow());
}
