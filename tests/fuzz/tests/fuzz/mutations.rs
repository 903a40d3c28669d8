//! Tests that truncated and mutated replays are refused or play as far as they can be read.

use jostle_fuzz::mutations::{bases, run};
use jostle_protocol::replay::{Ending, Replay};
use jostle_room::divergence;
use std::sync::Arc;

#[test]
fn a_replay_without_its_last_bytes_verifies_up_to_its_last_record() {
    for base in bases() {
        let whole = base.bytes();
        let mut verified = None;
        for length in whole.len().saturating_sub(1000)..whole.len() {
            let Ok(replay) = Replay::read(whole[..length].to_vec()) else {
                let start =
                    whole.len() - base.records[1..].iter().map(|r| r.seal().len()).sum::<usize>();
                assert!(length < start, "{}: {length} bytes hold a start", base.name);
                continue;
            };
            let Ending::Cut(error) = replay.ending() else { panic!("{length} of {}", whole.len()) };
            assert!(error.offset <= length);
            // All truncations within a record leave the same replay, so it is verified only once.
            if verified != Some(error.offset) {
                verified = Some(error.offset);
                let has_begun = replay.first_tick() == 0 || replay.keyframe_ticks().len() > 0;
                let found = divergence::verify(&Arc::new(replay), |_| {});
                assert_eq!(found, Ok(None), "{}: {length} bytes, begun: {has_begun}", base.name);
            }
        }
        assert!(verified.is_some(), "{}", base.name);
    }
}

#[test]
fn mutated_replays_are_refused_or_play_as_far_as_they_go() {
    let bases = bases();
    let count = crate::cases(4000);
    let tally = run(&bases, 0..count, |_| {});
    assert_eq!(tally.count(), count);
    // Every outcome must occur.
    for outcome in [tally.refused, tally.equal, tally.stopped, tally.differs] {
        assert!(outcome > count / 100, "{tally:?}");
    }
    assert!(tally.ticks > 5 * count / 2, "{tally:?}");
}
