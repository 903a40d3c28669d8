//! Pieces that carry rules, and templates.

use super::*;
use crate::editor::history::changed;
use crate::editor::templates;
use jostle_game::{Kind, RoundPhase, Seat, Side};
use jostle_protocol::Appearance;
use jostle_room::Room;
use std::sync::Arc;

/// Plays a text with a player who does nothing, and with bots, for ten seconds.
fn play(text: &str) -> Room {
    let scene = Scene::parse("scene.toml", text).unwrap_or_else(|error| panic!("{error}: {text}"));
    let mut room = Room::filled("test", Arc::new(scene), 1, 4);
    let player = Appearance { name: "Ann".into(), color: 0 };
    room.join(player, None).expect("a seat");
    for _ in 0..600 {
        room.tick();
        if room.game().round().is_some_and(|round| round.phase == RoundPhase::Over) {
            break;
        }
    }
    room
}

/// Places pieces of the palette, by their names, into the empty template.
fn build(pieces: &[(&str, [f32; 2])]) -> Editor {
    let mut editor = Editor::open(templates::EMPTY.to_owned(), None);
    for (name, at) in pieces {
        let make = Make::named(name).expect("a piece");
        act(&mut editor, [EditorEvent::Placed(make, Vec2::from(*at))]);
        assert_eq!(editor.doc.error, None, "{name}: {}", editor.text());
    }
    editor
}

fn delete(editor: &mut Editor, list: List, index: usize) {
    editor.select(vec![PieceId { list, index }]);
    act(editor, [EditorEvent::Deleted]);
    assert_eq!(editor.doc.error, None, "{}", editor.text());
}

#[test]
fn every_template_is_a_game_with_a_floor_walls_and_bots() {
    for (name, text) in templates::ALL {
        let room = play(text);
        let scene = room.scene();
        let walls = scene.bodies.iter().filter(|placed| placed.kind == Kind::Wall).count();
        assert!(walls >= 3, "{name}");
        assert!(room.bots() > 0, "{name}");
        assert_eq!(scene.rules.round.is_some(), name != "empty", "{name}");
        assert_eq!(templates::named(name), Some(text));
    }
}

#[test]
fn each_piece_with_rules_works_alone_and_twice() {
    for name in ["goal", "lava", "checkpoint", "home", "finish"] {
        let mut editor = build(&[(name, [100.0, 60.0])]);
        play(editor.text());
        assert_eq!(
            editor.doc.short_name(editor.selected().next().expect("it")),
            format!("{name} 1")
        );
        act(&mut editor, [EditorEvent::Undone]);
        assert_eq!(editor.text(), templates::EMPTY);
        play(build(&[(name, [60.0, 60.0]), (name, [260.0, 60.0])]).text());
    }
}

#[test]
fn a_ball_in_a_goal_scores_for_the_other_team() {
    let goals = [("goal", [40.0, 24.0]), ("goal", [280.0, 24.0]), ("ball", [280.0, 100.0])];
    let editor = build(&goals);
    let room = play(editor.text());
    let round = room.snapshot().round.clone().expect("a round");
    let points: Vec<i32> = round.teams.iter().map(|team| team.score).collect();
    assert!(points[0] > 0 && points[1] == 0, "{points:?}");
}

#[test]
fn a_bot_runs_to_the_finish_and_wins() {
    let room = play(build(&[("finish", [120.0, 34.0])]).text());
    let round = room.snapshot().round.clone().expect("a round");
    assert_eq!((round.phase, round.winners.len()), (RoundPhase::Over, 1));
    assert_ne!(round.winners, [Side::Player(Seat(0))], "who does nothing does not win");
}

#[test]
fn a_flag_brought_home_is_a_point_for_its_team() {
    let editor = build(&[("home", [60.0, 60.0]), ("home", [260.0, 60.0])]);
    let text = editor.text();
    for (home, team, flag) in [(1, "orange", 2), (2, "sky", 1)] {
        let rule =
            format!("on = \"home-{home}\"\nscore = 1\nto = \"{team}\"\nreset = [\"flag-{flag}\"]");
        assert_eq!(text.matches(&rule).count(), 1, "{text}");
    }
    assert_eq!((text.matches("[round]").count(), text.matches("[[teams]]").count()), (1, 2));
}

