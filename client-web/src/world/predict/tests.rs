use super::*;
use crate::input::sender::InputSender;
use crate::net::clock::Clock;
use crate::net::simulated_link::{NetworkConditions, SimulatedLink};
use crate::world::replica::{Eye, Replica};
use jostle_game::{Buttons, Kind};
use jostle_protocol::{Appearance, ServerMessage};
use jostle_room::{Rate, Room, Subscriber};

/// Time between frames, milliseconds. It is not a multiple of a tick, so that frames cover every phase.
const FRAME_MS: f64 = 15.0;
/// The options in the network panel.
const PRESETS: [&str; 4] = ["0", "60,10", "150,30", "300,100,stalls"];

fn conditions(preset: &str) -> NetworkConditions {
    NetworkConditions::parse(preset).expect("good conditions")
}

/// Time step of the simulation, milliseconds.
const STEP_MS: f64 = 1.0;

/// A room, a page, and the network between them.
struct Net {
    now_ms: f64,
    room: Room,
    seat: Seat,
    reader: Subscriber,
    conditions: NetworkConditions,
    links: [SimulatedLink; 2],
    to_page: VecDeque<(f64, Vec<u8>)>,
    to_room: VecDeque<(f64, u32, Input)>,
    clock: Clock,
    sender: InputSender,
    replica: Replica,
    predictor: Predictor,
    down: Buttons,
    /// Whether the mouse moves continuously.
    points: bool,
    /// The earliest time at which inputs arrive.
    held_up_ms: f64,
    shown: Option<Predicted>,
    /// The drawn centre in each frame, and the hero's true centre at the drawn moment once known.
    trail: Vec<Drawn>,
    /// The number of inputs queued at the room after each tick.
    queued: Vec<u32>,
    arrived: u32,
    /// The hero's true centre, by tick.
    truth: Vec<(u32, Vec2)>,
}

#[derive(Clone, Copy, Debug)]
struct Drawn {
    at_ms: f64,
    moment: f64,
    center: Vec2,
}

impl Net {
    fn new(scene: Scene, rate: Rate, conditions: NetworkConditions) -> Net {
        let scene = Arc::new(scene);
        let mut room = Room::new("room", Arc::clone(&scene), 1);
        let appearance = Appearance { name: "Jo".into(), color: 0 };
        let seat = room.join(appearance, None).unwrap().claim.seat;
        room.tick();
        let (reader, keyframe) = room.subscribe_view(seat, rate);
        let ServerMessage::Snapshot(coded) = ServerMessage::decode(&keyframe).unwrap() else {
            panic!("no keyframe");
        };
        let mut net = Net {
            now_ms: 0.0,
            room,
            seat,
            reader,
            conditions,
            links: [SimulatedLink::new(1), SimulatedLink::new(2)],
            to_page: VecDeque::new(),
            to_room: VecDeque::new(),
            clock: Clock::default(),
            sender: InputSender::default(),
            replica: Replica::new(Arc::clone(&scene), seat),
            predictor: Predictor::new(&scene, seat).expect("a hero to steer"),
            down: Buttons::default(),
            points: false,
            held_up_ms: 0.0,
            shown: None,
            trail: Vec::new(),
            queued: Vec::new(),
            arrived: 0,
            truth: Vec::new(),
        };
        net.hear(&coded);
        net
    }

    fn run(&mut self, ms: u32) {
        for _ in 0..ms {
            let before_ms = self.now_ms;
            self.now_ms += STEP_MS;
            let now_ms = self.now_ms;
            let passes = |every: f64| (now_ms / every).floor() > (before_ms / every).floor();
            if passes(TICK_MS) {
                self.tick();
            }
            while let Some((_, bytes)) = self.to_page.pop_front_if(|due| due.0 <= self.now_ms) {
                self.hear(&bytes);
            }
            self.speak();
            if passes(FRAME_MS) {
                self.frame();
            }
        }
    }

