//! Draws the lobby's pictures, of every scene, into `assets/pictures`, without a window:
//! `cargo run -p jostle-client-web --example picture`.
//!
//! Players are bots that fly about and shoot; the pictures are the same each time.

mod cast;

use jostle_client_web::replay::player::ReplayPlayer;
use jostle_client_web::view::draw::DrawList;
use jostle_client_web::view::frame::View;
use jostle_client_web::view::render::headless::Headless;
use jostle_game::{Game, Scene, Seat};
use jostle_protocol::Appearance;
use jostle_protocol::limits::COLORS;
use jostle_protocol::replay::{Change, Start, header};
use jostle_room::Recorder;
use jostle_sim::Vec2;
use std::error::Error;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

const SEED: u64 = 7;

const SIZE: [u32; 2] = [640, 360];

/// The lobby's pictures: a moment and a place in which something happens.
const LOBBY: [(&str, u32, Option<[f32; 3]>); 22] = [
    ("arena", 480, Some([178.0, 98.0, 100.0])),
    ("splash", 420, Some([160.0, 80.0, 130.0])),
    ("hockey", 330, None),
    ("hill", 600, Some([160.0, 90.0, 130.0])),
    ("race", 420, None),
    ("pong", 420, None),
    ("flags", 420, Some([160.0, 85.0, 150.0])),
    ("herd", 420, None),
    ("roundup", 420, Some([160.0, 56.0, 112.0])),
    ("lock", 480, None),
    ("lamp", 420, None),
    ("slingshot", 612, None),
    ("tower", 150, None),
    ("bridge", 1200, None),
    ("hall", 200, Some([220.0, 100.0, 200.0])),
    ("bounds", 100, None),
    ("emitters", 330, None),
    ("bounce", 190, None),
    ("planets", 60, None),
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
        let aspect = SIZE[0] as f32 / SIZE[1] as f32;
        let view = match close {
            Some([x, y, height]) => View { center: Vec2::new(x, y), height, pixels: SIZE },
            None => {
                let height = scene.size.y.max(scene.size.x / aspect);
                View { center: scene.size * 0.5, height, pixels: SIZE }
            }
        };
        let mut film = ReplayPlayer::open(played(scene, ticks)?)?;
        film.seek(ticks);
        let mut list = DrawList::new();
        list.fill(&film.frame(view));
        let bytes = headless.picture(SIZE, &list)?.png()?;
        let bytes = webp(&bytes, &folder.join(format!("{name}.webp")))?;
        println!("{name}: {bytes} bytes, by {}", headless.adapter);
    }
    Ok(())
}

/// Packs a PNG by Google's own encoder; returns the bytes that it wrote.
fn webp(png: &[u8], path: &Path) -> Result<u64, Box<dyn Error>> {
    let arguments = ["-quiet", "-q", "70", "-m", "6", "-o"];
    let mut command = Command::new("cwebp");
    command.args(arguments).arg(path).args(["--", "-"]).stdin(Stdio::piped());
    let mut child = command.spawn().map_err(|error| format!("cwebp (package webp): {error}"))?;
    child.stdin.take().ok_or("no input")?.write_all(png)?;
    if !child.wait()?.success() {
        return Err("cwebp failed".into());
    }
    Ok(std::fs::metadata(path)?.len())
}

/// A replay of the scene with its bots.
fn played(scene: Scene, ticks: u32) -> Result<Vec<u8>, Box<dyn Error>> {
    let (name, source) = (scene.name.clone(), scene.source.clone());
    let start = Start { scene_name: name, scene: source, seed: SEED, ..Start::default() };
    let mut game = Game::new(Arc::new(scene), SEED);
    let mut recorder = Recorder::new(start, &game, Vec::new());
    for tick in 0..ticks {
        let mut changes = Vec::new();
        for seat in (0..cast::players(game.scene())).filter(|_| tick == 0) {
            changes.push(Change::Join(
                Seat(seat),
                Appearance::new("Bot", (seat % u16::from(COLORS)) as u8)?,
            ));
            game.join(Seat(seat));
        }
        let inputs = cast::inputs(&game, tick);
        game.tick(&inputs);
        recorder.tick(changes, &inputs, &game, Vec::new);
    }
    let mut bytes = header();
    recorder.finish(&game).iter().for_each(|record| bytes.extend(record.seal()));
    Ok(bytes)
}
