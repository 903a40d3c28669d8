//! The formats in which other programs read the fields of scene files: the schema for text editors, and the classes of
//! the Tiled project.

use super::super::super::{BUILT_IN, FieldForm};
use super::{FILES, FieldNote, Reference, default, read, root};
use serde_json::{Value, json};

/// Tiled classes, each with the entries of the sample that have its fields.
const CLASSES: [(&str, &str); 16] = [
    ("scene", ""),
    ("wall", "bodies[0]."),
    ("platform", "bodies[1]."),
    ("block", "bodies[2]."),
    ("minion", "bodies[3]."),
    ("dumb", "bodies[4]."),
    ("layout", "layouts[0]."),
    ("spring", "springs[0]."),
    ("emitter", "emitters[0]."),
    ("launcher", "launchers[0]."),
    ("mark", "marks[0]."),
    ("team", "teams[0]."),
    ("zone", "zones[0]."),
    ("signal", "signals[]."),
    ("rule", "rules[0]."),
    ("spawn", "spawns[]."),
];
/// Fields that follow from an object's drawing or class, in all classes except that of layouts.
const DRAWN: [&str; 7] = ["position", "path", "area", "name", "kind", "size", "radius"];

impl Reference {
    /// The schema for text editors, in the draft of JSON Schema that TOML language servers understand.
    pub fn schema(&self, _: &str) -> String {
        let mut root = json!({ "$schema": "http://json-schema.org/draft-04/schema#" });
        let fields = self.schema_of("");
        let root_fields = root.as_object_mut().expect("an object");
        root_fields.extend(fields.as_object().expect("an object").clone());
        pretty(&root, 2)
    }

    /// The schema of the table whose fields' paths begin with this prefix.
    fn schema_of(&self, prefix: &str) -> Value {
        let (mut properties, mut required) = (serde_json::Map::new(), Vec::new());
        for field in &self.fields {
            let Some(key) = field.path.strip_prefix(prefix) else { continue };
            if key.contains(['.', '[']) {
                continue;
            }
            let mut schema = match field.is_section() {
                true if key == "recipes" => {
                    json!({ "type": "object", "additionalProperties": self.schema_of("recipes.NAME.") })
                }
                true if field.allowed.as_deref() == Some("a list") => {
                    json!({ "type": "array", "items": self.schema_of(&format!("{}[].", field.path)) })
                }
                true => self.schema_of(&format!("{}.", field.path)),
                false => schema_of_value(field),
            };
            if let Some(row) = self.row(&field.path) {
                let default = match default(field, &row.sentence) {
                    default if default == "required" => {
                        required.push(key.to_owned());
                        "Required".to_owned()
                    }
                    default => format!("Default: {default}"),
                };
                let text = format!("{} {default}.", row.sentence.text);
                schema["description"] = json!(plain(&text));
            }
            properties.insert(key.to_owned(), schema);
        }
        let mut schema =
            json!({ "type": "object", "additionalProperties": false, "properties": properties });
        if !required.is_empty() {
            schema["required"] = json!(required);
        }
        schema
    }

    /// The project with the fields of its classes.
    pub fn tiled_project(&self, old: &str) -> String {
        let mut project: Value = serde_json::from_str(old).expect("JSON");
        let types = project["propertyTypes"].as_array_mut().expect("a list");
        for class in types.iter_mut().filter(|entry| entry["type"] == "class") {
            let name = class["name"].as_str().expect("a name");
            let (_, prefix) =
                CLASSES.iter().find(|(known, _)| *known == name).expect("a known class");
            let old = class["members"].as_array().expect("a list").clone();
            // Members that are not fields of a scene file, such as the scale of the map, are kept.
            let is_field = |member: &Value| {
                self.notes.iter().any(|note| Some(note.path.as_str()) == member["name"].as_str())
            };
            let others =
                old.iter().filter(|member| prefix.is_empty() && !is_field(member)).cloned();
            let fields = self.fields_of_class(name, prefix);
            let members = fields.iter().map(|(key, field)| {
                let known = old.iter().find(|member| member["name"] == **key);
                member(key, field, known)
            });
            class["members"] = others.chain(members).collect();
        }
        pretty(&project, 1)
    }

    fn fields_of_class(&self, class: &str, prefix: &str) -> Vec<(&str, &FieldNote)> {
        let notes = if prefix.contains("[]") { &self.fields } else { &self.notes };
        let mut fields: Vec<(&str, &FieldNote)> = Vec::new();
        for note in notes.iter().filter(|note| note.allowed.is_some() && !note.is_section()) {
            let Some(key) = note.path.strip_prefix(prefix) else { continue };
            let is_drawn = match class {
                "layout" => key == "area",
                "scene" => key == "size",
                _ => DRAWN.contains(&key),
            };
            if !is_drawn && !key.contains(['.', '[']) {
                fields.push((key, note));
            }
        }
        fields
    }
}

/// A sentence without its Markdown markup.
pub fn plain(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, link)) = rest.split_once('[') {
        match link.split_once("](").and_then(|(name, rest)| Some((name, rest.split_once(')')?.1))) {
            Some((name, after)) if !name.contains(['[', ']']) => {
                out += &format!("{before}{name}");
                rest = after;
            }
            _ => {
                out += &format!("{before}[");
                rest = link;
            }
        }
    }
    (out + rest).replace('`', "")
}

