//! Compares the worst tick predicted by a scene's plan with the worst one measured in two games, the one that the
//! plan's trial plays and another. Covers the shipped scenes and random ones, whose bodies are stirred in the second
//! game too: `--count 1000 --seed 1`.
//!
//! A plan's milliseconds refer to the machine on which its cost model was fitted, whereas this machine may be slower or
//! shared. Times are therefore measured relative to the pace, the time of a reference scene played in between. The
//! summary converts them back: one pace equals the median, over all scenes, of the ratio between the worst tick's time
//! according to the cost model and its measured time.

use clap::Parser;
use jostle_game::Scene;
use jostle_game::scene::WorstTick;
use jostle_game::trial::{RandomGame, STIR_TICKS, Trial, tick_us};
use jostle_report::overview::median;
use jostle_report::study::thread_time_us;
use jostle_sim::Rng;
use std::rc::Rc;
use std::sync::Arc;

/// Number of ticks in the second game: a minute.
const TICKS: u32 = 3600;
/// Number of periods of each kind that are replayed, and the number of replays.
const PERIODS: usize = 5;
const ROUNDS: usize = 3;
/// Number of ticks during which a new or cloned game still allocates memory; they never count as the worst.
const FIRST_TICKS: usize = 3;
/// An estimate above this multiple of the worst tick counts as too high.
const RATIO_MAX: f64 = 4.0;

#[derive(Parser)]
struct Arguments {
    /// Number of random scenes to play after the shipped ones
    #[arg(long, default_value_t = 0)]
    count: u64,
    /// Number of the first random scene
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Seed of the random scenes and of all games except the trials, whose seed is 7
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Leave out the shipped scenes
    #[arg(long)]
    random_only: bool,
}

/// A scene's plan compared with the measurement.
#[derive(Clone, Copy)]
struct Comparison {
    /// The plan's worst tick in ms, divided by the measured one in paces.
    plan_ms_per_pace: f64,
    /// The measured worst tick in paces, divided by its time according to the cost model in ms.
    paces_per_ms: f64,
}

fn main() {
    let arguments = Arguments::parse();
    println!(
        "scene,bodies,plan_ms,limits_ms,mean_ms,worst_paces,worst_by_counts_ms,plan_ms_per_pace,about"
    );
    let pace = Pace::new();
    let mut shipped = Vec::new();
    let scenes = if arguments.random_only { Vec::new() } else { Scene::built_in() };
    for scene in scenes {
        let scene = Arc::new(scene);
        shipped.push(report(&scene, "", &play(&scene, arguments.seed, false, &pace)));
    }
    let mut by_solver = [Vec::new(), Vec::new()];
    for number in arguments.from..arguments.from + arguments.count {
        let text = random(arguments.seed, number);
        let about = text.lines().next().unwrap_or_default().replace(',', ";");
        let scene = Scene::parse(&format!("random-{number}.toml"), &text)
            .unwrap_or_else(|error| panic!("{error}\n{text}"));
        let scene = Arc::new(scene);
        let played = play(&scene, arguments.seed, true, &pace);
        by_solver[usize::from(scene.world.is_conjugate())].push(report(&scene, &about, &played));
    }
    let [relaxation, conjugate] = by_solver;
    let random = [relaxation.as_slice(), &conjugate].concat();
    let paces_per_ms = median(shipped.iter().chain(&random).map(|row| row.paces_per_ms).collect());
    println!(
        "# a tick of the pace takes {:.2} ms on the machine for which plans were fitted",
        1.0 / paces_per_ms
    );
    for (scenes, rows) in [
        ("shipped", &shipped),
        ("random, relaxation", &relaxation),
        ("random, conjugate", &conjugate),
        ("random", &random),
    ] {
        summarise(scenes, rows, paces_per_ms);
    }
}

/// Prints the distribution of the planned worst tick relative to the measured one.
fn summarise(scenes: &str, rows: &[Comparison], paces_per_ms: f64) {
    if rows.is_empty() {
        return;
    }
    let mut sorted: Vec<f64> = rows.iter().map(|row| row.plan_ms_per_pace * paces_per_ms).collect();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len();
    let of = |share: usize| sorted[(count - 1) * share / 100];
    let below = sorted.iter().filter(|&&ratio| ratio < 1.0).count();
    let above = sorted.iter().filter(|&&ratio| ratio > RATIO_MAX).count();
    println!(
        "# {scenes}: {count} scenes, least {:.2}, median {:.2}, p90 {:.2}, worst {:.2}, {below} below 1, \
         {above} above {RATIO_MAX} ({:.1} %)",
        of(0),
        of(50),
        of(90),
        of(100),
        100.0 * above as f64 / count as f64
    );
}