    fn tick(&mut self) {
        while let Some((_, seq, input)) = self.to_room.pop_front_if(|due| due.0 <= self.now_ms) {
            self.room.input(self.seat, seq, input);
            self.arrived = seq;
        }
        self.room.tick();
        let own = self.room.snapshot().players.iter().find(|player| player.seat == self.seat);
        self.queued.push(self.arrived - own.expect("a player").input_seq);
        let tick = self.room.game().tick_count();
        self.truth.extend(self.true_center().map(|center| (tick, center)));
        if let Some(bytes) = self.room.message(&self.reader) {
            let due = self.links[0].arrival_ms(&self.conditions, self.now_ms);
            self.to_page.push_back((due, bytes.to_vec()));
        }
    }

    fn hear(&mut self, coded: &[u8]) {
        let (arrival, _) = self.replica.hear(coded).unwrap();
        self.clock.arrived(arrival, self.now_ms);
        let (newest, before) = self.replica.room.newest_two();
        self.predictor.heard(newest.unwrap(), before);
    }

    fn speak(&mut self) {
        let waves = Vec2::new(self.now_ms as f32 / 10.0, 50.0);
        let pointer = self.points.then_some(waves);
        self.sender.note(Input::new(self.down, pointer));
        let tick = self.clock.server_tick(self.now_ms).unwrap();
        self.sender.book_until(self.predictor.booked());
        let moment = self.predictor.moment_at(tick, self.now_ms);
        while let Some((seq, input)) = self.sender.due(self.now_ms, moment) {
            let due = self.links[1].arrival_ms(&self.conditions, self.now_ms).max(self.held_up_ms);
            self.to_room.push_back((due, seq, input));
            self.predictor.sent(seq, input, tick, self.now_ms);
        }
    }

    fn frame(&mut self) {
        let now = self.now_ms;
        if let Some(tick) = self.clock.display(now) {
            self.replica.advance(tick, Eye::default());
        }
        let tick = self.clock.server_tick(now).unwrap();
        let replica = &self.replica;
        self.shown = self.predictor.advance(tick, now, |id| replica.room.place(id));
        if let (Some(shown), Some(moment)) = (self.shown, self.predictor.moment) {
            self.replica.lead(shown);
            self.trail.push(Drawn { at_ms: now, moment, center: shown.center });
        }
    }

    fn true_center(&self) -> Option<Vec2> {
        let game = self.room.game();
        let hero = game.players().find(|player| player.seat == self.seat)?.hero?;
        Some(game.world().position(hero))
    }

    fn hold(&mut self, buttons: Buttons, ms: u32) {
        self.down = buttons;
        self.run(ms);
    }

    /// The hero's true position at this moment.
    fn truth_at(&self, moment: f64) -> Option<Vec2> {
        let tick = moment as u32;
        let at = |tick: u32| self.truth.iter().find(|known| known.0 == tick).map(|known| known.1);
        let (a, b) = (at(tick)?, at(tick + 1)?);
        Some(a + (b - a) * (moment - f64::from(tick)) as f32)
    }

    /// The distances between the drawn and true positions since `from_ms`.
    fn errors(&self, from_ms: f64) -> Vec<f32> {
        let drawn = self.trail.iter().filter(|drawn| drawn.at_ms >= from_ms);
        drawn.filter_map(|d| Some((self.truth_at(d.moment)? - d.center).length())).collect()
    }
}

fn built_in(name: &str) -> Scene {
    Scene::built_in().into_iter().find(|scene| scene.name == name).expect("a built-in scene")
}

/// A wide room with a floor and a wall.
const HALL: &str = r#"
        title = "Hall"
        about = "A hall."
        size = [400, 200]
        tools = ["steer"]
        groups = ["hero", "platform"]
        pairs = [["hero", "platform"], ["hero", "hero"]]
        [hero]
        size = [9, 12]
        restitution = 0.25
        thrust = [110, 150]
        speed_max = 70
        spawns = [[60, 16]]
        [[bodies]]
        kind = "wall"
        position = [200, 0]
        size = [400, 20]
        [[bodies]]
        kind = "wall"
        position = [200, 100]
        size = [20, 180]
    "#;

