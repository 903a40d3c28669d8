//! Measures the bytes sent per tick without a feature, with the feature unused, and with it used.

use anyhow::{Result, anyhow};
use jostle_game::scene::Plan;
use jostle_game::{Buttons, Input, Scene, Seat};
use jostle_protocol::Appearance;
use jostle_room::{Rate, Room};
use jostle_sim::Vec2;
use std::sync::Arc;

/// Bytes per tick for one player.
#[derive(Clone, Debug)]
pub struct Bytes {
    /// Name of the feature.
    pub feature: &'static str,
    /// Bytes in a scene without the feature.
    pub lacking: f64,
    /// Bytes in a scene with the feature while it is unused; `None` if the feature is always active.
    pub unused: Option<f64>,
    /// Bytes while the feature is used.
    pub used: f64,
    /// Whether the page needs the particle pipeline.
    pub draws_particles: bool,
}

const TICKS: u32 = 600;
/// A hero on a floor, to which the compared features are added.
const FLOOR: &str = r#"
title = "Floor"
size = [200, 112.5]
groups = ["hero", "platform", "pack", "dumb"]
pairs = [["hero", "platform"], ["dumb", "platform"], ["dumb", "dumb"]]
hero = { spawns = [[40, 20]] }
"#;
const GROUND: &str = "[[bodies]]\nkind = \"wall\"\nposition = [100, -5]\nsize = [400, 20]\n";

/// A feature to be measured: its text in a scene file and the buttons that use it.
struct Sent {
    name: &'static str,
    top: &'static str,
    bodies: &'static str,
    pressed: Buttons,
    /// Whether the feature is always active, so that it cannot be present but unused.
    by_itself: bool,
}

const SENT: [Sent; 5] = [
    Sent {
        name: "particles",
        top: "tools = [\"spray\"]",
        bodies: "",
        pressed: Buttons::MAKE,
        by_itself: false,
    },
    Sent {
        name: "packs",
        top: "tools = [\"launch\"]",
        bodies: "",
        pressed: Buttons::FIRE,
        by_itself: false,
    },
    Sent {
        name: "made bodies, impacts",
        top: "tools = [\"dumb\"]",
        bodies: "",
        pressed: Buttons::MAKE,
        by_itself: false,
    },
    Sent {
        name: "emitters",
        top: "",
        bodies: "[[emitters]]\nrecipe = \"torch\"\nposition = [40, 60]\ncount = 12\nevery = 12\n",
        pressed: Buttons(0),
        by_itself: true,
    },
    Sent {
        name: "kinematic bodies",
        top: "",
        bodies: "[[bodies]]\nkind = \"platform\"\nsize = [24, 3]\npath = [[100, 40], [100, 80]]\nperiod = 10\n",
        pressed: Buttons(0),
        by_itself: true,
    },
];

/// Plays each feature's scenes and measures the bytes sent.
pub fn measure() -> Result<Vec<Bytes>> {
    let lacking = played("", "", Buttons(0))?;
    let of = |sent: &Sent| -> Result<Bytes> {
        let Sent { name, top, bodies, pressed, by_itself } = *sent;
        let unused = (!by_itself).then(|| played(top, bodies, Buttons(0))).transpose()?;
        let used = played(top, bodies, pressed)?;
        let draws_particles = Plan::of(&scene(top, bodies)?).features.particles;
        Ok(Bytes { feature: name, lacking, unused, used, draws_particles })
    };
    SENT.iter().map(of).collect()
}

/// Returns the floor scene with additions.
fn scene(top: &str, bodies: &str) -> Result<Scene> {
    let text = format!("{top}\n{FLOOR}\n{GROUND}{bodies}");
    Ok(Scene::parse("costs.toml", &text)?)
}

/// Mean size of a tick's snapshot, in bytes, for a player who reads all of them.
fn played(top: &str, bodies: &str, pressed: Buttons) -> Result<f64> {
    let mut room = Room::new("costs", Arc::new(scene(top, bodies)?), 1);
    let ann = Appearance::new("Ann", 0).map_err(|error| anyhow!("{error:?}"))?;
    room.join(ann, None).map_err(|refusal| anyhow!("{refusal:?}"))?;
    let (subscriber, _) = room.subscribe(Rate::Full);
    let mut sum = 0;
    for tick in 1..=TICKS {
        // Buttons are alternately pressed and released, so that a tool that acts on a press acts every other tick.
        let buttons = if tick % 2 == 0 { pressed } else { Buttons(0) };
        room.input(Seat(0), tick, Input::new(buttons, Some(Vec2::new(150.0, 60.0))));
        room.tick();
        sum += room.message(&subscriber).map_or(0, |coded| coded.len());
    }
    Ok(sum as f64 / f64::from(TICKS))
}
