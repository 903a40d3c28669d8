use super::*;
use crate::{Room, VIEW_EVERY_TICKS};
use jostle_game::{Buttons, Input, Kind};
use jostle_protocol::{Appearance, PlayerState, SnapshotStream};
use jostle_sim::Rng;
use jostle_sim::{Particles, Shape};

const QUANTUM: f32 = 1.0 / 64.0;
const SEAT: Seat = Seat(0);
const HERO: BodyId = BodyId { index: 7, generation: 2 };
const BODIES: u32 = 500;

/// A 400 x 200 world seen through an 80 x 40 view.
fn scene(camera: &str) -> Arc<Scene> {
    let text = format!(
        "title = \"Plain\"\nsize = [400, 200]\ngravity = [0, 0]\ncamera = {camera}\ntools = [\"steer\"]\n\
         groups = [\"hero\", \"block\"]\npairs = [[\"hero\", \"block\"]]\n\
         [limits]\nplayers = 2\n[hero]\nspawns = [[30, 30], [370, 170]]\n\
         [[bodies]]\nkind = \"block\"\nposition = [50, 30]\nradius = 1\n\
         [[bodies]]\nkind = \"block\"\nposition = [350, 170]\nradius = 1\n"
    );
    Arc::new(Scene::parse("plain.toml", &text).unwrap_or_else(|error| panic!("{error}")))
}

fn follow() -> Arc<Scene> {
    scene("{ follow = 40 }")
}

fn body(index: u32, at: Vec2) -> SnapshotBody {
    let id = if index == HERO.index { HERO } else { BodyId { index, generation: 0 } };
    let shape = Shape::circle(1.0);
    let quanta = [at.x, at.y].map(|axis| (axis / QUANTUM) as i32);
    SnapshotBody { id, kind: Kind::Block, owner: None, group: 0, shape, quanta }
}

fn snapshot(tick: u32, bodies: Vec<SnapshotBody>) -> Snapshot {
    let player = PlayerState {
        seat: SEAT,
        appearance: Appearance::new("Ann", 0).unwrap(),
        connected: true,
        input_seq: 0,
        hero: Some(HERO),
        selected: None,
        held: None,
        score: 0,
        pointer: None,
    };
    Snapshot { tick, bodies, players: vec![player], round: None }
}

/// Bodies that fly about, and a fast hero that turns at 240 units/s^2 and is teleported every four seconds.
struct Flight {
    rng: Rng,
    points: Vec<(Vec2, Vec2)>,
    wanted: Vec2,
    tick: u32,
}

impl Flight {
    const CARRIED_TICKS: u32 = 240;

    fn new() -> Flight {
        let mut rng = Rng::new(5, 1);
        let mut point = |_| (place(&mut rng), Vec2::ZERO);
        let points = (0..BODIES).map(&mut point).collect();
        Flight { rng, points, wanted: Vec2::ZERO, tick: 0 }
    }

    fn step(&mut self) -> Snapshot {
        self.tick += 1;
        let Flight { rng, points, wanted, tick } = self;
        let hero = HERO.index as usize;
        for (index, (at, speed)) in points.iter_mut().enumerate() {
            let fast = if index == hero { 60.0 } else { 15.0 };
            if rng.below(30) == 0 {
                let turned = Vec2::new(rng.range(-fast, fast), rng.range(-fast, fast));
                *if index == hero { &mut *wanted } else { &mut *speed } = turned;
            }
            if index == hero {
                *speed += (*wanted - *speed).clamp_length_max(4.0);
            }
            *at = (*at + *speed / 60.0).clamp(Vec2::ZERO, Vec2::new(400.0, 200.0));
        }
        if tick.is_multiple_of(Flight::CARRIED_TICKS) {
            points[hero] = (place(rng), Vec2::ZERO);
        }
        let bodies = (0..).zip(points).map(|(index, (at, _))| body(index, *at));
        snapshot(*tick, bodies.collect())
    }

    fn hero(&self) -> (Vec2, Vec2) {
        self.points[HERO.index as usize]
    }
}

fn place(rng: &mut Rng) -> Vec2 {
    Vec2::new(rng.range(0.0, 400.0), rng.range(0.0, 200.0))
}

struct Page {
    center: Option<Vec2>,
}

impl Page {
    const HALF: Vec2 = Vec2::new(40.0, 20.0);

