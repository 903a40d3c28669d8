//! The worst tick that a scene's plan promises beside the worst that was measured: for the shipped scenes, and for
//! random ones whose bodies are stirred: `--count 1000 --seed 1`.
//!
//! Every game is played three times, and a tick counts with the shortest of its times: the same tick does the same work.
//!
//! A plan's milliseconds are those of the machine on which the times of its counts were fitted. How many times as long this
//! machine takes is the median over all scenes of the time of the worst tick relative to that by the counts of this very
//! tick; in the summary, plans are multiplied by it.

use clap::Parser;
use jostle_game::scene::WorstTick;
use jostle_game::trial::{STIR_TICKS, stir, tick_us, worst_tick};
use jostle_game::{Buttons, Game, Input, Scene, Seat};
use jostle_report::overview::median;
use jostle_report::study::thread_time_us;
use jostle_sim::{Rng, Vec2};
use std::sync::Arc;

/// Ticks of a game: a minute.
const TICKS: u32 = 3600;
/// Times that it is played.
const PLAYS: u32 = 3;
/// An estimate of more than this many times the worst tick is counted as too high.
const RATIO_MAX: f64 = 4.0;

#[derive(Parser)]
struct Arguments {
    /// Random scenes after the shipped ones
    #[arg(long, default_value_t = 0)]
    count: u64,
    /// Number of the first one
    #[arg(long, default_value_t = 0)]
    from: u64,
    /// Seed of the random scenes and of all games
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Leave the shipped scenes out
    #[arg(long)]
    random_only: bool,
}

/// Times of the ticks of a game, ms.
struct Played {
    mean: f64,
    worst: f64,
    /// The worst one by its counts.
    by_counts: f64,
}

/// How the plan of a scene compares.
#[derive(Clone, Copy)]
struct Comparison {
    /// The plan's worst tick relative to that measured.
    ratio: f64,
    /// Time of the worst tick relative to that by its counts.
    slowness: f64,
}

fn main() {
    let arguments = Arguments::parse();
    println!(
        "scene,bodies,plan_ms,limits_ms,mean_ms,worst_ms,worst_by_counts_ms,plan_over_worst,about"
    );
    let mut shipped = Vec::new();
    let scenes = if arguments.random_only { Vec::new() } else { Scene::built_in() };
    for scene in scenes {
        let scene = Arc::new(scene);
        shipped.push(report(&scene, "", &play(&scene, arguments.seed, None)));
    }
    let mut by_solver = [Vec::new(), Vec::new()];
    for number in arguments.from..arguments.from + arguments.count {
        let text = random(arguments.seed, number);
        let about = text.lines().next().unwrap_or_default().replace(',', ";");
        let scene = Scene::parse(&format!("random-{number}.toml"), &text)
            .unwrap_or_else(|error| panic!("{error}\n{text}"));
        let scene = Arc::new(scene);
        let played = play(&scene, arguments.seed, Some(number));
        by_solver[usize::from(scene.world.is_conjugate())].push(report(&scene, &about, &played));
    }
    let [relaxation, conjugate] = by_solver;
    let random = [relaxation.as_slice(), &conjugate].concat();
    let slowness = median(shipped.iter().chain(&random).map(|row| row.slowness).collect());
    println!(
        "# this machine takes {slowness:.2} times as long as the one for which plans were fitted"
    );
    for (scenes, rows) in [
        ("shipped", &shipped),
        ("random, relaxation", &relaxation),
        ("random, conjugate", &conjugate),
        ("random", &random),
    ] {
        summarise(scenes, rows, slowness);
    }
}

