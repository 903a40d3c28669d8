use super::drag::EditPointer;
use super::palette::{self, Make};
use super::state::Editor;
use super::text::{List, PieceId, ScenePieces};
use super::update::EditorEvent;
use super::{edit, field, form::row::quoted, templates};
use jostle_game::Scene;
use jostle_game::scene::FieldForm;
use jostle_sim::{Rng, Vec2};
use std::collections::BTreeSet;

mod forms;
mod pieces;
mod random;

/// A scene with comments everywhere, and lists of both kinds.
const YARD: &str = r#"# The yard.
title = "Yard"   # its name
size = [320, 180]
tools = ["hold"]
groups = ["hero", "platform", "block"] # who meets whom
pairs = [["block", "platform"], ["hero", "platform"]]

# The floor.
[[bodies]]
kind = "wall"
position = [ 160, 2.50 ] # its middle
size = [320, 5]

# A crate,
# twice as high as wide.
[[bodies]]
kind = "block" # wood
position = [40, 15]
size = [10, 20]

# Not of the crate.

[hero]
spawns = [[20, 20], [30, 20]] # left
# The last line.
"#;

fn hand(x: f32, y: f32) -> EditPointer {
    EditPointer {
        id: 1,
        at: Vec2::new(x, y),
        inside: true,
        reach: 3.0,
        step: 0.25,
        adds: false,
        free: false,
    }
}

fn yard() -> Editor {
    let editor = Editor::open(YARD.to_owned(), Some("yard.toml"));
    assert_eq!(editor.doc.error, None);
    editor
}

fn act(editor: &mut Editor, deeds: impl IntoIterator<Item = EditorEvent>) {
    deeds.into_iter().for_each(|deed| editor.update(0.0, deed));
    editor.doc.check();
}

fn drag(editor: &mut Editor, from: EditPointer, to: EditPointer) {
    act(editor, [EditorEvent::Down(from), EditorEvent::Moved(to), EditorEvent::Up(to)]);
}

/// The lines in which two texts with equal line counts differ.
fn differing(before: &str, after: &str) -> Vec<(String, String)> {
    assert_eq!(before.lines().count(), after.lines().count());
    let pairs = before.lines().zip(after.lines()).filter(|(a, b)| a != b);
    pairs.map(|(a, b)| (a.to_owned(), b.to_owned())).collect()
}

const CRATE: PieceId = PieceId { list: List::Bodies, index: 1 };

#[test]
fn pieces_are_found_with_their_bytes() {
    let editor = yard();
    let bytes = |list, index| {
        let piece = editor.doc.sheet.piece(PieceId { list, index }).expect("a piece");
        &YARD[piece.bytes.clone()]
    };
    let crate_text = "# A crate,\n# twice as high as wide.\n[[bodies]]\nkind = \"block\" # wood\n\
                      position = [40, 15]\nsize = [10, 20]\n";
    assert_eq!(bytes(List::Bodies, 1), crate_text);
    assert_eq!(bytes(List::Spawns, 1), "[30, 20]");
    assert_eq!(editor.doc.sheet.pieces.len(), 4);
    assert_eq!(editor.doc.sheet.world, Some(Vec2::new(320.0, 180.0)));
}

#[test]
fn a_drag_replaces_the_bytes_of_a_position() {
    let mut editor = yard();
    // The moved piece is not near any other piece's edges, so it snaps to the unit.
    drag(&mut editor, hand(40.0, 15.0), hand(101.3, 60.4));
    let changed = differing(YARD, editor.text());
    assert_eq!(changed, [("position = [40, 15]".into(), "position = [101, 60]".into())]);
    assert_eq!(editor.selection, [CRATE]);
    // Only one coordinate changes.
    drag(&mut editor, hand(101.0, 60.0), hand(110.0, 60.1));
    assert!(editor.text().contains("position = [110, 60]"), "{}", editor.text());
}

#[test]
fn edges_meet_those_of_others_unless_snapping_is_off() {
    let mut editor = yard();
    drag(&mut editor, hand(40.0, 15.0), hand(40.0, 16.2));
    assert_eq!(editor.text(), YARD, "it stands on the floor again: 5 and 10 up");
    drag(&mut editor, hand(40.0, 15.0), EditPointer { free: true, ..hand(40.0, 17.3) });
    assert!(editor.text().contains("position = [40, 17.3]"), "{}", editor.text());
    // A second finger has the same effect as Alt.
    let second = EditPointer { id: 2, ..hand(0.0, 0.0) };
    let mut editor = yard();
    act(&mut editor, [EditorEvent::Down(hand(40.0, 15.0)), EditorEvent::Down(second)]);
    act(&mut editor, [EditorEvent::Moved(hand(40.0, 16.3)), EditorEvent::Up(hand(40.0, 16.3))]);
    assert!(editor.text().contains("position = [40, 16.3]"), "{}", editor.text());
}

