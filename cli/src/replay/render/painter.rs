//! The drawing itself: the film that the page shows, on a device without a window.

use super::Render;
use crate::output::{Failure, say};
use jostle_client_web::replay::player::ReplayPlayer;
use jostle_client_web::view::draw::DrawList;
use jostle_client_web::view::render::headless::Headless;
use jostle_game::Seat;
use jostle_protocol::replay::Replay;
use jostle_sim::TICKS_PER_SECOND;
use std::path::Path;

impl Render {
    pub(super) fn draw(self, replay: Replay, ticks: &[u32]) -> Result<(), Failure> {
        let refused = |error| Failure::Check(format!("{}: {error}", self.file.display()));
        let mut film =
            ReplayPlayer::open(replay.into_bytes()).map_err(|error| refused(error.to_string()))?;
        film.follow(self.follow.map(Seat));
        let mut painter = Painter::new(self.size, self.bottom)?;
        let (first, last) = (ticks[0], ticks[ticks.len() - 1]);
        if self.from.is_none() {
            painter.draw(&mut film, first, &self.out)?;
            return say(format!("tick {first}: {}", self.out.display()));
        }
        std::fs::create_dir_all(&self.out)
            .map_err(|error| Failure::Check(format!("{}: {error}", self.out.display())))?;
        for (frame, &tick) in ticks.iter().enumerate() {
            painter.draw(&mut film, tick, &self.out.join(format!("frame-{frame:05}.png")))?;
        }
        let seconds = f64::from(last - first) / f64::from(TICKS_PER_SECOND);
        say(format!("{} frames of {seconds:.1} s in {}", ticks.len(), self.out.display()))
    }
}

/// The device and what is drawn with it.
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

    fn draw(&mut self, film: &mut ReplayPlayer, tick: u32, out: &Path) -> Result<(), Failure> {
        let failed = |error: String| Failure::Check(format!("{}: {error}", out.display()));
        film.seek(tick);
        if let Some(trouble) = film.trouble().filter(|_| film.tick() < tick) {
            return Err(failed(trouble.to_string()));
        }
        self.list.fill(&film.frame(film.still_view(self.size, self.bottom)));
        let picture = self
            .headless
            .picture(self.size, &self.list)
            .map_err(|error| failed(error.to_string()))?;
        let bytes = picture.png().map_err(|error| failed(error.to_string()))?;
        std::fs::write(out, bytes).map_err(|error| failed(error.to_string()))
    }
}
