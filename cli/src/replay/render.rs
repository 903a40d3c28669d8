//! `jostle replay render` makes pictures of a replay, drawn by the same code that draws the page.

#[cfg(feature = "render")]
mod painter;

use super::file::read;
use crate::output::Failure;
use jostle_protocol::replay::{Ending, Replay};
use jostle_sim::TICKS_PER_SECOND;
use std::path::PathBuf;

/// Maximum number of pictures in a film: an hour at 10 per second.
const FRAMES_MAX: u64 = 36_000;
/// Maximum width or height of a picture, pixels.
const SIZE_MAX: u32 = 8192;

/// Draw a tick, or the frames of a film, as PNG pictures.
///
/// For a single picture, use --tick N --out FILE.png. For a film, --from A --to B --fps F --out DIR creates
/// frame-00000.png and so on, which any video encoder can combine. Drawing requires Vulkan or OpenGL ES; Mesa's
/// software drivers are enough (Debian's packages libegl1 libgles2 libgl1-mesa-dri).
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub struct Render {
    /// The replay file
    file: PathBuf,
    /// The tick to draw
    #[arg(long, value_name = "N", required_unless_present = "from")]
    tick: Option<u32>,
    /// First tick of a film
    #[arg(long, value_name = "A", requires = "to", conflicts_with = "tick")]
    from: Option<u32>,
    /// Last tick of a film
    #[arg(long, value_name = "B", requires = "from")]
    to: Option<u32>,
    /// Frames per second of the film
    #[arg(long, value_name = "F", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=60))]
    fps: u32,
    /// The picture file, or the directory for the film
    #[arg(long, value_name = "PATH")]
    out: PathBuf,
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    size: [u32; 2],
    /// Follow the player in this seat, as the page does. Without this flag, the whole world is shown
    #[arg(long, value_name = "SEAT")]
    follow: Option<u16>,
    /// Height in pixels of a strip at the bottom that will be covered; the world is fitted above it
    #[arg(long, value_name = "PIXELS", default_value_t = 0)]
    bottom: u32,
}

/// The failure of commands that draw, in a program that cannot.
#[cfg(not(feature = "render"))]
pub fn without_renderer() -> Failure {
    let text = "this program was built without its renderer; `cargo build --release --features render` has it";
    Failure::Check(text.to_owned())
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let allowed = || format!("allowed: WIDTHxHEIGHT, each 16 to {SIZE_MAX}");
    let (width, height) = text.split_once('x').ok_or_else(allowed)?;
    let side = |text: &str| text.parse().ok().filter(|side| (16..=SIZE_MAX).contains(side));
    match (side(width), side(height)) {
        (Some(width), Some(height)) => Ok([width, height]),
        _ => Err(allowed()),
    }
}

impl Render {
    /// Draws the requested pictures.
    pub fn run(self) -> Result<(), Failure> {
        let replay = read(&self.file)?;
        let ticks = self.ticks(&replay)?;
        self.draw(replay, &ticks)
    }

    #[cfg(not(feature = "render"))]
    fn draw(self, _: Replay, _: &[u32]) -> Result<(), Failure> {
        Err(without_renderer())
    }

    /// The ticks to draw, of which there is at least one.
    fn ticks(&self, replay: &Replay) -> Result<Vec<u32>, Failure> {
        let (first, last) = (replay.first_tick(), replay.last_tick());
        let inside = |tick: u32| (first..=last).contains(&tick);
        let cut = match replay.ending() {
            Ending::Whole => "",
            Ending::Cut(_) => " (the rest of the file is missing)",
            Ending::Damaged(_) => " (the file is damaged there)",
        };
        let outside = |tick: u32| {
            let allowed = format!("allowed: {first} to {last}{cut}");
            Failure::Usage(format!("{}: found tick {tick}; {allowed}", self.file.display()))
        };
        let (from, to) = match (self.tick, self.from, self.to) {
            (_, Some(from), Some(to)) => (from, to),
            (tick, ..) => (tick.unwrap_or(first), tick.unwrap_or(first)),
        };
        if let Some(tick) = [from, to].into_iter().find(|&tick| !inside(tick)) {
            return Err(outside(tick));
        }
        let frames = u64::from(to.saturating_sub(from)) * u64::from(self.fps)
            / u64::from(TICKS_PER_SECOND)
            + 1;
        if from > to || frames > FRAMES_MAX {
            let found = format!("found {from} to {to} at {} a second", self.fps);
            let allowed = format!("allowed: forwards, at most {FRAMES_MAX} frames");
            return Err(Failure::Usage(format!("{found}; {allowed}")));
        }
        let at =
            |frame: u64| from + (frame * u64::from(TICKS_PER_SECOND) / u64::from(self.fps)) as u32;
        Ok((0..frames).map(at).collect())
    }
}
