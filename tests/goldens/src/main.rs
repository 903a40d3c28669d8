//! Records and verifies the golden replays: `jostle-goldens record DIR SCENE.toml...`,
//! `jostle-goldens verify FILE...`.

use jostle_game::{Buttons, Input, Scene, Seat};
use jostle_protocol::Appearance;
use jostle_protocol::replay::{Record, Replay, header};
use jostle_room::{Room, divergence};
use jostle_sim::Rng;
use jostle_sim::Vec2;
use std::num::NonZero;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

const TICKS: u32 = 600;
const SEED: u64 = 7;
const PLAYERS: u8 = 3;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let done = match arguments.split_first() {
        Some((verb, files)) if verb == "verify" && !files.is_empty() => verify(files),
        Some((verb, rest)) if verb == "record" && !rest.is_empty() => record(&rest[0], &rest[1..]),
        _ => Err("usage: jostle-goldens record DIR SCENE.toml... | verify FILE...".to_owned()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Records one file per scene, first for the shipped scenes and then for the given ones.
fn record(dir: &str, files: &[String]) -> Result<(), String> {
    let mut scenes = Scene::built_in();
    for file in files {
        let source = std::fs::read_to_string(file).map_err(|error| format!("{file}: {error}"))?;
        scenes.push(Scene::parse(file, &source).map_err(|error| error.to_string())?);
    }
    for scene in scenes {
        let path = Path::new(dir).join(format!("{}.jostle", scene.name));
        let mut bytes = header();
        played(scene).iter().for_each(|record| bytes.extend(record.seal()));
        std::fs::write(&path, bytes).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}

/// Plays a game with three players who press all buttons, one of whom joins late and one of whom leaves early.
fn played(scene: Scene) -> Vec<Record> {
    let size = scene.size;
    let mut room = Room::new("golden", Arc::new(scene), SEED);
    room.record("golden", 0);
    let mut rng = Rng::new(SEED, 11);
    for tick in 0..TICKS {
        for seat in (0..PLAYERS).filter(|&seat| tick == u32::from(seat) * 60) {
            let look = Appearance::new(["Ada", "Grace", "Alan"][usize::from(seat)], seat);
            let look = look.expect("a good name");
            room.join(look, None).expect("a free seat");
        }
        if tick == TICKS * 3 / 4 {
            room.leave(Seat(1));
        }
        for seat in 0..PLAYERS {
            room.input(Seat(seat.into()), tick + 1, press(&mut rng, size));
        }
        room.tick();
    }
    room.stop_recording()
}

/// Generates a random input. Each button is down in a quarter of the ticks, except V, which clears the players'
/// creations and is rarely pressed.
fn press(rng: &mut Rng, size: Vec2) -> Input {
    let mut buttons = (rng.next_u32() & rng.next_u32()) as u16 & Buttons::ALL.0;
    if rng.below(100) > 0 {
        buttons &= !Buttons::CLEAR.0;
    }
    let pointer = Vec2::new(rng.range(0.0, size.x), rng.range(0.0, size.y));
    Input::new(Buttons(buttons), Some(pointer))
}

/// Verifies the files on as many threads as there are processors.
fn verify(files: &[String]) -> Result<(), String> {
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    let next = AtomicUsize::new(0);
    let work = || {
        while let Some(file) = files.get(next.fetch_add(1, Ordering::Relaxed)) {
            verify_one(file)?;
        }
        Ok(())
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().expect("no panic"))
    })
}

fn verify_one(file: &str) -> Result<(), String> {
    let bytes = std::fs::read(file).map_err(|error| format!("{file}: {error}"))?;
    let replay = Arc::new(Replay::read(bytes).map_err(|error| format!("{file}: {error}"))?);
    if let Some(error) = replay.ending().error() {
        return Err(format!("{file}: {error}"));
    }
    let found = divergence::verify(&replay, |_| {}).map_err(|error| error.to_string())?;
    if let Some(divergence) = found {
        return Err(format!("{file}: {divergence}"));
    }
    println!("{file}: {} ticks equal", replay.last_tick());
    Ok(())
}
