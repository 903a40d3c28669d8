//! Tests of scenes that combine everything that refers to a body with everything that removes or moves one: launchers,
//! packs in flight, springs, zones, emitters, slings and carrying, along with tools, bots and cameras. Nothing may
//! panic.

use super::*;
use jostle_game::Input;
use jostle_sim::Rng;
use std::fmt::Write;

/// Number of scenes per run.
const SCENES: u64 = 60;
/// Number of ticks per scene: enough for packs to hit, rounds to end and players to return.
const TICKS: u32 = 240;

/// Kinds of bodies that others refer to, each in a group named after it.
const KINDS: [&str; 5] = ["hero", "minion", "dumb", "platform", "block"];
/// Effects that remove or move the bodies that trigger a rule.
const ENDS: [&str; 7] = [
    "remove = true",
    "back = true",
    "back = 0.3",
    "carry = true",
    "drop = true",
    "checkpoint = true",
    "remove = true\nback = 0.1",
];

struct Writer<'a> {
    rng: &'a mut Rng,
    text: String,
    bodies: u32,
    has_sling: bool,
}

impl Writer<'_> {
    fn one_in(&mut self, count: u32) -> bool {
        self.rng.below(count) == 0
    }

    fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.rng.below(of.len() as u32) as usize]
    }

    fn line(&mut self, line: impl std::fmt::Display) {
        writeln!(self.text, "{line}").expect("a String takes any text");
    }

    fn maybe(&mut self, one_in: u32, line: impl std::fmt::Display) {
        if self.one_in(one_in) {
            self.line(line);
        }
    }

    fn body_name(&mut self) -> String {
        format!("body{}", self.rng.below(self.bodies))
    }

    fn point(&mut self) -> String {
        let (x, y) = (self.rng.range(10.0, 150.0), self.rng.range(12.0, 80.0));
        format!("[{x:.1}, {y:.1}]")
    }

    fn condition(&mut self, field: &str) {
        let name = self.pick(&["here", "!here", "blink", "!blink", "later"]);
        self.maybe(4, format!("{field} = \"{name}\""));
    }

    fn scene(&mut self) {
        self.head();
        (0..self.bodies).for_each(|number| self.body(number));
        if self.has_sling {
            let shots = 1 + self.rng.below(2);
            self.line(format!(
                "[sling]\nball = \"body0\"\nshots = {shots}\nover_time = 0.3\npull = 200"
            ));
        }
        (0..3).for_each(|_| self.follower());
        self.line("[[zones]]\nname = \"here\"\nwho = [\"hero\", \"block\"]");
        if self.one_in(2) {
            let name = self.body_name();
            self.line(format!("follow = \"{name}\"\nposition = [0, 0]\nradius = 25"));
        } else {
            self.line("area = [[40, 0], [110, 60]]");
        }
        self.maybe(3, "take = 0.1\nlabel = \"Here\"");
        self.line("[[signals]]\nname = \"blink\"\nwhen = \"!here\"\ntoggles = true");
        self.line("[[signals]]\nname = \"later\"\nwhen = \"!here\"\nafter = 0.3");
        let rules = 1 + self.rng.below(5);
        (0..rules).for_each(|_| self.rule());
    }

    fn head(&mut self) {
        self.line("title = \"Vanishing\"\nsize = [160, 90]\nkill_zone = [[-20, -20], [180, 110]]");
        let camera = self.pick(&["\"fit\"", "{ follow = 40 }"]);
        let left = self.pick(&["launch", "select"]);
        let sling = if self.has_sling { ", \"sling\"" } else { "" };
        self.line(format!("camera = {camera}"));
        self.line(format!(
            "tools = [\"steer\", \"dumb\", \"hold\", \"agitate\", \"clear\", \"{left}\"{sling}]"
        ));
        self.line(
            "groups = [\"hero\", \"minion\", \"dumb\", \"platform\", \"block\", \"pack\"]\n\
             pairs = [[\"hero\", \"platform\"], [\"hero\", \"block\"], [\"hero\", \"hero\"], [\"hero\", \"minion\"], \
             [\"block\", \"platform\"], [\"block\", \"block\"], [\"minion\", \"platform\"], [\"minion\", \"block\"], \
             [\"dumb\", \"dumb\"], [\"dumb\", \"platform\"], [\"dumb\", \"block\"], [\"pack\", \"platform\"]]",
        );
        self.maybe(2, "solver = \"conjugate\"");
        self.line("limits = { players = 5, packs = 3, dumb = 20, bodies = 60 }");
        self.line("pack = { push = 40, burst = 3, life_ticks = 90 }");
        self.line("hero = { size = [9, 12], spawns = [[20, 30], [50, 30], [80, 30], [110, 60]] }");
        if self.one_in(2) {
            let fill = self.rng.below(4);
            self.line(format!("[round]\ncountdown = 0.1\npause = 0.2\ntime = 1\nfill = {fill}"));
            self.maybe(3, "lives = 2");
            self.maybe(3, "goal = 3");
        }
        if self.one_in(3) {
            self.line("[[teams]]\nname = \"red\"\n[[teams]]\nname = \"blue\"");
            self.maybe(3, "lane = \"x\"");
        }
        self.line("[[bodies]]\nkind = \"wall\"\nposition = [80, 0]\nsize = [200, 8]");
    }

    fn body(&mut self, number: u32) {
        let is_ball = self.has_sling && number == 0;
        let kind = if is_ball { "block" } else { self.pick(&KINDS) };
        let radius = self.rng.range(2.0, 6.0);
        self.line(format!("[[bodies]]\nname = \"body{number}\"\nkind = \"{kind}\""));
        self.line(format!("radius = {radius:.2}"));
        // The first body must be movable, because springs are attached to it.
        let moves = if number == 0 { "dynamic" } else { self.pick(&["dynamic", "static", "path"]) };
        let from = self.point();
        if moves == "path" {
            let to = self.point();
            self.line(format!("path = [{from}, {to}]\nperiod = 3"));
            self.condition("runs");
        } else {
            self.line(format!("position = {from}\nmotion = \"{moves}\""));
        }
        if moves == "dynamic" {
            let speed = self.rng.range(-90.0, 90.0);
            self.maybe(2, format!("velocity = [{speed:.1}, 40]"));
            let strength = self.rng.range(0.5, 20.0);
            self.maybe(2, format!("strength = {strength:.1}\nsplash = \"spark\""));
        }
        if !is_ball {
            self.condition("while");
        }
    }

    /// Adds something that follows a body in the scene.
    fn follower(&mut self) {
        let (name, point) = (self.body_name(), self.point());
        let place = self.pick(&["follow", "position"]);
        let place = match place {
            "follow" => format!("follow = \"{name}\""),
            _ => format!("position = {point}"),
        };
        match self.rng.below(4) {
            0 | 1 => {
                let what = self.pick(&["pack", "pack", "dumb"]);
                self.line(format!("[[launchers]]\n{place}\nevery = 0.05\nwhat = \"{what}\""));
                self.condition("while");
            }
            2 => {
                self.line(format!(
                    "[[emitters]]\n{place}\nrecipe = \"fire\"\ncount = 8\nevery = 7"
                ));
                self.condition("while");
            }
            _ => {
                let other = 1 + self.rng.below(self.bodies - 1);
                let end = self.pick(&["point", "body"]);
                let end = if end == "point" { point } else { format!("\"body{other}\"") };
                self.line(format!("[[springs]]\nbody = \"body0\"\nto = {end}\nfrequency = 2"));
            }
        }
    }

    fn rule(&mut self) {
        let (one, other) = (self.pick(&KINDS), self.pick(&KINDS));
        let occasion = match self.rng.below(7) {
            0 => "enter = \"here\"".to_owned(),
            1 => "leave = \"here\"".to_owned(),
            2 => format!("touch = [\"{one}\", \"{other}\"]"),
            3 => "burst = true".to_owned(),
            4 => format!("lost = \"{one}\""),
            5 => "breaks = \"block\"".to_owned(),
            _ => "every = 0.2".to_owned(),
        };
        self.line(format!("[[rules]]\n{occasion}"));
        let is_about_bodies = !occasion.starts_with("every");
        if is_about_bodies {
            let end = self.pick(&ENDS);
            self.line(end);
            self.maybe(3, "splash = \"spark\"");
            self.maybe(4, "stun = 0.2");
        }
        let name = self.body_name();
        self.maybe(if is_about_bodies { 4 } else { 1 }, format!("reset = [\"{name}\"]"));
        self.maybe(3, "score = 1");
        self.maybe(5, "life = -1");
    }
}

