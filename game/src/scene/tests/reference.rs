//! The reference for scene files: the tables in docs/scenes.md, the schema for text editors, the classes in the Tiled
//! project and the words of the editor's form. They are generated from the fields that the reader asks for and from the comments above its calls.
//! `cargo xtask docs` writes them, and a test detects when they are out of date.

use super::super::table::Document;
use super::super::{FieldForm, Scene, Tools, spec};
use super::fields_of_the_top_level;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

mod formats;
mod words;

const REFERENCE: &str = include_str!("../../../../docs/scenes.md");
/// If this environment variable is set, the files are written instead of compared.
const WRITE: &str = "JOSTLE_WRITE_DOCS";
const FILES: [(&str, MakeText); 4] = [
    ("docs/scenes.md", Reference::guide),
    ("docs/scene.schema.json", Reference::schema),
    ("docs/examples/tiled/jostle.tiled-project", Reference::tiled_project),
    ("client-web/web/fields.txt", Reference::words),
];
/// Makes the new text of a file from its old text.
type MakeText = fn(&Reference, &str) -> String;
/// Start of a comment that precedes a table in the guide. It lists the tables of a scene file, and the types and
/// functions whose comments describe their fields. A field appears in the first table of the guide that covers it.
const TABLE_START: &str = "<!-- fields of ";
const TABLE_END: &str = "<!-- end of fields -->\n";

/// A scene for which every field is read, though not every field is given.
const SAMPLE: &str = r#"
title = "Sample"
size = [100, 100]
tools = ["launch", "dumb", "spray", "sling"]
groups = ["hero", "minion", "dumb", "platform", "pack", "block"]
recipes.own = {}
bodies = [
    { kind = "wall" },
    { kind = "platform", path = [[0, 0], [9, 9]], period = 1 },
    { kind = "block", name = "ball" },
    { kind = "minion" },
    { kind = "dumb" },
]
layouts = [{ kind = "block" }]
springs = [{ body = "ball", to = [0, 0] }]
emitters = [{}]
launchers = [{}]
marks = [{}]
teams = [{}]
zones = [{}]
signals = [{}, { order = [] }]
rules = [{}]
sling.ball = "ball"
"#;

/// A field, as described by the reader's calls.
#[derive(Clone, Debug, Default)]
pub struct FieldNote {
    /// Its path in a scene, like `bodies[3].radius`.
    path: String,
    /// If the file must have the field, the allowed values in a few words.
    pub needed: Option<String>,
    /// Whether it has no default.
    pub is_optional: bool,
    /// The default, if it is a word.
    pub default: Option<String>,
    allowed: Option<String>,
    /// Whether the words for what is allowed cover more than the form does.
    is_described: bool,
    form: Option<FieldForm>,
    /// Whether its default differs between the entries of a list.
    varies: bool,
}

impl FieldNote {
    /// The note about a field.
    pub fn of<'n>(notes: &'n mut Vec<FieldNote>, path: &str) -> &'n mut FieldNote {
        let known = notes.iter().position(|note| note.path == path);
        let index = known.unwrap_or(notes.len());
        if known.is_none() {
            notes.push(FieldNote { path: path.to_owned(), ..FieldNote::default() });
        }
        &mut notes[index]
    }

    pub fn describe(&mut self, allowed: String) {
        if !self.is_described {
            (self.allowed, self.is_described) = (Some(allowed), true);
        }
    }

    pub fn allow(&mut self, allowed: String) {
        self.allowed.get_or_insert(allowed);
    }

    pub fn keep(&mut self, form: FieldForm) {
        self.form.get_or_insert(form);
    }

    /// Adds what another entry of the same list says about the field.
    fn merge(&mut self, other: &FieldNote) {
        let FieldNote { needed, is_optional, default, allowed, form, .. } = other.clone();
        let values = [self.default_value(), other.default_value()];
        self.varies |= values.iter().all(Option::is_some) && values[0] != values[1];
        self.needed = self.needed.take().or(needed);
        self.is_optional |= is_optional;
        self.default = self.default.take().or(default);
        self.allowed = self.allowed.take().or(allowed);
        self.form = self.form.take().or(form);
    }

    /// Whether it is a table or a list of tables instead of a value.
    fn is_section(&self) -> bool {
        !self.is_described && matches!(self.allowed.as_deref(), Some("a table" | "a list"))
    }

    /// The form that its values must have; `None` if other values are allowed too.
    fn only_form(&self) -> Option<&FieldForm> {
        self.form.as_ref().filter(|_| !self.is_described)
    }

    /// The value that applies if the file does not have the field, as TOML.
    fn default_value(&self) -> Option<String> {
        if self.is_optional || self.needed.is_some() {
            return None;
        }
        let word = self.default.as_ref().map(|word| format!("\"{word}\""));
        word.or(match self.form.as_ref()? {
            FieldForm::Number { default, .. } => Some(default.to_string()),
            FieldForm::Whole { default, .. } => Some(default.to_string()),
            FieldForm::Vector { default: [x, y], .. } => Some(format!("[{x}, {y}]")),
            FieldForm::Truth { default } => Some(default.to_string()),
            FieldForm::Text { .. } | FieldForm::Choice { .. } => None,
        })
    }
}

