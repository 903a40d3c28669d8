//! What games send a tick, for the report, as CSV: without a feature, with it unused, and used.

use jostle_protocol::Appearance;
use jostle_room::{Rate, Room};
use jostle_sim::scene::{Part, Plan};
use jostle_sim::{Buttons, Input, Scene, Seat, Vec2};
use std::process::ExitCode;
use std::sync::Arc;

fn main() -> ExitCode {
    match bytes() {
        Some(table) => {
            println!("{table}");
            ExitCode::SUCCESS
        }
        None => ExitCode::FAILURE,
    }
}

const TICKS: u32 = 600;
/// A hero on a floor; what is compared comes after it.
const FLOOR: &str = r#"
title = "Floor"
size = [200, 112.5]
groups = ["hero", "platform", "pack", "dumb"]
pairs = [["hero", "platform"], ["dumb", "platform"], ["dumb", "dumb"]]
hero = { spawns = [[40, 20]] }
"#;
const GROUND: &str = "[[bodies]]\nkind = \"wall\"\nposition = [100, -5]\nsize = [400, 20]\n";

/// A feature on the wire: what a scene says to have it, and what is pressed to use it.
struct Sent {
    name: &'static str,
    top: &'static str,
    bodies: &'static str,
    /// The tick's buttons of the one player.
    pressed: Buttons,
    /// Whether it works by itself: then it can not be there and unused.
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

/// Bytes a tick without a feature, with it unused, and used.
fn bytes() -> Option<String> {
    let mut lines = vec!["feature,lacking,unused,used,draws particles".to_owned()];
    for sent in &SENT {
        let without = played("", "", Buttons(0))?;
        let unused = match sent.by_itself {
            true => String::new(),
            false => format!("{:.3}", played(sent.top, sent.bodies, Buttons(0))?),
        };
        let used = played(sent.top, sent.bodies, sent.pressed)?;
        let particles = u8::from(Plan::of(&scene(sent.top, sent.bodies)?).uses(Part::Particles));
        lines.push(format!("\"{}\",{without:.3},{unused},{used:.3},{particles}", sent.name));
    }
    Some(lines.join("\n"))
}

/// The floor with more in it.
fn scene(top: &str, bodies: &str) -> Option<Scene> {
    let text = format!("{top}\n{FLOOR}\n{GROUND}{bodies}");
    Scene::parse("costs.toml", &text).map_err(|error| eprintln!("{error}")).ok()
}

/// Mean bytes of a tick's snapshot for a player who reads all of them.
fn played(top: &str, bodies: &str, pressed: Buttons) -> Option<f32> {
    let mut room = Room::new("costs", Arc::new(scene(top, bodies)?), 1);
    room.join(Appearance::new("Ann", 0).ok()?, None).ok()?;
    let (reader, _) = room.begin(Rate::Full);
    let mut sum = 0;
    for tick in 1..=TICKS {
        // Up and down again: a tool that acts on a press acts every second time.
        let buttons = if tick % 2 == 0 { pressed } else { Buttons(0) };
        room.input(Seat(0), tick, Input { buttons, pointer: Some(Vec2::new(150.0, 60.0)) });
        room.tick();
        sum += room.message(&reader).map_or(0, |coded| coded.len());
    }
    Some(sum as f32 / TICKS as f32)
}
