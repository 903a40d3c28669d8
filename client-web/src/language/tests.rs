//! Finds every sentence of the page and checks that it exists in each language.

use super::*;
use crate::editor::palette::{Make, added};
use crate::editor::templates;
use jostle_game::Scene;
use jostle_protocol::Refusal;
use jostle_sim::Vec2;
use proc_macro2::{TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The languages, identified by the names of their files in `web`.
const LANGUAGES: [(&str, &str); 1] = [("de", include_str!("../../web/de.txt"))];
/// Files in which every literal is shown to the user.
const ALL_SENTENCES: [&str; 5] = [
    "page/strings.rs",
    "page/strings/scenes.rs",
    "page/tools.rs",
    "editor/strings.rs",
    "replay/error.rs",
];
/// Attributes of the document that are shown or read out; the style sheet shows the last two.
const ATTRIBUTES: [&str; 6] =
    ["aria-label", "title", "placeholder", "alt", "data-first", "data-last"];

#[test]
fn every_language_has_exactly_the_sentences_of_the_page() {
    let wanted = sentences();
    for (language, file) in LANGUAGES {
        let known: Vec<String> = pairs(file).map(|(english, _)| english.to_owned()).collect();
        let set = BTreeSet::from_iter(known.iter().cloned());
        assert_eq!(known.len(), set.len(), "{language}.txt has a sentence twice");
        let lacking: Vec<_> = wanted.difference(&set).collect();
        let unused: Vec<_> = set.difference(&wanted).collect();
        assert!(
            lacking.is_empty() && unused.is_empty(),
            "web/{language}.txt: add, with a tab before the translation below each: {lacking:#?}\n\
             remove: {unused:#?}"
        );
    }
}

#[test]
fn a_translation_has_the_placeholders_of_its_sentence() {
    for (language, file) in LANGUAGES {
        for (english, other) in pairs(file) {
            assert_eq!(names(english), names(other), "web/{language}.txt: {english}");
            assert!(!other.is_empty(), "web/{language}.txt: {english}");
        }
    }
}

#[test]
fn the_document_offers_every_language() {
    for (language, _) in LANGUAGES {
        let option = format!("<option value=\"{language}\" data-file=\"/assets/{language}.txt\"");
        assert!(document().contains(&option), "{option}");
    }
}

#[test]
fn a_sentence_is_said_in_the_chosen_language() {
    speak("Play\n\tSpielen\n\n# A comment.\n{count} of {all}\n\tvon {all}: {count}\n");
    assert_eq!(say("Play"), "Spielen");
    assert_eq!(say("Leave"), "Leave", "what is not known stays");
    let parts = [("count", "3"), ("all", "{count}")];
    assert_eq!(fill("{count} of {all}", &parts), "von {count}: 3", "parts are not filled again");
    speak("");
    assert_eq!(fill("{count} of {all}", &parts), "3 of {count}");
}

/// The names of the placeholders in a sentence.
fn names(sentence: &str) -> BTreeSet<&str> {
    let rest = std::iter::successors(placeholder(sentence), |part| placeholder(part.2));
    rest.map(|(_, name, _)| name).collect()
}

fn sentences() -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in rust_files(&source) {
        let name = path.strip_prefix(&source).expect("below src").to_string_lossy().into_owned();
        let tokens: TokenStream = read(&path).parse().expect("Rust");
        let all = ALL_SENTENCES.contains(&name.replace('\\', "/").as_str());
        literals(tokens, all, &mut found);
    }
    in_document(document(), &mut found);
    found.extend(Refusal::ALL.map(|refusal| refusal.message().to_owned()));
    found.extend(crate::view::palette::NAMES.map(str::to_owned));
    let fields = include_str!("../../web/fields.txt").lines();
    // The label and the help of each field.
    let words = fields.flat_map(|field| field.split('\t').skip(2));
    found.extend(words.map(|word| word.trim_start_matches('+').to_owned()));
    for scene in Scene::built_in() {
        of_scene(&scene, &mut found);
    }
    for (name, text) in templates::ALL {
        of_scene(&Scene::parse(name, text).expect("a scene"), &mut found);
    }
    for (make, name) in Make::ALL {
        let (text, _) = added("", make, Vec2::new(160.0, 90.0)).expect("TOML");
        of_scene(&Scene::parse(name, &text).expect("a scene"), &mut found);
    }
    found.retain(|text| is_sentence(text));
    found
}

