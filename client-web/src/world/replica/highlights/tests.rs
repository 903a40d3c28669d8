use super::*;
use jostle_game::{RoundPhase::*, Side, SideInfo};
use jostle_protocol::SnapshotBody;

/// Highlights that received a snapshot for each tick from 1 to `ticks`, with the score at each tick.
fn heard(ticks: u32, round: impl Fn(u32) -> (RoundPhase, i32)) -> Highlights {
    let mut highlights = Highlights::default();
    for tick in 1..=ticks {
        highlights.note(&told(tick, 0, round(tick)), &[]);
    }
    highlights
}

fn told(tick: u32, bodies: usize, (phase, score): (RoundPhase, i32)) -> Arc<Snapshot> {
    let teams = [score, 0].map(|score| SideInfo { score, lives: 0, is_in: true }).to_vec();
    let winners = if phase == Over { vec![Side::Team(0)] } else { Vec::new() };
    let round = RoundInfo { phase, teams, winners, ..RoundInfo::default() };
    let body = SnapshotBody {
        id: jostle_sim::BodyId { index: 0, generation: 0 },
        kind: jostle_game::Kind::Block,
        owner: None,
        group: 0,
        shape: jostle_sim::Shape::circle(2.0),
        quanta: [0; 2],
    };
    let bodies = vec![body; bodies];
    Arc::new(Snapshot { tick, bodies, round: Some(round), ..Snapshot::default() })
}

/// The first and last ticks of all stored highlights.
fn ends(highlights: &mut Highlights) -> Vec<(u32, u32)> {
    let all = highlights.newest_within(u32::MAX);
    let tick = |filed: Option<&Filed>| filed.map_or(0, |filed| filed.snapshot.tick);
    all.iter().map(|highlight| (tick(highlight.first()), tick(highlight.last()))).collect()
}

#[test]
fn a_goal_is_shown_from_three_seconds_before_it_and_the_end_as_far_as_it_came() {
    let goals = |tick| match tick {
        ..500 => (Running, 0),
        500..540 => (Running, 1),
        // This goal follows too soon after the first one.
        540..900 => (Running, 2),
        900.. => (Over, 3),
    };
    assert_eq!(ends(&mut heard(910, goals)), [(320, 530), (720, 910)]);
    assert_eq!(ends(&mut heard(499, goals)), []);
    assert!(heard(499, goals).is_empty() && !heard(500, goals).is_empty());
    assert_eq!(ends(&mut heard(60, |tick| (Running, i32::from(tick >= 50)))), [(1, 60)]);
}

#[test]
fn the_end_right_after_a_goal_belongs_to_it() {
    let round = |tick| if tick < 500 { (Running, 0) } else { (Running, 1) };
    let ends_soon = |tick| if tick < 520 { round(tick) } else { (Over, 1) };
    assert_eq!(ends(&mut heard(600, ends_soon)), [(320, 530)]);
}

#[test]
fn an_end_without_a_goal_is_shown_only_if_there_was_none() {
    let time_up = |goals| move |tick| if tick < 900 { (Running, goals) } else { (Over, goals) };
    assert_eq!(ends(&mut heard(910, time_up(0))), [(720, 910)]);
    let after_a_goal = |tick| time_up(i32::from(tick >= 500))(tick);
    assert_eq!(ends(&mut heard(910, after_a_goal)), [(320, 530)]);
}

#[test]
fn the_next_round_forgets_the_highlights_of_the_last() {
    let round = |tick| match tick {
        ..500 => (Running, 0),
        500..800 => (Over, 1),
        _ => (Countdown, 0),
    };
    assert!(!heard(799, round).is_empty());
    assert!(heard(800, round).is_empty());
}

#[test]
fn only_so_much_is_kept_and_shown() {
    let every_200 = |tick: u32| (Running, (tick / 200) as i32);
    let mut highlights = heard(3000, every_200);
    let all = ends(&mut highlights);
    assert_eq!((all.len(), all[5]), (HIGHLIGHTS_MAX, (2820, 3000)), "the newest");
    let shown = highlights.newest_within(500);
    assert_eq!(shown.iter().map(length).sum::<u32>(), 180 + 210);
    assert_eq!(highlights.newest_within(0).len(), 1, "one at least");
    assert!(Highlights::default().newest_within(500).is_empty());
    // In a scene with thousands of bodies, there is room for 50 snapshots, no matter what their ticks are.
    let mut crowd = Highlights::default();
    for tick in 1..=400 {
        let round = (Running, i32::from(tick >= 300));
        crowd.note(&told(tick, BODIES_MAX / 50, round), &[]);
        assert!(crowd.recent.bodies <= BODIES_MAX);
    }
    assert_eq!(ends(&mut crowd), [(281, 330)]);
    crowd.note(&told(7, 0, (Running, 1)), &[]);
    assert_eq!(crowd.recent.newest(), Some(400), "what is older is of no use");
}
