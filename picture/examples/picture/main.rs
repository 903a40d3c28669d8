//! Renders the lobby's pictures of all scenes into `assets/pictures` without a window:
//! `cargo run -p jostle-picture --example picture`.
//!
//! The players are scripted: they fly around and shoot, or are the room's bots. The pictures are identical every time.

mod cast;
mod studio;

use jostle_game::Scene;
use jostle_picture::Headless;
use std::error::Error;
use std::path::Path;

/// The lobby's pictures: for each scene, a moment and optionally a view in which something happens.
const LOBBY: [(&str, u32, Option<[f32; 3]>); 24] = [
    ("arena", 480, Some([178.0, 98.0, 100.0])),
    ("splash", 300, Some([160.0, 80.0, 130.0])),
    ("hockey", 540, Some([120.0, 60.0, 130.0])),
    ("hill", 600, Some([160.0, 90.0, 130.0])),
    ("race", 420, Some([190.0, 62.0, 115.0])),
    ("pong", 420, None),
    ("flags", 420, Some([160.0, 85.0, 150.0])),
    ("herd", 660, None),
    ("roundup", 780, Some([102.0, 56.0, 112.0])),
    ("lock", 260, Some([80.0, 55.0, 100.0])),
    ("lamp", 420, None),
    ("slingshot", 612, None),
    ("tower", 150, None),
    ("bridge", 1200, None),
    ("hall", 200, Some([220.0, 100.0, 200.0])),
    ("bounds", 100, None),
    ("emitters", 330, None),
    ("bounce", 190, None),
    ("planets", 60, None),
    ("euler", 500, None),
    ("listing", 44, None),
    ("impulse", 240, None),
    ("particles", 210, None),
    ("pile", 1500, None),
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut headless = Headless::open()?;
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/pictures");
    for (name, ticks, close) in LOBBY {
        let found = Scene::built_in().into_iter().find(|scene| scene.name == name);
        let scene = found.ok_or_else(|| format!("there is no scene {name}"))?;
        let path = folder.join(format!("{name}.webp"));
        let bytes = studio::draw(&mut headless, scene, ticks, close, &path)?;
        println!("{name}: {bytes} bytes, by {}", headless.adapter);
    }
    Ok(())
}