/// Whether a text needs translating. Numbers, symbols and key names are the same in every language.
fn is_sentence(text: &str) -> bool {
    let letters = |word: &str| word.chars().filter(|letter| letter.is_alphabetic()).count();
    let bare = std::iter::successors(Some(("", "", text)), |part| placeholder(part.2));
    let last = bare.clone().last().map_or("", |part| part.2);
    bare.map(|part| part.0).chain([last]).map(letters).sum::<usize>() > 1
}

fn of_scene(scene: &Scene, found: &mut BTreeSet<String>) {
    found.extend([scene.title.clone(), scene.about.clone()]);
    found.extend(scene.rules.round.iter().map(|round| round.task.clone()));
    found.extend(scene.rules.teams.iter().map(|team| team.name.clone()));
    found.extend(scene.rules.zones.iter().map(|zone| zone.label.clone()));
    let rules = scene.rules.rules.iter();
    found.extend(rules.filter_map(|rule| Some(rule.effects.say.as_ref()?.text.clone())));
}

fn rust_files(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).expect("a folder").map(|entry| entry.expect("an entry").path());
    entries
        .flat_map(|path| match path.is_dir() {
            true => rust_files(&path),
            false => vec![path],
        })
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .filter(|path| !path.components().any(|part| part.as_os_str() == "tests"))
        .filter(|path| !path.ends_with("tests.rs"))
        .collect()
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).expect("a text")
}

/// Collects the literals passed to `say`, `fill` or `around`, or all literals. Attributes and tests are skipped.
fn literals(tokens: TokenStream, all: bool, found: &mut BTreeSet<String>) {
    let mut before: [String; 2] = Default::default();
    for token in tokens {
        if let TokenTree::Group(group) = &token {
            let is_call = matches!(before[1].as_str(), "say" | "fill" | "around");
            let first = group.stream().into_iter().next();
            if is_call {
                found.extend(first.and_then(|first| text_of(&first)));
            }
            let is_attribute = before[1] == "#" || before == ["#", "!"];
            if !is_attribute && before != ["mod", "tests"] {
                // The other arguments of `fill` are placeholder names.
                literals(group.stream(), all && before[1] != "fill", found);
            }
        } else if all {
            found.extend(text_of(&token));
        }
        before = [std::mem::take(&mut before[1]), token.to_string()];
    }
}

fn text_of(token: &TokenTree) -> Option<String> {
    let TokenTree::Literal(literal) = token else { return None };
    syn::parse_str::<syn::LitStr>(&literal.to_string()).ok().map(|text| text.value())
}

fn document() -> &'static str {
    include_str!("../../web/index.html")
}

/// Collects the document's texts and attributes the way `dom/language.rs` does in the browser.
fn in_document(document: &str, found: &mut BTreeSet<String>) {
    // Without JavaScript, the page is always in English.
    let document = document.split("<noscript>").next().expect("a first part");
    for part in document.split('<').skip(1) {
        let (tag, text) = part.split_once('>').expect("a tag ends");
        if tag.starts_with("!--") {
            continue;
        }
        found.insert(text.trim().to_owned());
        for name in ATTRIBUTES {
            let value = tag.split_once(&format!(" {name}=\"")).map(|(_, rest)| rest);
            found
                .extend(value.and_then(|rest| rest.split_once('"')).map(|(value, _)| value.into()));
        }
    }
}
