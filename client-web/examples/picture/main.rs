//! Draws the lobby's pictures, and any other still, without a window:
//!
//! ```text
//! cargo run -p jostle-client-web --example picture                 every scene, into assets/pictures
//! cargo run -p jostle-client-web --example picture -- SCENE OUT.png [--ticks N] [--size W H]
//!     [--view X Y HEIGHT] [--bounds]
//! ```
//!
//! Players are bots that fly about and shoot; the same arguments give the same picture.

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
use std::path::Path;
use std::sync::Arc;

const SEED: u64 = 7;

/// One picture.
struct Shot {
    scene: String,
    out: String,
    ticks: u32,
    size: [u32; 2],
    /// Middle and height of the view; `None` shows the whole world.
    view: Option<(Vec2, f32)>,
    bounds: bool,
}

/// The lobby's pictures: a moment and a place in which something happens.
const LOBBY: [(&str, u32, Option<[f32; 3]>); 6] = [
    ("arena", 480, Some([178.0, 98.0, 100.0])),
    ("bounds", 100, None),
    ("emitters", 330, None),
    ("impulse", 240, None),
    ("particles", 210, None),
    ("pile", 1500, None),
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut headless = Headless::open()?;
    if arguments.is_empty() {
        for (scene, ticks, view) in LOBBY {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/pictures");
            std::fs::create_dir_all(&folder)?;
            let shot = Shot {
                scene: scene.to_owned(),
                out: folder.join(format!("{scene}.png")).to_string_lossy().into_owned(),
                ticks,
                size: [640, 360],
                view: view.map(|[x, y, height]| (Vec2::new(x, y), height)),
                bounds: false,
            };
            take(&mut headless, &shot)?;
        }
        return Ok(());
    }
    take(&mut headless, &parse(&arguments)?)
}

fn parse(arguments: &[String]) -> Result<Shot, Box<dyn Error>> {
    let [scene, out, options @ ..] = arguments else {
        return Err(
            "usage: picture SCENE OUT.png [--ticks N] [--size W H] [--view X Y HEIGHT]".into()
        );
    };
    let mut shot = Shot {
        scene: scene.clone(),
        out: out.clone(),
        ticks: 300,
        size: [1280, 720],
        view: None,
        bounds: false,
    };
    let mut words = options.iter();
    while let Some(option) = words.next() {
        let mut number = || -> Result<f32, Box<dyn Error>> {
            let word = words.next().ok_or_else(|| format!("{option} needs more numbers"))?;
            word.parse().map_err(|_| format!("{option}: {word} is no number").into())
        };
        match option.as_str() {
            "--ticks" => shot.ticks = number()? as u32,
            "--size" => shot.size = [number()? as u32, number()? as u32],
            "--view" => shot.view = Some((Vec2::new(number()?, number()?), number()?)),
            "--bounds" => shot.bounds = true,
            _ => return Err(format!("unknown option {option}").into()),
        }
    }
    Ok(shot)
}

fn take(headless: &mut Headless, shot: &Shot) -> Result<(), Box<dyn Error>> {
    let scene = Scene::built_in()
        .into_iter()
        .find(|scene| scene.name == shot.scene)
        .ok_or_else(|| format!("there is no scene {}", shot.scene))?;
    let view = view(&scene, shot);
    let mut film = ReplayPlayer::open(played(scene, shot.ticks)?)?;
    film.seek(shot.ticks);
    let mut frame = film.frame(view);
    frame.bounds |= shot.bounds;
    let mut list = DrawList::new();
    list.fill(&frame);
    let picture = headless.picture(shot.size, &list)?;
    let bytes = picture.png()?;
    std::fs::write(&shot.out, &bytes)?;
    println!(
        "{}: {} bytes, {} bodies, {} particles, by {}",
        shot.out,
        bytes.len(),
        frame.bodies.len(),
        frame.particles.len(),
        headless.adapter
    );
    Ok(())
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

fn view(scene: &Scene, shot: &Shot) -> View {
    let aspect = shot.size[0] as f32 / shot.size[1] as f32;
    let whole = (scene.size * 0.5, scene.size.y.max(scene.size.x / aspect));
    let (center, height) = shot.view.unwrap_or(whole);
    View { center, height, pixels: shot.size }
}