/// Prints a scene's row and returns its figures.
fn report(scene: &Scene, about: &str, played: &Played) -> Comparison {
    let limits = WorstTick::of(scene).ms;
    let (name, bodies) = (&scene.name, scene.world.bodies_max);
    let Played { plan, mean, worst, by_counts } = *played;
    let plan_ms_per_pace = plan / worst;
    println!(
        "{name},{bodies},{plan:.3},{limits:.3},{mean:.4},{worst:.4},{by_counts:.4},{plan_ms_per_pace:.2},{about}"
    );
    Comparison { plan_ms_per_pace, paces_per_ms: worst / by_counts }
}

/// A scene's plan and its measurements.
struct Played {
    /// The plan's worst tick in ms.
    plan: f64,
    /// Mean time of a tick in ms.
    mean: f64,
    /// Time of the worst tick: measured in paces, and according to the cost model in ms.
    worst: f64,
    by_counts: f64,
}

/// Plays a scene's trial and then another game for one minute, in which bodies are stirred if `are_stirred` is set.
fn play(scene: &Arc<Scene>, seed: u64, are_stirred: bool, pace: &Pace) -> Played {
    let mut clock = Clock::default();
    let trial = Trial::played(scene, &mut |game, is_stirred| clock.tick(game, is_stirred));
    let mut game = RandomGame::new(scene.clone(), seed);
    clock.end_period();
    for tick in 0..TICKS {
        clock.tick(&mut game, are_stirred && tick.is_multiple_of(STIR_TICKS));
    }
    clock.end_period();
    let plan = f64::from(trial.worst_tick(scene).ms);
    let (worst, by_counts) = clock.worst_tick(pace);
    Played { plan, mean: clock.mean(), worst, by_counts }
}

/// The machine's current speed. Because the machine is shared, the same work may take 1.7 times as long as under ideal
/// conditions.
struct Pace(Period);

impl Pace {
    fn new() -> Pace {
        let scene = Scene::parse("pace.toml", &random(1, 1)).expect("the scene is valid");
        let mut game = RandomGame::new(Arc::new(scene), 1);
        (0..10 * STIR_TICKS).for_each(|tick| game.tick(tick.is_multiple_of(STIR_TICKS)));
        let ticks = (0..FIRST_TICKS + STIR_TICKS as usize).map(|tick| (tick == FIRST_TICKS, None));
        Pace(Period { start: Rc::new(game), ticks: ticks.collect() })
    }

    /// Mean time of the ticks after a stir in a scene with 532 bodies in ms.
    fn now(&self) -> f64 {
        self.0.play().iter().skip(FIRST_TICKS).sum::<f64>() / f64::from(STIR_TICKS)
    }
}

/// Time of a tick in ms, measured and according to the cost model.
#[derive(Clone, Copy)]
struct Times {
    measured: f64,
    by_counts: f64,
}

/// The times that periods are compared by.
const KEYS: [fn(&Times) -> f64; 2] = [|times| times.measured, |times| times.by_counts];

/// Times the ticks of games. At the end the periods with the longest ticks are replayed, since the same tick always
/// does the same work.
#[derive(Default)]
struct Clock {
    /// Total time of the first run in ms, and its number of ticks.
    total: f64,
    ticks: u32,
    period: Option<Period>,
    /// The game at the start of the next period; periods overlap by [`FIRST_TICKS`].
    next: Option<Rc<RandomGame>>,
    /// The periods with the longest ticks, longest first: by measured time, which includes interference from other
    /// programs, and by the cost model.
    longest: [Vec<Period>; 2],
}

/// A range of a game's ticks.
#[derive(Clone)]
struct Period {
    start: Rc<RandomGame>,
    /// For each tick, whether bodies are stirred in it, and its times, except for the first ticks.
    ticks: Vec<(bool, Option<Times>)>,
}

