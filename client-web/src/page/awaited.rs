//! Games in the page that the address asks for, while their scenes are awaited.

use crate::net::api::query_value;
use crate::world::ghost::GhostWish;
use crate::world::room_in_page::DemoRequest;

/// A game in the page that waits for its scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Awaited {
    Demo(DemoRequest),
    /// A scene to play alone, by its name.
    Alone(String, Wish),
    /// A scene to edit, by its name.
    Edit(String),
}

impl Awaited {
    /// Name of the scene.
    pub fn scene(&self) -> &str {
        match self {
            Awaited::Demo(request) => &request.scene,
            Awaited::Alone(scene, _) | Awaited::Edit(scene) => scene,
        }
    }
}

/// How a scene is played alone. The same request begins the same game.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wish {
    /// Bots; as the scene wants them if not given.
    pub bots: Option<u16>,
    /// Seed of the game; 1 if not given.
    pub seed: Option<u64>,
    /// The run whose ghost goes along.
    pub ghost: Option<GhostWish>,
}

impl Wish {
    /// Reads the part of an address after `#`.
    pub fn of(hash: &str) -> Wish {
        let number = |name| query_value(hash, name);
        Wish {
            bots: number("bots").and_then(|bots| bots.parse().ok()),
            seed: number("seed").and_then(|seed| seed.parse().ok()),
            ghost: number("ghost").and_then(GhostWish::parse),
        }
    }
}