#[test]
fn handles_size_a_box_and_the_opposite_edge_stays() {
    let mut editor = yard();
    editor.update(0.0, EditorEvent::Down(hand(40.0, 15.0)));
    editor.update(0.0, EditorEvent::Up(hand(40.0, 15.0)));
    drag(&mut editor, hand(45.0, 15.0), hand(57.0, 15.0));
    let changed = differing(YARD, editor.text());
    assert_eq!(
        changed,
        [
            ("position = [40, 15]".into(), "position = [46, 15]".to_owned()),
            ("size = [10, 20]".into(), "size = [22, 20]".to_owned()),
        ]
    );
}

#[test]
fn a_deleted_piece_takes_its_own_comments_along_and_no_others() {
    let mut editor = yard();
    editor.select(vec![CRATE]);
    act(&mut editor, [EditorEvent::Deleted]);
    let text = editor.text();
    assert!(!text.contains("crate,") && !text.contains("wood"), "{text}");
    for comment in ["# The yard.", "# The floor.", "# Not of the crate.", "# The last line."] {
        assert!(text.contains(comment), "{comment} is gone: {text}");
    }
    editor.select(vec![PieceId { list: List::Spawns, index: 0 }]);
    act(&mut editor, [EditorEvent::Deleted]);
    assert!(editor.text().contains("spawns = [[30, 20]] # left"), "{}", editor.text());
    act(&mut editor, [EditorEvent::Undone, EditorEvent::Undone]);
    assert_eq!(editor.text(), YARD);
    act(&mut editor, [EditorEvent::Redone]);
    assert!(!editor.text().contains("crate,"));
}

#[test]
fn a_copy_stands_right_after_its_original() {
    let mut editor = yard();
    editor.select(vec![CRATE]);
    act(&mut editor, [EditorEvent::Duplicated]);
    assert_eq!(editor.doc.error, None);
    assert!(editor.text().contains("position = [44, 19]\nsize = [10, 20]\n\n# Not of"));
    assert_eq!(editor.selection, [PieceId { index: 2, ..CRATE }]);
    act(&mut editor, [EditorEvent::Deleted]);
    assert_eq!(editor.text(), YARD, "what was added goes to the last byte");
}

#[test]
fn nudges_in_a_row_are_one_step() {
    let mut editor = yard();
    editor.select(vec![CRATE]);
    let right = |far| EditorEvent::Nudged { way: Vec2::X, far };
    editor.update(0.0, right(false));
    editor.update(100.0, right(true));
    assert!(editor.text().contains("position = [51, 15]"));
    editor.update(5000.0, right(false));
    editor.update(5000.0, EditorEvent::Undone);
    assert!(editor.text().contains("position = [51, 15]"));
    editor.update(5000.0, EditorEvent::Undone);
    assert_eq!(editor.text(), YARD);
}

#[test]
fn an_empty_text_becomes_a_scene_with_each_piece_of_the_palette() {
    for (make, name) in Make::ALL {
        let mut editor = Editor::open(String::new(), None);
        assert!(editor.doc.error.is_some(), "nothing is no scene");
        act(&mut editor, [EditorEvent::Placed(make, Vec2::new(100.0, 90.0))]);
        assert_eq!(editor.doc.error, None, "{name}: {}", editor.text());
        assert_eq!(editor.selection.len(), 1, "{name}");
        act(&mut editor, [EditorEvent::Undone]);
        assert_eq!(editor.text(), "", "{name}");
    }
    // Also add all pieces to the same text, one after another.
    let mut editor = Editor::open(String::new(), None);
    for (index, (make, _)) in Make::ALL.into_iter().enumerate() {
        let at = [25.0 + 28.0 * (index % 10) as f32, 60.0 + 60.0 * (index / 10) as f32];
        act(&mut editor, [EditorEvent::Placed(make, Vec2::from(at))]);
    }
    assert_eq!(editor.doc.error, None, "{}", editor.text());
    let room = ScenePieces::read(templates::EMPTY).expect("TOML").pieces.len();
    // A flag comes with its home, and with a zone that marks it.
    assert_eq!(editor.doc.sheet.pieces.len(), room + Make::ALL.len() + 2);
}