    fn follow(&mut self, (at, speed): (Vec2, Vec2)) {
        let wanted = (at + speed * 0.18).clamp(Page::HALF, Vec2::new(400.0, 200.0) - Page::HALF);
        let last = self.center.unwrap_or(wanted);
        let share = if (wanted - last).length() > 60.0 { 1.0 } else { 0.11 };
        self.center = Some(last + (wanted - last) * share);
    }

    fn shows(&self, body: &SnapshotBody) -> bool {
        let at = Vec2::new(body.quanta[0] as f32, body.quanta[1] as f32) * QUANTUM;
        let off = (at - self.center.unwrap()).abs();
        off.x < Page::HALF.x + 1.0 && off.y < Page::HALF.y + 1.0
    }
}

#[test]
fn everything_that_a_camera_shows_was_sent_at_every_rate() {
    let scene = follow();
    let view = view_of(&scene, None).unwrap();
    assert_eq!(view, [80 * 64, 40 * 64]);
    for rate in Rate::ALL {
        let mut flight = Flight::new();
        let first = flight.step();
        let (mut area, subscriber, keyframe) =
            InterestArea::subscribe(None, SEAT, rate, &scene, view, &first, None);
        let (mut stream, mut page) = (SnapshotStream::default(), Page { center: None });
        stream.decode(&keyframe).unwrap();
        let (mut shown, mut held, mut came) = (0, 0, 0);
        for _ in 0..1200 {
            let now = flight.step();
            page.follow(flight.hero());
            area.push(&now, &[], &Particles::default(), &mut BufferPool::default());
            let before = stream.newest().unwrap().bodies.clone();
            area.message(&subscriber).iter().for_each(|bytes| drop(stream.decode(bytes).unwrap()));
            let newest = stream.newest().unwrap();
            let is_known = |id| newest.bodies.binary_search_by_key(&id, |body| body.id).ok();
            for body in now.bodies.iter().filter(|body| page.shows(body)) {
                shown += 1;
                let place = is_known(body.id).unwrap_or_else(|| {
                    panic!(
                        "{rate:?} {}: {body:?} {:?} {:?} {:?}",
                        now.tick,
                        area.camera,
                        page.center,
                        flight.hero()
                    )
                });
                let known = &newest.bodies[place];
                assert!(newest.tick < now.tick || known == body, "{rate:?}: {body:?}");
            }
            assert!(newest.bodies.is_sorted_by(|a, b| a.id.index < b.id.index), "each once");
            assert!(is_known(HERO).is_some());
            let is_new = |body: &&SnapshotBody| !before.iter().any(|old| old.id == body.id);
            came += newest.bodies.iter().filter(is_new).count();
            held += newest.bodies.len();
        }
        // Only part of the world is shown, and bodies do not constantly enter and leave.
        assert!(shown > 1200 * 20 && 2 * held < 5 * shown, "{rate:?}: {shown} of {held}");
        assert!(came < held / 60, "{rate:?}: {came} of {held}");
    }
}

#[test]
fn a_body_trembling_on_the_edge_of_a_view_enters_once() {
    let scene = follow();
    let mut camera = CameraArea::new(&scene, view_of(&scene, None).unwrap());
    let (mut held, mut seen) = (Vec::new(), Vec::new());
    let margin = 40.0 / MARGINS as f32;
    let way = [1.1, 0.8, 1.1, 0.8, 1.9, 1.1, 2.1, 2.1, 1.1, 0.9];
    for (tick, beyond) in way.into_iter().enumerate() {
        // The view ends at 240, and the body is 1 wide.
        let edge = body(9, Vec2::new(241.0 + beyond * margin, 100.0));
        let all = vec![body(HERO.index, Vec2::new(200.0, 100.0)), edge];
        let all = snapshot(tick as u32, all);
        camera.follow(&all, SEAT, Rate::Full);
        let mut shown = Snapshot::default();
        camera.see(&all, &held, &mut shown);
        held = shown.bodies;
        seen.push(held.len() == 2);
    }
    assert_eq!(seen, [false, true, true, true, true, true, false, false, false, true]);
}

