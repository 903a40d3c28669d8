use super::*;
use crate::view::frame::ZoneSign;
use jostle_game::RoundInfo;
use jostle_protocol::SnapshotBody;
use jostle_sim::particles::{EmitterDef, Source};
use jostle_sim::{BodyId, Shape};

fn scene(name: &str) -> Arc<Scene> {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == name);
    Arc::new(scene.expect("a built-in scene"))
}

fn replica(name: &str) -> Replica {
    Replica::new(scene(name), Seat(0))
}

fn body(index: u32, kind: Kind, x: f32, owner: Option<u16>) -> SnapshotBody {
    SnapshotBody {
        id: BodyId { index, generation: 0 },
        kind,
        owner: owner.map(Seat),
        group: 0,
        shape: Shape::circle(2.0),
        // The quantum of every built-in scene is 1/64.
        quanta: [(x * 64.0) as i32, 640],
    }
}

fn player(seat: u16, hero: Option<u32>) -> PlayerState {
    PlayerState {
        seat: Seat(seat),
        appearance: Appearance { name: format!("p{seat}").into(), color: seat as u8 + 3 },
        connected: true,
        input_seq: 0,
        hero: hero.map(|index| BodyId { index, generation: 0 }),
        selected: None,
        held: None,
        score: 0,
        pointer: Some([256, 512]),
    }
}

fn snapshot(tick: u32, bodies: Vec<SnapshotBody>, players: Vec<PlayerState>) -> Snapshot {
    Snapshot { tick, bodies, players, round: None }
}

fn at(tick: u32, event: Event) -> TimedEvent {
    TimedEvent { tick, event }
}

#[test]
fn zones_are_drawn_as_what_they_are() {
    let signs = |name: &str| -> Vec<ZoneSign> {
        let scene = scene(name);
        let drawn = scene.rules.zones.iter().filter(|zone| zone.is_drawn());
        drawn.map(|zone| picture::sign(scene.size, zone)).collect()
    };
    let [area, goal, gate] = [ZoneSign::Area, ZoneSign::Goal, ZoneSign::Gate];
    assert_eq!(signs("hockey"), [goal; 2]);
    assert_eq!(signs("pong"), [goal; 4]);
    assert_eq!(signs("race"), [gate, gate, gate, gate, area, area], "lava is no gate");
    assert_eq!(signs("flags"), [ZoneSign::Flag, ZoneSign::Flag, area, area]);
    assert_eq!(signs("lock"), [area; 6]);
}

#[test]
fn heroes_wear_their_players_colour_and_look_where_they_point() {
    let mut replica = replica("arena");
    let bodies = vec![body(0, Kind::Hero, 10.0, Some(0)), body(1, Kind::Hero, 50.0, Some(1))];
    replica.file(snapshot(5, bodies, vec![player(0, Some(0)), player(1, Some(1))]), vec![]);
    let own = Vec2::new(70.0, 70.0);
    replica.advance(5.0, Eye { pointer: Some(own), bounds: false });
    let [me, other] = replica.bodies() else { panic!("two bodies") };
    assert_eq!((me.color, other.color), (Some(3), Some(4)));
    assert_eq!(me.gaze, Some(own), "the own eyes do not wait for the server");
    let quantum = replica.room.scene.world.quantum;
    assert_eq!(other.gaze, Some(Vec2::new(256.0, 512.0) * quantum));
    assert_eq!(replica.own_hero().map(|b| b.id), Some(me.id));
}

#[test]
fn an_emitter_starts_when_its_tick_is_shown_and_not_before() {
    let mut replica = replica("emitters");
    let emitter =
        EmitterDef { recipe: 0, count: 20, seed: 1, source: Source::Point(Vec2::new(50.0, 50.0)) };
    replica.file(snapshot(10, vec![], vec![]), vec![]);
    replica.file(snapshot(11, vec![], vec![]), vec![]);
    replica.file(snapshot(12, vec![], vec![]), vec![at(12, Event::EmitterStarted(emitter))]);
    replica.advance(10.5, Eye::default());
    replica.advance(11.9, Eye::default());
    assert_eq!(replica.particles().len(), 0);
    replica.advance(12.1, Eye::default());
    assert!(replica.particles().len() >= 5);
}

