use super::*;
use crate::view::frame::FrameRoom;
use jostle_game::{OrderProgress, RoundPlayer};
use jostle_protocol::Snapshot;
use std::sync::Arc;

/// A room and its moments, fed with rounds.
struct Watched {
    room: RoomView,
    moments: Moments,
    round: RoundInfo,
    tick: u32,
}

fn info(score: i32) -> SideInfo {
    SideInfo { score, lives: 3, is_in: true }
}

impl Watched {
    fn new(scene: &str, teams: usize) -> Watched {
        let scene = Scene::built_in().into_iter().find(|known| known.name == scene);
        let players = [0, 1].map(|seat: u16| RoundPlayer {
            seat: Seat(seat),
            team: (teams > 0).then_some(seat as u8),
            side: info(0),
            is_stunned: false,
            goes_on: false,
        });
        let round = RoundInfo {
            phase: RoundPhase::Running,
            teams: vec![info(0); teams],
            players: players.to_vec(),
            ..RoundInfo::default()
        };
        let room = RoomView::new(Arc::new(scene.expect("a shipped scene")), Seat(0));
        let mut watched = Watched { room, moments: Moments::default(), round, tick: 100 };
        watched.step(0);
        watched
    }

    /// Shows the current round this many ticks later.
    fn step(&mut self, ticks: u32) -> Option<Sound> {
        self.tick += ticks;
        let round = Some(self.round.clone());
        self.room.timeline.file(Arc::new(Snapshot {
            tick: self.tick,
            round,
            ..Default::default()
        }));
        self.room.display = f64::from(self.tick);
        self.moments.observe(&self.room, self.room.display)
    }

    fn banner(&self) -> Option<MomentKind> {
        self.moments.banner(self.room.display).map(|moment| moment.kind)
    }
}

#[test]
fn a_goal_holds_and_shakes_the_picture_and_its_point_flies_from_the_goal() {
    let mut watched = Watched::new("hockey", 2);
    watched.round.teams[1].score = 1;
    watched.step(1);
    let tick = watched.room.display;
    assert_eq!(watched.banner(), Some(MomentKind::Goal));
    assert!(watched.moments.holds(tick + 7.0) && !watched.moments.holds(tick + 12.0));
    assert_ne!(watched.moments.shake(tick + 9.0), Vec2::ZERO);
    assert_eq!(watched.moments.shake(tick + 60.0), Vec2::ZERO);
    assert_eq!(watched.moments.banner(tick + BANNER_TICKS), None);
    let mut drawn = FrameRoom::default();
    watched.moments.lay_out(&watched.room, &mut drawn);
    let [points] = drawn.points[..] else { panic!("{:?}", drawn.points) };
    assert_eq!((points.points, points.color, points.at.y), (1, 1, 60.0));
    assert!(points.at.x < 20.0, "blue scores on the left, not at {}", points.at);
}

#[test]
fn a_goal_for_the_others_is_an_own_goal() {
    let mut watched = Watched::new("hockey", 2);
    watched.moments.note_line(101.0, Seat(0), true);
    watched.round.teams[1].score = 1;
    watched.step(1);
    let moment = watched.moments.banner(watched.room.display).expect("a banner");
    assert_eq!((moment.kind, moment.by), (MomentKind::OwnGoal, Some(Seat(0))));
    assert!(watched.moments.bests.best().next().is_none(), "nobody is praised for it");
}

#[test]
fn laps_knock_outs_and_the_end_have_their_moments() {
    let mut race = Watched::new("race", 0);
    race.round.players[1].side.score = 1;
    race.step(1);
    assert_eq!(race.banner(), None, "only the own laps have a banner");
    race.round.players[0].side.score = 1;
    race.step(200);
    assert_eq!(race.banner(), Some(MomentKind::Lap));
    race.round.phase = RoundPhase::Over;
    race.round.winners = vec![Side::Player(Seat(0))];
    race.step(50);
    assert_eq!(race.banner(), Some(MomentKind::Over));
    let best: Vec<_> = race.moments.best().collect();
    assert!(matches!(best[..], [(Seat(1), Best::Lap(_))]), "{best:?}");

    let mut pong = Watched::new("pong", 2);
    pong.round.teams[0].lives = 2;
    assert_eq!(pong.step(1), Some(Sound::Out));
    assert_eq!(pong.banner(), Some(MomentKind::LifeLost));
    pong.round.teams[0] = SideInfo { score: 0, lives: 0, is_in: false };
    pong.step(100);
    assert_eq!(pong.banner(), Some(MomentKind::Out));
}

#[test]
fn only_a_new_leader_is_announced_and_not_too_often() {
    let mut watched = Watched::new("splash", 0);
    let mut sounds = 0;
    for turn in 0..40 {
        // The two overtake each other all the time.
        watched.round.players[turn % 2].side.score = turn as i32 + 1;
        sounds += i32::from(watched.step(60) == Some(Sound::Lead));
    }
    assert!((3..=5).contains(&sounds), "{sounds} in 40 seconds");
    assert_eq!(watched.moments.leader, Some(Side::Player(Seat(1))));
    watched.round.players[0].side.score = watched.round.players[1].side.score;
    watched.step(60);
    assert_eq!(watched.moments.leader, Some(Side::Player(Seat(1))), "a tie changes nothing");
}

#[test]
fn the_picture_jolts_at_most_three_times_a_second_and_memory_is_bounded() {
    let mut watched = Watched::new("hockey", 2);
    for turn in 0..600 {
        watched.round.teams[turn % 2].score += 1;
        watched.step(1);
        let hit = Some(Seat(0));
        watched.moments.note_burst(&watched.room, watched.room.display, None, hit, Vec2::ZERO);
        assert!(watched.moments.recent.len() <= MOMENTS_MAX);
        let second = watched.room.display - 60.0;
        let jolts = watched.moments.recent.iter().filter(|it| it.jolts && it.tick > second);
        assert!(jolts.count() <= 3);
    }
}