/// A comment about a field in the source.
#[derive(Clone)]
struct Sentence {
    /// The type or function that contains it.
    item: String,
    key: String,
    text: String,
    default: Option<String>,
    /// The field's name in the editor's form, followed by ", for experts" if it is folded away there.
    label: Option<String>,
}

/// A row of a table in the guide.
struct Row {
    /// The fields that it describes, one in each table of scene files that has it.
    paths: Vec<String>,
    field: FieldNote,
    sentence: Sentence,
}

/// Everything that is known about fields.
struct Reference {
    /// Notes in the order and with the paths of the sample.
    notes: Vec<FieldNote>,
    /// Notes with one for all entries of a list, with paths like `bodies[].radius`.
    fields: Vec<FieldNote>,
    /// The tables in the guide.
    tables: Vec<Vec<Row>>,
    /// For each table, the section that contains it, as links name it.
    sections: Vec<String>,
}

impl Reference {
    fn new(guide: &str) -> Reference {
        let mut notes = notes(SAMPLE);
        notes.extend(notes_of_conjugate());
        let mut fields: Vec<FieldNote> = Vec::new();
        for note in &notes {
            let path = note.path.replace(|c: char| c.is_ascii_digit(), "");
            let path = path.replace("recipes.own", "recipes.NAME");
            match fields.iter_mut().find(|field| field.path == path) {
                Some(field) => field.merge(note),
                None => fields.push(FieldNote { path, ..note.clone() }),
            }
        }
        let mut sentences = Vec::new();
        for file in sources(&root().join("game/src/scene")) {
            scan(&read(&file), &mut sentences);
        }
        let sections = words::sections(guide);
        let mut reference = Reference { notes, fields, tables: Vec::new(), sections };
        for part in guide.split(TABLE_START).skip(1) {
            let head = part.split(" -->").next().unwrap_or_default();
            let rows = reference.rows(head, &sentences);
            assert!(!rows.is_empty(), "no fields of {head}");
            reference.tables.push(rows);
        }
        reference
    }

    /// The rows of the table with this head, except for fields that are in an earlier table.
    fn rows(&self, head: &str, sentences: &[Sentence]) -> Vec<Row> {
        let (tables, items) = head.split_once(": ").expect("tables and where they are described");
        let path = |table: &str, key: &str| match table {
            "top" => key.to_owned(),
            table => format!("{table}.{key}"),
        };
        let mut rows: Vec<Row> = Vec::new();
        for item in items.split(", ") {
            for sentence in sentences.iter().filter(|sentence| sentence.item == item) {
                let mut paths: Vec<String> =
                    tables.split(' ').map(|table| path(table, &sentence.key)).collect();
                let of_rows = |path: &String| rows.iter().any(|row| row.paths.contains(path));
                paths.retain(|path| self.row(path).is_none() && !of_rows(path));
                let field = paths.iter().find_map(|path| {
                    let field = self.fields.iter().find(|field| field.path == *path);
                    field.filter(|field| !field.is_section())
                });
                if let Some(field) = field.cloned() {
                    rows.push(Row { paths, field, sentence: sentence.clone() });
                }
            }
        }
        rows
    }

    /// The row about a field.
    fn row(&self, path: &str) -> Option<&Row> {
        let mut rows = self.tables.iter().flatten();
        rows.find(|row| row.paths.iter().any(|known| known == path))
    }

    /// The guide with its tables filled in.
    fn guide(&self, old: &str) -> String {
        let mut parts = old.split(TABLE_START);
        let mut guide = parts.next().unwrap_or_default().to_owned();
        for (part, rows) in parts.zip(&self.tables) {
            let (head, rest) = part.split_once(" -->\n").expect("an end of the comment");
            let (_, rest) = rest.split_once(TABLE_END).expect("an end of the table");
            guide += &format!("{TABLE_START}{head} -->\n{}{TABLE_END}{rest}", table(rows));
        }
        let is_known = |path: &str| self.row(path).is_some();
        let missing = self.fields.iter().filter(|field| {
            let is_inside = field.path.rsplit_once('.').is_some_and(|(table, _)| is_known(table));
            !field.is_section() && !is_known(&field.path) && !is_inside
        });
        let missing: Vec<&str> = missing.map(|field| field.path.as_str()).collect();
        let cure = "write a comment above their calls of `Table::get`, or above the fields of the type that these fill, \
                    and name the function or type in the head of their table in docs/scenes.md";
        assert!(missing.is_empty(), "no sentence about {missing:?}: {cure}");
        guide
    }
}