#[test]
fn every_shipped_scene_takes_every_piece_of_the_palette() {
    for scene in Scene::built_in() {
        for (make, name) in Make::ALL {
            let at = scene.size * 0.5;
            let made = palette::added(&scene.source, make, at);
            let (text, id) = made.unwrap_or_else(|| panic!("{} {name}: no TOML", scene.name));
            let sheet = ScenePieces::read(&text).expect("it still is");
            assert!(sheet.piece(id).is_some_and(|piece| piece.place.is_some()), "{}", scene.name);
            let Err(error) = Scene::parse("scene.toml", &text) else { continue };
            // A piece may overlap another one or exceed a limit, but no required field may be missing.
            let told = error.to_string();
            let known = ["inside", "entries", "round", "walk", "found 2 zones", "limits"];
            assert!(known.iter().any(|word| told.contains(word)), "{} {name}: {told}", scene.name);
        }
    }
}

#[test]
fn a_piece_is_dragged_out_of_the_palette_as_one_step() {
    let mut editor = yard();
    let outside = EditPointer { inside: false, ..hand(-50.0, 60.0) };
    act(&mut editor, [EditorEvent::Taken(Make::Ball, 1), EditorEvent::Moved(hand(200.2, 90.4))]);
    assert!(editor.text().contains("position = [200, 90]"), "{}", editor.text());
    act(&mut editor, [EditorEvent::Moved(outside)]);
    assert_eq!(editor.text(), YARD, "back over the palette it is gone");
    act(&mut editor, [EditorEvent::Moved(hand(210.0, 92.0)), EditorEvent::Up(hand(210.0, 92.0))]);
    assert_eq!(editor.doc.error, None);
    assert_eq!(editor.doc.sheet.pieces.len(), 5);
    act(&mut editor, [EditorEvent::Undone]);
    assert_eq!(editor.text(), YARD);
}

#[test]
fn a_text_with_an_error_keeps_the_last_pieces_and_is_not_dragged() {
    let mut editor = yard();
    let broken = YARD.replace("kind = \"wall\"", "kind = ");
    act(&mut editor, [EditorEvent::Typed(broken.clone())]);
    assert!(!editor.doc.is_toml && editor.doc.scene.is_some());
    assert_eq!(editor.doc.sheet.pieces.len(), 4);
    drag(&mut editor, hand(40.0, 15.0), hand(101.3, 60.4));
    act(&mut editor, [EditorEvent::Deleted, EditorEvent::Duplicated]);
    assert_eq!(editor.text(), broken);
}

/// The beginnings of the scene parser's messages about allowed values.
const RANGES: [&str; 6] =
    ["a number ", "a whole number ", "[x, y], each ", "true or false", "one of ", "a text of "];

#[test]
fn every_field_of_a_form_is_accepted_at_both_ends_of_its_range() {
    let mut tried = BTreeSet::new();
    for scene in Scene::built_in() {
        for field in Scene::fields(&scene.source) {
            // Test one entry of each list.
            let kind = field.path.replace(|c: char| c.is_ascii_digit(), "");
            if !tried.insert((kind, field.given.is_some())) {
                continue;
            }
            for value in ends(&field.form) {
                let splice = field::set(&scene.source, &field.path, &value);
                let splice = splice.unwrap_or_else(|| panic!("no place for {}", field.path));
                let text = edit::apply(&scene.source, vec![splice]);
                let Err(error) = Scene::parse("scene.toml", &text) else { continue };
                // Two fields may conflict, but each must be known, of the right type and in range.
                let told = error.to_string();
                let is_own = error.field.starts_with(&field.path);
                let is_out = RANGES.iter().any(|words| error.allowed.starts_with(words));
                assert!(!(is_own && is_out), "{}: {told}", scene.name);
                assert!(!told.contains("unknown field"), "{}: {told}", scene.name);
                assert_ne!(error.allowed, "TOML", "{}: {told}", scene.name);
            }
        }
    }
    assert!(tried.len() > 150, "{}", tried.len());
}

