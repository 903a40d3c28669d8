//! Scenes that cost more than their plans predict. Each is refused, ends in time, or stays within the budget for a
//! step. No outcome depends on the machine's speed.

use crate::guests::*;
use crate::host::delivery::{Delivery, ParticlePermits};
use crate::limits::uplink::Uplink;
use crate::ops::metrics::Metrics;
use jostle_game::{Buttons, Input};
use jostle_protocol::Appearance;
use jostle_room::{Rate, Room};
use jostle_sim::Vec2;
use std::cell::Cell;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// A scene's fate.
#[derive(Debug, PartialEq, Eq)]
enum Fate {
    /// The file is refused because of this field.
    Refused(String),
    /// The trial exceeds the budget for a step.
    FailsTrial,
    /// The room later exceeds the budget for a step.
    Ends,
    /// Every step stays within the budget, which limits how much of its share the room uses.
    Bounded,
}

const REFUSED_COUNT: &str = "layouts[0].count";
/// Number of players in a room attacked by a crowd.
const CROWD: u16 = 64;
/// Number of ticks played in a room that passed its trial.
const TICKS: u32 = 700;
/// Number of ticks in the longest trial.
const TRIAL_TICKS: u32 = limits::GUEST_TRIAL_TICKS * limits::GUEST_TRIAL_PARTS;

/// A 60 x 60 world with these lines at the top and the end of its file.
fn scene(top: &str, rest: &str) -> String {
    format!(
        "title = \"Worst\"\nsize = [60, 60]\ngroups = [\"hero\", \"ball\", \"wall\", \"pack\"]\n\
         pairs = [[\"ball\", \"wall\"], [\"ball\", \"ball\"], [\"pack\", \"pack\"], [\"hero\", \"wall\"]]\n{top}\n{rest}\n"
    )
}

fn layout(count: u32, shape: &str, more: &str) -> String {
    format!("[[layouts]]\nkind = \"block\"\ngroup = \"ball\"\ncount = {count}\n{shape}\n{more}\n")
}

/// Places all bodies in one place.
const STACKED: &str = "area = [[29, 29], [31, 31]]\nexact = true\ngrid = [40, 25]";
const FLOOR: &str =
    "[[bodies]]\nkind = \"wall\"\ngroup = \"wall\"\nposition = [30, 1]\nsize = [60, 2]\n";

/// Bodies in rows, with springs that pull them all towards one point.
fn pulled_together(top: &str, count: u32) -> String {
    let mut rest = String::new();
    for index in 0..count {
        let (x, y) = (2 + index % 14 * 4, 2 + index / 14 * 4);
        writeln!(
            rest,
            "[[bodies]]\nkind=\"block\"\ngroup=\"ball\"\nradius=1.9\nposition=[{x},{y}]\nname=\"b{index}\"\n\
             [[springs]]\nbody=\"b{index}\"\nto=[30,30]\nlength=0\nstiffness=90000"
        )
        .expect("a String takes any text");
    }
    scene(&format!("limits = {{ bodies = 300 }}\nspeed_max = 1000\n{top}"), &rest)
}

fn packs(life_ticks: u32) -> String {
    format!(
        "[pack]\nradius = 8\nspeed = 0\nturn = 0\nburst = 0\nlife_ticks = {life_ticks}\ngroup = \"pack\"\n"
    )
}

/// Players who throw all their packs at one spot.
fn crowd_with_packs() -> String {
    let top = "tools = [\"launch\"]\nlimits = { players = 64, packs = 12 }";
    scene(top, &(packs(3000) + "[hero]\nspawns = [[30, 30]]\n"))
}