/// The notes about all fields of a scene.
fn notes(text: &str) -> Vec<FieldNote> {
    let mut document = Document::new("sample.toml", text);
    document.notes = Some(RefCell::default());
    let entries = toml::de::DeTable::parse(text).expect("TOML");
    document.root(entries.get_ref()).read(|root| spec::read(String::new(), text, root));
    document.notes.map(RefCell::into_inner).unwrap_or_default()
}

/// The notes for the conjugate solver. Only the chosen solver's settings are read.
fn notes_of_conjugate() -> Vec<FieldNote> {
    let mut notes = notes(&SAMPLE.replace("title = \"Sample\"", "solver = \"conjugate\""));
    notes.retain(|note| note.path.starts_with("conjugate"));
    notes
}

/// Adds the comments in a source file that are directly above a field of a type, or above a line that names a field.
fn scan(source: &str, sentences: &mut Vec<Sentence>) {
    let (mut item, mut comment, mut alias) = (String::new(), String::new(), None);
    for line in source.lines().map(str::trim) {
        if let Some(text) = line.strip_prefix("/// ").or_else(|| line.strip_prefix("// ")) {
            comment += if comment.is_empty() { "" } else { " " };
            comment += text;
            continue;
        }
        if let Some(rest) = line.strip_prefix("#[doc(alias = \"") {
            alias = rest.split('"').next().map(str::to_owned);
        }
        if line.starts_with("#[") {
            continue;
        }
        let comment = std::mem::take(&mut comment);
        let alias = alias.take();
        if let Some(name) = item_of(line) {
            item = name;
        } else if !comment.is_empty() {
            let (comment, label) = halves(&comment, " Label: ");
            let (text, default) = halves(comment, " Default: ");
            let keys = alias.map_or_else(|| keys(line), |alias| vec![alias]);
            sentences.extend(keys.into_iter().map(|key| Sentence {
                item: item.clone(),
                key,
                text: text.to_owned(),
                default: default.map(str::to_owned),
                label: label.map(str::to_owned),
            }));
        }
    }
}

/// A comment, and the part that a mark in it introduces, without its full stop.
fn halves<'c>(comment: &'c str, mark: &str) -> (&'c str, Option<&'c str>) {
    let halves = comment.split_once(mark);
    halves.map_or((comment, None), |(text, part)| (text, Some(part.trim_end_matches('.'))))
}

/// The name of the type or function that begins on a line.
fn item_of(line: &str) -> Option<String> {
    let mut words = line.split_whitespace();
    words.by_ref().take(4).find(|word| ["struct", "enum", "fn"].contains(word))?;
    Some(first_word(words.next()?))
}

/// The quoted words in a line of code; otherwise its first word, which is the name of a field.
fn keys(line: &str) -> Vec<String> {
    let quoted: Vec<String> = line.split('"').skip(1).step_by(2).map(str::to_owned).collect();
    let name = || vec![first_word(line.trim_start_matches("pub ")).to_lowercase()];
    if quoted.is_empty() { name() } else { quoted }
}

fn first_word(text: &str) -> String {
    text.chars().take_while(|&c| c.is_alphanumeric() || c == '_').collect()
}

/// The cell with a field's default.
fn default(field: &FieldNote, sentence: &Sentence) -> String {
    assert!(!field.varies || sentence.default.is_some(), "what is the default of {}?", field.path);
    match (&sentence.default, field.default_value()) {
        (Some(words), _) => words.clone(),
        (None, Some(value)) => format!("`{value}`"),
        (None, None) if field.needed.is_some() => "required".to_owned(),
        (None, None) => "none".to_owned(),
    }
}

/// The cell with what a field allows, in the words of the reader's errors, shortened.
fn allowed(field: &FieldNote) -> String {
    let words = field.allowed.as_ref().or(field.needed.as_ref());
    let words = words.unwrap_or_else(|| panic!("the sample does not have {} read", field.path));
    if let Some(names) = words.strip_prefix("one of ").filter(|_| !field.is_described) {
        return names
            .split(", ")
            .map(|name| format!("`\"{name}\"`"))
            .collect::<Vec<_>>()
            .join(", ");
    }
    let short = [
        ("a number from ", ""),
        ("a number above ", "above "),
        ("a whole number from ", "whole, "),
        ("0.016666668", "1/60"),
        ("a text of ", ""),
        (", one line", ""),
        ("true or false", "`true`, `false`"),
        ("true, or", "`true`, or"),
        ("a condition", "a [condition](#conditions)"),
    ];
    let words = short.iter().fold(words.clone(), |words, (from, to)| words.replace(from, to));
    if words.contains(['`', '(']) { words } else { with_code(&words) }
}