#[test]
fn particles_are_stepped_once_for_each_tick_even_where_snapshots_are_missing() {
    let emitter =
        EmitterDef { recipe: 0, count: 20, seed: 1, source: Source::Point(Vec2::new(50.0, 50.0)) };
    let play = |ticks: &[u32]| {
        let mut replica = replica("emitters");
        replica.file(snapshot(9, vec![], vec![]), vec![]);
        replica.advance(9.0, Eye::default());
        for &tick in ticks {
            let events = if tick == ticks[0] {
                vec![at(10, Event::EmitterStarted(emitter))]
            } else {
                vec![]
            };
            replica.file(snapshot(tick, vec![], vec![]), events);
            replica.advance(f64::from(tick), Eye::default());
        }
        replica.particles().digest()
    };
    assert_eq!(play(&[10, 11, 12, 13, 14, 15, 16]), play(&[13, 16]));
}

#[test]
fn flashes_age_and_go() {
    let mut replica = replica("arena");
    let impact = Event::Impact {
        a: BodyId { index: 0, generation: 0 },
        b: BodyId { index: 1, generation: 0 },
        point: Vec2::new(3.0, 4.0),
        speed: 12.0,
    };
    let bodies = || vec![body(0, Kind::Block, 1.0, None), body(1, Kind::Hero, 9.0, Some(0))];
    replica.file(snapshot(9, bodies(), vec![]), vec![]);
    replica.advance(9.0, Eye::default());
    replica.file(snapshot(10, bodies(), vec![]), vec![at(10, impact)]);
    replica.file(snapshot(100, bodies(), vec![]), vec![]);
    replica.advance(16.0, Eye::default());
    let [spark] = &replica.picture.drawn.effects[..] else { panic!("one spark") };
    assert_eq!(spark.body, Some(BodyId { index: 1, generation: 0 }), "the hero feels it");
    assert_eq!((spark.kind, spark.strength), (EffectKind::Spark, 12.0));
    assert!((spark.age - 0.1).abs() < 1e-6, "age {}", spark.age);
    replica.advance(80.0, Eye::default());
    assert!(&replica.picture.drawn.effects.is_empty());
}

#[test]
fn news_names_players_who_have_left() {
    let mut replica = replica("arena");
    replica.file(snapshot(1, vec![], vec![player(0, None), player(1, None)]), vec![]);
    replica.advance(1.0, Eye::default());
    let left = at(2, Event::Left(Seat(1)));
    replica.file(snapshot(2, vec![], vec![player(0, None)]), vec![left]);
    replica.advance(2.0, Eye::default());
    assert_eq!(replica.news.pop_front(), Some(News::Left(player(1, None).appearance)));
    assert_eq!(replica.news.pop_front(), None);
    // The host's page does not say that a player left whom the host removed.
    replica.room.removed.push(Seat(0));
    replica.file(snapshot(3, vec![], vec![]), vec![at(3, Event::Left(Seat(0)))]);
    replica.advance(3.0, Eye::default());
    assert_eq!(replica.news.pop_front(), Some(News::Removed(player(0, None).appearance)));
}

#[test]
fn bodies_that_touch_the_selected_one_are_marked() {
    let mut replica = replica("bounds");
    let kinds = [(0, Kind::Hero, 10.0), (1, Kind::Minion, 13.0), (2, Kind::Minion, 30.0)];
    let all =
        replica.room.scene.world.meets.iter().position(|&groups| groups != 0).expect("a pair");
    let partner = replica.room.scene.world.meets[all].trailing_zeros() as u8;
    let mut bodies: Vec<_> = kinds.map(|(i, kind, x)| body(i, kind, x, None)).into();
    bodies[0].group = all as u8;
    bodies[1].group = partner;
    bodies[2].group = partner;
    let mut me = player(0, None);
    me.selected = Some(bodies[0].id);
    replica.file(snapshot(1, bodies, vec![me]), vec![]);
    replica.advance(1.0, Eye::default());
    let flags: Vec<_> = replica.bodies().iter().map(|b| (b.hidden, b.touching)).collect();
    assert_eq!(flags, [(true, false), (false, true), (false, false)]);
}