const LIFT: &str = r#"
        [[bodies]]
        kind = "platform"
        size = [24, 4]
        path = [[60, 14], [60, 150]]
        period = 40
"#;

const CRATE: &str = r#"
        [[bodies]]
        kind = "block"
        position = [76, 14]
        size = [8, 8]
        mass = 0.6
"#;

/// The quantum of the scenes used here, world units.
const QUANTUM: f32 = 1.0 / 64.0;

fn hall() -> Scene {
    Scene::parse("hall.toml", HALL).expect("a good scene")
}

fn largest(errors: &[f32]) -> f32 {
    errors.iter().copied().fold(0.0, f32::max)
}

fn mean(errors: &[f32]) -> f32 {
    errors.iter().sum::<f32>() / errors.len().max(1) as f32
}

/// Flies back and forth and up and down for about four seconds, among obstacles.
fn fly(net: &mut Net) {
    let (right, left, up, none) = (Buttons::RIGHT, Buttons::LEFT, Buttons::UP, Buttons::default());
    let keys = [(right, 500), (none, 210), (up, 333), (left, 700), (none, 95), (up, 400)];
    for (keys, ms) in keys.into_iter().chain([(right, 900), (none, 800)]) {
        net.hold(keys, ms);
    }
}

/// The distances between the drawn and true positions while the hero flies, over this network.
fn flight(scene: Scene, rate: Rate, conditions: NetworkConditions) -> Vec<f32> {
    let mut net = Net::new(scene, rate, conditions);
    net.run(3000);
    let begin_ms = net.now_ms;
    fly(&mut net);
    let errors = net.errors(begin_ms);
    assert!(errors.len() > 200, "{} frames", errors.len());
    errors
}

#[test]
fn on_a_near_link_the_hero_is_where_the_server_will_have_it() {
    for name in ["hall", "arena"] {
        let scene = if name == "hall" { hall() } else { built_in(name) };
        let errors = flight(scene, Rate::Full, NetworkConditions::default());
        assert!(largest(&errors) < 0.05, "{name}: {} units off", largest(&errors));
        assert!(mean(&errors) < QUANTUM, "{name}: {} units off on average", mean(&errors));
    }
}

#[test]
fn on_a_far_link_the_hero_is_close_to_where_the_server_will_have_it() {
    for (preset, mean_max, largest_max) in [(1, 0.05, 0.5), (2, 0.15, 1.0), (3, 1.5, 6.0)] {
        let errors = flight(built_in("arena"), Rate::Full, conditions(PRESETS[preset]));
        let name = PRESETS[preset];
        assert!(largest(&errors) < largest_max, "{name}: {} units off", largest(&errors));
        assert!(mean(&errors) < mean_max, "{name}: {} units off on average", mean(&errors));
    }
}

#[test]
fn few_snapshots_are_enough() {
    for (rate, mean_max) in [(Rate::Third, 0.2), (Rate::Twelfth, 0.5)] {
        let errors = flight(built_in("arena"), rate, conditions(PRESETS[2]));
        assert!(mean(&errors) < mean_max, "{rate:?}: {} units off on average", mean(&errors));
    }
}

#[test]
fn bodies_at_rest_do_not_drift() {
    for preset in PRESETS {
        let mut net = Net::new(built_in("arena"), Rate::Full, conditions(preset));
        net.run(4000);
        let begin_ms = net.now_ms;
        net.run(3000);
        let mut drawn = net.trail.iter().filter(|drawn| drawn.at_ms > begin_ms);
        let first = drawn.next().expect("a frame").center;
        assert!(drawn.all(|drawn| (drawn.center - first).length() < 1e-3), "{}", preset);
        assert!(largest(&net.errors(begin_ms)) < QUANTUM, "{}", preset);
    }
}