#[test]
fn confetti_falls_for_the_winner_and_ends() {
    let mut watched = Watched::new("hockey", 2);
    watched.round.phase = RoundPhase::Over;
    watched.round.winners = vec![Side::Team(1)];
    watched.step(1);
    let mut drawn = FrameRoom::default();
    watched.moments.lay_out(&watched.room, &mut drawn);
    assert_eq!(drawn.confetti.map(|confetti| confetti.color), Some(1));
    watched.step(600);
    watched.moments.lay_out(&watched.room, &mut drawn);
    assert_eq!(drawn.confetti, None);
}

/// Sets a player's progress in the race: laps and gates of the lap.
fn progress(watched: &mut Watched, seat: u16, laps: i32, gates: u8) {
    let side = Some(Side::Player(Seat(seat)));
    watched.round.players[usize::from(seat)].side.score = laps;
    watched.round.orders.retain(|order| order.side != side);
    if gates > 0 {
        watched.round.orders.push(OrderProgress { signal: 0, side, steps: gates });
    }
}

#[test]
fn a_race_knows_times_places_and_splits() {
    let mut watched = Watched::new("race", 0);
    watched.round.since = 100;
    watched.step(1);
    let race = |watched: &Watched| watched.moments.race.clone().expect("a race");
    for (ticks, seat, laps, gates) in [
        (59, 0, 0, 1),
        (60, 1, 0, 2),
        (60, 0, 0, 3),
        (60, 0, 1, 0),
        (60, 1, 1, 1),
        (60, 0, 3, 0),
        (60, 1, 3, 0),
    ] {
        progress(&mut watched, seat, laps, gates);
        watched.step(ticks);
        let first = race(&watched).place(Seat(0));
        assert_eq!(first, (if seat == 1 && laps < 3 { 2 } else { 1 }, 2), "{seat} {laps} {gates}");
    }
    let race = race(&watched);
    assert_eq!(race.marks(Seat(0))[..4], [60, 180, 180, 240]);
    assert_eq!(race.lap_times(Seat(0)).collect::<Vec<_>>(), [240, 120, 0]);
    assert_eq!([0, 1].map(|seat| race.finish(Seat(seat))), [Some(360), Some(420)]);
    assert_eq!(race.elapsed(watched.room.display), Some(420.0));
    let [own, other] = [0, 1].map(|seat| race.marks(Seat(seat)));
    assert_eq!((race::split(&own[..2], other), race::split(own, other)), (Some(60), Some(-60)));
    assert_eq!(race::split(own, &[]), None);
    // It ends half a minute after its first finisher.
    let spec = watched.room.scene.rules.round.clone().expect("a round");
    assert_eq!(race::round_length(&spec, Some(&race)), Some(180 * 60));
    let mut won = race.clone();
    won.won_at = Some(360);
    assert_eq!(race::round_length(&spec, Some(&won)), Some(360 + 30 * 60));
    // The next race starts anew.
    progress(&mut watched, 0, 0, 0);
    progress(&mut watched, 1, 0, 0);
    watched.round.since = 600;
    watched.step(200);
    assert_eq!(watched.moments.race.as_ref().map(|race| race.marks(Seat(0)).len()), Some(0));
}

#[test]
fn a_race_is_timed_by_snapshots_rather_than_frames() {
    let mut watched = Watched::new("race", 0);
    watched.round.since = 100;
    progress(&mut watched, 0, 1, 0);
    watched.tick = 150;
    for ticks in [0, 1, 2] {
        let (tick, round) = (watched.tick + ticks, Some(watched.round.clone()));
        watched.room.timeline.file(Arc::new(Snapshot { tick, round, ..Default::default() }));
    }
    watched.step(3);
    let race = watched.moments.race.as_ref().expect("a race");
    assert_eq!(race.lap_times(Seat(0)).collect::<Vec<_>>(), [50]);
}

#[test]
fn scenes_without_laps_have_no_race() {
    for scene in Scene::built_in() {
        assert_eq!(Race::of(&scene).is_some(), scene.name == "race", "{}", scene.name);
    }
}

#[test]
fn only_what_happens_in_a_round_seen_from_its_start_counts_for_its_best() {
    let mut watched = Watched::new("splash", 0);
    let hit = |watched: &mut Watched| {
        let Watched { room, moments, tick, .. } = watched;
        moments.note_burst(room, f64::from(*tick), Some(Seat(1)), Some(Seat(0)), Vec2::ZERO);
    };
    hit(&mut watched);
    watched.step(1);
    assert_eq!(watched.moments.best().next(), None, "the beginning was not seen");
    let set = |watched: &mut Watched, phase| {
        watched.round.phase = phase;
        watched.round.since = watched.tick;
        watched.step(1);
    };
    set(&mut watched, RoundPhase::Countdown);
    set(&mut watched, RoundPhase::Running);
    hit(&mut watched);
    set(&mut watched, RoundPhase::Over);
    hit(&mut watched);
    let best = watched.moments.best().next();
    assert_eq!(best, Some((Seat(1), Best::Hits(1))), "not what follows the end");
}

#[test]
fn a_robot_in_a_pen_is_a_point_and_a_puck_in_a_goal_is_a_goal() {
    for (scene, kind) in [("roundup", MomentKind::Points), ("hockey", MomentKind::Goal)] {
        let scene = Scene::built_in().into_iter().find(|known| known.name == scene);
        assert_eq!(scoring(&scene.expect("a shipped scene"), Side::Team(0)), kind);
    }
}
