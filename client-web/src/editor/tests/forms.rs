//! The form: its words, the round, and rules as sentences.

use super::*;
use crate::editor::field_words;
use crate::editor::form::row::Row;
use crate::editor::form::sentence::{Part, Sentence, sentences};
use crate::editor::form::{Form, with_rules};

const FIELDS: &str = include_str!("../../../web/fields.txt");

fn named<'r>(rows: &'r [Row], path: &str) -> &'r Row {
    let row = rows.iter().find(|row| row.path == path);
    row.unwrap_or_else(|| panic!("no {path} in {rows:?}"))
}

/// A scene with a zone and a ball.
fn pitch() -> Editor {
    let text =
        format!("{YARD}\n[[zones]]\nname = \"zone-1\" # the goal\narea = [[100, 0], [120, 40]]\n");
    let editor = Editor::open(text, Some("pitch.toml"));
    assert_eq!(editor.doc.error, None);
    editor
}

/// Fills a blank as a player does, and checks that the text is a scene.
fn fill(editor: &mut Editor, path: &str, value: &str) {
    editor.set_field(0.0, path, &[value.to_owned()]);
    editor.doc.check();
    assert_eq!(editor.doc.error, None, "{path} {value}: {}", editor.text());
}

/// A sentence with its blanks in brackets.
fn read(sentence: &Sentence) -> String {
    let parts = sentence.parts.iter().map(|part| match part {
        Part::Words(words) => words.clone(),
        Part::Blank(row) => {
            let value = &row.values.as_ref().expect("a value")[0];
            let FieldForm::Choice { names } = &row.form else { return format!("[{value}]") };
            let at = names.iter().position(|name| name == value).expect("one of the choices");
            format!("[{}]", row.names[at])
        }
    });
    parts.collect()
}

fn only_sentence(editor: &Editor) -> String {
    let [sentence] = &sentences(editor.text())[..] else { panic!("{}", editor.text()) };
    read(sentence)
}

#[test]
fn each_field_has_a_label_a_sentence_and_a_section_of_the_documentation() {
    field_words::learn("scenes.html", FIELDS);
    let mut editor = yard();
    let fields = Form::of(&editor).fields;
    let title = &named(&fields, "title").words;
    assert_eq!((title.label.as_str(), title.help), ("Title", "Name shown to players."));
    assert_eq!(title.docs, "scenes.html#top-level");
    for row in &fields {
        assert!(!row.words.help.is_empty(), "{}", row.path);
    }
    // What only experts need is folded away.
    for (path, is_expert) in [("solver", true), ("quantum", true), ("gravity", false)] {
        assert_eq!(named(&fields, path).words.is_expert, is_expert, "{path}");
    }
    editor.select(vec![CRATE]);
    let fields = Form::of(&editor).fields;
    assert_eq!(named(&fields, "bodies[1].restitution").words.label, "Bounciness");
}

#[test]
fn fields_that_may_be_absent_are_in_the_form_unless_others_rule_them_out() {
    let mut editor = pitch();
    editor.select(vec![PieceId { list: List::Zones, index: 0 }]);
    let fields = Form::of(&editor).fields;
    let label = named(&fields, "zones[0].label");
    assert_eq!((&label.values, label.default.len()), (&None, 0));
    named(&fields, "zones[0].slower");
    // The zone has an area, and nobody can take it.
    for path in ["zones[0].position", "zones[0].radius", "zones[0].keep"] {
        assert!(fields.iter().all(|row| row.path != path), "{path}");
    }
    assert_eq!(named(&fields, "zones[0].color").names.len(), 8);
    fill(&mut editor, "zones[0].color", "2");
    assert!(editor.text().ends_with("color = 2\n"));
}

#[test]
fn the_sizes_of_the_scene_and_of_a_piece_are_those_in_the_picture() {
    let editor = Editor::open(String::new(), None);
    let size = |editor: &Editor, path| named(&Form::of(editor).fields, path).default.clone();
    assert_eq!(size(&editor, "size"), ["320", "180"]);
    let text = YARD.replace("kind = \"block\" # wood\n", "kind = \"platform\"\n");
    let text = text.replace("[40, 15]\nsize = [10, 20]", "[160, 100]");
    let mut editor = Editor::open(text, None);
    editor.select(vec![CRATE]);
    assert_eq!(size(&editor, "bodies[1].size"), ["30", "3"]);
}

