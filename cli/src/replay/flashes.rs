//! `jostle replay flashes` counts the flashes that people with photosensitive epilepsy must not be shown.

use super::file::read;
use crate::output::Failure;
use jostle_protocol::replay::Replay;
use std::path::PathBuf;

/// Count the flashes in replays, by the rule of WCAG 2.2, success criterion 2.3.1
///
/// The rule allows at most three flashes in any second over a quarter of the picture: changes in brightness by a tenth
/// and back, or to and from a saturated red. Every tick is drawn, as a spectator sees it or as --follow says. Exits
/// with 1 if a replay has more flashes. Drawing requires Vulkan or OpenGL ES, as for `render`.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub struct FlashCount {
    /// The replay files
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Follow the player in this seat, as the page does. Without this flag, the whole world is shown
    #[arg(long, value_name = "SEAT")]
    follow: Option<u16>,
}

impl FlashCount {
    /// Prints a line for each file.
    pub fn run(self) -> Result<(), Failure> {
        let replays = self.files.iter().map(|file| read(file)).collect::<Result<_, _>>()?;
        self.count(replays)
    }

    #[cfg(not(feature = "render"))]
    fn count(self, _: Vec<Replay>) -> Result<(), Failure> {
        Err(super::render::without_renderer())
    }

    #[cfg(feature = "render")]
    fn count(self, replays: Vec<Replay>) -> Result<(), Failure> {
        use crate::output::{OrFail, say};
        use jostle_client_web::replay::player::ReplayPlayer;
        use jostle_game::Seat;
        use jostle_picture::{Headless, flashes};

        let mut headless = Headless::open().or_check("no picture")?;
        let mut worst = None;
        for (file, replay) in self.files.iter().zip(replays) {
            let mut player = ReplayPlayer::open(replay.into_bytes()).or_check(file.display())?;
            player.follow(self.follow.map(Seat));
            let found = flashes::of_replay(&mut headless, &mut player).or_check(file.display())?;
            let tick = player.first_tick() + found.frame;
            let line = format!("{}: at most {} flashes", file.display(), found.flashes);
            let line = format!("{line} in a second, the one before tick {tick}");
            if found.flashes > flashes::FLASHES_MAX {
                worst.get_or_insert(line.clone());
            }
            say(line)?;
        }
        let allowed = flashes::FLASHES_MAX;
        worst.map_or(Ok(()), |line| Err(Failure::Check(format!("{line}; allowed: {allowed}"))))
    }
}