/// Values at both ends of a field's range.
fn ends(form: &FieldForm) -> Vec<String> {
    match form {
        FieldForm::Number { range: [low, high], above, .. } => {
            let low = if *above { low.next_up().max(1e-6) } else { *low };
            vec![low.to_string(), high.to_string()]
        }
        FieldForm::Whole { range, .. } => range.map(|end| end.to_string()).to_vec(),
        FieldForm::Vector { range, .. } => range.map(|end| format!("[{end}, {end}]")).to_vec(),
        FieldForm::Truth { .. } => vec!["true".into(), "false".into()],
        FieldForm::Text { chars_max } => {
            vec![quoted("x"), quoted(&"x".repeat(*chars_max))]
        }
        FieldForm::Choice { names } => names.iter().map(|name| quoted(name)).collect(),
    }
}

#[test]
fn a_form_sets_adds_and_removes_fields() {
    let mut editor = yard();
    editor.select(vec![CRATE]);
    editor.set_field(0.0, "bodies[1].mass", &["2.5".into()]);
    assert!(editor.text().contains("size = [10, 20]\nmass = 2.5\n\n# Not"), "{}", editor.text());
    editor.set_field(0.0, "bodies[1].size", &["12".into(), String::new()]);
    assert!(editor.text().contains("size = [12, 20]"), "{}", editor.text());
    editor.set_field(0.0, "bodies[1].mass", &[String::new()]);
    editor.set_field(0.0, "bodies[1].size", &["10".into(), "20".into()]);
    assert_eq!(editor.text(), YARD);
    editor.select(Vec::new());
    editor.set_field(0.0, "title", &["A \"new\" yard".into()]);
    assert!(editor.text().contains("title = \"A \\\"new\\\" yard\"   # its name"));
    editor.set_field(0.0, "limits.players", &["4".into()]);
    assert!(editor.text().ends_with("# The last line.\n\n[limits]\nplayers = 4\n"));
    editor.doc.check();
    assert_eq!(editor.doc.error, None);
}

#[test]
fn an_error_is_that_of_the_check() {
    let mut editor = yard();
    let wrong = YARD.replace("[10, 20]", "[10, -2]");
    act(&mut editor, [EditorEvent::Typed(wrong.clone())]);
    let checked = Scene::parse("yard.toml", &wrong).expect_err("a negative size");
    assert_eq!(editor.doc.error.as_ref().map(ToString::to_string), Some(checked.to_string()));
    assert!(checked.to_string().starts_with("yard.toml:19: bodies[1].size"), "{checked}");
}

#[test]
fn typing_is_undone_word_by_word() {
    let mut editor = Editor::open(String::new(), None);
    let mut text = String::new();
    for (index, letter) in "title = \"A b\"".chars().enumerate() {
        text.push(letter);
        editor.update(50.0 * index as f64, EditorEvent::Typed(text.clone()));
    }
    let mut steps = Vec::new();
    while editor.can()[0] {
        editor.update(9000.0, EditorEvent::Undone);
        steps.push(editor.text().to_owned());
    }
    assert_eq!(steps, ["title = \"A ", "title = ", "title ", ""]);
}

#[test]
fn a_box_and_shift_select_many_and_tab_goes_through_all() {
    let mut editor = yard();
    drag(&mut editor, hand(10.0, 40.0), hand(60.0, 10.0));
    assert_eq!(editor.selection.len(), 3, "the crate and both spawns");
    let click = EditPointer { adds: true, ..hand(40.0, 15.0) };
    act(&mut editor, [EditorEvent::Down(click), EditorEvent::Up(click)]);
    assert_eq!(editor.selection.len(), 2);
    act(&mut editor, [EditorEvent::Deselected]);
    let mut seen = Vec::new();
    for _ in 0..editor.doc.sheet.pieces.len() {
        act(&mut editor, [EditorEvent::Next { back: false }]);
        seen.push(editor.said.clone());
    }
    assert_eq!(
        seen,
        ["wall 1 at 160, 2.5", "block 2 at 40, 15", "spawn 1 at 20, 20", "spawn 2 at 30, 20"]
    );
}

/// A yard whose crate has a path with these points.
fn with_path(points: &str) -> Editor {
    let text =
        YARD.replace("position = [40, 15]", &format!("path = {points} # its way\nperiod = 4"));
    let editor = Editor::open(text, Some("yard.toml"));
    assert_eq!(editor.doc.error, None);
    editor
}

/// Presses twice without moving.
fn double(editor: &mut Editor, x: f32, y: f32) {
    for ms in [0.0, 90.0, 200.0, 290.0] {
        let deed = if ms % 20.0 == 0.0 { EditorEvent::Down } else { EditorEvent::Up };
        editor.update(ms, deed(hand(x, y)));
    }
}

