//! Scenes for servers under test.

/// Many bodies that never rest, so that a second of snapshots is larger than any buffer.
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

/// Room for more players than any test has, and nothing else.
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
