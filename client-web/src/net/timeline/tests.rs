use super::*;

const QUANTUM: f32 = 1.0 / 16.0;

fn body(index: u32, generation: u32, x: f32) -> SnapshotBody {
    SnapshotBody {
        id: BodyId { index, generation },
        kind: Kind::Block,
        owner: None,
        group: 0,
        shape: Shape::circle(1.0),
        quanta: [(x / QUANTUM) as i32, 0],
    }
}

fn timeline(snapshots: &[(u32, Vec<SnapshotBody>)]) -> Timeline {
    timeline_of(150.0, snapshots)
}

fn timeline_of(speed_max: f32, snapshots: &[(u32, Vec<SnapshotBody>)]) -> Timeline {
    let mut timeline = Timeline::new(QUANTUM, speed_max);
    for (tick, bodies) in snapshots {
        timeline.file(Snapshot { tick: *tick, bodies: bodies.clone(), ..Snapshot::default() });
    }
    timeline
}

fn sampled(timeline: &Timeline, tick: f64) -> Vec<Sample> {
    let mut out = Vec::new();
    timeline.sample(tick, &mut out);
    out
}

#[test]
fn a_body_is_interpolated_between_two_snapshots() {
    let timeline = timeline(&[(10, vec![body(0, 0, 1.0)]), (11, vec![body(0, 0, 2.0)])]);
    let sample = sampled(&timeline, 10.25)[0];
    assert_eq!(sample.center, Vec2::new(1.25, 0.0));
    assert_eq!(sample.velocity, Vec2::new(60.0, 0.0));
}

#[test]
fn a_gap_of_snapshots_is_bridged() {
    let timeline = timeline(&[(10, vec![body(0, 0, 0.0)]), (14, vec![body(0, 0, 8.0)])]);
    let sample = sampled(&timeline, 13.0)[0];
    assert_eq!(sample.center, Vec2::new(6.0, 0.0));
    assert_eq!(sample.velocity, Vec2::new(120.0, 0.0));
}

#[test]
fn a_body_appears_with_its_first_snapshot_and_stays_until_it_is_gone() {
    let timeline = timeline(&[
        (10, vec![body(0, 0, 0.0)]),
        (11, vec![body(0, 0, 0.0), body(1, 0, 5.0)]),
        (12, vec![body(1, 0, 5.0)]),
    ]);
    let indices = |tick| sampled(&timeline, tick).iter().map(|s| s.id.index).collect::<Vec<_>>();
    assert_eq!(indices(10.9), [0]);
    assert_eq!(indices(11.0), [0, 1]);
    assert_eq!(indices(11.9), [0, 1]);
    assert_eq!(indices(12.0), [1]);
}

#[test]
fn a_reused_slot_is_another_body() {
    let timeline = timeline(&[(10, vec![body(0, 0, 0.0)]), (11, vec![body(0, 1, 4.0)])]);
    assert_eq!(sampled(&timeline, 10.5)[0].center.x, 0.0);
    let reborn = sampled(&timeline, 11.0)[0];
    assert_eq!((reborn.id.generation, reborn.center.x), (1, 4.0));
    assert_eq!(reborn.velocity, Vec2::ZERO);
}

#[test]
fn a_jump_is_not_interpolated() {
    let timeline = timeline(&[(10, vec![body(0, 0, 0.0)]), (11, vec![body(0, 0, 90.0)])]);
    let before = sampled(&timeline, 10.9)[0];
    assert_eq!((before.center.x, before.velocity), (0.0, Vec2::ZERO));
    assert_eq!(sampled(&timeline, 11.5)[0].center.x, 90.0, "and not carried on");
}

#[test]
fn the_threshold_of_a_jump_depends_on_the_speed_limit() {
    let steps = [(10, vec![body(0, 0, 0.0)]), (11, vec![body(0, 0, 16.0)])];
    assert_eq!(sampled(&timeline_of(150.0, &steps), 10.5)[0].center.x, 0.0);
    assert_eq!(sampled(&timeline_of(1000.0, &steps), 10.5)[0].center.x, 8.0);
}

#[test]
fn extrapolation_is_bounded() {
    let timeline = timeline(&[(10, vec![body(0, 0, 0.0)]), (11, vec![body(0, 0, 1.0)])]);
    assert_eq!(sampled(&timeline, 11.5)[0].center.x, 1.5);
    assert_eq!(sampled(&timeline, 99.0)[0].center.x, 3.0);
}

#[test]
fn a_moment_before_the_first_snapshot_shows_the_first() {
    let timeline = timeline(&[(10, vec![body(0, 0, 7.0)])]);
    assert_eq!(sampled(&timeline, 3.0)[0].center.x, 7.0);
    assert_eq!(sampled(&timeline, 12.0)[0].center.x, 7.0);
}

#[test]
fn old_snapshots_are_removed_and_late_ones_dropped() {
    let mut timeline = timeline(&[(10, vec![]), (11, vec![]), (12, vec![])]);
    timeline.forget_before(11.5);
    assert_eq!(timeline.at_or_before(0.0).map(|s| s.tick), Some(11));
    timeline.file(Snapshot { tick: 9, ..Snapshot::default() });
    assert_eq!(timeline.newest().map(|s| s.tick), Some(12));
}

#[test]
fn an_empty_timeline_shows_nothing() {
    assert!(sampled(&timeline(&[]), 5.0).is_empty());
}