#[test]
fn a_round_is_switched_on_and_off_and_has_teams() {
    let mut editor = yard();
    assert_eq!(Form::of(&editor).round.len(), 1, "only the switch");
    fill(&mut editor, "round", "true");
    assert!(editor.text().ends_with("# The last line.\n\n[round]\ntime = 120\n"));
    fill(&mut editor, "round.goal", "5");
    fill(&mut editor, "round.task", "Be first");
    fill(&mut editor, "round.fill", "2");
    assert!(editor.text().contains("time = 120\ngoal = 5\ntask = \"Be first\"\nfill = 2\n"));
    let with_round = editor.text().to_owned();
    fill(&mut editor, "teams", "2");
    assert!(editor.text().ends_with("[[teams]]\nname = \"orange\"\n\n[[teams]]\nname = \"sky\"\n"));
    let rows = Form::of(&editor).round;
    assert_eq!(named(&rows, "teams").values.as_deref(), Some(&["2".to_owned()][..]));
    assert!(named(&rows, "round.lives").values.is_none());
    fill(&mut editor, "teams", "0");
    assert_eq!(editor.text(), with_round);
    fill(&mut editor, "round", "false");
    assert_eq!(editor.text(), YARD);
    for round in ["round = { time = 5 }\n", "round.time = 5\nround.goal = 2\n"] {
        let text = YARD.replacen("tools", &format!("{round}tools"), 1);
        let mut editor = Editor::open(text, None);
        fill(&mut editor, "round", "false");
        assert_eq!(editor.text(), YARD, "{round}");
    }
}

#[test]
fn a_rule_about_blocks_says_ball_where_they_are_round() {
    let rule = "\n[[rules]]\nlost = \"block\"\nscore = 1\n";
    let ball = "\n[[bodies]]\nkind = \"block\"\nposition = [60, 60]\nradius = 4\n";
    let block = ball.replace("radius = 4", "size = [4, 4]");
    let head = "title = \"T\"\nsize = [120, 80]\ngroups = [\"block\", \"platform\"]\npairs = []\n";
    let floor = "\n[[bodies]]\nkind = \"wall\"\nposition = [60, -4]\nsize = [90, 8]\n";
    for (bodies, word) in [
        (ball.to_owned(), "[a ball]"),
        (block.clone(), "[a block]"),
        (format!("{ball}{block}"), "[a block or ball]"),
    ] {
        let text = format!("{head}{floor}{bodies}{rule}");
        let editor = Editor::open(text, None);
        assert_eq!(editor.doc.error, None, "{}", editor.text());
        let sentence = only_sentence(&editor);
        assert!(sentence.starts_with(&format!("When {word} [falls out")), "{sentence}");
    }
}

#[test]
fn a_rule_is_made_without_typing() {
    let mut editor = pitch();
    let before = editor.text().to_owned();
    let text = with_rules(&editor, "").expect("a rule");
    act(&mut editor, [EditorEvent::Rewritten(text)]);
    assert_eq!(editor.doc.error, None, "{}", editor.text());
    assert!(editor.text().ends_with("\n\n[[rules]]\nenter = \"zone-1\"\nscore = 1\n"));
    let sentence = "When [a hero] [enters] [zone-1], [its player] [gets points]: [1] [and\u{2026}]";
    assert_eq!(only_sentence(&editor), sentence);
    fill(&mut editor, "zones[0].who", "block");
    fill(&mut editor, "rules[0].to", "others");
    fill(&mut editor, "rules[0].score", "3");
    fill(&mut editor, "rules[0]#", "back");
    assert!(editor.text().contains("name = \"zone-1\" # the goal\n"));
    assert!(editor.text().contains("who = [\"block\"]\n"));
    assert!(editor.text().ends_with("score = 3\nto = \"others\"\nback = true\n"));
    assert_eq!(
        only_sentence(&editor),
        "When [a block] [enters] [zone-1], [everyone else] [gets points]: [3] and it \
         [goes back to its start] and waits [0] seconds [and\u{2026}]"
    );
    fill(&mut editor, "rules[0]#score", "say");
    fill(&mut editor, "rules[0].say", "A \"goal\"");
    fill(&mut editor, "rules[0]#back", "");
    assert!(editor.text().contains("enter = \"zone-1\"\nsay = \"A \\\"goal\\\"\"\nto"));
    let text = with_rules(&editor, "0").expect("a rule to remove");
    act(&mut editor, [EditorEvent::Rewritten(text)]);
    assert_eq!(editor.text(), before.replace("[120, 40]]\n", "[120, 40]]\nwho = [\"block\"]\n"));
}

