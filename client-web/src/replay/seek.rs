//! Seeking: the ticks from the nearest known state to the goal are played in slices, first without displaying them and
//! then into a new display, while the current display stays visible.

use super::display::ReplayDisplay;
use super::player::{LEAD_TICKS, Rebuilt, ReplayPlayer, Seek};
use jostle_sim::TICKS_PER_SECOND;

/// If more ticks than this are left, a new seek replaces the current one. A shorter seek is completed first, so that
/// something is shown while the slider is dragged.
const FINISHED_TICKS_MAX: u32 = 1500;

impl ReplayPlayer {
    /// Seeks to this tick immediately, no matter how long that takes, and pauses there.
    pub fn seek(&mut self, tick: u32) {
        self.playing = false;
        self.wish = None;
        self.begin_seek(tick);
        self.work(|| true);
    }

    /// Starts seeking to this tick; [`ReplayPlayer::work`] does the work.
    pub fn aim(&mut self, tick: u32) {
        match &self.seek {
            Some(seek) if seek.left(&self.playback) <= FINISHED_TICKS_MAX => self.wish = Some(tick),
            _ => {
                self.wish = None;
                self.begin_seek(tick);
            }
        }
    }

    /// Moves by this many ticks and pauses.
    pub fn step_by(&mut self, ticks: i64) {
        self.pause();
        self.skip(ticks);
    }

    /// Starts seeking to the tick this many ticks away.
    pub fn skip(&mut self, ticks: i64) {
        let goal = i64::from(self.goal()) + ticks;
        let (first, last) = (i64::from(self.first_tick()), i64::from(self.last_tick()));
        self.aim(goal.clamp(first, last) as u32);
    }

    /// Seeks to shortly before the next or previous known goal, or beginning or end of a round.
    pub fn skip_to_goal(&mut self, forward: bool) {
        /// Time before a goal at which its build-up is visible.
        const BEFORE: u32 = 2 * TICKS_PER_SECOND;
        let (here, first) = (self.goal(), self.first_tick());
        let known = self.chapters.known.iter().filter(|(_, chapter)| chapter.is_of_game());
        let mut ticks = known.map(|&(tick, _)| tick.saturating_sub(BEFORE).max(first));
        let found = match forward {
            true => ticks.filter(|&tick| tick > here).min(),
            // While playing, the playhead is already slightly past the previous target.
            false => ticks.rfind(|&tick| tick + TICKS_PER_SECOND / 2 < here),
        };
        found.into_iter().for_each(|tick| self.aim(tick));
    }

    /// Whether a seek is in progress.
    pub fn is_seeking(&self) -> bool {
        self.seek.is_some()
    }

    /// The goal of the current seek, or the tick on display.
    pub fn goal(&self) -> u32 {
        let goal = self.seek.as_ref().map(|seek| seek.goal);
        self.wish.or(goal).unwrap_or(self.tick())
    }

    /// Progress of the current seek, 0..=1.
    pub fn progress(&self) -> f64 {
        self.seek.as_ref().map_or(1.0, |seek| {
            let way = f64::from(seek.goal - seek.begin).max(1.0);
            1.0 - f64::from(seek.left(&self.playback)) / way
        })
    }

    fn begin_seek(&mut self, tick: u32) {
        let goal = tick.clamp(self.first_tick(), self.last_tick());
        let now = self.playback.tick();
        let goes_on = self.seek.as_ref().is_none_or(|seek| seek.rebuilt.is_none());
        if goes_on && goal >= now && goal - now <= LEAD_TICKS {
            self.seek = Some(Seek { goal, begin: now, rebuilt: None });
            return;
        }
        let (particles, particle_lead) = match self.seek.take().and_then(|seek| seek.rebuilt) {
            Some(rebuilt) => (rebuilt.particles, rebuilt.particle_lead),
            None => (self.playback.game().world().particles().clone(), self.particle_lead()),
        };
        let lead = goal.saturating_sub(LEAD_TICKS).max(self.first_tick());
        if let Err(error) = self.playback.jump(lead) {
            // Only the current state of the game can still be shown.
            self.fail(error);
            return self.stand_here();
        }
        let rebuilt = Some(Rebuilt { lead, display: None, particles, particle_lead });
        self.seek = Some(Seek { goal, begin: self.playback.tick(), rebuilt });
    }

    fn stand_here(&mut self) {
        self.display = ReplayDisplay::begin(&self.playback);
        self.jumps += 1;
        self.playhead = f64::from(self.playback.tick());
        self.show();
    }

    /// Continues a seek as long as `more` returns `true`.
    pub fn work(&mut self, mut more: impl FnMut() -> bool) {
        while self.seek.is_some() {
            let moved = self.seek_on(&mut more);
            if !moved {
                return;
            }
            self.arrive();
        }
    }

    /// Plays up to the goal; returns `false` if time ran out.
    fn seek_on(&mut self, more: &mut impl FnMut() -> bool) -> bool {
        while let Some(seek) = &mut self.seek {
            let tick = self.playback.tick();
            let rebuilt = seek.rebuilt.as_mut();
            if let Some(rebuilt) = rebuilt.filter(|r| r.display.is_none() && r.lead <= tick) {
                rebuilt.display = Some(ReplayDisplay::begin(&self.playback));
            }
            if tick >= seek.goal {
                return true;
            }
            if !more() {
                return false;
            }
            if !self.step() {
                return true;
            }
        }
        true
    }

    /// Completes a seek at its goal, or at the last tick that can be reached.
    fn arrive(&mut self) {
        let rebuilt = self.seek.take().and_then(|seek| seek.rebuilt);
        if let Some(rebuilt) = rebuilt {
            self.display = rebuilt.display.unwrap_or_else(|| ReplayDisplay::begin(&self.playback));
            self.jumps += 1;
        }
        self.playhead = f64::from(self.playback.tick());
        self.show();
        if let Some(wish) = self.wish.take() {
            self.begin_seek(wish);
        }
    }
}
