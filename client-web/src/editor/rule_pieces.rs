//! Pieces of the palette that carry rules: each is a zone, and the tables that make it work at once.

use super::field;
use super::groups::with_group;
use super::references::names;
use super::tables;
use toml::de::DeTable;

/// The text of a piece. In its parts, `$n` is the piece's number, `$own` and `$color` are the name and the colour of
/// the team that it belongs to, `$other` is the opposing team and `$m` the number of its piece, `$who` is the group of
/// the balls, and `$area` and `$at` are the zone's corners and centre.
pub struct RulePiece {
    /// The zone's name without its number, which is also the name in the palette.
    pub base: &'static str,
    /// The zone's fields, after its name.
    zone: &'static str,
    /// The tables that come with it.
    tables: &'static str,
    /// The fields of the round, if the piece needs one and the scene has none.
    round: &'static str,
    /// The collision groups that it needs.
    groups: &'static [&'static str],
    /// Whether the piece belongs to a team.
    of_team: bool,
}

/// A place into which one team has to get the ball.
pub const GOAL: RulePiece = RulePiece {
    base: "goal",
    zone: "area = $area\nwho = [\"$who\"]\nlabel = \"goal\"\ncolor = $color",
    tables: r#"
[[rules]]
enter = "goal-$n"
score = 1
to = "$other"
say = "{it} scored"
back = 1.5
splash = "explosion"
"#,
    round: "task = \"Get the ball into the other goal, first to five\"\ngoal = 5\ntime = 180\nfill = 2\n",
    groups: &["hero", "$who"],
    of_team: true,
};

/// A place that sends heroes back to their last checkpoint.
pub const LAVA: RulePiece = RulePiece {
    base: "lava",
    zone: "area = $area\ntouch = true\nlabel = \"lava\"\ncolor = 5",
    tables: "\n[[rules]]\nenter = \"lava-$n\"\nsplash = \"explosion\"\nback = 0.5\n",
    round: "",
    groups: &["hero"],
    of_team: false,
};

/// A place to which heroes come back.
pub const CHECKPOINT: RulePiece = RulePiece {
    base: "checkpoint",
    zone: "area = $area\nlabel = \"checkpoint\"\ncolor = 3",
    tables: "\n[[rules]]\nenter = \"checkpoint-$n\"\ncheckpoint = true\nsplash = \"spark\"\n",
    round: "",
    groups: &["hero"],
    of_team: false,
};

/// A place where the first hero to reach it wins.
pub const FINISH: RulePiece = RulePiece {
    base: "finish",
    zone: "area = $area\nlabel = \"finish\"\ncolor = 7",
    tables: r#"
[[rules]]
enter = "finish-$n"
end = "win"
say = "{it} reached the finish"
splash = "fountain"
"#,
    round: "task = \"Be the first at the finish\"\ntime = 180\nfill = 2\n",
    groups: &["hero"],
    of_team: false,
};

/// A team's flag, and the place to which the team brings the opposing flag.
pub const HOME: RulePiece = RulePiece {
    base: "home",
    zone: "area = $area\nwho = [\"flag-$m\"]\nlabel = \"home\"\ncolor = $color",
    tables: r#"
[[bodies]]
kind = "block"
name = "flag-$n"
group = "flag-$n"
position = $at
radius = 3
mass = 0.1
friction = 2

[[zones]]
name = "mark-$n"
follow = "flag-$n"
position = [0, 0]
radius = 5
who = ["flag-$n"]
label = "flag"
color = $color

[[rules]]
touch = ["hero", "flag-$n"]
team = "$other"
carry = true

[[rules]]
touch = ["hero", "flag-$n"]
team = "$own"
reset = ["flag-$n"]

[[rules]]
lost = "flag-$n"
back = true
"#,
    round: "task = \"Touch their flag, and bring it home\"\ngoal = 3\ntime = 300\nfill = 2\n",
    groups: &["hero", "flag-$n", "flag-$m"],
    of_team: true,
};

/// The rule that rewards a team for the opposing flag, which exists only if both teams have a flag.
const BROUGHT: &str = r#"
[[rules]]
on = "home-$n"
score = 1
to = "$own"
reset = ["flag-$m"]
"#;

