//! Games in the page that the address asks for, while their scenes are awaited.

use crate::net::api::{self, query_value};
use crate::world::ghost::GhostWish;
use crate::world::room_in_page::DemoRequest;
use jostle_game::Scene;
use jostle_game::scene::WorstTick;

/// Milliseconds that a tick of a scene may take by its limits before the player is asked: past a tenth of a second a
/// page is felt to hang. The largest shipped scene, `hall`, stays within.
const HEAVY_TICK_MS: f32 = 100.0;

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

    /// Bots in a game of this scene: those that a round needs to begin, and those that are wished for, or that the scene wants.
    pub fn bots_in(&self, scene: &Scene) -> u16 {
        let round = scene.rules.round.as_ref();
        let (fill, players_min) = round.map_or((0, 1), |round| (round.fill, round.players_min));
        let [needed, wanted] = [0, fill].map(|fill| {
            let seats = [fill, players_min, scene.players_max].map(u32::from);
            api::bots_beside_one(scene.hero.is_some(), seats) as u16
        });
        self.bots.unwrap_or(wanted).max(needed)
    }

    /// The worst tick of a scene, if it may be too heavy for the page.
    pub fn heavy_tick(scene: &Scene) -> Option<WorstTick> {
        Some(WorstTick::of(scene)).filter(|worst| worst.ms > HEAVY_TICK_MS)
    }
}
