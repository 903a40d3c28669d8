//! Draws replays without a window, using the page's player and renderer.

use super::Render;
use crate::output::{Failure, OrFail, say};
use jostle_client_web::replay::player::ReplayPlayer;
use jostle_client_web::view::draw::DrawList;
use jostle_game::Seat;
use jostle_picture::Headless;
use jostle_protocol::replay::Replay;
use jostle_sim::TICKS_PER_SECOND;
use std::path::Path;

impl Render {
    pub(super) fn draw(self, replay: Replay, ticks: &[u32]) -> Result<(), Failure> {
        let mut player = ReplayPlayer::open(replay.into_bytes()).or_check(self.file.display())?;
        player.follow(self.follow.map(Seat));
        let mut painter = Painter::new(self.size, self.bottom)?;
        let (first, last) = (ticks[0], ticks[ticks.len() - 1]);
        if self.from.is_none() {
            painter.draw(&mut player, first, &self.out)?;
            return say(format!("tick {first}: {}", self.out.display()));
        }
        std::fs::create_dir_all(&self.out).or_check(self.out.display())?;
        for (frame, &tick) in ticks.iter().enumerate() {
            painter.draw(&mut player, tick, &self.out.join(format!("frame-{frame:05}.png")))?;
        }
        let seconds = f64::from(last - first) / f64::from(TICKS_PER_SECOND);
        say(format!("{} frames of {seconds:.1} s in {}", ticks.len(), self.out.display()))
    }
}

/// The device and the draw list.
struct Painter {
    headless: Headless,
    list: DrawList,
    size: [u32; 2],
    bottom: u32,
}

impl Painter {
    fn new(size: [u32; 2], bottom: u32) -> Result<Painter, Failure> {
        let headless = Headless::open().map_err(|error| Failure::Check(error.to_string()))?;
        Ok(Painter { headless, list: DrawList::new(), size, bottom })
    }

    fn draw(&mut self, player: &mut ReplayPlayer, tick: u32, out: &Path) -> Result<(), Failure> {
        player.seek(tick);
        if let Some(trouble) = player.trouble().filter(|_| player.tick() < tick) {
            return Err(trouble).or_check(out.display());
        }
        self.list.fill(&player.frame(player.still_view(self.size, self.bottom)));
        let picture = self.headless.picture(self.size, &self.list).or_check(out.display())?;
        let bytes = picture.png().or_check(out.display())?;
        std::fs::write(out, bytes).or_check(out.display())
    }
}