impl RulePiece {
    /// Adds the piece to a text, with its zone at these corners and centre, each written as TOML.
    pub fn added(&self, text: &str, area: &str, at: &str) -> Option<String> {
        let known = names(text);
        let has = |base: &str, number: usize| known.contains(&format!("{base}-{number}"));
        let n = (1..).find(|number| !has(self.base, *number))?;
        // Pieces of opposing teams come in pairs.
        let m = if n % 2 == 1 { n + 1 } else { n - 1 };
        let mut text = ended(text.to_owned());
        if !self.round.is_empty() && field::is_missing(&text, "round") {
            text = format!("{text}\n[round]\n{}", self.round);
        }
        if self.of_team {
            text = tables::with_teams(text, 2)?;
        }
        let blanks = Blanks { teams: teams(&text), who: ball_group(&text), area, at };
        for group in self.groups {
            text = with_group(&text, &blanks.fill(group, n, m));
        }
        let fields = format!("name = \"{}-{n}\"\n{}", self.base, blanks.fill(self.zone, n, m));
        text = tables::added(&text, "zones", &fields)?;
        let is_home = self.base == HOME.base;
        let mut tables = String::new();
        if !is_home || !has("flag", n) {
            tables += &blanks.fill(self.tables, n, m);
            if is_home && has("home", m) {
                tables += &blanks.fill(BROUGHT, m, n);
            }
        }
        if is_home && has("flag", m) {
            tables += &blanks.fill(BROUGHT, n, m);
        }
        for table in tables.split("\n[[").skip(1) {
            let (list, fields) = table.split_once("]]\n")?;
            text = tables::added(&text, list, fields.trim_end())?;
        }
        Some(text)
    }
}

/// The values for the blanks in the texts of a piece.
struct Blanks<'a> {
    teams: Vec<(String, i64)>,
    who: String,
    area: &'a str,
    at: &'a str,
}

impl Blanks<'_> {
    /// Fills a text of the piece with number `n`, whose opposing piece has number `m`.
    fn fill(&self, part: &str, n: usize, m: usize) -> String {
        let team = |number: usize| {
            let team = self.teams.get((number - 1) % self.teams.len().max(1));
            team.map_or(("", 0), |(name, color)| (name, *color))
        };
        let (own, color) = team(n);
        let parts = [
            ("$n", &*n.to_string()),
            ("$m", &*m.to_string()),
            ("$own", own),
            ("$other", team(m).0),
            ("$color", &*color.to_string()),
            ("$who", &*self.who),
            ("$area", self.area),
            ("$at", self.at),
        ];
        parts.iter().fold(part.to_owned(), |part, (name, value)| part.replace(name, value))
    }
}

/// The text with a final newline.
fn ended(mut text: String) -> String {
    if !text.ends_with('\n') {
        text.push('\n');
    }
    text
}

/// The names and colours of the teams.
fn teams(text: &str) -> Vec<(String, i64)> {
    let Ok(root) = DeTable::parse(text) else { return Vec::new() };
    let items = root.get_ref().get("teams").and_then(|teams| teams.get_ref().as_array());
    let tables = items.into_iter().flatten().map(|item| item.get_ref().as_table());
    let team = |(index, table): (usize, Option<&DeTable>)| {
        let name = table?.get("name")?.get_ref().as_str()?.to_owned();
        let color = table?.get("color").and_then(super::text::number);
        Some((name, color.map_or(index as i64, |color| color.value as i64)))
    };
    tables.enumerate().filter_map(team).collect()
}

/// The group of the first ball, or of the first block.
pub fn ball_group(text: &str) -> String {
    let group = || {
        let root = DeTable::parse(text).ok()?;
        let bodies = root.get_ref().get("bodies")?.get_ref().as_array()?;
        let is_block = |body: &&DeTable| {
            body.get("kind").is_some_and(|kind| kind.get_ref().as_str() == Some("block"))
        };
        let blocks = bodies.iter().filter_map(|body| body.get_ref().as_table()).filter(is_block);
        let ball = blocks.clone().find(|body| body.contains_key("radius"));
        let ball = ball.or_else(|| blocks.clone().next())?;
        Some(ball.get("group")?.get_ref().as_str()?.to_owned())
    };
    group().unwrap_or_else(|| "block".to_owned())
}