#[test]
fn prediction_recovers_soon_after_any_error() {
    let mut net = Net::new(built_in("arena"), Rate::Full, conditions(PRESETS[3]));
    net.run(3000);
    fly(&mut net);
    net.hold(Buttons::default(), 4000);
    let begin_ms = net.now_ms;
    net.run(1500);
    assert!(largest(&net.errors(begin_ms)) < QUANTUM);
    // An input is repeated every 80 ms, and each is in flight for up to 400 ms.
    assert!(net.predictor.unacknowledged() <= 8, "{} on their way", net.predictor.unacknowledged());
}

#[test]
fn walls_stop_the_hero_where_the_server_says() {
    let mut net = Net::new(hall(), Rate::Full, conditions(PRESETS[2]));
    net.run(2000);
    let begin_ms = net.now_ms;
    net.hold(Buttons::RIGHT, 4000);
    // The wall's face is at 190, and the hero is 9 wide.
    let touch = 190.0 - 4.5;
    let farthest = net.trail.iter().map(|drawn| drawn.center.x).fold(0.0, f32::max);
    assert!((touch - 0.5..touch + 0.25).contains(&farthest), "it came to {farthest}");
    let errors = net.errors(begin_ms + 1000.0);
    assert!(largest(&errors) < 1.0, "{} units off", largest(&errors));
    assert!(mean(&errors) < 0.1, "{} units off on average", mean(&errors));
}

#[test]
fn a_key_is_answered_by_the_next_frame_however_far_the_server_is() {
    for preset in PRESETS {
        let mut net = Net::new(hall(), Rate::Full, conditions(preset));
        net.run(4000);
        let before = net.shown.expect("a hero").center;
        net.hold(Buttons::RIGHT, 2 * FRAME_MS as u32);
        let after = net.shown.expect("a hero").center;
        assert!(after.x > before.x + 0.25 * QUANTUM, "{}: {before} to {after}", preset);
    }
}

#[test]
fn a_moving_mouse_keeps_no_key_waiting_at_the_server() {
    for (preset, waiting_max) in [(0, 0.1), (1, 0.2), (2, 0.9)] {
        let mut net = Net::new(hall(), Rate::Full, conditions(PRESETS[preset]));
        net.points = true;
        net.run(3000);
        let begin = net.queued.len();
        for _ in 0..10 {
            net.hold(Buttons::RIGHT, 130);
            net.hold(Buttons::default(), 270);
        }
        let queued = &net.queued[begin..];
        let mean = queued.iter().sum::<u32>() as f32 / queued.len() as f32;
        let name = PRESETS[preset];
        assert!(mean < waiting_max, "{name}: {mean} inputs wait on average");
    }
}

#[test]
fn corrections_are_smooth() {
    let mut net = Net::new(built_in("arena"), Rate::Full, conditions(PRESETS[3]));
    net.run(3000);
    let begin_ms = net.now_ms;
    fly(&mut net);
    let flown: Vec<Drawn> =
        net.trail.iter().copied().filter(|drawn| drawn.at_ms >= begin_ms).collect();
    for pair in flown.windows(2) {
        let way = (pair[1].center - pair[0].center).length();
        // The hero's motion in a frame, plus the fading of the largest error.
        assert!(way < 70.0 * 0.015 * 1.5 + 2.5, "{way} units in a frame at {:?}", pair[1]);
    }
}

#[test]
fn keys_that_the_room_releases_in_silence_are_released_here() {
    let mut net = Net::new(hall(), Rate::Full, NetworkConditions::default());
    net.run(3000);
    net.hold(Buttons::RIGHT, 200);
    let begin_ms = net.now_ms;
    net.held_up_ms = begin_ms + 600.0;
    net.hold(Buttons::RIGHT, 600);
    let errors = net.errors(begin_ms);
    assert!(largest(&errors) < 0.12, "{} units off", largest(&errors));
}