fn scene_of(rng: &mut Rng) -> String {
    let (bodies, has_sling) = (2 + rng.below(5), rng.below(4) == 0);
    let mut writer = Writer { rng, text: String::new(), bodies, has_sling };
    writer.scene();
    writer.text
}

/// A room's clients and inputs: players with random keys who come and go, and both kinds of subscribers.
struct Party {
    rng: Rng,
    seats: Vec<Seat>,
    subscribers: Vec<Subscriber>,
}

impl Party {
    fn act(&mut self, room: &mut Room) {
        if self.seats.len() < 3
            && self.rng.below(20) == 0
            && let Ok(welcome) = room.join(look("Ann"), None)
        {
            let seat = welcome.claim.seat;
            self.seats.push(seat);
            self.subscribers.push(room.subscribe(Rate::Full).0);
            self.subscribers.push(room.subscribe_view(seat, Rate::Full).0);
        }
        if !self.seats.is_empty() && self.rng.below(60) == 0 {
            let seat = self.seats.remove(self.rng.below(self.seats.len() as u32) as usize);
            if self.rng.below(2) == 0 { room.leave(seat) } else { room.disconnect(seat) }
        }
        let seq = room.game().tick_count() + 1;
        for &seat in &self.seats {
            let (x, y) = (self.rng.range(0.0, 160.0), self.rng.range(0.0, 90.0));
            let buttons = Buttons(self.rng.next_u32() as u16 & Buttons::ALL.0);
            // An input is held for a while, so that a grabbed body may be removed in the meantime.
            if seq.is_multiple_of(5) {
                room.input(seat, seq, Input::new(buttons, Some(Vec2::new(x, y))));
            }
        }
    }
}

#[test]
fn nothing_that_remembers_a_body_fails_when_it_is_gone() {
    let (mut played, mut failed) = (0, Vec::new());
    for seed in 0..SCENES {
        let mut rng = Rng::new(seed, 5);
        let text = scene_of(&mut rng);
        let Ok(scene) = Scene::parse("vanishing.toml", &text) else { continue };
        played += 1;
        let ended = std::panic::catch_unwind(|| {
            let mut room = Room::new("oak", Arc::new(scene), seed);
            let mut party = Party { rng, seats: Vec::new(), subscribers: Vec::new() };
            for _ in 0..TICKS {
                party.act(&mut room);
                room.tick();
                party.subscribers.iter().for_each(|subscriber| {
                    room.message(subscriber);
                });
            }
            assert!(room.game().world().is_finite());
        });
        if ended.is_err() {
            failed.push((seed, text));
        }
    }
    assert!(played > SCENES / 3, "only {played} of {SCENES} scenes can be played");
    let first = failed.first().map_or("", |(_, text)| text);
    let seeds: Vec<u64> = failed.iter().map(|&(seed, _)| seed).collect();
    assert_eq!(seeds, [], "of {played}, the first is:\n{first}");
}
