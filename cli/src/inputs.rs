//! The input file for `jostle run`: JSON lines, each containing one seat's input from a given tick on.

use crate::output::{Failure, OrFail};
use jostle_game::{Buttons, Input, Seat};
use jostle_sim::Vec2;
use serde::Deserialize;
use std::path::Path;

/// The buttons' names in an input file.
pub const BUTTONS: [(&str, Buttons); 12] = [
    ("up", Buttons::UP),
    ("left", Buttons::LEFT),
    ("down", Buttons::DOWN),
    ("right", Buttons::RIGHT),
    ("fire", Buttons::FIRE),
    ("make", Buttons::MAKE),
    ("hold", Buttons::HOLD),
    ("agitate", Buttons::AGITATE),
    ("clear", Buttons::CLEAR),
    ("pick-hero", Buttons::PICK_HERO),
    ("pick-minion", Buttons::PICK_MINION),
    ("pick-platform", Buttons::PICK_PLATFORM),
];

const LINE_ALLOWED: &str = r#"{"tick":60,"seat":0,"buttons":["right"],"pointer":[100,50]}"#;

/// All seats' inputs, tick by tick.
#[derive(Debug, Default)]
pub struct Inputs {
    /// Sorted by tick; lines for the same tick stay in file order.
    changes: Vec<InputChange>,
    next: usize,
    /// Each seat's current input, in seat order.
    held: Vec<(Seat, Input)>,
}

#[derive(Debug, PartialEq)]
struct InputChange {
    tick: u32,
    seat: Seat,
    input: Input,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    tick: u32,
    #[serde(default)]
    seat: u16,
    #[serde(default)]
    buttons: Vec<String>,
    pointer: Option<[f32; 2]>,
}

impl Inputs {
    /// Seat 0 with no input.
    pub fn none() -> Inputs {
        Inputs { held: vec![(Seat(0), Input::default())], ..Inputs::default() }
    }

    /// Reads a file. All seats from 0 up to the highest one mentioned take part from the start.
    pub fn read(path: &Path, seats_max: u16) -> Result<Inputs, Failure> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path).or_usage(&file)?;
        Inputs::parse(&file, &text, seats_max)
    }

    fn parse(file: &str, text: &str, seats_max: u16) -> Result<Inputs, Failure> {
        let mut inputs = Inputs::none();
        for (index, line) in text.lines().enumerate() {
            if line.trim().is_empty() {
                continue;
            }
            let change = parse_line(line, seats_max);
            inputs.changes.push(change.or_check(format_args!("{file}:{}", index + 1))?);
        }
        inputs.changes.sort_by_key(|change| change.tick);
        let last = inputs.changes.iter().map(|change| change.seat.0).max().unwrap_or(0);
        inputs.held = (0..=last).map(|seat| (Seat(seat), Input::default())).collect();
        Ok(inputs)
    }

    /// The seats that take part.
    pub fn seats(&self) -> impl Iterator<Item = Seat> + '_ {
        self.held.iter().map(|(seat, _)| *seat)
    }

    /// Every seat's input in a tick. Must be called with ticks in increasing order.
    pub fn at(&mut self, tick: u32) -> &[(Seat, Input)] {
        while let Some(change) = self.changes.get(self.next)
            && change.tick <= tick
        {
            self.held[usize::from(change.seat.0)].1 = change.input;
            self.next += 1;
        }
        &self.held
    }
}

fn parse_line(line: &str, seats_max: u16) -> Result<InputChange, String> {
    let line: Line = serde_json::from_str(line)
        .map_err(|error| format!("line: found {error}; allowed: {LINE_ALLOWED}"))?;
    if line.seat >= seats_max {
        let last = seats_max.saturating_sub(1);
        return Err(format!("seat: found {}; allowed: 0 to {last}", line.seat));
    }
    let mut buttons = Buttons::default();
    for name in &line.buttons {
        buttons.0 |= button(name)?.0;
    }
    let pointer = line.pointer.map(|[x, y]| Vec2::new(x, y));
    if let Some(pointer) = pointer
        && !pointer.is_finite()
    {
        return Err(format!("pointer: found {pointer}; allowed: two finite numbers"));
    }
    Ok(InputChange { tick: line.tick, seat: Seat(line.seat), input: Input::new(buttons, pointer) })
}

fn button(name: &str) -> Result<Buttons, String> {
    match BUTTONS.iter().find(|(known, _)| *known == name) {
        Some((_, buttons)) => Ok(*buttons),
        None => {
            let names = BUTTONS.map(|(known, _)| known).join(", ");
            Err(format!("buttons: found {name:?}; allowed: {names}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Inputs, String> {
        Inputs::parse("keys.jsonl", text, 4).map_err(|failure| match failure {
            Failure::Check(text) | Failure::Usage(text) => text,
        })
    }

    #[test]
    fn inputs_are_held_until_changed() {
        let mut inputs = parse(
            "{\"tick\":3,\"seat\":1,\"buttons\":[\"right\",\"make\"],\"pointer\":[1.5,2]}\n\n\
             {\"tick\":5,\"seat\":1}\n{\"tick\":2,\"buttons\":[\"up\"]}\n",
        )
        .expect("a good file");
        let idle = Input::default();
        let up = Input::new(Buttons::UP, None);
        let make =
            Input::new(Buttons(Buttons::RIGHT.0 | Buttons::MAKE.0), Some(Vec2::new(1.5, 2.0)));
        let held: Vec<_> = (1..=5).map(|tick| inputs.at(tick).to_vec()).collect();
        let expected = [[idle, idle], [up, idle], [up, make], [up, make], [up, idle]];
        for (held, [first, second]) in held.iter().zip(expected) {
            assert_eq!(held, &[(Seat(0), first), (Seat(1), second)]);
        }
    }

    #[test]
    fn bad_lines_are_named() {
        for (text, part) in [
            ("{\"tick\":1,\"seat\":4}", "keys.jsonl:1: seat: found 4; allowed: 0 to 3"),
            (
                "{\"tick\":1}\n{\"tick\":1,\"buttons\":[\"jump\"]}",
                "keys.jsonl:2: buttons: found \"jump\"",
            ),
            ("{\"tick\":-1}", "keys.jsonl:1: line: found invalid value"),
            ("{\"tick\":1,\"pointer\":[1e60,0]}", "keys.jsonl:1: "),
            ("{\"tick\":1,\"keys\":[]}", "unknown field `keys`"),
            ("tick 1", "keys.jsonl:1: "),
        ] {
            let error = parse(text).expect_err(text);
            assert!(error.contains(part), "{error}");
        }
    }
}
