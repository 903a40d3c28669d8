//! Highlights of a round that is over, in place of the room until the next one runs.

use super::GameScreen;
use super::showing::Showing;
use crate::page::context::Context;
use crate::world::highlight_player::HighlightPlayer;
use crate::world::replica::Replica;
use jostle_game::RoundPhase;

impl GameScreen {
    /// Whether there are highlights to show.
    pub fn has_highlights(&self) -> bool {
        let highlights = self.replica().and_then(|replica| replica.highlights.as_ref());
        highlights.is_some_and(|highlights| !highlights.is_empty())
    }

    /// Shows as many highlights as there is time for before the next round, the newest; or ends them.
    pub fn toggle_highlights(&mut self, ctx: &mut Context) {
        let ends = self.end_highlights();
        if ends || self.is_frozen() {
            return;
        }
        let Some(replica) = self.membership.as_mut().map(|membership| &mut membership.replica)
        else {
            return;
        };
        let ticks = ticks_left(replica).unwrap_or(0);
        let Some(highlights) = &mut replica.highlights else { return };
        let newest = highlights.newest_within(ticks);
        let player =
            HighlightPlayer::new(&replica.room.scene, replica.room.seat, newest, ctx.now_ms);
        self.showing = player.map(|player| Showing { player, copy: (1, ctx.next_number()) });
        self.view.cut();
    }

    /// Ends the highlights; `false` if none were on.
    pub fn end_highlights(&mut self) -> bool {
        let ends = self.showing.take().is_some();
        if ends {
            self.view.cut();
        }
        ends
    }

    /// Moves the highlights to the present. They end when all were shown, or when the next round runs.
    pub(super) fn advance_highlights(&mut self, ctx: &mut Context) {
        let Some(showing) = &mut self.showing else { return };
        let live = self.membership.as_ref().map(|membership| &membership.replica);
        let eye = self.view.eye(&self.controls, live);
        let goes_on =
            live.and_then(ticks_left).is_some() && showing.player.advance(ctx.now_ms, eye);
        if !goes_on {
            self.end_highlights();
        } else if showing.copy.0 != showing.player.number {
            showing.copy = (showing.player.number, ctx.next_number());
            self.view.cut();
        }
    }

    /// The copy of the room in the picture, and its number: that of a highlight, while one is on.
    pub(super) fn pictured(&self) -> Option<(&Replica, u32)> {
        match (&self.showing, &self.membership) {
            (Some(showing), _) => Some((&showing.player.replica, showing.copy.1)),
            (None, Some(membership)) => Some((&membership.replica, membership.copy)),
            (None, None) => None,
        }
    }

    /// The copy of the room in the picture.
    pub fn pictured_replica(&self) -> Option<&Replica> {
        self.pictured().map(|(replica, _)| replica)
    }
}

/// Ticks until the next round runs, as far as is known; `None` while one does.
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