#[test]
fn the_authoritative_position_is_kept_while_the_hero_is_drawn_ahead() {
    let mut net = Net::new(hall(), Rate::Full, conditions(PRESETS[2]));
    net.run(3000);
    net.hold(Buttons::RIGHT, 600);
    while net.now_ms % FRAME_MS != 0.0 {
        net.run(1);
    }
    let (told, _) = net.replica.own_hero_as_told().expect("a hero");
    let drawn = net.replica.own_hero().expect("a hero").center;
    assert!(drawn.x > told.x + 2.0, "{told} was told, {drawn} is drawn");
    let truth = net.truth_at(net.replica.room.display).expect("a hero");
    assert!((told - truth).length() < 2.0 * QUANTUM, "{told} was told, {truth} is true");
}

/// A hero on a lift, as seen by a page with a distant server.
fn on_the_lift() -> Net {
    let source = format!("{HALL}{LIFT}");
    let source = source.replace("spawns = [[60, 16]]", "spawns = [[60, 30]]");
    let scene = Scene::parse("hall.toml", &source).expect("a good scene");
    let mut net = Net::new(scene, Rate::Full, conditions(PRESETS[2]));
    net.run(3000);
    net
}

#[test]
fn a_new_hero_does_not_ride_on_the_support_of_the_last_one() {
    let mut net = on_the_lift();
    assert!(net.predictor.riding.length() > 0.5, "it rides {}", net.predictor.riding);
    let mut gone = net.replica.room.newest().expect("a snapshot").clone();
    gone.tick += 1;
    gone.players.iter_mut().for_each(|player| player.hero = None);
    net.predictor.heard(&gone, None);
    assert_eq!(net.predictor.riding, Vec2::ZERO);
}

#[test]
fn the_hero_stands_on_the_lift_that_is_drawn() {
    let mut net = on_the_lift();
    let mut gaps = Vec::new();
    for _ in 0..300 {
        net.run(FRAME_MS as u32);
        let lift = net.replica.room.samples.iter().find(|sample| sample.kind == Kind::Platform);
        let lift = lift.expect("a lift").center.y + 2.0;
        gaps.push((net.shown.expect("a hero").center.y - 6.0 - lift).abs());
    }
    // The lift is displayed 0.2 s late, during which it moves 1.4 units.
    assert!(largest(&gaps) < 0.2, "{} units between the hero and the lift", largest(&gaps));
    assert!(mean(&gaps) < 0.1, "{} units on average", mean(&gaps));
}

#[test]
fn pushed_bodies_yield_as_on_the_server() {
    let groups = r#"groups = ["hero", "platform", "block"]"#;
    let pairs = r#"["hero", "platform"], ["hero", "block"], ["block", "platform"],"#;
    let source = HALL
        .replace(r#"groups = ["hero", "platform"]"#, groups)
        .replace(r#"["hero", "platform"],"#, pairs);
    let scene = Scene::parse("hall.toml", &format!("{source}{CRATE}")).expect("a good scene");
    let mut net = Net::new(scene, Rate::Full, conditions(PRESETS[2]));
    net.run(3000);
    let (begin_ms, before) = (net.now_ms, net.shown.expect("a hero").center.x);
    net.hold(Buttons::RIGHT, 1200);
    let way = net.shown.expect("a hero").center.x - before;
    assert!(way > 25.0, "the crate is no wall: {way} units");
    let errors = net.errors(begin_ms);
    assert!(mean(&errors) < 0.1, "{} units off on average", mean(&errors));
}

#[test]
fn without_a_hero_to_steer_nothing_is_predicted() {
    let predicts = |name: &str| Predictor::new(&Arc::new(built_in(name)), Seat(0)).is_some();
    for (name, steers) in [("arena", true), ("impulse", true), ("bounds", false), ("pile", false)] {
        assert_eq!(predicts(name), steers, "{name}");
    }
}