#[test]
fn a_body_gets_a_path_where_it_stands_and_the_path_more_points() {
    let mut editor = yard();
    editor.select(vec![PieceId { list: List::Bodies, index: 1 }]);
    act(&mut editor, [EditorEvent::PathExtended]);
    editor.doc.check();
    assert_eq!(editor.doc.error, None, "{}", editor.text());
    let wanted = YARD
        .replace("position = [40, 15]", "path = [[10, 15], [70, 15]]")
        .replace("size = [10, 20]\n", "size = [10, 20]\nperiod = 4\n");
    assert_eq!(editor.text(), wanted);
    act(&mut editor, [EditorEvent::PathExtended]);
    assert_eq!(editor.text(), wanted.replace("[10, 15], [", "[10, 15], [40, 15], ["));
    act(&mut editor, [EditorEvent::Undone, EditorEvent::Undone]);
    assert_eq!(editor.text(), YARD);
    // A body that moved freely now moves only along its path.
    let text = YARD.replace("[40, 15]", "[40, 15]\nvelocity = [3, 0]\nmotion = \"dynamic\"");
    let mut editor = Editor::open(text, None);
    editor.select(vec![PieceId { list: List::Bodies, index: 1 }]);
    act(&mut editor, [EditorEvent::PathExtended]);
    editor.doc.check();
    assert_eq!((editor.text(), &editor.doc.error), (&*wanted, &None));
}

#[test]
fn two_presses_add_a_point_to_a_path_and_remove_one() {
    let mut editor = with_path("[[40, 15], [100, 15]]");
    let before = editor.text().to_owned();
    double(&mut editor, 70.0, 15.4);
    assert_eq!(editor.text(), before.replace("15], [100", "15], [70, 15], [100"));
    assert!(editor.path_offer().is_some(), "it is selected");
    double(&mut editor, 70.0, 15.0);
    assert_eq!(editor.text(), before);
    // The last two points cannot be removed.
    double(&mut editor, 100.0, 15.0);
    assert_eq!(editor.text(), before);
    act(&mut editor, [EditorEvent::Undone, EditorEvent::Undone]);
    assert_eq!(editor.text(), before);
}

#[test]
fn a_press_on_a_path_selects_its_body_and_one_elsewhere_none() {
    let mut editor = with_path("[[40, 15], [100, 75]]");
    act(&mut editor, [EditorEvent::Down(hand(70.0, 45.5)), EditorEvent::Up(hand(70.0, 45.5))]);
    assert_eq!(editor.selection, [PieceId { list: List::Bodies, index: 1 }]);
    assert_eq!(editor.path_offer(), Some(super::strings::ADD_POINT));
    act(&mut editor, [EditorEvent::Down(hand(70.0, 60.0)), EditorEvent::Up(hand(70.0, 60.0))]);
    assert_eq!((editor.selection.len(), editor.path_offer()), (0, None));
}

#[test]
fn neighbours_in_a_list_are_removed_together() {
    use super::edit::{Splice, apply, item_bytes};
    let text = "spawns = [[60, 60], [90, 30], [60, 120]]";
    let item = |entry: &str| {
        let at = text.find(entry).expect("an entry");
        item_bytes(text, &(at..at + entry.len()))
    };
    let removed = |entries: &[&str]| {
        apply(text, entries.iter().map(|entry| Splice::remove(item(entry))).collect())
    };
    assert_eq!(removed(&["[60, 60]", "[90, 30]"]), "spawns = [ [60, 120]]");
    assert_eq!(removed(&["[60, 60]"]), "spawns = [[90, 30], [60, 120]]");
}

#[test]
fn an_entry_is_added_after_a_comment_with_a_comma_before_it_or_none() {
    use super::edit::apply;
    use super::field::push;
    for (list, added) in [
        ("[\n  \"a\", # one\n]", "[\n  \"a\", # one\n  \"b\",\n]"),
        ("[\n  \"a\" # one,\n]", "[\n  \"a\" # one,\n, \"b\"\n]"),
        ("[\"a,#\"]", "[\"a,#\", \"b\"]"),
    ] {
        let text = format!("groups = {list}\n");
        let splice = push(&text, "groups", "\"b\"").expect("a place");
        assert_eq!(apply(&text, vec![splice]), format!("groups = {added}\n"), "{list}");
    }
}