#[test]
fn a_long_absence_is_caught_up_in_part() {
    let mut replica = replica("emitters");
    replica.file(snapshot(1, vec![], vec![]), vec![]);
    replica.advance(1.0, Eye::default());
    replica.file(snapshot(1_000_000, vec![], vec![]), vec![]);
    replica.advance(1_000_000.0, Eye::default());
    assert_eq!(replica.particle_lead(), 0.0);
}

#[test]
fn only_bodies_born_while_watching_are_new() {
    let mut replica = replica("arena");
    let there = || body(0, Kind::Block, 1.0, None);
    replica.file(snapshot(500, vec![there()], vec![]), vec![]);
    replica.advance(497.5, Eye::default());
    assert!(replica.bodies()[0].age > 10.0, "it was there before we came");
    let reborn = SnapshotBody { id: BodyId { index: 0, generation: 1 }, ..there() };
    let born = body(1, Kind::Block, 9.0, None);
    replica.file(snapshot(501, vec![there(), born], vec![]), vec![]);
    replica.file(snapshot(507, vec![reborn, born], vec![]), vec![]);
    replica.advance(501.0, Eye::default());
    replica.advance(507.0, Eye::default());
    let ages: Vec<f32> = replica.bodies().iter().map(|body| body.age).collect();
    assert_eq!(ages, [0.0, 0.1], "a new body in an old slot, and one of 6 ticks");
}

#[test]
fn only_the_body_that_x_would_grab_is_highlighted() {
    let source = "title = \"Grab\"\nsize = [100, 50]\ngroups = [\"all\"]\ntools = [\"hold\"]\n\
        [[bodies]]\nkind = \"block\"\nposition = [10, 10]\nradius = 2\ngroup = \"all\"\n\
        motion = \"static\"\n[[bodies]]\nkind = \"block\"\nposition = [30, 10]\nradius = 2\n\
        group = \"all\"\n";
    let scene = Arc::new(Scene::parse("grab.toml", source).expect("a valid scene"));
    let mut replica = Replica::new(scene, Seat(0));
    let bodies = vec![body(0, Kind::Block, 10.0, None), body(1, Kind::Block, 30.0, None)];
    let loose = bodies[1].id;
    let mut lit = |tick, x, held: [bool; 2]| {
        let players = [0, 1].map(|seat| {
            let held = held[usize::from(seat)].then_some(loose);
            PlayerState { held, ..player(seat, None) }
        });
        replica.file(snapshot(tick, bodies.clone(), players.into()), vec![]);
        let pointer = Some(Vec2::new(x, 10.0));
        replica.advance(f64::from(tick), Eye { pointer, bounds: false });
        replica.bodies().iter().map(|body| body.hot).collect::<Vec<_>>()
    };
    assert_eq!(lit(1, 10.0, [false, false]), [false, false], "it is fixed");
    assert_eq!(lit(2, 30.0, [false, false]), [false, true]);
    assert_eq!(lit(3, 50.0, [false, true]), [false, true], "held by another");
}

fn cues(replica: &mut Replica) -> Vec<Cue> {
    std::iter::from_fn(|| replica.next_cue()).collect()
}

#[test]
fn of_two_bodies_that_meet_the_smaller_one_sounds_and_walls_never() {
    let mut replica = replica("arena");
    let large = SnapshotBody { shape: Shape::circle(9.0), ..body(1, Kind::Marble, 20.0, None) };
    let bodies = vec![body(0, Kind::Wall, 1.0, None), large, body(2, Kind::Hero, 40.0, Some(0))];
    let id = |index| BodyId { index, generation: 0 };
    let impact = |a, b| {
        let point = Vec2::new(3.0, 4.0);
        at(5, Event::Impact { a: id(a), b: id(b), point, speed: 20.0 })
    };
    let players = || vec![player(0, Some(2))];
    replica.file(snapshot(4, bodies.clone(), players()), vec![]);
    replica.advance(4.0, Eye::default());
    replica.file(snapshot(5, bodies, players()), vec![impact(0, 1), impact(1, 2), impact(0, 9)]);
    replica.advance(5.0, Eye::default());
    let [wall, hero] = cues(&mut replica)[..] else { panic!("two cues") };
    assert_eq!((wall.sound, wall.size, wall.bodies), (Sound::Glass, 18.0, [Some(id(1)), None]));
    assert_eq!(hero.bodies, [Some(id(2)), Some(id(1))]);
    assert_eq!((hero.sound, hero.size, hero.speed), (Sound::Rubber, 4.0, 20.0));
    assert_eq!(hero.at, Some(Vec2::new(3.0, 4.0)));
}