#[test]
fn a_body_at_rest_is_kept_longer_when_the_camera_turns_away() {
    let scene = follow();
    let mut camera = CameraArea::new(&scene, view_of(&scene, None).unwrap());
    let (mut held, mut last) = (Vec::new(), Vec::new());
    for step in 0..600 {
        let hero = body(HERO.index, Vec2::new(100.0 + 0.25 * step as f32, 100.0));
        // One body rests, and the other creeps.
        let rests = body(9, Vec2::new(100.0, 90.0));
        let creeps = body(10, Vec2::new(100.0, 90.0 + step as f32 / 60.0));
        let all = snapshot(step, vec![hero, rests, creeps]);
        camera.follow(&all, SEAT, Rate::Full);
        let mut shown = Snapshot::default();
        camera.see(&all, &held, &mut shown);
        held = shown.bodies;
        last.push([9, 10].map(|index| held.iter().any(|body| body.id.index == index)));
    }
    let gone = |place: usize| last.iter().position(|seen| !seen[place]).unwrap() as f32 * 0.25;
    // The view is 80 wide and the margin 2.5; the hero is slightly ahead of or behind the middle.
    assert!((43.0..49.0).contains(&gone(1)), "{}", gone(1));
    assert!((58.0..66.0).contains(&gone(0)), "{}", gone(0));
}

#[test]
fn impacts_are_sent_where_they_are_seen_and_other_events_everywhere() {
    let scene = follow();
    let mut camera = CameraArea::new(&scene, view_of(&scene, None).unwrap());
    let hero = body(HERO.index, Vec2::new(200.0, 100.0));
    camera.follow(&snapshot(1, vec![hero]), SEAT, Rate::Full);
    let impact = |x: f32| {
        let point = Vec2::new(x, 100.0);
        TimedEvent { tick: 1, event: Event::Impact { a: HERO, b: HERO, point, speed: 1.0 } }
    };
    assert!(camera.shows(&impact(165.0)) && camera.shows(&impact(242.0)));
    assert!(!camera.shows(&impact(100.0)) && !camera.shows(&impact(300.0)));
    assert!(camera.shows(&TimedEvent { tick: 1, event: Event::Joined(Seat(1)) }));
}

/// A room with two players, one at each end of the plain.
fn room(scene: Arc<Scene>) -> Room {
    let mut room = Room::new("oak", scene, 1);
    for _ in 0..2 {
        room.join(Appearance::new("Ann", 0).unwrap(), None).unwrap();
    }
    room.tick();
    room
}

fn held(keyframe: &[u8]) -> Vec<f32> {
    let mut stream = SnapshotStream::default();
    stream.decode(keyframe).unwrap();
    let bodies = &stream.newest().unwrap().bodies;
    bodies.iter().map(|body| body.quanta[0] as f32 * QUANTUM).collect()
}

#[test]
fn a_world_that_fits_into_the_view_has_one_channel_for_all() {
    for camera in ["\"fit\"", "{ follow = 200 }", "{ follow = 300 }"] {
        let mut room = room(scene(camera));
        let (everybody, _) = room.subscribe(Rate::Full);
        let subscribers = [SEAT, Seat(1)].map(|seat| room.subscribe_view(seat, Rate::Full).0);
        room.view(SEAT, Vec2::new(900.0, 500.0));
        for tick in 0..40 {
            let input = Input::new(Buttons::RIGHT, None);
            room.input(SEAT, tick + 1, input);
            room.tick();
            let all = room.message(&everybody).unwrap();
            for subscriber in &subscribers {
                assert_eq!(all.as_ptr(), room.message(subscriber).unwrap().as_ptr(), "{camera}");
            }
        }
    }
}

#[test]
fn players_see_their_own_areas_and_a_larger_view_shows_more() {
    let mut room = room(follow());
    let near = held(&room.subscribe_view(SEAT, Rate::Full).1);
    let far = held(&room.subscribe_view(Seat(1), Rate::Third).1);
    assert!(near.len() == 2 && near.iter().all(|&x| x < 60.0), "{near:?}");
    assert!(far.len() == 2 && far.iter().all(|&x| x > 340.0), "{far:?}");
    assert_eq!(held(&room.subscribe(Rate::Full).1).len(), 4);

    let mut room = self::room(follow());
    room.view(SEAT, Vec2::new(24.0, 40.0));
    let (subscriber, keyframe) = room.subscribe_view(SEAT, Rate::Full);
    let mut stream = SnapshotStream::default();
    stream.decode(&keyframe).unwrap();
    // The camera's height is 40, so no view is larger than 160 in either direction.
    for (size, bodies) in [([24.0, 40.0], 1), ([1000.0, 1000.0], 2)] {
        room.view(SEAT, Vec2::from(size));
        // The view may change after this time, and the camera glides until it is inside the world.
        for _ in 0..VIEW_EVERY_TICKS + 40 {
            room.tick();
            room.message(&subscriber).iter().for_each(|bytes| drop(stream.decode(bytes).unwrap()));
        }
        assert_eq!(stream.newest().unwrap().bodies.len(), bodies, "{size:?}");
    }
}