impl Clock {
    /// Plays and times one tick.
    fn tick(&mut self, game: &mut RandomGame, is_stirred: bool) {
        let new = || Period { start: Rc::new(game.clone()), ticks: Vec::new() };
        let period = self.period.get_or_insert_with(new);
        if period.ticks.len() == STIR_TICKS as usize {
            self.next = Some(Rc::new(game.clone()));
        }
        let times = timed(game, is_stirred);
        self.total += times.measured;
        self.ticks += 1;
        let is_first = period.ticks.len() < FIRST_TICKS;
        period.ticks.push((is_stirred, (!is_first).then_some(times)));
        if period.ticks.len() == STIR_TICKS as usize + FIRST_TICKS {
            let last = &period.ticks[STIR_TICKS as usize..];
            let ticks = last.iter().map(|&(is_stirred, _)| (is_stirred, None)).collect();
            let next = self.next.take().map(|start| Period { start, ticks });
            self.end_period();
            self.period = next;
        }
    }

    /// Ends the current period, which also happens at the end of a game.
    fn end_period(&mut self) {
        let Some(period) = self.period.take() else { return };
        for (list, key) in self.longest.iter_mut().zip(KEYS) {
            list.push(period.clone());
            list.sort_by(|one, other| other.longest(key).total_cmp(&one.longest(key)));
            list.truncate(PERIODS);
        }
    }

    /// Replays the longest periods. Returns the time of the worst tick in paces, as the median of several runs, and its
    /// time according to the cost model in ms.
    fn worst_tick(&self, pace: &Pace) -> (f64, f64) {
        let mut periods: Vec<&Period> = self.longest.iter().flatten().collect();
        periods.sort_by_key(|period| Rc::as_ptr(&period.start));
        periods.dedup_by_key(|period| Rc::as_ptr(&period.start));
        let mut paces: Vec<Vec<[f64; ROUNDS]>> =
            periods.iter().map(|period| vec![[0.0; ROUNDS]; period.ticks.len()]).collect();
        let mut before = pace.now();
        for round in 0..ROUNDS {
            let again = periods.iter().map(|period| period.play()).collect::<Vec<_>>();
            let after = pace.now();
            for (ticks, again) in paces.iter_mut().zip(again) {
                for (tick, again) in ticks.iter_mut().zip(again) {
                    tick[round] = 2.0 * again / (before + after);
                }
            }
            before = after;
        }
        let ticks = periods.iter().flat_map(|period| &period.ticks).zip(paces.concat());
        let times = ticks.filter_map(|((_, times), paces)| {
            times.map(|times| (median(paces.to_vec()), times.by_counts))
        });
        times.max_by(|(one, _), (other, _)| one.total_cmp(other)).expect("a game has ticks")
    }

    fn mean(&self) -> f64 {
        self.total / f64::from(self.ticks)
    }
}

impl Period {
    /// Replays the period and returns the times of its ticks in ms.
    fn play(&self) -> Vec<f64> {
        let mut game = RandomGame::clone(&self.start);
        self.ticks.iter().map(|(is_stirred, _)| timed(&mut game, *is_stirred).measured).collect()
    }

    /// The time of the longest tick according to one of the keys.
    fn longest(&self, key: fn(&Times) -> f64) -> f64 {
        self.ticks.iter().filter_map(|(_, times)| times.as_ref()).map(key).fold(0.0, f64::max)
    }
}

/// Plays one tick of a game and returns how long it took.
fn timed(game: &mut RandomGame, is_stirred: bool) -> Times {
    let began = thread_time_us();
    game.tick(is_stirred);
    let measured = (thread_time_us() - began) / 1000.0;
    Times { measured, by_counts: f64::from(tick_us(game.game())) / 1000.0 }
}