#[test]
fn bodies_are_heard_when_they_appear_and_not_when_the_player_comes() {
    let mut replica = replica("arena");
    let mut bodies = vec![body(0, Kind::Hero, 20.0, Some(0)), body(1, Kind::Marble, 40.0, None)];
    replica.file(snapshot(4, bodies.clone(), vec![player(0, Some(0))]), vec![]);
    replica.advance(4.0, Eye::default());
    assert_eq!(cues(&mut replica), []);
    bodies.push(body(2, Kind::Pack, 25.0, Some(0)));
    bodies.push(body(3, Kind::Marble, 60.0, None));
    bodies.push(body(4, Kind::Platform, 80.0, None));
    replica.file(snapshot(5, bodies.clone(), vec![player(0, Some(0))]), vec![]);
    replica.advance(5.0, Eye::default());
    let sounds: Vec<Sound> = cues(&mut replica).iter().map(|cue| cue.sound).collect();
    assert_eq!(sounds, [Sound::Throw, Sound::Spawn]);
    replica.file(snapshot(6, bodies, vec![player(0, Some(0))]), vec![]);
    replica.advance(6.0, Eye::default());
    assert_eq!(cues(&mut replica), []);
}

#[test]
fn in_a_large_world_what_comes_into_view_is_not_heard() {
    let mut replica = replica("hall");
    let hero = body(0, Kind::Hero, 20.0, Some(0));
    replica.file(snapshot(4, vec![hero], vec![player(0, Some(0))]), vec![]);
    replica.advance(4.0, Eye::default());
    let bodies = vec![hero, body(1, Kind::Block, 90.0, None)];
    replica.file(snapshot(5, bodies, vec![player(0, Some(0))]), vec![]);
    replica.advance(5.0, Eye::default());
    assert_eq!(cues(&mut replica), []);
}

#[test]
fn cues_of_an_absence_are_not_heard_later() {
    let mut replica = replica("arena");
    let impact = |tick| {
        let [a, b] = [0, 1].map(|index| BodyId { index, generation: 0 });
        at(tick, Event::Impact { a, b, point: Vec2::ZERO, speed: 20.0 })
    };
    let bodies = || vec![body(0, Kind::Block, 1.0, None), body(1, Kind::Hero, 9.0, Some(0))];
    replica.file(snapshot(4, bodies(), vec![]), vec![]);
    replica.advance(4.0, Eye::default());
    for tick in 5..=120 {
        replica.file(snapshot(tick, bodies(), vec![]), vec![impact(tick)]);
        replica.advance(f64::from(tick), Eye::default());
    }
    assert_eq!(cues(&mut replica).len(), 16);
}

/// The sounds of a round, displayed tick by tick.
fn round_sounds(replica: &mut Replica, rounds: &[(u32, RoundInfo)]) -> Vec<Sound> {
    let mut sounds = Vec::new();
    for (tick, round) in rounds {
        let told = Snapshot { round: Some(round.clone()), ..snapshot(*tick, vec![], vec![]) };
        replica.file(told, vec![]);
        replica.advance(f64::from(*tick), Eye::default());
        sounds.extend(cues(replica).iter().map(|cue| cue.sound));
    }
    sounds
}

