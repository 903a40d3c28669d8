//! Highlights of a finished round, shown instead of the room until the next round starts.

use crate::page::context::Context;
use crate::world::highlight_player::HighlightPlayer;
use crate::world::replica::{Eye, Replica};
use jostle_game::RoundPhase;
use jostle_sim::TICKS_PER_SECOND;

/// How long the result is shown before highlights begin by themselves, ticks.
const UNASKED_TICKS: f64 = 4.0 * TICKS_PER_SECOND as f64;

/// Highlights that are being shown instead of the room.
pub struct Showing {
    pub player: HighlightPlayer,
    /// The number of the current highlight, and of the replica that draws it.
    pub copy: (usize, u32),
    /// Whether they began by themselves, so that the result stays in view.
    pub is_auto: bool,
}

impl Showing {
    /// Starts the newest highlights, as many as will fit before the next round.
    pub fn begin(ctx: &mut Context, replica: &mut Replica) -> Option<Showing> {
        let ticks = ticks_left(replica).unwrap_or(0);
        let newest = replica.highlights.as_mut()?.newest_within(ticks);
        let player =
            HighlightPlayer::new(&replica.room.scene, replica.room.seat, newest, ctx.now_ms)?;
        Some(Showing { player, copy: (1, ctx.next_number()), is_auto: false })
    }

    /// Advances the highlights to the current time and returns whether another one begins. `None` once all have been
    /// shown or the next round is running.
    pub fn advance(&mut self, ctx: &mut Context, live: Option<&Replica>, eye: Eye) -> Option<bool> {
        live.and_then(ticks_left)?;
        if !self.player.advance(ctx.now_ms, eye) {
            return None;
        }
        let begins = self.copy.0 != self.player.number;
        if begins {
            self.copy = (self.player.number, ctx.next_number());
        }
        Some(begins)
    }
}

/// The end of the round that is over, if it is time to show its highlights unasked: the tick since which it is over.
pub fn due(replica: &Replica) -> Option<u32> {
    let round = replica.room.round().filter(|round| round.phase == RoundPhase::Over)?;
    let ticks = replica.room.display - f64::from(round.since);
    (ticks >= UNASKED_TICKS).then_some(round.since)
}

/// Ticks until the next round starts, if known; `None` while a round is running.
fn ticks_left(replica: &Replica) -> Option<u32> {
    let spec = replica.room.scene.rules.round.as_ref()?;
    let round = replica.room.round()?;
    let ticks = (replica.room.display - f64::from(round.since)).max(0.0) as u32;
    match round.phase {
        RoundPhase::Over => Some((spec.pause + spec.countdown).saturating_sub(ticks)),
        RoundPhase::Countdown => Some(spec.countdown.saturating_sub(ticks)),
        RoundPhase::Waiting => Some(u32::MAX),
        RoundPhase::Running => None,
    }
}