#[test]
fn a_view_that_changes_each_tick_is_resized_once_a_second() {
    let mut room = room(follow());
    let (subscriber, keyframe) = room.subscribe_view(SEAT, Rate::Full);
    room.view(SEAT, Vec2::new(80.0, 40.0));
    let mut stream = SnapshotStream::default();
    stream.decode(&keyframe).unwrap();
    let (mut held, mut changes) = (stream.newest().unwrap().bodies.len(), 0);
    for tick in 0..4 * VIEW_EVERY_TICKS {
        room.view(SEAT, if tick % 7 < 3 { Vec2::new(10.0, 10.0) } else { Vec2::new(80.0, 40.0) });
        room.tick();
        room.message(&subscriber).iter().for_each(|bytes| drop(stream.decode(bytes).unwrap()));
        let now = stream.newest().unwrap().bodies.len();
        changes += u32::from(now != std::mem::replace(&mut held, now));
    }
    assert!((1..=4).contains(&changes), "{changes} changes");
}

#[test]
fn a_teleported_hero_takes_the_view_along_at_once() {
    let mut camera = CameraArea::new(&follow(), view_of(&follow(), None).unwrap());
    let far = 1.3 * 40.0;
    let places = [Vec2::new(150.0, 70.0), Vec2::new(150.0 + far, 70.0 + far)];
    for (tick, place) in (0..).zip(places) {
        camera.follow(&snapshot(tick, vec![body(HERO.index, place)]), SEAT, Rate::Full);
        assert_eq!(camera.center, Some(body(HERO.index, place).quanta));
    }
}

#[test]
fn a_change_of_rate_leaves_the_camera_where_it_was() {
    let scene = follow();
    let view = view_of(&scene, None).unwrap();
    let at =
        |tick: u32| snapshot(tick, vec![body(HERO.index, Vec2::new(100.0 + tick as f32, 100.0))]);
    let (mut area, ..) =
        InterestArea::subscribe(None, SEAT, Rate::Full, &scene, view, &at(0), None);
    (1..60).for_each(|tick| {
        area.push(&at(tick), &[], &Particles::default(), &mut BufferPool::default())
    });
    let center = area.camera.center.unwrap();
    let (area, ..) =
        InterestArea::subscribe(Some(area), SEAT, Rate::Third, &scene, view, &at(59), None);
    let moved = area.camera.center.unwrap()[0] - center[0];
    // The camera moves by at most one tick's glide, although it is 11 ticks of motion ahead of the hero.
    assert!(moved.abs() <= 2 * 64, "{moved} quanta");
}

#[test]
fn the_view_jumps_to_the_first_hero_and_stays_where_the_last_one_was() {
    let mut camera = CameraArea::new(&follow(), view_of(&follow(), None).unwrap());
    camera.follow(&snapshot(0, vec![]), SEAT, Rate::Full);
    let hero = body(HERO.index, Vec2::new(160.0, 110.0));
    camera.follow(&snapshot(1, vec![hero]), SEAT, Rate::Full);
    assert_eq!(camera.center, Some(hero.quanta));
    camera.follow(&snapshot(2, vec![]), SEAT, Rate::Full);
    assert_eq!(camera.center, Some(hero.quanta));
}

#[test]
fn a_player_without_a_socket_gets_no_messages() {
    let mut room = room(follow());
    let [one, two] = [SEAT, Seat(1)].map(|seat| room.subscribe_view(seat, Rate::Full).0);
    room.disconnect(SEAT);
    room.leave(Seat(1));
    room.tick();
    assert!(room.message(&one).is_none() && room.message(&two).is_none());
    let (back, keyframe) = room.subscribe_view(SEAT, Rate::Twelfth);
    assert_eq!(held(&keyframe).len(), 2);
    let mut messages = 0;
    for _ in 0..200 {
        room.tick();
        messages += usize::from(room.message(&back).is_some());
    }
    assert!(messages > 0);
}
