//! Scenes that strangers might send: random ones within or above the budget, and one that takes as much time as the
//! budget allows.

use jostle_sim::Rng;
use std::fmt::Write;

/// A heap that never comes to rest, with the largest number of bodies and iterations that a guest scene may have.
pub const DEAR: &str = r#"title = "Dear"
size = [64, 64]
gravity = [0, -40]
groups = ["ball", "wall"]
pairs = [["ball", "wall"], ["ball", "ball"]]
relaxation = { iterations = 30 }
limits = { players = 4, bodies = 994, particles = 1 }

[[bodies]]
kind = "wall"
group = "wall"
position = [32, 2]
size = [64, 4]

[[bodies]]
kind = "wall"
group = "wall"
position = [2, 32]
size = [4, 56]

[[bodies]]
kind = "wall"
group = "wall"
position = [62, 32]
size = [4, 56]

[[layouts]]
kind = "block"
group = "ball"
radius = 0.7
restitution = 0.9
count = 990
area = [[6, 6], [58, 58]]
grid = [33, 30]
exact = true
"#;

/// Generates a random scene that is determined by the seed.
pub fn random_scene(seed: u64) -> String {
    let mut rng = Rng::new(seed, 4);
    let (width, height) = (size(&mut rng), size(&mut rng).min(400));
    let mut text = format!(
        "title = \"Random\"\nsize = [{width}, {height}]\ngroups = [\"hero\", \"ball\", \"wall\"]\n\
         pairs = [[\"ball\", \"wall\"], [\"ball\", \"ball\"], [\"hero\", \"ball\"], [\"hero\", \"wall\"]]\n"
    );
    top(&mut rng, &mut text);
    line(&mut text, format_args!("[hero]\nspawns = [[{}, {}]]", width / 2, height - 8));
    line(
        &mut text,
        format_args!(
            "[[bodies]]\nkind = \"wall\"\ngroup = \"wall\"\nposition = [{}, 1]\nsize = [{width}, 2]",
            width / 2
        ),
    );
    for _ in 0..1 + rng.below(3) {
        layout(&mut rng, &mut text, [width, height]);
    }
    for _ in 0..rng.below(4) {
        let (count, every) = (1 + rng.below(200), 1 + rng.below(60));
        let recipe = ["fire", "spark", "explosion"][rng.below(3) as usize];
        line(
            &mut text,
            format_args!(
                "[[emitters]]\nrecipe = \"{recipe}\"\ncount = {count}\nevery = {every}\nposition = [{}, 9]",
                rng.below(width)
            ),
        );
    }
    if rng.below(3) == 0 {
        let every = rng.range(0.02, 1.0);
        line(
            &mut text,
            format_args!(
                "[[launchers]]\nwhat = \"dumb\"\nevery = {every}\nlimit = 60\nposition = [9, {}]",
                height - 5
            ),
        );
    }
    text
}

fn size(rng: &mut Rng) -> u32 {
    if rng.below(12) == 0 { 6000 } else { 60 + rng.below(400) }
}

fn top(rng: &mut Rng, text: &mut String) {
    if rng.below(3) == 0 {
        line(text, format_args!("solver = \"conjugate\""));
        let work = if rng.below(6) == 0 { 50_000_000 } else { 1_000_000 };
        line(text, format_args!("conjugate = {{ work_max = {work} }}"));
    } else {
        line(text, format_args!("relaxation = {{ iterations = {} }}", 1 + rng.below(33)));
    }
    line(text, format_args!("gravity = [0, {}]", rng.range(-100.0, 10.0)));
    let tools =
        ["\"steer\", \"launch\", \"dumb\"", "\"steer\", \"spray\"", "\"steer\", \"agitate\""];
    line(text, format_args!("tools = [{}]", tools[rng.below(3) as usize]));
    let (players, particles) = (1 + rng.below(70), rng.below(9000));
    let (packs, marbles) = (rng.below(5), rng.below(300));
    line(
        text,
        format_args!(
            "limits = {{ players = {players}, particles = {particles}, packs = {packs}, dumb = {marbles} }}"
        ),
    );
    line(text, format_args!("[dumb]\ngroup = \"ball\"\nradius = 1\n[pack]\ngroup = \"ball\""));
}

fn layout(rng: &mut Rng, text: &mut String, [width, height]: [u32; 2]) {
    let count = 1 + rng.below(500);
    let (radius, bounce) = (rng.range(0.2, 2.0), rng.range(0.0, 1.0));
    let mass = if rng.below(8) == 0 { 100_000.0 } else { 1.0 };
    line(
        text,
        format_args!(
            "[[layouts]]\nkind = \"block\"\ngroup = \"ball\"\nradius = {radius}\nrestitution = {bounce}\n\
             mass = {mass}\ncount = {count}\narea = [[6, 6], [{}, {}]]",
            width - 6,
            height - 10
        ),
    );
}

fn line(text: &mut String, line: std::fmt::Arguments<'_>) {
    writeln!(text, "{line}").expect("a String takes any text");
}