fn schema_of_value(field: &FieldNote) -> Value {
    let number = |value: f32| json!(value.to_string().parse::<f64>().expect("a number"));
    match field.only_form() {
        None => json!({}),
        Some(FieldForm::Number { range: [low, high], above, .. }) => {
            let (minimum, maximum) = (number(*low), number(*high));
            json!({ "type": "number", "minimum": minimum, "exclusiveMinimum": above, "maximum": maximum })
        }
        Some(FieldForm::Whole { range: [low, high], .. }) => {
            json!({ "type": "integer", "minimum": low, "maximum": high })
        }
        Some(FieldForm::Vector { range: [low, high], .. }) => {
            let part =
                json!({ "type": "number", "minimum": number(*low), "maximum": number(*high) });
            json!({ "type": "array", "items": part, "minItems": 2, "maxItems": 2 })
        }
        Some(FieldForm::Truth { .. }) => json!({ "type": "boolean" }),
        Some(FieldForm::Text { chars_max }) => {
            json!({ "type": "string", "minLength": 1, "maxLength": chars_max })
        }
        Some(FieldForm::Choice { names }) => json!({ "enum": names }),
    }
}

/// A property of a Tiled class. A field without a default keeps the value that the project has for it.
fn member(key: &str, field: &FieldNote, known: Option<&Value>) -> Value {
    let is_word = field.allowed.as_ref().is_some_and(|words| words.contains('"'));
    let form = field.form.as_ref().filter(|_| !is_word);
    let (kind, zero) = match form {
        Some(FieldForm::Number { .. }) => ("float", json!(0.0)),
        Some(FieldForm::Whole { .. }) => ("int", json!(0)),
        Some(FieldForm::Truth { .. }) => ("bool", json!(false)),
        _ => ("string", json!("")),
    };
    let is_simple = kind != "string" || field.default.is_some();
    let default = field.default_value().filter(|_| is_simple && !is_word);
    let default = default.map(|text| serde_json::from_str(&text).expect("a value of JSON"));
    let mut member = json!({ "name": key });
    if let Some(of) = known.and_then(|known| known.get("propertyType")) {
        member["propertyType"] = of.clone();
    }
    member["type"] = json!(kind);
    member["value"] = default.or(known.map(|known| known["value"].clone())).unwrap_or(zero);
    member
}

fn pretty(value: &Value, indent: usize) -> String {
    let text = serde_json::to_string_pretty(value).expect("JSON");
    let lines = text.lines().map(|line| {
        let inner = line.trim_start();
        format!("{}{inner}\n", " ".repeat((line.len() - inner.len()) / 2 * indent))
    });
    lines.collect()
}

/// A scene's values that its schema does not allow, checking only those parts of JSON Schema that the schema uses.
fn faults(value: &toml::Value, schema: &Value, path: &str) -> Vec<String> {
    let is_of_type = match schema["type"].as_str() {
        Some("object") => value.is_table(),
        Some("array") => value.is_array(),
        Some("string") => value.is_str(),
        Some("boolean") => value.is_bool(),
        Some("integer") => value.is_integer(),
        Some("number") => value.is_integer() || value.is_float(),
        _ => true,
    };
    let number = value.as_float().or(value.as_integer().map(|whole| whole as f64));
    let bound = |name: &str, fits: &dyn Fn(f64, f64) -> bool| match (number, &schema[name]) {
        (Some(number), Value::Number(end)) => fits(number, end.as_f64().expect("a number")),
        _ => true,
    };
    let is_above = schema["exclusiveMinimum"] == true;
    let is_within = bound("minimum", &|number, low| number > low || number == low && !is_above)
        && bound("maximum", &|number, high| number <= high);
    let mut words = schema["enum"].as_array().into_iter().flatten();
    let is_word = schema["enum"].is_null() || words.any(|word| word.as_str() == value.as_str());
    let mut found = Vec::new();
    if !(is_of_type && is_within && is_word) {
        found.push(format!("{path} = {value}"));
    }
    let fields = value.as_table().filter(|_| schema["type"] == "object");
    for (key, value) in fields.into_iter().flatten() {
        let path = format!("{path}.{key}");
        match (schema["properties"].get(key), &schema["additionalProperties"]) {
            (Some(schema), _) | (None, schema @ Value::Object(_)) => {
                found.extend(faults(value, schema, &path));
            }
            _ => found.push(format!("{path} is unknown")),
        }
    }
    let needed = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let missing = needed.filter(|key| fields.is_some_and(|fields| !fields.contains_key(*key)));
    found.extend(missing.map(|key| format!("{path}.{key} is missing")));
    for item in value.as_array().into_iter().flatten() {
        found.extend(faults(item, &schema["items"], path));
    }
    found
}

#[test]
fn the_schema_allows_every_shipped_scene_and_refuses_mistakes() {
    let schema = read(&root().join(FILES[1].0));
    let schema: Value = serde_json::from_str(&schema).expect("JSON");
    let check = |text: &str| faults(&toml::Value::Table(text.parse().expect("TOML")), &schema, "");
    for (file, source) in BUILT_IN {
        assert_eq!(check(source), [""; 0], "{file}");
    }
    let wrong = "title = \"\"\nsize = [1, 0]\nmass = 1\nhero = {}\nbodies = [{ kind = \"hat\", mass = -1 }]";
    let found = [
        ".bodies.kind = \"hat\"",
        ".bodies.mass = -1",
        ".hero.spawns is missing",
        ".mass is unknown",
        ".size = 0",
        ".groups is missing",
    ];
    assert_eq!(check(wrong), found);
}
