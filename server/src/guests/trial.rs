//! A guest's scene is read and played for a moment before its room opens, so that one that is too slow is refused with
//! the field that costs most.

use crate::limits::{GUEST_TRIAL_PLAYERS, GUEST_TRIAL_TICKS};
use jostle_game::scene::{SceneError, WorstTick};
use jostle_game::{Buttons, Game, Input, Scene, Seat};
use jostle_sim::{Rng, Vec2};
use std::sync::Arc;
use std::time::Duration;

/// Seed of the game and of its players' keys.
const SEED: u64 = 1;
/// Ticks after which a player presses other keys, at the mean.
const HELD_TICKS: u32 = 6;

/// Plays the beginning of a scene with players who press every key. `worked` returns the processor time of this thread,
/// of which `most` may be taken; `rest` is told after each tick how long that took.
pub fn play(
    scene: &Arc<Scene>,
    most: Duration,
    worked: impl Fn() -> Duration,
    mut rest: impl FnMut(Duration),
) -> Result<(), SceneError> {
    let began = worked();
    let mut game = Game::new(Arc::clone(scene), SEED);
    let players = scene.players_max.min(GUEST_TRIAL_PLAYERS);
    (0..players).for_each(|seat| game.join(Seat(seat)));
    let mut keys = Keys::new(scene.size, players);
    let mut before = worked();
    rest(before - began);
    for tick in 1..=GUEST_TRIAL_TICKS {
        game.tick(keys.press());
        let now = worked();
        if now - began > most {
            return Err(too_slow(scene, tick, now - began, most));
        }
        rest(now - before);
        before = worked();
    }
    Ok(())
}

fn too_slow(scene: &Scene, ticks: u32, took: Duration, most: Duration) -> SceneError {
    let field = WorstTick::of(scene).field;
    let took = took.as_secs_f32() * 1000.0;
    let mean = most.as_secs_f32() * 1000.0 / GUEST_TRIAL_TICKS as f32;
    let found = format!("a slow scene: its first {ticks} ticks took {took:.0} ms");
    let allowed =
        format!("at most {mean:.1} ms a tick; most time goes into what this field brings");
    SceneError::in_scene(scene, &field, found, allowed)
}

/// Random keys and pointers of all players.
struct Keys {
    rng: Rng,
    size: Vec2,
    held: Vec<(Seat, Input)>,
}

impl Keys {
    fn new(size: Vec2, players: u16) -> Keys {
        let held = (0..players).map(|seat| (Seat(seat), Input::default())).collect();
        Keys { rng: Rng::new(SEED, 0), size, held }
    }

    /// The inputs of the next tick.
    fn press(&mut self) -> &[(Seat, Input)] {
        for (_, input) in &mut self.held {
            if self.rng.below(HELD_TICKS) == 0 {
                let (x, y) = (self.rng.range(0.0, self.size.x), self.rng.range(0.0, self.size.y));
                let buttons = Buttons(self.rng.next_u32() as u16 & Buttons::ALL.0);
                *input = Input { buttons, pointer: Some(Vec2::new(x, y)) };
            }
        }
        &self.held
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    fn built_in(name: &str) -> Arc<Scene> {
        let mut scenes = Scene::built_in().into_iter();
        Arc::new(scenes.find(|scene| scene.name == name).expect("a built-in scene"))
    }

    /// Plays a trial in which each look at the time finds a millisecond more.
    fn trial(scene: &Arc<Scene>, most: Duration) -> (Result<(), SceneError>, Duration) {
        let (time, rested) = (Cell::new(Duration::ZERO), Cell::new(Duration::ZERO));
        let worked = || {
            time.set(time.get() + Duration::from_millis(1));
            time.get()
        };
        let played = play(scene, most, worked, |took| rested.set(rested.get() + took));
        (played, rested.get())
    }

    #[test]
    fn a_trial_rests_for_as_long_as_it_works_and_ends_in_time() {
        let pile = built_in("pile");
        let (played, rested) = trial(&pile, Duration::from_secs(1));
        assert_eq!(played, Ok(()));
        assert_eq!(rested, Duration::from_millis(u64::from(GUEST_TRIAL_TICKS) + 1));
        let (played, _) = trial(&pile, Duration::from_millis(60));
        let error = played.expect_err("it took longer");
        assert_eq!(
            error.to_string(),
            "pile.toml:11: limits.dumb: found a slow scene: its first 31 ticks took 62 ms; allowed: at most \
             0.5 ms a tick; most time goes into what this field brings"
        );
    }

    #[test]
    fn each_shipped_scene_plays_through_a_trial() {
        for scene in Scene::built_in() {
            let (played, _) = trial(&Arc::new(scene), Duration::from_secs(1));
            assert_eq!(played, Ok(()));
        }
    }
}
