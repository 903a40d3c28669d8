//! Scenes used by servers under test.

/// Many bodies that never rest, so that one second of snapshots exceeds any buffer.
pub const RESTLESS: &str = r#"title = "Restless"
size = [400, 200]
gravity = [0, 0]
groups = ["block", "platform"]
pairs = [["block", "platform"], ["block", "block"]]

[limits]
players = 8
bodies = 600

[[bodies]]
kind = "wall"
position = [200, -5]
size = [420, 10]

[[bodies]]
kind = "wall"
position = [200, 205]
size = [420, 10]

[[bodies]]
kind = "wall"
position = [-5, 100]
size = [10, 200]

[[bodies]]
kind = "wall"
position = [405, 100]
size = [10, 200]

[[layouts]]
kind = "block"
count = 250
area = [[10, 10], [390, 95]]
radius = 2
velocity = [70, 40]
restitution = 1
friction = 0

[[layouts]]
kind = "block"
count = 250
area = [[10, 105], [390, 190]]
radius = 2
velocity = [-60, -50]
restitution = 1
friction = 0
"#;

/// A small scene with four seats and a tool.
pub const SMALL: &str = "title = \"Small\"\nsize = [40, 30]\ntools = [\"steer\"]\n\
    groups = [\"hero\"]\n[limits]\nplayers = 4\n[hero]\nspawns = [[20, 15]]\n";

/// An empty scene with room for more players than there are in any test.
pub const CROWD: &str = r#"title = "Crowd"
size = [800, 100]
tools = ["steer"]
groups = ["hero", "platform"]
pairs = [["hero", "platform"]]

[limits]
players = 512

[hero]
spawns = [[100, 20], [300, 20], [500, 20], [700, 20]]

[[bodies]]
kind = "wall"
position = [400, 0]
size = [800, 4]
"#;

/// A game between two sides in which a ball repeatedly flies to the right, so that the right side loses.
pub const DUEL: &str = r#"title = "Duel"
size = [200, 100]
gravity = [0, 0]
tools = ["steer"]
groups = ["hero", "ball", "wall"]
pairs = [["hero", "wall"], ["ball", "wall"]]

[round]
task = "Keep the ball out of your side"
lives = 3
players_min = 2

[[teams]]
name = "left"
color = 0
spawns = [[30, 20], [50, 20]]

[[teams]]
name = "right"
color = 1
spawns = [[170, 20], [150, 20]]

[hero]
size = [9, 12]
spawns = [[100, 20]]

[[bodies]]
kind = "block"
name = "ball"
group = "ball"
position = [60, 60]
radius = 4
velocity = [90, 0]

[[zones]]
name = "goal"
area = [[180, 40], [220, 80]]
who = ["ball"]
color = 1

[[rules]]
enter = "goal"
life = -1
to = "right"
back = 1
"#;