#[test]
fn a_rule_takes_every_occasion_and_effect_that_it_offers() {
    let mut editor = pitch();
    fill(&mut editor, "round", "true");
    let named =
        editor.text().replace("kind = \"block\" # wood", "name = \"crate\"\nkind = \"block\"");
    let rule = "\n[[rules]]\nenter = \"zone-1\"\nscore = 1\n";
    let first = format!("{named}{rule}");
    let blanks = |text: &str| -> Vec<Row> {
        let parts = sentences(text).into_iter().flat_map(|sentence| sentence.parts);
        let rows =
            parts.filter_map(|part| if let Part::Blank(row) = part { Some(row) } else { None });
        rows.collect()
    };
    let mut seen = BTreeSet::from([first.clone()]);
    let mut open = vec![first];
    while let Some(text) = open.pop().filter(|_| seen.len() < 400) {
        let error = Scene::parse("a.toml", &text).err();
        assert!(error.is_none(), "{error:?}: {text}");
        let rows = blanks(&text);
        assert!(!rows.is_empty(), "it is still a sentence: {text}");
        for row in rows.iter().filter(|row| row.path.contains('#')) {
            let FieldForm::Choice { names } = &row.form else { panic!("{row:?}") };
            for name in names {
                let mut editor = Editor::open(text.clone(), None);
                editor.set_field(0.0, &row.path, std::slice::from_ref(name));
                if seen.insert(editor.text().to_owned()) {
                    open.push(editor.text().to_owned());
                }
            }
        }
    }
    assert!(seen.len() > 100, "{}", seen.len());
}

#[test]
fn rules_beyond_sentences_stay_as_text() {
    let mut said = 0;
    for scene in Scene::built_in() {
        for sentence in sentences(&scene.source) {
            let line = scene.source.lines().nth(sentence.line - 1).unwrap_or_default();
            assert_eq!(line, "[[rules]]", "{}", scene.name);
            said += usize::from(!sentence.parts.is_empty());
        }
    }
    assert!(said > 20, "{said}");
    let lines = "[[rules]]\non = [\"zone-1\", \"!other\"]\nscore = 1\n";
    let text = format!("{}\n{lines}", pitch().text());
    assert!(sentences(&text)[0].parts.is_empty());
    // A rule for one team says so.
    let teams = "[[teams]]\nname = \"red\"\n\n[[teams]]\nname = \"sky\"\n";
    let flag = "[[rules]]\nlost = \"block\"\nteam = \"sky\"\nback = 2\n";
    let of_team = format!("{}\n{teams}\n{flag}", pitch().text());
    let wanted = "When [a block] [falls out of the world], only for [team sky], it \
                  [goes back to its start] and waits [2] seconds [and\u{2026}]";
    assert_eq!(read(&sentences(&of_team)[0]), wanted);
    // An endless rule is about nobody.
    let text = text.replace("on = [\"zone-1\", \"!other\"]", "every = 2.5");
    let sentence = read(&sentences(&text)[0]);
    let wanted =
        "Whenever [time has passed] ([2.5] seconds), [everyone] [gets points]: [1] [and\u{2026}]";
    assert_eq!(sentence, wanted);
}
