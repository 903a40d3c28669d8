//! A scene's collision groups, and which of them collide.

use super::kind::Kind;
use super::table::{Field, Table, one_of};
use jostle_sim::{EulerGroups, GROUPS_MAX};

const NAME_CHARS_MAX: usize = 32;

/// The names of the groups, and the groups with which each one collides.
pub(super) struct Groups {
    pub names: Vec<String>,
    /// Which groups collide; a group may collide with itself. All other pairs pass through each other. Default: `[]`.
    #[doc(alias = "pairs")]
    pub meets: [u32; GROUPS_MAX],
    /// Which groups push particles out. Default: `[]`.
    #[doc(alias = "particles_meet")]
    pub meets_particles: u32,
}

impl Groups {
    /// Reads `groups`, `pairs` and `particles_meet`.
    pub fn read(root: &Table) -> Groups {
        let mut groups = Groups { names: names(root), meets: [0; GROUPS_MAX], meets_particles: 0 };
        for pair in root.get("pairs").items_of("pairs of groups") {
            let allowed = || "a pair of groups, [\"a\", \"b\"]".to_owned();
            let [a, b] = pair.array([0; 2], allowed, |field, _| groups.index(field));
            groups.meets[usize::from(a)] |= 1 << b;
            groups.meets[usize::from(b)] |= 1 << a;
        }
        for field in root.get("particles_meet").items_of("groups") {
            groups.meets_particles |= 1 << groups.index(&field);
        }
        groups
    }

    /// Reads `integrators`: the groups that are moved by one of Euler's methods.
    pub fn euler(&self, field: &Field) -> EulerGroups {
        let allowed = "{ explicit = [\"group\"], symplectic = [\"group\"] }";
        let mask =
            |field: Field| field.items().iter().fold(0, |all, item| all | 1 << self.index(item));
        let euler = field.given(|field| {
            field.table_or(allowed, |methods| EulerGroups {
                explicit: mask(methods.get("explicit")),
                symplectic: mask(methods.get("symplectic")),
            })
        });
        let euler = euler.unwrap_or(EulerGroups::NONE);
        if euler.explicit & euler.symplectic != 0 {
            field.refuse_as("a group with both methods", "each group once");
        }
        euler
    }

    /// Index of the group named by a field, if the file has it.
    pub fn given(&self, field: &Field) -> Option<u8> {
        field.describe("a group");
        field.index_in(&self.names).map(|index| index as u8)
    }

    /// Index of the group named by a field; 0 if the file is invalid.
    fn index(&self, field: &Field) -> u8 {
        self.given(field).unwrap_or(0)
    }

    /// Index of the default group of a kind: the one with the kind's own name, or "platform" for walls.
    pub fn default_of(&self, kind: Kind, table: &Table) -> u8 {
        let name = if kind == Kind::Wall { Kind::Platform.name() } else { kind.name() };
        let index = self.names.iter().position(|known| known == name);
        index.unwrap_or_else(|| {
            let found = format!("nothing, and no group is called {name:?}");
            table.get("group").refuse_as(found, one_of(&self.names));
            0
        }) as u8
    }
}

fn names(root: &Table) -> Vec<String> {
    let field = root.need("groups", "a list of names of collision groups");
    let items = field.items_of("1 to 32 names");
    if field.is_given() && !(1..=GROUPS_MAX).contains(&items.len()) {
        field.refuse_as(format!("{} groups", items.len()), format!("1 to {GROUPS_MAX} names"));
    }
    let mut names: Vec<String> = Vec::new();
    for item in items.iter().take(GROUPS_MAX) {
        let name = item.text(NAME_CHARS_MAX);
        if names.contains(&name) {
            item.refuse("each name once");
        }
        names.push(name);
    }
    names
}