/// Puts TOML lists and tables into backticks.
fn with_code(words: &str) -> String {
    let (mut out, mut depth) = (String::new(), 0);
    for c in words.chars() {
        if "[{".contains(c) {
            out += if depth == 0 { "`" } else { "" };
            depth += 1;
        }
        out.push(c);
        if "]}".contains(c) {
            depth -= 1;
            out += if depth == 0 { "`" } else { "" };
        }
    }
    out
}

/// A Markdown table, without the column of defaults if no field has one.
fn table(rows: &[Row]) -> String {
    let cells = |row: &Row| {
        let name = format!("`{}`", row.sentence.key);
        let (default, allowed) = (default(&row.field, &row.sentence), allowed(&row.field));
        [name, default, allowed, row.sentence.text.clone()]
    };
    let heads = [["field", "default", "allowed", "meaning"], ["---"; 4]];
    let heads = heads.map(|cells| cells.map(str::to_owned));
    let lines: Vec<[String; 4]> = heads.into_iter().chain(rows.iter().map(cells)).collect();
    let has_defaults = lines[2..].iter().any(|cells| cells[1] != "none");
    let line = |[name, default, allowed, text]: &[String; 4]| match has_defaults {
        true => format!("| {name} | {default} | {allowed} | {text} |\n"),
        false => format!("| {name} | {allowed} | {text} |\n"),
    };
    lines.iter().map(line).collect()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a workspace").to_owned()
}

/// The Rust files of a folder without its tests, in order.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = folder.read_dir().expect("a folder").map(|entry| entry.expect("an entry").path());
    let mut paths: Vec<PathBuf> = entries.collect();
    paths.sort();
    let inside =
        paths.into_iter().filter(|path| !path.ends_with("tests.rs") && !path.ends_with("tests"));
    inside.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] }).collect()
}

#[expect(clippy::disallowed_methods, reason = "the sources and documents that a test compares")]
fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_default()
}

#[test]
#[expect(clippy::disallowed_methods, reason = "`cargo xtask docs` writes by this test")]
fn what_is_written_from_the_fields_is_up_to_date() {
    let reference = Reference::new(&read(&root().join(FILES[0].0)));
    for (path, make) in FILES {
        let file = root().join(path);
        let old = read(&file);
        let new = make(&reference, &old);
        if std::env::var_os(WRITE).is_some() {
            std::fs::write(&file, new).expect("a file that can be written");
        } else {
            assert!(old == new, "{path} is out of date; `cargo xtask docs` writes it");
        }
    }
}

/// The reference's code blocks in one language.
fn reference_blocks(language: &str) -> Vec<&'static str> {
    let opening = format!("```{language}\n");
    let blocks = REFERENCE.split(opening.as_str()).skip(1);
    blocks.map(|rest| rest.split("```").next().expect("a closed block")).collect()
}
#[test]
fn the_references_example_parses_and_its_error_is_true() {
    let examples = reference_blocks("toml");
    let (whole, wall, launcher, sling, game) = match examples[..] {
        [whole, wall, launcher, sling, game] => (whole, wall, launcher, sling, game),
        _ => panic!("{} examples", examples.len()),
    };
    let with_wall = Scene::parse("yard.toml", &format!("{whole}\n{wall}"));
    assert_eq!(with_wall.unwrap_or_else(|error| panic!("{error}")).layouts.len(), 2);
    let yard = Scene::parse("yard.toml", whole).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((yard.layouts.len(), yard.emitters.len()), (1, 1));
    let launching = Scene::parse("yard.toml", &format!("{whole}\n{launcher}"));
    assert_eq!(launching.unwrap_or_else(|error| panic!("{error}")).launchers.len(), 1);
    let range = Scene::parse("range.toml", sling).unwrap_or_else(|error| panic!("{error}"));
    assert!(range.sling.is_some());
    let push = Scene::parse("push.toml", game).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((push.rules.zones.len(), push.rules.rules.len()), (1, 1));
    let wrong = whole.replace("radius = 5", "radius = -3");
    let error = Scene::parse("my-yard.toml", &wrong).expect_err("a negative radius");
    assert!(REFERENCE.contains(&error.to_string()), "{error}");
}

#[test]
fn the_reference_names_every_field_of_the_top_level() {
    for field in fields_of_the_top_level() {
        let forms = [
            format!("`{field}`"),
            format!("`[{field}]`"),
            format!("`[[{field}]]`"),
            format!("`[{field}."),
        ];
        assert!(forms.iter().any(|form| REFERENCE.contains(form)), "{field} is not documented");
    }
    for (tool, _) in Tools::NAMES {
        assert!(REFERENCE.contains(&format!("| `{tool}` |")), "{tool} is not documented");
    }
}
