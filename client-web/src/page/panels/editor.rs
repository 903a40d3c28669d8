//! The panels around the picture being edited: bar, form and error.

use crate::editor::field_words::FieldWords;
use crate::editor::form::row::Row;
use crate::editor::form::sentence::{Part, Sentence, sentences};
use crate::editor::form::{self, Form};
use crate::editor::state::Editor;
use crate::editor::strings;
use crate::language::{fill, say};
use crate::page::app::App;
use crate::page::edit_screen::EditScreen;
use crate::page::view::{Set, View};
use jostle_game::scene::FieldForm;
use std::iter::once;

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

/// The fields of the selected piece or of the scene, with a control for each field whose range the scene parser knows,
/// the round and the rules. Fields for experts are folded away.
pub fn form(editor: &Editor) -> View {
    let form = Form::of(editor);
    let rules = sentences(editor.text());
    let part = |rows: &[Row], is_expert: bool| -> Vec<View> {
        rows.iter().filter(|row| row.words.is_expert == is_expert).map(line).collect()
    };
    let [more, more_of_round] = [&form.fields, &form.round].map(|rows| part(rows, true));
    let is_toml = editor.doc.is_toml;
    View::panel("form")
        .list("#form-fields", part(&form.fields, false))
        .show("#form-more", !more.is_empty())
        .list("#form-more-fields", more)
        .show("#form-round", is_toml)
        .list("#round-fields", part(&form.round, false))
        .show("#round-more", !more_of_round.is_empty())
        .list("#round-more-fields", more_of_round)
        .show("#form-rules", is_toml)
        .list("#rules", rules.iter().enumerate().map(|(index, rule)| sentence(index, rule)))
        .text("#form-title", form::title(editor))
        .text("#form-note", say(form::note(editor)))
        .text_or_hide("#edit-path", editor.path_offer().map(say))
}

/// A rule, with a button that removes it.
fn sentence(index: usize, rule: &Sentence) -> View {
    let parts = rule.parts.iter().enumerate().map(|(at, part)| match part {
        Part::Words(words) => View::item("word-item", at).text("", words.clone()),
        Part::Blank(row) => View::item("blank-item", at)
            .with("", "data-path", row.path.clone())
            .list("", [control(row, 0)]),
    });
    let beyond = rule.parts.is_empty().then(|| strings::rule_at(rule.line));
    View::item("rule-item", index)
        .list("p", parts)
        .text_or_hide("button", beyond)
        .with("button", "data-value", rule.at.to_string())
        .with("[data-action=edit-unrule]", "data-value", index.to_string())
}

fn line(row: &Row) -> View {
    let count = if let FieldForm::Vector { .. } = row.form { 2 } else { 1 };
    let FieldWords { label, help, docs, .. } = &row.words;
    View::item("field-item", &row.path)
        .list(".set", (0..count).map(|at| control(row, at)))
        .with(".set", "class", if count == 2 { "set two" } else { "set" })
        .with("", "data-path", row.path.clone())
        .with("", "class", if row.values.is_some() { "field given" } else { "field" })
        .text("span", label.clone())
        .with("span", "title", *help)
        .show("small", !help.is_empty())
        .text("small span", *help)
        .with_or_without("a", "href", (!docs.is_empty()).then(|| docs.clone()))
}

fn control(row: &Row, at: usize) -> View {
    let value = row.values.as_ref().and_then(|values| values.get(at));
    let typed = Set::Typed(value.cloned().unwrap_or_default().into());
    let default = row.default.get(at).cloned();
    let item = |template| View::item(template, at).with("", "aria-label", row.words.label.clone());
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
        FieldForm::Whole { .. } if !row.names.is_empty() => {
            let numbers = row.names.iter().enumerate();
            let numbers = numbers.map(|(number, name)| option(&number.to_string(), name));
            return item("choice-item").list("", once(unset()).chain(numbers)).set("", typed);
        }
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
            let label = |at: usize, name| row.names.get(at).map_or(name, String::as_str);
            let names = names.iter().enumerate().map(|(at, name)| option(name, label(at, name)));
            let unset = row.names.is_empty().then(unset);
            return item("choice-item").list("", unset.into_iter().chain(names)).set("", typed);
        }
    };
    control.set("", typed).with_or_without("", "placeholder", default)
}

fn unset() -> View {
    option("", say("default"))
}

fn option(value: &str, label: &str) -> View {
    View::item("option-item", value).with("", "value", value.to_owned()).text("", label.to_owned())
}