/// A closed world with up to four layouts of blocks and, in a third of the scenes, a network of springs. The first line
/// describes the contents.
fn random(seed: u64, number: u64) -> String {
    let rng = &mut Rng::new(seed, number);
    let solver = if rng.below(3) == 0 { "relaxation" } else { "conjugate" };
    let gravity = [-50.0, -50.0, -10.0, 0.0][rng.below(4) as usize];
    let (layouts, count) = (1 + rng.below(4), 10 + rng.below(190));
    let largest = rng.range(0.8, 3.0);
    let mut listed = String::new();
    let (mut area, mut heaviest, mut lightest, mut bounce) = (0.0, 0f32, f32::INFINITY, 0f32);
    for _ in 0..layouts {
        let radius = rng.range(0.3, 1.0) * largest;
        let shape = match rng.below(2) {
            0 => format!("radius = {radius:.2}"),
            _ => format!("size = [{:.2}, {:.2}]", 2.0 * radius, rng.range(0.6, 2.0) * radius),
        };
        let restitution: f32 = [0.0, 0.0, 0.4, 0.9][rng.below(4) as usize];
        let mass = 10f32.powf(rng.range(-1.0, 1.0) * rng.below(4) as f32);
        let friction = [0.0, 0.3, 0.8][rng.below(3) as usize];
        (heaviest, lightest) = (heaviest.max(mass), lightest.min(mass));
        bounce = bounce.max(restitution);
        area += 4.0 * radius * radius * count as f32;
        listed += &format!(
            "[[layouts]]\nkind = \"block\"\ncount = {count}\narea = [[4, 4], [SIDE, SIDE]]\n{shape}\n\
             restitution = {restitution}\nmass = {mass:.3}\nfriction = {friction}\n"
        );
    }
    let side = (area / rng.range(0.1, 0.45)).sqrt().max(30.0) + 8.0;
    let (fill, ratio) = (area / (side - 8.0).powi(2), heaviest / lightest);
    let (middle, inner) = (side / 2.0, format!("{:.1}", side - 4.0));
    let springs = if rng.below(3) == 0 { springs(rng, side, lightest) } else { String::new() };
    let mut text = format!(
        "# {} bodies, {solver}, gravity {gravity}, fill {fill:.2}, masses to 1 : {ratio:.0}, restitution to {bounce}, and \
         {} springs with bodies of their own\n\
         title = \"Random\"\nsize = [{side:.1}, {side:.1}]\n\
         solver = \"{solver}\"\ngravity = [0, {gravity}]\ngroups = [\"platform\", \"block\"]\n\
         pairs = [[\"block\", \"platform\"], [\"block\", \"block\"]]\n",
        layouts * count,
        springs.matches("[[springs]]").count()
    );
    let (far, long) = (side + 6.0, side + 40.0);
    for (x, y, w, h) in [
        (middle, -6.0, long, 20.0),
        (middle, far, long, 20.0),
        (-6.0, middle, 20.0, long),
        (far, middle, 20.0, long),
    ] {
        text += &format!(
            "[[bodies]]\nkind = \"wall\"\nposition = [{x:.1}, {y:.1}]\nsize = [{w:.1}, {h:.1}]\n"
        );
    }
    text + &listed.replace("SIDE", &inner) + &springs
}

/// Bodies at random positions, joined by springs of any stiffness in a row, as a grid or at random.
fn springs(rng: &mut Rng, side: f32, lightest: f32) -> String {
    let (rows, columns) = (1 + rng.below(10), 2 + rng.below(24));
    let count = rows * columns;
    let joins_at_random = rng.below(3) == 0;
    // Masses in a scene may differ by a factor of up to a million.
    let heaviest = 10f32.powi(rng.below(6) as i32).min(3e5 * lightest);
    let stiffness = rng.range(0.0, 9.0);
    let damping = if rng.below(2) == 0 { 0.0 } else { rng.range(0.0, 0.5) };
    let mut text = String::new();
    for number in 0..count {
        let [x, y] = [0; 2].map(|_| rng.range(5.5, side - 5.5));
        let mass = if rng.below(5) == 0 { heaviest } else { 1.0 };
        text += &format!(
            "[[bodies]]\nkind = \"block\"\nname = \"n{number}\"\nposition = [{x:.1}, {y:.1}]\n\
             radius = 0.5\nmass = {mass}\n"
        );
    }
    let mut join = |rng: &mut Rng, one: u32, other: u32| {
        if one == other {
            return;
        }
        let length = rng.range(0.0, 8.0);
        let stiffness = 10f32.powf(stiffness * rng.range(0.7, 1.0));
        text += &format!(
            "[[springs]]\nbody = \"n{one}\"\nto = \"n{other}\"\nlength = {length:.1}\n\
             stiffness = {stiffness:.3}\ndamping_ratio = {damping:.2}\n"
        );
    };
    for number in 0..count {
        if joins_at_random {
            for _ in 0..1 + rng.below(2) {
                let other = rng.below(count);
                join(rng, number, other);
            }
            continue;
        }
        if (number + 1) % columns > 0 {
            join(rng, number, number + 1);
        }
        if number + columns < count {
            join(rng, number, number + columns);
        }
    }
    text
}
