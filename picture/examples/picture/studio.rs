//! Plays scenes with scripted players and draws moments of them as WebP files.

use super::cast;
use jostle_client_web::replay::player::ReplayPlayer;
use jostle_client_web::view::draw::DrawList;
use jostle_client_web::view::frame::View;
use jostle_game::Scene;
use jostle_picture::Headless;
use jostle_protocol::Appearance;
use jostle_protocol::limits::COLORS;
use jostle_protocol::replay::header;
use jostle_room::Room;
use jostle_sim::Vec2;
use std::error::Error;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

const SEED: u64 = 7;

const SIZE: [u32; 2] = [640, 360];

/// Draws a scene after this many ticks; returns the size of the file in bytes. `close` is the centre and the height of a
/// view in which something happens; the picture shows the whole scene without it.
pub fn draw(
    headless: &mut Headless,
    scene: Scene,
    ticks: u32,
    close: Option<[f32; 3]>,
    path: &Path,
) -> Result<u64, Box<dyn Error>> {
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
    webp(&headless.picture(SIZE, &list)?.png()?, path)
}

/// Maximum size of a picture in bytes. It is small because a first visit downloads several pictures.
const PICTURE_BYTES_MAX: u64 = 12_000;

/// Compresses a PNG with Google's encoder, at the best quality that stays within [`PICTURE_BYTES_MAX`]; returns the
/// size.
fn webp(png: &[u8], path: &Path) -> Result<u64, Box<dyn Error>> {
    let bytes = webp_of(&["-q", "70"], png, path)?;
    if bytes <= PICTURE_BYTES_MAX {
        return Ok(bytes);
    }
    webp_of(&["-size", &PICTURE_BYTES_MAX.to_string(), "-pass", "6"], png, path)
}

fn webp_of(quality: &[&str], png: &[u8], path: &Path) -> Result<u64, Box<dyn Error>> {
    let mut command = Command::new("cwebp");
    command.args(quality).args(["-quiet", "-m", "6", "-o"]).arg(path);
    command.args(["--", "-"]).stdin(Stdio::piped());
    let mut child = command.spawn().map_err(|error| format!("cwebp (package webp): {error}"))?;
    child.stdin.take().ok_or("no input")?.write_all(png)?;
    if !child.wait()?.success() {
        return Err("cwebp failed".into());
    }
    Ok(std::fs::metadata(path)?.len())
}

/// A replay of a room with the players from [`cast`], plus the room's own bots if the scene uses them.
fn played(scene: Scene, ticks: u32) -> Result<Vec<u8>, Box<dyn Error>> {
    let players = cast::players(&scene);
    let mut room = Room::new("picture", Arc::new(scene), SEED);
    room.record("", 0);
    for seat in 0..players {
        let appearance = Appearance::new("Player", (seat % u16::from(COLORS)) as u8)?;
        room.join(appearance, None).map_err(|refusal| format!("{refusal:?}"))?;
    }
    let mut records = Vec::new();
    for tick in 0..ticks {
        for (seat, input) in cast::inputs(room.game(), tick) {
            if seat.0 < players {
                room.input(seat, tick + 1, input);
            }
        }
        room.tick();
        records.extend(room.take_records());
    }
    records.extend(room.stop_recording());
    let mut bytes = header();
    records.iter().for_each(|record| bytes.extend(record.seal()));
    Ok(bytes)
}
