//! Errors about a scene that parsed: the line of a field, by its path.

use super::error::{SceneError, line_at};
use super::spec::Scene;
use toml::de::{DeTable, DeValue};

impl SceneError {
    /// An error about a field of a scene, named by its path, such as `layouts[2].count`. Its line is that of the
    /// field, or of the deepest table around it that the file has.
    pub fn in_scene(scene: &Scene, field: &str, found: String, allowed: String) -> SceneError {
        let (at, _) = locate(&scene.source, field);
        let line = line_at(scene.source.as_bytes(), at);
        let file = format!("{}.toml", scene.name);
        SceneError { file, line, field: field.to_owned(), found, allowed }
    }
}

/// Returns whether the file of a scene has this field.
pub(super) fn has_field(scene: &Scene, field: &str) -> bool {
    locate(&scene.source, field).1
}

/// The byte at which the deepest part of a path begins that the text has, and whether that is the whole path.
fn locate(source: &str, path: &str) -> (usize, bool) {
    let Ok(document) = DeTable::parse(source) else { return (0, false) };
    let (mut table, mut at) = (Some(document.get_ref()), 0);
    for segment in path.split('.') {
        let (name, index) = match segment.strip_suffix(']').and_then(|rest| rest.split_once('[')) {
            Some((name, index)) => (name, index.parse().ok()),
            None => (segment, None),
        };
        let Some(mut value) = table.and_then(|table| table.get(name)) else { return (at, false) };
        at = value.span().start;
        if let Some(index) = index {
            let items = value.get_ref().as_array();
            let Some(item) = items.and_then(|items| items.get::<usize>(index)) else {
                return (at, false);
            };
            (value, at) = (item, item.span().start);
        }
        table = DeValue::as_table(value.get_ref());
    }
    (at, true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_leads_to_its_line_or_to_the_table_around_it() {
        let source = "title = \"a\"\n\n[limits]\nbodies = 4\n[[layouts]]\nx = 1\n[[layouts]]\ny = { z = 2 }\n";
        let line = |path: &str| {
            let (at, whole) = locate(source, path);
            (line_at(source.as_bytes(), at), whole)
        };
        assert_eq!(line("limits.bodies"), (4, true));
        assert_eq!(line("limits.players"), (3, false));
        assert_eq!(line("layouts[1].y.z"), (8, true));
        assert_eq!(line("layouts[1].count"), (7, false));
        assert_eq!(line("layouts[7]"), (5, false));
        assert_eq!(line("solver"), (1, false));
    }
}
