//! The panels around the picture being edited: bar, form and error.

use crate::editor::form::{self, Row, rows};
use crate::editor::state::Editor;
use crate::language::{fill, say};
use crate::page::app::App;
use crate::page::edit_screen::EditScreen;
use crate::page::view::{Set, Text, View};
use jostle_game::scene::FieldForm;

/// The panels that are inactive while the scene is being played.
const RESTING: [&str; 4] = ["#palette", "#edit-tabs", "#edit-form", "#edit-code"];

pub fn view(app: &App) -> View {
    let (edits, edited) = (app.screen.edit_screen().is_some(), app.screen.edited());
    let mode = edited.map(|_| if edits { "edit" } else { "play" });
    let view = View::panel("editor")
        .with_or_without("", "data-editor", mode)
        .show("#editor", mode.is_some());
    let Some(screen) = edited else { return view };
    let (label, title) =
        if edits { (say("Play"), say("Play (E)")) } else { (say("Edit"), say("Edit (E)")) };
    let view = RESTING.into_iter().fold(view, |view, at| view.flag(at, "inert", !edits));
    let view = view.with("#edit-toggle", "title", title).text("#edit-toggle span", label);
    bar(view, screen, edits)
}

fn bar(view: View, screen: &EditScreen, edits: bool) -> View {
    let editor = &screen.editor;
    let [undo, redo] = editor.can();
    let chosen = !editor.selection.is_empty() && editor.doc.is_toml;
    let empty = editor.text().is_empty();
    let buttons = [
        ("#edit-undo", undo && edits),
        ("#edit-redo", redo && edits),
        ("#edit-duplicate", chosen && edits),
        ("#edit-delete", chosen && edits),
        ("#edit-new", edits),
        ("#edit-room", !empty && !screen.opening),
    ];
    let view = buttons.into_iter().fold(view, |view, (at, on)| view.flag(at, "disabled", !on));
    let room = if screen.opening { say("Opening\u{2026}") } else { say("Open a room") };
    view.text("#edit-room", room)
        .text("#edit-file", editor.doc.file.clone())
        .text("#edit-said", editor.said.clone())
}

/// The error in the text.
pub fn error(app: &App) -> View {
    let view = View::panel("error");
    match app.screen.edit_screen().map(|screen| screen.editor.doc.problem()) {
        Some(problem) => view.text_or_hide("#edit-error", problem.map(ToString::to_string)),
        None => view,
    }
}

/// The fields of the selected piece or of the scene, with a control for each field whose range the scene parser knows.
pub fn form(editor: &Editor) -> View {
    View::panel("form")
        .list("#form-fields", rows(editor).iter().map(line))
        .text("#form-title", form::title(editor))
        .text("#form-note", say(form::note(editor)))
        .text_or_hide("#edit-path", editor.path_offer().map(say))
}

fn line(row: &Row) -> View {
    let count = if let FieldForm::Vector { .. } = row.form { 2 } else { 1 };
    View::item("field-item", &row.path)
        .list("span:last-child", (0..count).map(|at| control(row, at)))
        .with_or_without("span:last-child", "class", (count == 2).then_some("two"))
        .with("", "data-path", row.path.clone())
        .with("", "class", if row.values.is_some() { "field given" } else { "field" })
        .text("span", row.name.clone())
}

fn control(row: &Row, at: usize) -> View {
    let value = row.values.as_ref().and_then(|values| values.get(at));
    let typed = Set::Typed(value.cloned().unwrap_or_default().into());
    let default = row.default.get(at).cloned();
    let item = |template| View::item(template, at).with("", "aria-label", row.name.clone());
    let number = |ends: [String; 2], step: Option<&'static str>| {
        let [low, high] = ends.each_ref().map(String::as_str);
        let title = fill("{low} to {high}", &[("low", low), ("high", high)]);
        let [low, high] = ends;
        item("number-item")
            .with("", "min", low)
            .with("", "max", high)
            .with("", "title", title)
            .with_or_without("", "step", step)
    };
    let control = match &row.form {
        FieldForm::Number { range, .. } | FieldForm::Vector { range, .. } => {
            number(range.map(|end| end.to_string()), Some("any"))
        }
        FieldForm::Whole { range, .. } => number(range.map(|end| end.to_string()), None),
        FieldForm::Truth { default } => {
            let on = value.map_or(*default, |value| value == "true");
            return item("truth-item").set("", Set::Checked(on));
        }
        FieldForm::Text { chars_max } => {
            item("text-item").with("", "maxlength", chars_max.to_string())
        }
        FieldForm::Choice { names } => {
            let names = std::iter::once("").chain(names.iter().map(String::as_str));
            return item("choice-item").list("", names.map(option)).set("", typed);
        }
    };
    control.set("", typed).with_or_without("", "placeholder", default)
}

fn option(name: &str) -> View {
    let label = if name.is_empty() { Text::from(say("default")) } else { name.to_owned().into() };
    View::item("option-item", name).with("", "value", name.to_owned()).text("", label)
}
