//! Checks that planted divergences are found, down to one unit in the last place of one number in one body.

use super::*;
use crate::playback::tests::{file, recorded, records};
use jostle_protocol::replay::Record;

/// The replay of a program that computes one number differently. The game is recorded again from the same start and
/// inputs, with a nudge in one tick.
fn recorded_with(replay: &Arc<Replay>, at: u32, nudge: Nudge, records: &[Record]) -> Arc<Replay> {
    let mut moment = Playback::new(Arc::clone(replay)).unwrap().moment().clone();
    let mut records = records.to_vec();
    for record in &mut records {
        match record {
            Record::Ticks(block) => {
                let given = block.clone();
                for (place, tick) in (block.first..).enumerate() {
                    if place == given.ticks.len() {
                        break;
                    }
                    let mut watch = |phase, world: &mut World| {
                        if tick == at {
                            nudge.apply(phase, world);
                        }
                    };
                    moment.step(&given, &mut watch).unwrap();
                    let full = jostle_protocol::replay::keeps_full_hash(tick);
                    let hash = moment.game.hash();
                    block.ticks[place].hash = if full { hash } else { hash & 0xffff };
                }
            }
            Record::Keyframe(keyframe) => {
                keyframe.hash = moment.game.hash();
                keyframe.state = moment.game.save();
            }
            Record::End { hash, .. } => *hash = moment.game.hash(),
            Record::Start(_) | Record::Host(_) => {}
        }
    }
    Arc::new(Replay::read(file(&records)).unwrap())
}

fn some_body(replay: &Arc<Replay>, tick: u32, nth: usize) -> BodyId {
    let mut playback = Playback::new(Arc::clone(replay)).unwrap();
    playback.seek(tick).unwrap();
    let world = playback.game().world();
    let loose = world.ids().filter(|&id| {
        // A contact can undo a change to a slow body.
        world.motion(id) == Motion::Dynamic && world.velocity(id).abs().cmpgt(Vec2::ONE).all()
    });
    loose.skip(nth).step_by(3).next().expect("a moving body")
}

#[test]
fn a_change_of_one_unit_is_found_in_a_plain_replay() {
    let records = records("arena", 500, 4);
    let replay = Arc::new(Replay::read(file(&records)).unwrap());
    for (at, phase, field) in [
        (61, Phase::Integrate, 0),
        (250, Phase::Relax, 3),
        (333, Phase::Integrate, 2),
        (499, Phase::Relax, 1),
    ] {
        let body = some_body(&replay, at - 1, 1);
        let nudge = Nudge { phase, body, field, greater: true };
        let other = recorded_with(&replay, at, nudge, &records);
        let found = verify(&other, |_| {}).unwrap();
        let found = found.unwrap_or_else(|| panic!("tick {at}: no divergence of {body:?}"));
        assert_eq!(found.tick, at);
        let Cause::Nudge { phases, body: found_body, field: found_field, recorded_is_greater } =
            &found.cause
        else {
            panic!("{found}")
        };
        assert!(phases.contains(&phase), "{found}");
        assert_eq!((*found_body, *found_field), (body, FIELDS[field]), "{found}");
        assert!(recorded_is_greater);
    }
}

#[test]
fn a_larger_change_is_shown_at_the_next_keyframe() {
    let records = records("impulse", crate::log::KEYFRAME_TICKS_MIN + 10, 4);
    let replay = Arc::new(Replay::read(file(&records)).unwrap());
    let mut other = records.clone();
    // This imitates a recorder that diverged, by giving the keyframe a different state.
    let (mut changed, at) = (None, 1700);
    for record in &mut other {
        match record {
            Record::Ticks(block) if block.last() >= at => {
                for (tick, number) in block.ticks.iter_mut().zip(block.first..) {
                    if number >= at {
                        tick.hash ^= 1;
                    }
                }
            }
            Record::Keyframe(keyframe) => {
                let scene = Arc::new(
                    jostle_game::Scene::parse("impulse.toml", &replay.start().scene).unwrap(),
                );
                let mut game = Game::restore(scene, &keyframe.state).unwrap();
                game.tick_watched(&[], &mut |_, _| {});
                keyframe.state = game.save();
                keyframe.hash = game.hash();
                changed = Some(keyframe.tick);
            }
            _ => {}
        }
    }
    let other = Arc::new(Replay::read(file(&other)).unwrap());
    let found = verify(&other, |_| {}).unwrap().expect("a divergence");
    assert_eq!(found.tick, at);
    let Cause::Later { tick, .. } = found.cause else { panic!("{found}") };
    assert_eq!(Some(tick), changed);
    assert!(found.to_string().contains("tick 1700: more than one number differs; at tick 1800"));
}

/// Plays the same tick in two games, and returns their first difference and the phase in which it appeared.
/// `watch_other` may change the other world after each phase, before the comparison.
fn step_together(
    one: &mut Moment,
    other: &mut Moment,
    block: &Block,
    watch_other: &mut impl FnMut(Phase, &mut World),
) -> Option<(Phase, Difference)> {
    let mut worlds = Vec::new();
    one.step(block, &mut |_, world| worlds.push(world.clone())).unwrap();
    let mut found = None;
    let mut worlds = worlds.iter();
    other
        .step(block, &mut |phase, world| {
            watch_other(phase, world);
            let twin = worlds.next().filter(|_| found.is_none());
            let difference = twin.and_then(|twin| twin.first_difference(world));
            found = found.or(difference.map(|difference| (phase, difference)));
        })
        .unwrap();
    // The state of the rules is compared at the end.
    let rules = || Some((Phase::Events, one.game.first_difference(&other.game)?));
    found.or_else(rules)
}

#[test]
fn two_runs_are_compared_phase_by_phase() {
    let replay = recorded("arena", 300, 6);
    let at = 200;
    let body = some_body(&replay, at - 1, 2);
    for phase in [Phase::Inputs, Phase::Integrate, Phase::Pairs, Phase::Relax, Phase::Events] {
        let mut one = Playback::new(Arc::clone(&replay)).unwrap().moment().clone();
        let mut other = one.clone();
        for tick in 1..=300 {
            let block = replay.block_with(tick).unwrap();
            let nudge = Nudge { phase, body, field: 2, greater: false };
            let mut plant = |now, world: &mut World| {
                if tick == at {
                    nudge.apply(now, world);
                }
            };
            let found = step_together(&mut one, &mut other, &block, &mut plant);
            if tick < at {
                assert_eq!(found, None, "tick {tick}");
                continue;
            }
            let (found_phase, difference) = found.expect("a difference");
            assert_eq!(found_phase, phase);
            assert_eq!(difference.subject, jostle_sim::Subject::Body(body));
            assert_eq!(difference.field, "velocity.x");
            break;
        }
    }
}

#[test]
fn a_difference_in_particles_is_reported_in_their_phase() {
    let replay = recorded("emitters", 100, 6);
    let block = replay.block_with(60).unwrap();
    let mut playback = Playback::new(Arc::clone(&replay)).unwrap();
    playback.seek(59).unwrap();
    let (mut one, mut other) = (playback.moment().clone(), playback.moment().clone());
    let mut plant = |phase, world: &mut World| {
        if phase == Phase::Particles {
            world.start_emitter(jostle_sim::EmitterDef {
                recipe: 0,
                count: 1,
                seed: 1,
                source: jostle_sim::Source::Point(Vec2::ZERO),
            });
        }
    };
    let found = step_together(&mut one, &mut other, &block, &mut plant);
    assert_eq!(found.map(|(phase, _)| phase), Some(Phase::Particles));
}
