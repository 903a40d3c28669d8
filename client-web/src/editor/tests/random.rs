//! Random sequences of edits on every built-in scene.

use super::*;

const RUNS: u64 = 6;
const DEEDS: u32 = 30;

fn deed(editor: &Editor, rng: &mut Rng) -> EditorEvent {
    let size = editor.doc.world();
    let at = Vec2::new(rng.range(0.0, size.x), rng.range(0.0, size.y));
    let hand = EditPointer {
        free: rng.next_u32().is_multiple_of(4),
        adds: rng.next_u32().is_multiple_of(5),
        ..hand(at.x, at.y)
    };
    match rng.next_u32() % 16 {
        0..=2 => EditorEvent::Down(hand),
        3..=6 => EditorEvent::Moved(hand),
        7 | 8 => EditorEvent::Up(hand),
        9 => EditorEvent::Placed(Make::ALL[rng.next_u32() as usize % Make::ALL.len()].0, at),
        10 => EditorEvent::Taken(Make::ALL[rng.next_u32() as usize % Make::ALL.len()].0, 1),
        11 => EditorEvent::Nudged { way: Vec2::Y, far: rng.next_u32().is_multiple_of(2) },
        12 => EditorEvent::Duplicated,
        13 => EditorEvent::Next { back: rng.next_u32().is_multiple_of(2) },
        14 => EditorEvent::Undone,
        _ => EditorEvent::Redone,
    }
}

fn comments(text: &str) -> Vec<&str> {
    text.lines().filter_map(|line| line.split_once('#').map(|(_, comment)| comment)).collect()
}

/// Whether `few` is a subsequence of `many`.
fn are_kept(few: &[&str], many: &[&str]) -> bool {
    let mut rest = many.iter();
    few.iter().all(|one| rest.any(|other| other == one))
}

#[test]
fn any_edits_keep_comments_and_are_undone_to_the_first_text_and_redone_to_the_last() {
    for scene in Scene::built_in() {
        for run in 0..RUNS {
            let mut rng = Rng::new(run, 0);
            let mut editor = Editor::open(scene.source.clone(), None);
            for number in 0..DEEDS {
                let deed = deed(&editor, &mut rng);
                editor.update(f64::from(number) * 300.0, deed);
                assert!(editor.doc.is_toml, "{} {run}: {}", scene.name, editor.text());
                let kept = are_kept(&comments(&scene.source), &comments(editor.text()));
                assert!(kept, "{} {run}: comments are gone", scene.name);
            }
            editor.update(0.0, EditorEvent::Cancelled);
            let last = editor.text().to_owned();
            let ahead = std::iter::from_fn(|| {
                editor.can()[1].then(|| editor.update(0.0, EditorEvent::Redone))
            });
            let ahead = ahead.count();
            let newest = editor.text().to_owned();
            (0..ahead).for_each(|_| editor.update(0.0, EditorEvent::Undone));
            assert!(editor.text() == last, "{} {run}: undone", scene.name);
            while editor.can()[0] {
                editor.update(0.0, EditorEvent::Undone);
            }
            assert!(
                editor.text() == scene.source,
                "{} {run}: undone to the first text",
                scene.name
            );
            while editor.can()[1] {
                editor.update(0.0, EditorEvent::Redone);
            }
            assert!(editor.text() == newest, "{} {run}: redone to the last", scene.name);
        }
    }
}

#[test]
fn a_piece_that_is_added_and_deleted_leaves_every_byte_as_it_was() {
    for scene in Scene::built_in() {
        let (text, id) =
            palette::added(&scene.source, Make::Emitter, scene.size * 0.5).expect("TOML");
        let mut editor = Editor::open(text, None);
        editor.select(vec![id]);
        editor.update(0.0, EditorEvent::Deleted);
        assert!(editor.text() == scene.source, "{}", scene.name);
    }
}
