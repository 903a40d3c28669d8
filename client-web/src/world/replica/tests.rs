use super::*;
use jostle_protocol::SnapshotBody;
use jostle_sim::Shape;
use jostle_sim::particles::{EmitterDef, Source};

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
        // Every built-in scene counts in 64ths.
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
fn heroes_wear_their_players_colour_and_look_where_they_point() {
    let mut replica = replica("arena");
    let bodies = vec![body(0, Kind::Hero, 10.0, Some(0)), body(1, Kind::Hero, 50.0, Some(1))];
    replica.file(snapshot(5, bodies, vec![player(0, Some(0)), player(1, Some(1))]), vec![]);
    let own = Vec2::new(70.0, 70.0);
    replica.advance(5.0, Eye { pointer: Some(own), bounds: false });
    let [me, other] = replica.bodies() else { panic!("two bodies") };
    assert_eq!((me.color, other.color), (Some(3), Some(4)));
    assert_eq!(me.gaze, Some(own), "the own eyes do not wait for the server");
    let quantum = replica.scene.world.quantum;
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
    let [spark] = &replica.effects[..] else { panic!("one spark") };
    assert_eq!(spark.body, Some(BodyId { index: 1, generation: 0 }), "the hero feels it");
    assert_eq!((spark.kind, spark.strength), (EffectKind::Spark, 12.0));
    assert!((spark.age - 0.1).abs() < 1e-6, "age {}", spark.age);
    replica.advance(80.0, Eye::default());
    assert!(&replica.effects.is_empty());
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
}

#[test]
fn bodies_that_touch_the_selected_one_are_marked() {
    let mut replica = replica("bounds");
    let kinds = [(0, Kind::Hero, 10.0), (1, Kind::Minion, 13.0), (2, Kind::Minion, 30.0)];
    let all = replica.scene.world.meets.iter().position(|&groups| groups != 0).expect("a pair");
    let partner = replica.scene.world.meets[all].trailing_zeros() as u8;
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
