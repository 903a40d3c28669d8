//! Tests the scene editor with any text and any sequence of actions: it must never fail, all actions must be undone and
//! redone byte for byte, and every reported range must lie within the text.

use jostle_client_web::editor::drag::EditPointer;
use jostle_client_web::editor::form::Form;
use jostle_client_web::editor::form::sentence::sentences;
use jostle_client_web::editor::palette::Make;
use jostle_client_web::editor::sketch;
use jostle_client_web::editor::state::Editor;
use jostle_client_web::editor::update::EditorEvent;
use jostle_client_web::view::frame::Sketch;
use jostle_sim::Vec2;
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::{Config, RngSeed, TestRunner};
use std::fs;
use std::path::Path;

/// An action: its kind, and its position in thousandths of the world.
type Act = (u8, u16, u16);

fn texts() -> Vec<String> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["../../assets/scenes", "../scenes"].map(|path| here.join(path));
    let entries = folders.iter().flat_map(|path| fs::read_dir(path).expect("a folder of scenes"));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("a readable entry").path()).collect();
    paths.sort();
    let files = paths.iter().map(|path| fs::read(path).expect("a listed file"));
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    jostle_fuzz::corpus("scene").into_iter().chain(files).map(text).collect()
}

/// A text with some of its characters replaced by others.
fn changed(text: &str, changes: &[(Index, String)]) -> String {
    let mut text = text.to_owned();
    for (place, with) in changes {
        let at = text.floor_char_boundary(place.index(text.len() + 1));
        let end = text.ceil_char_boundary((at + with.len() % 3).min(text.len()));
        text.replace_range(at..end, with);
    }
    text
}

fn deed(editor: &Editor, (kind, x, y): Act) -> EditorEvent {
    let share = Vec2::new(f32::from(x % 1200), f32::from(y % 1200)) / 1000.0;
    let at = editor.doc.world() * (share - Vec2::splat(0.1));
    let (adds, free) = (x % 7 == 0, y % 5 == 0);
    let id = i32::from(x % 9 == 0);
    let hand = EditPointer { id, at, inside: kind != 200, reach: 4.0, step: 0.4, adds, free };
    let (make, _) = Make::ALL[usize::from(x) % Make::ALL.len()];
    match kind % 17 {
        0 | 1 => EditorEvent::Down(hand),
        2..=4 => EditorEvent::Moved(hand),
        5 | 6 => EditorEvent::Up(hand),
        7 => EditorEvent::Cancelled,
        8 => EditorEvent::Taken(make, id),
        9 => EditorEvent::Placed(make, at),
        10 => EditorEvent::Nudged { way: share, far: free },
        11 => EditorEvent::Duplicated,
        12 => EditorEvent::Deleted,
        13 => EditorEvent::Undone,
        14 => EditorEvent::Redone,
        15 => EditorEvent::Next { back: adds },
        _ => EditorEvent::SelectedAll,
    }
}

fn check(text: &str, acts: &[Act]) {
    let mut editor = Editor::open(text.to_owned(), None);
    let mut sketch = Sketch::default();
    for (number, &act) in acts.iter().enumerate() {
        let deed = deed(&editor, act);
        editor.update(number as f64 * 250.0, deed);
        sketch::draw(&editor, 0.4, &mut sketch);
    }
    editor.update(0.0, EditorEvent::Cancelled);
    editor.doc.check();
    if let Some(at) = editor.doc.error_bytes() {
        assert!(editor.text().get(at.clone()).is_some(), "{at:?}");
    }
    for piece in editor.selected() {
        assert!(editor.text().get(piece.bytes.clone()).is_some() || !editor.doc.is_toml);
    }
    Form::of(&editor);
    sentences(editor.text());
    while editor.can()[1] {
        editor.update(0.0, EditorEvent::Redone);
    }
    let last = editor.text().to_owned();
    while editor.can()[0] {
        editor.update(0.0, EditorEvent::Undone);
    }
    assert!(editor.text() == text, "undone to the first text");
    while editor.can()[1] {
        editor.update(0.0, EditorEvent::Redone);
    }
    assert!(editor.text() == last, "done again to the last");
}

#[test]
fn any_text_can_be_edited_and_undone() {
    let texts = texts();
    let config = Config {
        cases: crate::cases(2000) as u32,
        rng_seed: RngSeed::Fixed(0x4544_4954),
        failure_persistence: None,
        ..Config::default()
    };
    let piece = "[\\PC]{0,3}|\\n|\\r\\n|\\[\\[|\\]|# |\"|'''|\\{|\\}|=|1e39|-";
    let changes = prop::collection::vec((any::<Index>(), piece), 0..4);
    let one = (any::<Index>(), changes, prop::collection::vec(any::<Act>(), 0..16));
    TestRunner::new(config)
        .run(&one, |(place, changes, acts)| {
            check(&changed(place.get::<String>(&texts), &changes), &acts);
            Ok(())
        })
        .unwrap_or_else(|error| panic!("{error}"));
}