/// Prints how the plan's worst ticks on a machine that takes `slowness` times as long compare with those measured: the first
/// divided by the second.
fn summarise(scenes: &str, rows: &[Comparison], slowness: f64) {
    if rows.is_empty() {
        return;
    }
    let mut sorted: Vec<f64> = rows.iter().map(|row| row.ratio * slowness).collect();
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

/// Prints the row of a scene; returns its figures.
fn report(scene: &Scene, about: &str, played: &Played) -> Comparison {
    let plan = f64::from(worst_tick(scene).ms);
    let limits = WorstTick::of(scene).ms;
    let (name, bodies) = (&scene.name, scene.world.bodies_max);
    let Played { mean, worst, by_counts } = played;
    let ratio = plan / worst;
    println!(
        "{name},{bodies},{plan:.3},{limits:.3},{mean:.4},{worst:.4},{by_counts:.4},{ratio:.2},{about}"
    );
    Comparison { ratio, slowness: worst / by_counts }
}

/// Plays with as many bots as the scene allows; stirs the bodies of a random scene. The games come one after another: what
/// else the machine does for a moment slows down another tick of each.
fn play(scene: &Arc<Scene>, seed: u64, random: Option<u64>) -> Played {
    // Time of each tick, and that by its counts, ms.
    let mut ticks = [(f64::INFINITY, 0.0); TICKS as usize];
    for _ in 0..PLAYS {
        let mut game = Game::new(scene.clone(), seed);
        let mut hands: Vec<Hand> = Vec::new();
        for seat in 0..scene.players_max {
            game.join(Seat(seat));
            hands.push(Hand::new(Rng::new(seed, u64::from(seat))));
        }
        for (tick, (time, by_counts)) in (1u32..).zip(&mut ticks) {
            let inputs: Vec<(Seat, Input)> = (0u16..)
                .zip(&mut hands)
                .map(|(seat, hand)| (Seat(seat), hand.next(scene.size)))
                .collect();
            let stirred = random.filter(|_| tick.is_multiple_of(STIR_TICKS));
            let mut rng = stirred.map(|number| Rng::new(number, u64::from(tick)));
            let began = thread_time_us();
            match &mut rng {
                None => game.tick(&inputs),
                Some(_) => game.tick_watched(&inputs, &mut |_, world| {
                    if let Some(mut rng) = rng.take() {
                        stir(world, &mut rng);
                    }
                }),
            }
            *time = time.min((thread_time_us() - began) / 1000.0);
            *by_counts = f64::from(tick_us(&game)) / 1000.0;
        }
    }
    let mean = ticks.iter().map(|(time, _)| time).sum::<f64>() / f64::from(TICKS);
    let (worst, by_counts) = ticks
        .into_iter()
        .max_by(|(one, _), (other, _)| one.total_cmp(other))
        .expect("a game has ticks");
    Played { mean, worst, by_counts }
}

/// Holds buttons and a pointer for some ticks, then others.
struct Hand {
    rng: Rng,
    input: Input,
    ticks: u32,
}

impl Hand {
    fn new(rng: Rng) -> Hand {
        Hand { rng, input: Input::default(), ticks: 0 }
    }

    fn next(&mut self, size: Vec2) -> Input {
        if self.ticks == 0 {
            let rng = &mut self.rng;
            let mut buttons = rng.next_u32() as u16 & Buttons::ALL.0 & !Buttons::TEAM.0;
            if rng.below(10) > 0 {
                buttons &= !Buttons::CLEAR.0;
            }
            let pointer = Vec2::new(rng.range(0.0, size.x), rng.range(0.0, size.y));
            self.input = Input { buttons: Buttons(buttons), pointer: Some(pointer) };
            self.ticks = 2 + rng.below(30);
        }
        self.ticks -= 1;
        self.input
    }
}

/// A scene with up to four layouts of blocks in a closed world, and a network of springs in a third of them. Its first line
/// says what is in it.
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

/// Bodies at random places, joined in a row, as a grid or at random, by springs of any stiffness.
fn springs(rng: &mut Rng, side: f32, lightest: f32) -> String {
    let (rows, columns) = (1 + rng.below(10), 2 + rng.below(24));
    let count = rows * columns;
    let joins_at_random = rng.below(3) == 0;
    // A scene's masses may differ by a factor of a million.
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