#[test]
fn a_round_is_counted_down_begun_scored_and_won() {
    use jostle_game::{RoundPhase::*, Side, SideInfo};
    let countdown = scene("hockey").rules.round.as_ref().expect("rounds").countdown;
    let of = |phase, since, score| RoundInfo {
        phase,
        since,
        teams: [score, 0].map(|score| SideInfo { score, lives: 0, is_in: true }).to_vec(),
        ..RoundInfo::default()
    };
    let seconds = countdown / TICKS_PER_SECOND;
    let mut rounds = vec![(1, of(Waiting, 0, 0))];
    rounds.extend((0..countdown).map(|tick| (2 + tick, of(Countdown, 2, 0))));
    let begun = 2 + countdown;
    rounds.extend([(begun, of(Running, begun, 0)), (begun + 1, of(Running, begun, 1))]);
    rounds.extend([(begun + 40, of(Running, begun, 2)), (begun + 200, of(Running, begun, 3))]);
    let won = RoundInfo { winners: vec![Side::Team(0)], ..of(Over, begun + 300, 3) };
    rounds.extend([(begun + 300, won.clone()), (begun + 301, won)]);
    let sounds = round_sounds(&mut replica("hockey"), &rounds);
    let counts = sounds.iter().take_while(|&&sound| sound == Sound::Count).count();
    assert_eq!(counts, seconds as usize, "{sounds:?}");
    // The second point follows too soon.
    assert_eq!(sounds[counts..], [Sound::Go, Sound::Goal, Sound::Goal, Sound::Won]);
}

#[test]
fn a_pot_that_is_gone_has_broken() {
    let mut replica = replica("slingshot");
    let placed = replica.room.scene.bodies.iter().find(|placed| placed.breaks.is_some());
    let placed = placed.expect("something to break").clone();
    let pot = |index| SnapshotBody {
        kind: placed.kind,
        group: placed.def.group,
        shape: placed.def.shape,
        ..body(index, Kind::Block, 10.0 * index as f32, None)
    };
    let running = RoundInfo { phase: jostle_game::RoundPhase::Running, ..RoundInfo::default() };
    let told =
        |tick, bodies| Snapshot { round: Some(running.clone()), ..snapshot(tick, bodies, vec![]) };
    replica.file(told(4, vec![pot(1), pot(2)]), vec![]);
    replica.advance(4.0, Eye::default());
    replica.file(told(5, vec![pot(2)]), vec![]);
    replica.advance(5.0, Eye::default());
    let [cue] = cues(&mut replica)[..] else { panic!("one cue") };
    assert_eq!((cue.sound, cue.at), (Sound::Break, Some(Vec2::new(10.0, 10.0))));
}

#[test]
fn a_sling_says_that_it_reloads() {
    let mut replica = replica("slingshot");
    for (tick, is_flying, shots) in [(4, false, 3), (5, true, 2), (6, true, 0), (7, false, 2)] {
        let round = Some(RoundInfo {
            phase: jostle_game::RoundPhase::Running,
            sling: Some(jostle_game::SlingInfo { shots, is_flying }),
            ..RoundInfo::default()
        });
        replica.file(Snapshot { round, ..snapshot(tick, vec![], vec![]) }, vec![]);
        replica.advance(f64::from(tick), Eye::default());
        let mut labels = replica.picture.zone_labels(&replica.room);
        let says = labels.any(|label| label.text == "Reloading…");
        assert_eq!(says, is_flying && shots > 0, "tick {tick}");
    }
}

#[test]
fn the_losers_hear_another_end_than_winners_and_spectators() {
    use jostle_game::{RoundPhase::*, RoundPlayer, Side, SideInfo};
    let player = |team| RoundPlayer {
        seat: Seat(0),
        team: Some(team),
        side: SideInfo { score: 0, lives: 0, is_in: true },
        is_stunned: false,
        goes_on: false,
    };
    for (players, sound) in
        [(vec![player(0)], Sound::Won), (vec![player(1)], Sound::Lost), (vec![], Sound::Won)]
    {
        let running = RoundInfo { phase: Running, players, ..RoundInfo::default() };
        let over = RoundInfo { phase: Over, winners: vec![Side::Team(0)], ..running.clone() };
        assert_eq!(round_sounds(&mut replica("hockey"), &[(1, running), (2, over)]), [sound]);
    }
}
