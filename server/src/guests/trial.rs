//! Before a guest's room opens, its scene is read and played briefly. A scene that is too slow is refused, and the
//! error names its most expensive field.

use crate::limits::{GUEST_STEP, GUEST_TRIAL_PARTS, GUEST_TRIAL_PLAYERS, GUEST_TRIAL_TICKS};
use jostle_game::scene::{SceneError, WorstTick};
use jostle_game::{Buttons, Input, Scene, Seat};
use jostle_protocol::Appearance;
use jostle_room::{Rate, Room};
use jostle_sim::{Rng, Vec2};
use std::sync::Arc;
use std::time::Duration;

/// Seed for the game and its players' key presses.
const SEED: u64 = 1;
/// Mean number of ticks before a player presses different keys.
const HELD_TICKS: u32 = 6;

/// Plays this scene in a room with its bots and with players who press every key. It plays two seconds, then repeats
/// until the repetitions have used `later`. `worked` returns this thread's processor time; each two seconds of play may
/// use `most`. `rest` is called after each tick with the time that the tick took.
pub fn play(
    scene: &Arc<Scene>,
    [most, later]: [Duration; 2],
    worked: impl Fn() -> Duration,
    mut rest: impl FnMut(Duration),
) -> Result<(), SceneError> {
    let mut began = worked();
    let mut players = RandomPlayers::join(&without_waits(scene));
    let (mut before, mut spent) = (worked(), Duration::ZERO);
    rest(before - began);
    for part in 0..GUEST_TRIAL_PARTS {
        for ticks in 1..=GUEST_TRIAL_TICKS {
            players.play();
            if players.room.game().is_over_budget() {
                return Err(too_large(scene));
            }
            let now = worked();
            if now - began > most {
                return Err(too_slow(scene, ticks, now - began, most));
            }
            rest(now - before);
            before = worked();
        }
        if part > 0 {
            spent += before - began;
        }
        if spent >= later {
            break;
        }
        began = before;
    }
    Ok(())
}

/// The scene with rounds that begin immediately and with a trial's number of players. Otherwise nothing would move
/// until a round began.
fn without_waits(scene: &Arc<Scene>) -> Arc<Scene> {
    let mut scene = Arc::clone(scene);
    if scene.rules.round.is_some() {
        let round = Arc::make_mut(&mut scene).rules.round.as_mut();
        round.into_iter().for_each(|round| (round.countdown, round.players_min) = (0, 1));
    }
    scene
}

fn too_slow(scene: &Scene, ticks: u32, took: Duration, most: Duration) -> SceneError {
    let field = WorstTick::of(scene).field;
    let took = took.as_secs_f32() * 1000.0;
    let mean = most.as_secs_f32() * 1000.0 / GUEST_TRIAL_TICKS as f32;
    let found = format!("a slow scene: {ticks} of its ticks took {took:.0} ms");
    let allowed =
        format!("at most {mean:.1} ms a tick; most time goes into what this field brings");
    SceneError::in_scene(scene, &field, found, allowed)
}

fn too_large(scene: &Scene) -> SceneError {
    let field = WorstTick::of(scene).field;
    let found = "a heap: too many bodies come together in a trial of the scene".to_owned();
    let pairs = GUEST_STEP.pairs;
    let allowed = format!("at most {pairs} pairs of bodies near each other, and as much work");
    SceneError::in_scene(scene, &field, found, allowed)
}

/// A room whose players have random keys and pointers.
struct RandomPlayers {
    room: Room,
    rng: Rng,
    size: Vec2,
    held: Vec<(Seat, Input)>,
    ticks: u32,
}