type Case = (&'static str, String, Fate);

fn balls(count: u32, radius: f32) -> String {
    layout(count, &format!("radius = {radius}"), STACKED)
}

fn loose(count: u32, radius: f32) -> String {
    let area = "area = [[4, 4], [56, 56]]\ngap = 0.01";
    layout(count, &format!("radius = {radius}\nrestitution = 1"), area)
}

fn refused_cases() -> [Case; 3] {
    let refused = |field: &str| Fate::Refused(field.to_owned());
    let listed =
        "[[bodies]]\nkind=\"block\"\ngroup=\"ball\"\nradius=9\nposition=[30,30]\n".repeat(400);
    let boxes = layout(500, "size = [24, 24]", STACKED);
    let round = format!("[round]\ntask = \"Wait\"\n{}", balls(999, 12.0));
    [
        (
            "discs in one place before a round",
            scene("relaxation = { iterations = 30 }", &round),
            refused(REFUSED_COUNT),
        ),
        ("boxes in one place", scene("solver = \"conjugate\"", &boxes), refused(REFUSED_COUNT)),
        ("bodies one by one in one place", scene("", &listed), refused("bodies")),
    ]
}

fn ended_cases() -> [Case; 5] {
    let launcher = "[[launchers]]\nposition = [30, 30]\nevery = 0.0625\nlimit = 250\n";
    let covers = "[[layouts]]\nkind = \"wall\"\ngroup = \"wall\"\ncount = 40\nsize = [60, 60]\narea = [[29, 29], [31, 31]]\nexact = true\n\
                  grid = [8, 5]\n[[emitters]]\nrecipe = \"fire\"\ncount = 60\nevery = 2\nposition = [30, 30]\n";
    [
        ("springs that pull to a point", pulled_together("", 190), Fate::FailsTrial),
        (
            "springs that pull to a point where nothing pushes back",
            pulled_together("response = \"none\"", 190),
            Fate::FailsTrial,
        ),
        (
            "a launcher that fills one place",
            scene("response = \"none\"\nlimits = { packs = 1 }", &(packs(100_000) + launcher)),
            Fate::Ends,
        ),
        ("packs that a crowd makes", crowd_with_packs(), Fate::Ends),
        (
            "walls that cover each other under a fire",
            scene("particles_meet = [\"wall\"]", covers),
            Fate::FailsTrial,
        ),
    ]
}

fn bounded_cases() -> [Case; 6] {
    let touch_rules =
        "[[rules]]\ntouch = [\"ball\", \"ball\"]\nto = \"all\"\nscore = 1\nsplash = \"fire\"\n"
            .repeat(60);
    let zones = (0..32).fold(String::new(), |text, zone| {
        format!("{text}[[zones]]\nname = \"z{zone}\"\nwho = [\"ball\"]\n[[rules]]\nenter = \"z{zone}\"\nback = true\n")
    });
    let round = "[round]\ntask = \"Again\"\ntime = 1\npause = 0\ncountdown = 0\n";
    let spawns = "[hero]\nspawns = [".to_owned() + &"[30, 30], ".repeat(256) + "]\n";
    let still = layout(900, "radius = 0.9", "area = [[4, 4], [56, 56]]\ngap = 0.01");
    let gas = "solver = \"conjugate\"\ngravity = [0, -900]\nspeed_max = 10000";
    let many = loose(900, 0.9);
    [
        ("few enough to be within the plan", scene("", &balls(60, 12.0))),
        ("rules about each touch", scene("", &format!("{many}{touch_rules}{FLOOR}"))),
        ("zones that everybody is in", scene("", &format!("{many}{zones}{FLOOR}"))),
        ("a gas that bounces without end", scene(gas, &format!("{}{FLOOR}", loose(310, 0.9)))),
        ("rounds that begin again and again", scene("", &format!("{round}{many}"))),
        (
            "heroes that find no place",
            scene("limits = { players = 64 }", &format!("{spawns}{still}")),
        ),
    ]
    .map(|(name, text)| (name, text, Fate::Bounded))
}

/// Reads a scene, tries it and plays it. Players join at tick `first` and press keys from then on.
fn fate(name: &str, text: &str, first: u32) -> Fate {
    let scene = match read(text.as_bytes()) {
        Ok(scene) => Arc::new(scene),
        Err(error) if error.found.contains("worst tick") => return Fate::Refused(error.field),
        Err(error) => return Fate::Refused(error.to_string()),
    };
    // Each clock reading is a millisecond later than the previous one, so the trial does not depend on the machine.
    let time = Cell::new(0);
    let worked = || {
        time.set(time.get() + 1);
        Duration::from_millis(time.get())
    };
    match trial::play(&scene, [Duration::from_millis(242); 2], worked, |_| {}) {
        Err(error) if error.found.contains("a heap") => return Fate::FailsTrial,
        Err(error) => return Fate::Refused(error.to_string()),
        Ok(()) => {}
    }
    let mut room = Room::new("worst", Arc::clone(&scene), 1);
    for tick in 1..first + TICKS {
        if tick == first {
            for seat in 0..crowd(&mut room, &scene) {
                drop(room.subscribe_view(jostle_game::Seat(seat), Rate::Full));
            }
        }
        if tick >= first {
            press(&mut room, &scene, tick - first + 1);
        }
        room.tick();
        if room.game().is_over_budget() {
            return Fate::Ends;
        }
        let world = room.game().world();
        assert!(world.pair_count() <= limits::GUEST_STEP.pairs, "{name}");
    }
    Fate::Bounded
}

/// Fills the room, and returns the number of players.
fn crowd(room: &mut Room, scene: &Scene) -> u16 {
    let appearance = Appearance { name: "Ann".into(), color: 0 };
    let players = scene.players_max.min(CROWD);
    for _ in 0..players {
        room.join(appearance.clone(), None).expect("a seat");
    }
    players
}

/// In every other tick, all players press the button at roughly the same place.
fn press(room: &mut Room, scene: &Scene, tick: u32) {
    let buttons = if tick.is_multiple_of(2) { Buttons::FIRE } else { Buttons::default() };
    for seat in 0..scene.players_max.min(CROWD) {
        let off = Vec2::new(f32::from(seat % 8), f32::from(seat / 8)) * 0.1;
        let input = Input::new(buttons, Some(Vec2::splat(30.0) + off));
        room.input(jostle_game::Seat(seat), tick, input);
    }
}

#[test]
fn scenes_made_to_cost_more_than_their_plan_are_refused_or_end_or_stay_bounded() {
    let mut wrong = String::new();
    let cases = refused_cases().into_iter().chain(ended_cases()).chain(bounded_cases());
    for (name, text, expected) in cases {
        let found = fate(name, &text, 1);
        if found != expected {
            writeln!(wrong, "{name}: {found:?} instead of {expected:?}").expect("a String");
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn a_crowd_that_comes_after_the_longest_trial_ends_its_room() {
    assert_eq!(fate("a patient crowd", &crowd_with_packs(), TRIAL_TICKS), Fate::Ends);
}

/// Number of ticks to play.
#[cfg(target_os = "linux")]
const WORST_TICKS: u32 = 160;
/// The tick in which the crowd joins. By then there are nearly as many particles as possible, which newcomers must be
/// sent.
#[cfg(target_os = "linux")]
const CROWD_TICK: u32 = 120;

/// Memory limit for a guest's room in the worst case, bytes.
#[cfg(target_os = "linux")]
const ROOM_BYTES_MAX: usize = 10_000_000;
/// Memory used by full clips, in bytes, measured with [`WORST_TICKS`] set to 1500.
#[cfg(target_os = "linux")]
const FULL_CLIPS_BYTES: usize = 1_400_000;

/// Peak memory used by this process so far, in bytes.
#[cfg(target_os = "linux")]
fn peak_bytes() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux has it");
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).expect("it has a peak");
    let kib = line.split_whitespace().nth(1).and_then(|kib| kib.parse::<usize>().ok());
    kib.expect("a number") << 10
}

/// Plays a heap with nearly as many pairs as a step may have, along with everything else that a room stores: a crowd
/// that joins all at once and reads nothing, particles, clips, and the record from which the room is restored.
#[cfg(target_os = "linux")]
fn play_worst(solver: &str) -> (Room, Vec<Delivery>) {
    let more = "[[emitters]]\nrecipe = \"fire\"\ncount = 130\nevery = 2\nposition = [30, 30]\n";
    let top = format!(
        "{solver}\ncamera = {{ follow = 20 }}\ngravity = [0, 0]\nlimits = {{ players = 64, particles = 8192, bodies = 1000 }}\n"
    );
    // 135 discs form 9,045 pairs; the other bodies are at rest.
    let heap = layout(135, "radius = 12\nrestitution = 0.9", STACKED);
    let rest =
        layout(760, "radius = 0.2", "area = [[70, 2], [88, 58]]\nexact = true\ngrid = [20, 38]");
    let text = scene(&top, &format!("[hero]\nspawns = [[5, 5]]\n{heap}{rest}{more}"));
    let mut scene = Scene::parse(FILE, &text).unwrap_or_else(|error| panic!("{error}"));
    scene.world.budget = limits::GUEST_STEP;
    let scene = Arc::new(scene);
    let mut room = Room::new("worst", Arc::clone(&scene), 1);
    room.keep_clips("test");
    let shared = crate::log::SharedLog::default();
    let now = Instant::now();
    let (uplink, metrics) = (Uplink::new(limits::UPLINK_MEGABITS, now), Metrics::default());
    let (permits, mut unread) = (ParticlePermits::default(), Vec::new());
    for tick in 1..=WORST_TICKS {
        if tick == CROWD_TICK {
            unread.extend((0..crowd(&mut room, &scene)).map(|seat| {
                let allowance = uplink.open([10, 0, seat as u8, 1].into(), true, false, now);
                let (seat, outbox) = (Some(jostle_game::Seat(seat)), Arc::default());
                Delivery::new(seat, outbox, allowance, permits.clone(), tick)
            }));
        }
        press(&mut room, &scene, tick);
        room.tick();
        // These clients read nothing.
        for delivery in &mut unread {
            delivery.feed(&mut room, u32::MAX, now, &metrics);
        }
        shared.publish(room.log().expect("it is kept").blocks().clone(), true);
        if tick == 1 {
            let pairs = room.game().world().pair_count();
            assert!(pairs > limits::GUEST_STEP.pairs * 9 / 10, "{pairs} pairs");
        }
    }
    assert!(!room.game().is_over_budget());
    let particles = room.game().world().particles().len();
    assert!(particles > 7500, "{particles} particles");
    (room, unread)
}

#[cfg(target_os = "linux")]
#[test]
fn all_rooms_of_guests_at_their_worst_take_ten_megabytes_each_at_most() {
    const ALONE: &str = "JOSTLE_TEST_ALONE";
    let name =
        "guests::tests::worst::all_rooms_of_guests_at_their_worst_take_ten_megabytes_each_at_most";
    if std::env::var_os(ALONE).is_none() {
        // Runs in a separate process, since other tests would affect the measurement.
        let program = std::env::current_exe().expect("the test's own program");
        let mut child = std::process::Command::new(program);
        let ended = child.args(["--exact", name, "--nocapture"]).env(ALONE, "1").status();
        assert!(ended.expect("it starts").success(), "see its output");
        return;
    }
    let before = peak_bytes();
    let solvers =
        ["relaxation = { iterations = 30 }", "solver = \"conjugate\""].into_iter().cycle();
    let rooms: Vec<_> =
        solvers.take(4).map(|solver| std::thread::spawn(|| play_worst(solver))).collect();
    let rooms: Vec<_> = rooms.into_iter().map(|room| room.join().expect("it plays")).collect();
    let each = (peak_bytes() - before) / rooms.len();
    println!("{} KiB a room", each >> 10);
    assert!(each + FULL_CLIPS_BYTES <= ROOM_BYTES_MAX, "{} KiB a room", each >> 10);
}