#[test]
fn a_deleted_piece_takes_its_rules_along() {
    let mut editor =
        build(&[("goal", [40.0, 24.0]), ("lava", [150.0, 24.0]), ("goal", [280.0, 24.0])]);
    delete(&mut editor, List::Zones, 0);
    delete(&mut editor, List::Zones, 0);
    let text = editor.text();
    assert!(!text.contains("goal-1") && !text.contains("lava-1"), "{text}");
    assert_eq!((text.matches("[[rules]]").count(), text.matches("goal-2").count()), (1, 2));
    // A new goal is again that of the first team.
    act(&mut editor, [EditorEvent::Placed(Make::Goal, Vec2::new(40.0, 24.0))]);
    assert!(
        editor.text().contains("enter = \"goal-1\"\nscore = 1\nto = \"sky\""),
        "{}",
        editor.text()
    );
    // A flag takes the mark along that follows it, and the rules that would bring it back.
    let mut editor = build(&[("home", [60.0, 60.0]), ("home", [260.0, 60.0])]);
    delete(&mut editor, List::Bodies, 3);
    assert!(!editor.text().contains("mark-1") && !editor.text().contains("[\"flag-1\"]\n\n"));
    play(editor.text());
}

#[test]
fn whatever_is_deleted_from_a_template_it_remains_a_scene() {
    for (name, text) in templates::ALL {
        let editor = Editor::open(text.to_owned(), None);
        for piece in editor.doc.sheet.pieces.iter().filter(|piece| piece.id.list == List::Zones) {
            let mut editor = Editor::open(text.to_owned(), None);
            delete(&mut editor, List::Zones, piece.id.index);
            act(&mut editor, [EditorEvent::Undone]);
            assert_eq!(editor.text(), text, "{name}");
        }
        // All zones, one after the other.
        let mut editor = Editor::open(text.to_owned(), None);
        for _ in 0..editor.doc.sheet.pieces.iter().filter(|p| p.id.list == List::Zones).count() {
            delete(&mut editor, List::Zones, 0);
        }
        play(editor.text());
    }
}

#[test]
fn a_copy_has_the_rules_of_its_original() {
    let mut editor = build(&[("lava", [100.0, 24.0])]);
    act(&mut editor, [EditorEvent::Duplicated]);
    assert_eq!(editor.doc.error, None);
    assert!(
        editor.text().ends_with("enter = \"lava-2\"\nsplash = \"explosion\"\nback = 0.5\n"),
        "{}",
        editor.text()
    );
    let mut editor = Editor::open(templates::named("race").expect("one").to_owned(), None);
    editor.select(vec![PieceId { list: List::Zones, index: 0 }]);
    act(&mut editor, [EditorEvent::Duplicated]);
    assert_eq!(editor.doc.error, None);
    assert!(
        editor.text().contains("\"finish-1\", \"checkpoint-4\"]\ncheckpoint = true"),
        "{}",
        editor.text()
    );
}

#[test]
fn an_empty_text_has_no_scene_and_one_with_an_error_the_last() {
    let mut editor = build(&[("ball", [100.0, 60.0])]);
    act(&mut editor, [EditorEvent::Typed("size = \n".to_owned())]);
    assert!(editor.doc.scene.is_some());
    act(&mut editor, [EditorEvent::Typed(String::new())]);
    assert!(editor.doc.scene.is_none() && editor.doc.sheet.pieces.is_empty());
    act(&mut editor, [EditorEvent::Undone]);
    act(&mut editor, [EditorEvent::Undone]);
    assert!(editor.doc.scene.is_some_and(|scene| scene.bodies.len() == 4));
}

#[test]
fn the_changed_bytes_of_a_text_are_known() {
    assert_eq!(changed("one three", "one two three"), 5..9, "\"wo t\"");
    assert_eq!(changed("one two three", "one three"), 5..5);
    assert_eq!(changed("a = \u{e9}", "a = \u{e8}"), 4..6, "whole letters");
    assert_eq!(changed("same", "same"), 0..0);
}
