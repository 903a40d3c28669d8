//! The form's box for rounds and teams.

use super::row::Row;
use crate::editor::edit::apply;
use crate::editor::field;
use crate::editor::field_words::FieldWords;
use crate::editor::strings;
use crate::editor::tables;
use crate::language::say;
use jostle_game::scene::{FieldForm, TEAMS_MAX};

/// Length of a round in a scene that had none, seconds.
const TIME: &str = "120";
/// More lines than the fields of a round can take, if each is written as `round.NAME`.
const LINES_MAX: usize = 16;

/// The switch for rounds, and if it is on, the fields of the round and the number of teams.
pub fn rows(text: &str, fields: Vec<Row>) -> Vec<Row> {
    let is_on = field::is_given(text, "round");
    let own = |path: &str, label: &str, help: &'static str, form, value: String| Row {
        path: path.to_owned(),
        words: FieldWords {
            label: say(label).to_owned(),
            help: say(help),
            ..FieldWords::default()
        },
        form,
        values: Some(vec![value]),
        default: Vec::new(),
        names: Vec::new(),
    };
    let truth = FieldForm::Truth { default: false };
    let switch = own("round", strings::ROUNDS, strings::ABOUT_ROUNDS, truth, is_on.to_string());
    let mut rows = vec![switch];
    if is_on {
        rows.extend(fields);
        let form = FieldForm::Whole { range: [0, TEAMS_MAX as i64], default: 0 };
        let count = tables::count(text, "teams").to_string();
        rows.push(own("teams", strings::TEAMS, strings::ABOUT_TEAMS, form, count));
    }
    rows
}

/// Adds a round, or removes it.
pub fn switch(text: &str, on: bool) -> Option<String> {
    if on {
        return Some(apply(text, vec![field::set(text, "round.time", TIME)?]));
    }
    if let Some(text) = tables::removed(text, "round", None) {
        return Some(text);
    }
    let mut text = text.to_owned();
    for _ in 0..LINES_MAX {
        let Some(splice) = field::unset(&text, "round") else { break };
        text = apply(&text, vec![splice]);
    }
    Some(text)
}

/// Adds teams after the last one, named after the players' colours, or removes the last ones.
pub fn set_teams(text: &str, count: usize) -> Option<String> {
    let mut text = tables::with_teams(text.to_owned(), count)?;
    for team in (count..tables::count(&text, "teams")).rev() {
        text = tables::removed(&text, "teams", Some(team))?;
    }
    Some(text)
}
