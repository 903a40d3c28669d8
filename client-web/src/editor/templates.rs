//! Complete small scenes from which a new scene starts.

/// Every template, under the name that the page's buttons use for it.
pub const ALL: [(&str, &str); 5] = [
    ("empty", EMPTY),
    ("ball", include_str!("../../../assets/templates/ball.toml")),
    ("race", include_str!("../../../assets/templates/race.toml")),
    ("splash", include_str!("../../../assets/templates/splash.toml")),
    ("hill", include_str!("../../../assets/templates/hill.toml")),
];

/// A floor, a wall on each side and a spawn point. An empty text becomes this when its first piece is added.
pub const EMPTY: &str = include_str!("../../../assets/templates/empty.toml");

/// The template with this name.
pub fn named(name: &str) -> Option<&'static str> {
    ALL.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}
