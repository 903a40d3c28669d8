//! Collision groups of a scene and which of them meet.

use super::document::{Field, Table, one_of};
use super::{Kind, SceneError};
use crate::world::GROUPS_MAX;

const NAME_CHARS_MAX: usize = 32;

/// Names of the groups and who meets whom.
pub(super) struct Groups {
    pub names: Vec<String>,
    pub meets: [u32; GROUPS_MAX],
    pub meets_particles: u32,
}

impl Groups {
    /// Reads `groups`, `pairs` and `particles_meet`.
    pub fn read(root: &Table) -> Result<Groups, SceneError> {
        let mut groups = Groups { names: names(root)?, meets: [0; GROUPS_MAX], meets_particles: 0 };
        for pair in root.list("pairs")? {
            let [a, b] = pair.items("a pair of groups, [\"a\", \"b\"]")?;
            let (a, b) = (groups.index(&a)?, groups.index(&b)?);
            groups.meets[usize::from(a)] |= 1 << b;
            groups.meets[usize::from(b)] |= 1 << a;
        }
        for field in root.list("particles_meet")? {
            groups.meets_particles |= 1 << groups.index(&field)?;
        }
        Ok(groups)
    }

    /// Index of the group that a field names.
    pub fn index(&self, field: &Field) -> Result<u8, SceneError> {
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        Ok(field.choice(&names)? as u8)
    }

    /// Index of the group that a kind has by default: its own name, and for walls "platform".
    pub fn default_of(&self, kind: Kind, table: &Table) -> Result<u8, SceneError> {
        let name = if kind == Kind::Wall { Kind::Platform.name() } else { kind.name() };
        let index = self.names.iter().position(|known| known == name);
        index.map(|index| index as u8).ok_or_else(|| {
            let found = format!("nothing, and no group is called {name:?}");
            table.error("group", found, one_of(&self.names))
        })
    }
}

fn names(root: &Table) -> Result<Vec<String>, SceneError> {
    let field = root.need("groups", "a list of names of collision groups")?;
    let items = field.list()?;
    if !(1..=GROUPS_MAX).contains(&items.len()) {
        let found = format!("{} groups", items.len());
        return Err(field.refuse_as(found, format!("1 to {GROUPS_MAX} names")));
    }
    let mut names: Vec<String> = Vec::new();
    for item in &items {
        let name = item.text(NAME_CHARS_MAX)?;
        if names.contains(&name) {
            return Err(item.refuse("each name once"));
        }
        names.push(name);
    }
    Ok(names)
}