impl RandomPlayers {
    /// Joins as many players as a trial has.
    fn join(scene: &Arc<Scene>) -> RandomPlayers {
        let mut room = Room::new("trial", Arc::clone(scene), SEED);
        let wanted = scene.players_max.min(GUEST_TRIAL_PLAYERS);
        let appearance = Appearance { name: "Player".into(), color: 0 };
        let joined = (0..wanted).filter_map(|_| room.join(appearance.clone(), None).ok());
        let held: Vec<_> = joined.map(|welcome| (welcome.claim.seat, Input::default())).collect();
        for &(seat, _) in &held {
            drop(room.subscribe_view(seat, Rate::Full));
        }
        RandomPlayers { room, rng: Rng::new(SEED, 0), size: scene.size, held, ticks: 0 }
    }

    /// Plays a tick with all players' inputs.
    fn play(&mut self) {
        self.ticks += 1;
        for (seat, input) in &mut self.held {
            if self.rng.below(HELD_TICKS) == 0 {
                let (x, y) = (self.rng.range(0.0, self.size.x), self.rng.range(0.0, self.size.y));
                let buttons = Buttons(self.rng.next_u32() as u16 & Buttons::ALL.0);
                *input = Input::new(buttons, Some(Vec2::new(x, y)));
            }
            self.room.input(*seat, self.ticks, *input);
        }
        self.room.tick();
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

    /// Plays a trial in which each clock reading is a millisecond later than the previous one.
    fn trial(scene: &Arc<Scene>, most: Duration) -> (Result<(), SceneError>, Duration) {
        let (time, rested) = (Cell::new(Duration::ZERO), Cell::new(Duration::ZERO));
        let worked = || {
            time.set(time.get() + Duration::from_millis(1));
            time.get()
        };
        let played = play(scene, [most, most], worked, |took| rested.set(rested.get() + took));
        (played, rested.get())
    }

    #[test]
    fn a_trial_rests_for_as_long_as_it_works_and_ends_in_time() {
        let pile = built_in("pile");
        let (played, rested) = trial(&pile, Duration::from_secs(3));
        assert_eq!(played, Ok(()));
        let ticks = u64::from(GUEST_TRIAL_TICKS * GUEST_TRIAL_PARTS);
        assert_eq!(rested, Duration::from_millis(ticks + 1));
        // On this clock each part takes a quarter of a second, so three parts use up the time for a trial.
        let (played, rested) = trial(&pile, Duration::from_millis(242));
        assert_eq!(played, Ok(()));
        assert!(rested <= Duration::from_millis(3 * u64::from(GUEST_TRIAL_TICKS) + 1));
        let (played, _) = trial(&pile, Duration::from_millis(60));
        let error = played.expect_err("it took longer");
        assert_eq!(
            error.to_string(),
            "pile.toml:12: limits.dumb: found a slow scene: 31 of its ticks took 62 ms; allowed: at most \
             0.5 ms a tick; most time goes into what this field brings"
        );
    }

    #[test]
    fn each_shipped_scene_plays_through_a_trial() {
        for scene in Scene::built_in() {
            let played =
                play(&Arc::new(scene), [Duration::MAX, Duration::ZERO], || Duration::ZERO, |_| {});
            assert_eq!(played, Ok(()));
        }
    }

    #[test]
    fn a_countdown_is_not_what_a_trial_sees() {
        let text = "title = \"Heap\"\nsize = [100, 100]\ngroups = [\"block\"]\npairs = [[\"block\", \"block\"]]\n\
                    limits = { players = 9 }\n[round]\ntask = \"Wait\"\ncountdown = 30\nplayers_min = 9\n\
                    [[layouts]]\nkind = \"block\"\ncount = 300\nradius = 10\narea = [[49, 49], [51, 51]]\n\
                    exact = true\ngrid = [20, 15]\n";
        let mut scene = Scene::parse("heap.toml", text).unwrap_or_else(|error| panic!("{error}"));
        scene.world.budget = GUEST_STEP;
        let (played, _) = trial(&Arc::new(scene), Duration::from_secs(1));
        let error = played.expect_err("it is a heap");
        assert_eq!(
            error.to_string(),
            "heap.toml:12: layouts[0].count: found a heap: too many bodies come together in a trial of the scene; \
             allowed: at most 10000 pairs of bodies near each other, and as much work"
        );
    }
}
