//! The sling of the displayed moment, with the way that its ball would take.

use super::Replica;
use crate::view::frame::FrameSling;
use jostle_game::sling_path;

/// Ticks of the way that are shown, and from one dot to the next.
const PATH_TICKS: u32 = 75;
const DOT_TICKS: usize = 3;

impl Replica {
    /// Notes where the sling's ball is, and where it would fly.
    pub(super) fn lay_out_sling(&mut self) {
        self.sling = self.find_sling();
    }

    fn find_sling(&self) -> Option<FrameSling> {
        let (spec, info) = (self.scene.sling?, self.round()?.sling?);
        let start = self.scene.bodies[spec.ball].def.position;
        let ball = self.find_placed(spec.ball).filter(|_| !info.is_flying);
        // A ball that was just let go is on its way already in the newest snapshot.
        let ball = ball.filter(|at| at.distance(start) <= spec.pull + 0.5);
        let path = ball.map(|ball| sling_path(&self.scene, ball - start, PATH_TICKS));
        let path = path.unwrap_or_default().into_iter().step_by(DOT_TICKS).collect();
        Some(FrameSling { start, ball, shots: info.shots, path })
    }
}
