//! Estimates the worst tick that a scene's limits allow, with everything that it can ever contain in motion and
//! in contact at once. Scenes cost less when they are played, since bodies sleep or fly and few players make
//! full use of their limits.
//!
//! The constants are processor times of the simulation in a release build on one virtual core of a shared Intel
//! Xeon server, for the worst of 1200 to 3600 ticks with 8 to 64 bots. They do not include sending snapshots.

use super::plan::{self, Bodies, Per};
use super::spec::Scene;
use jostle_sim::math::{max, min, ordered_bits};
use jostle_sim::{BodyDef, DT, Motion, Relaxation, Shape, Solver, collide};

/// Microseconds per dynamic body with the relaxation solver, or if contacts are only detected: 3000 bodies in ten
/// pits with 64 bots took 12.1 ms, and the 250 marbles of `pile` took 0.73 ms. Using more iterations than the
/// default costs proportionally more.
const RELAXED_BODY_US: f32 = 4.0;
/// Costs with the conjugate solver, by mass ratio. Each entry lists the ratio between the heaviest and the lightest
/// dynamic body from which it applies, the microseconds per tick if there is any moving body, and the microseconds
/// per body. Among a thousand random heaps of 200 to 1000 bodies and a thousand of 20 to 800, the worst ticks took
/// 12.8, 17.3 and 27.1 us per body, the last of these with 48 bodies; half of the heaps took a sixth of that. Bounces
/// add almost nothing.
const CONJUGATE_US: [(f32, f32, f32); 3] =
    [(0.0, 0.0, 15.0), (100.0, 300.0, 18.0), (10_000.0, 1000.0, 24.0)];
/// Microseconds per particle. The 4096 particles of `emitters` took 0.33 ms, including everything else in that scene.
const PARTICLE_US: f32 = 0.08;

/// Microseconds for springs. A few springs cost a fixed time each. Hundreds of springs, which share their substeps,
/// cost a fixed time in total plus a smaller time each. Ten bodies on 11 springs took 0.3 ms, and the densest network
/// of 1020 springs took 5.3 ms.
const FEW_SPRINGS_US: f32 = 30.0;
const MANY_SPRINGS_US: (f32, f32) = (1500.0, 3.8);

/// Maximum number of pairs overlapping at the start that are counted; more make no difference.
const COUNTED_MAX: u32 = 1_000_000;

/// Contacts per body in a heap. A body's time is proportional to this number, and each additional contact at the
/// start adds the same amount.
const CONTACTS_PER_BODY: u32 = 3;

/// An upper estimate of what a tick costs.
#[derive(Clone, Debug, PartialEq)]
pub struct WorstTick {
    /// Processor time of the simulation, milliseconds.
    pub ms: f32,
    /// Field of the file with the largest cost, like `layouts[2].count`.
    pub field: String,
}

/// Time taken by the bodies or particles that one field adds, microseconds.
struct CostShare {
    us: f32,
    field: String,
}

impl WorstTick {
    /// Estimates the worst tick of this scene.
    pub fn of(scene: &Scene) -> WorstTick {
        let movers = movers(scene);
        let (any_us, body_us) = costs(scene, &movers);
        let mut room = scene.world.bodies_max as u32;
        let mut shares: Vec<CostShare> = Vec::new();
        for alike in &movers {
            let count = alike.total(scene.players_max).min(room);
            room -= count;
            let (us, field) = (body_us * count as f32, alike.count_field());
            match shares.iter_mut().find(|share| share.field == field) {
                Some(share) => share.us += us,
                None => shares.push(CostShare { us, field }),
            }
        }
        let moving = scene.world.bodies_max as u32 - room;
        let overlaps = Overlaps::at_start(scene);
        let beyond = overlaps.count.saturating_sub(CONTACTS_PER_BODY * moving);
        if beyond > 0 {
            let us = body_us / CONTACTS_PER_BODY as f32 * beyond as f32;
            shares.push(CostShare { us, field: overlaps.field });
        }
        if emits(scene) {
            let us = PARTICLE_US * scene.world.particles_max as f32;
            shares.push(CostShare { us, field: "limits.particles".to_owned() });
        }
        if !scene.springs.is_empty() {
            let count = scene.springs.len() as f32;
            let many = MANY_SPRINGS_US.0 + MANY_SPRINGS_US.1 * count;
            let us = min(FEW_SPRINGS_US * count, many);
            shares.push(CostShare { us, field: "springs".to_owned() });
        }
        let us = any_us + shares.iter().map(|share| share.us).sum::<f32>();
        let largest = shares.into_iter().max_by(|a, b| a.us.total_cmp(&b.us));
        WorstTick { ms: us / 1000.0, field: largest.map_or_else(String::new, |share| share.field) }
    }

    /// Number of rooms with this scene that one core can run even if all of them have their worst tick at once.
    pub fn rooms_per_core(&self) -> u32 {
        (1000.0 * DT / max(self.ms, 0.01)) as u32
    }

    /// Returns the estimate as a readable sentence.
    pub fn sentence(&self) -> String {
        let (ms, share) = (self.ms, self.ms / (1000.0 * DT));
        let digits = if ms < 1.0 { 2 } else { 1 };
        match self.rooms_per_core() {
            0 => format!("{ms:.digits$} ms ({share:.1} ticks: late if all of it moves at once)"),
            1 => format!("{ms:.digits$} ms ({share:.2} of a tick; 1 room fits a core)"),
            rooms => {
                format!("{ms:.digits$} ms ({share:.2} of a tick; {rooms} rooms fit a core)")
            }
        }
    }
}

/// Microseconds that the worst tick takes if there is any moving body, and additional microseconds per moving body.
fn costs(scene: &Scene, movers: &[Bodies]) -> (f32, f32) {
    match scene.world.solver {
        _ if movers.is_empty() => (0.0, 0.0),
        None => (0.0, RELAXED_BODY_US),
        Some(Solver::Relaxation(settings)) => {
            let usual = Relaxation::default().iterations as f32;
            (0.0, RELAXED_BODY_US * max(settings.iterations as f32 / usual, 1.0))
        }
        Some(Solver::Conjugate(_)) => {
            let ratio = mass_ratio(movers);
            let known = CONJUGATE_US.iter().rev().find(|(least, ..)| ratio >= *least);
            let (_, any_us, body_us) = known.expect("the first class is that of all");
            (*any_us, *body_us)
        }
    }
}

/// The ratio of the greatest mass to the smallest.
fn mass_ratio(movers: &[Bodies]) -> f32 {
    let masses = || movers.iter().map(|alike| alike.def.mass);
    let (heaviest, lightest) = (masses().fold(0.0, max), masses().fold(f32::INFINITY, min));
    heaviest / lightest
}

/// Maximum number of bodies that tools and launchers may make.
pub fn made_max(scene: &Scene) -> u32 {
    let made = movers(scene).into_iter().filter(|alike| alike.per == Per::Tool);
    let total: u32 = made.map(|alike| alike.count).sum();
    total.min(scene.world.bodies_max as u32)
}

/// All dynamic bodies that the scene can contain.
fn movers(scene: &Scene) -> Vec<Bodies> {
    let mut movers = plan::sources(scene);
    movers.retain(|alike| alike.def.motion == Motion::Dynamic);
    movers
}

/// Whether anything in the scene emits particles.
fn emits(scene: &Scene) -> bool {
    scene.world_settings().features.particles
}

/// Bodies that overlap at the start. Only those in `bodies` and exact layouts can, since other layouts keep their
/// bodies apart.
struct Overlaps {
    /// Number of overlapping pairs that collide.
    count: u32,
    /// Field of the file that adds the most overlapping pairs; empty if there are none.
    field: String,
}

/// A body at the start, and the index of its source.
#[derive(Clone, Copy)]
struct StartingBody {
    def: BodyDef,
    source: usize,
}

impl Overlaps {
    /// Counts the overlaps by sorting and sweeping along x.
    fn at_start(scene: &Scene) -> Overlaps {
        let starts = by_edge(starts(scene));
        let (mut count, mut by_source) = (0, vec![0u32; 1 + scene.layouts.len()]);
        for (index, a) in starts.iter().enumerate() {
            if count > COUNTED_MAX {
                break;
            }
            let right = a.def.position.x + a.def.shape.half_extent().x;
            let beside = starts[index + 1..].iter().take_while(|b| left(&b.def) < right);
            for b in beside.filter(|b| lie_in_each_other(scene, &a.def, &b.def)) {
                count += 1;
                by_source[a.source] += 1;
                by_source[b.source] += 1;
            }
        }
        let most = (0..by_source.len()).max_by_key(|&source| by_source[source]);
        let field = match most.filter(|&source| by_source[source] > 0) {
            None => String::new(),
            Some(0) => "bodies".to_owned(),
            Some(source) => format!("layouts[{}].count", source - 1),
        };
        Overlaps { count, field }
    }
}

/// All bodies whose start is fixed by the file. The source of those in `bodies` is 0, and that of a layout's
/// bodies is the layout's index plus 1.
fn starts(scene: &Scene) -> Vec<StartingBody> {
    let bodies = scene.bodies.iter().map(|body| StartingBody { def: body.def, source: 0 });
    let layouts = scene.layouts.iter().enumerate().filter(|(_, layout)| layout.exact);
    let exact = layouts.flat_map(|(index, layout)| {
        // The largest of the shapes from which the seed chooses.
        let largest = layout.shapes.iter().copied().max_by(|a, b| area(*a).total_cmp(&area(*b)));
        let shape = largest.unwrap_or(layout.def.shape);
        (0..layout.count).map(move |number| {
            let position = layout.cell_center(number);
            StartingBody { def: BodyDef { shape, position, ..layout.def }, source: index + 1 }
        })
    });
    bodies.chain(exact).collect()
}

/// Sorts bodies by their left edges. As in the broad phase, it sorts plain numbers, since another sort would add 3 kB
/// to the page's program.
fn by_edge(starts: Vec<StartingBody>) -> Vec<StartingBody> {
    let keys = starts.iter().zip(0u64..);
    let keys = keys.map(|(start, index)| u64::from(ordered_bits(left(&start.def))) << 32 | index);
    let mut keys: Vec<u64> = keys.collect();
    keys.sort_unstable();
    keys.iter().map(|&key| starts[key as u32 as usize]).collect()
}

fn area(shape: Shape) -> f32 {
    shape.half_extent().x * shape.half_extent().y
}

fn left(def: &BodyDef) -> f32 {
    def.position.x - def.shape.half_extent().x
}

/// Whether two bodies overlap and may collide.
fn lie_in_each_other(scene: &Scene, a: &BodyDef, b: &BodyDef) -> bool {
    let movable = [a, b].iter().any(|def| def.motion == Motion::Dynamic);
    (movable || scene.world.solver.is_none())
        && scene.groups_meet(a.group, b.group)
        && collide(a.shape, a.position, b.shape, b.position, (0, 1)).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor, and `count` blocks on it.
    fn scene(top: &str, block: &str, count: u32) -> Scene {
        let source = format!(
            "title = \"Cost\"\nsize = [100, 100]\ngroups = [\"platform\", \"block\"]\n\
             pairs = [[\"block\", \"platform\"], [\"block\", \"block\"]]\n{top}\n\
             [[bodies]]\nkind = \"wall\"\nposition = [50, 0]\nsize = [100, 4]\n\
             [[layouts]]\nkind = \"block\"\ncount = {count}\narea = [[5, 5], [95, 95]]\nradius = 1\n\
             {block}\n"
        );
        Scene::parse("cost.toml", &source).unwrap_or_else(|error| panic!("{error}"))
    }

    fn ms(top: &str, block: &str) -> f32 {
        WorstTick::of(&scene(top, block, 1000)).ms
    }

    #[test]
    fn a_body_costs_by_its_solver_and_by_how_unequal_masses_are() {
        let conjugate = "solver = \"conjugate\"";
        assert_eq!(ms("", ""), 4.0);
        assert_eq!(ms(conjugate, "restitution = 0"), 15.0);
        assert_eq!(ms(conjugate, "restitution = 0.2"), 15.0);
        let heavier = |mass: &str| {
            let one = "\n[[layouts]]\nkind = \"block\"\ncount = 1\narea = [[5, 5], [95, 95]]\nradius = 1\nmass = ";
            ms(conjugate, &format!("mass = 1{one}{mass}"))
        };
        assert!((heavier("99") - 1001.0 * 0.015).abs() < 1e-4);
        assert!((heavier("100") - (0.3 + 1001.0 * 0.018)).abs() < 1e-4);
        assert!((heavier("10000") - (1.0 + 1001.0 * 0.024)).abs() < 1e-4);
        assert_eq!(ms(conjugate, "motion = \"kinematic\""), 0.0);
        assert_eq!(ms("relaxation = { iterations = 60 }", ""), 16.0);
    }

    #[test]
    fn the_field_that_costs_most_is_named() {
        let field = |top: &str| WorstTick::of(&scene(top, "", 1000)).field;
        assert_eq!(field(""), "layouts[0].count");
        let marbles =
            "tools = [\"dumb\"]\nlimits = { dumb = 2000 }\n[dumb]\ngroup = \"block\"\nradius = 1";
        assert_eq!(field(marbles), "limits.dumb");
    }

    #[test]
    fn only_bodies_within_the_limit_and_particles_that_something_emits_count() {
        let spray = "tools = [\"spray\"]\nlimits = { particles = 10000 }";
        assert_eq!(ms(spray, ""), 4.8);
        assert_eq!(ms("limits = { particles = 10000 }", ""), 4.0);
        let arena = Scene::built_in().swap_remove(0);
        let all: u32 = movers(&arena).iter().map(|alike| alike.total(arena.players_max)).sum();
        let mut few = arena.clone();
        few.world.bodies_max = 100;
        let saved = WorstTick::of(&arena).ms - WorstTick::of(&few).ms;
        assert!((saved - (all - 100) as f32 * 0.004).abs() < 1e-3, "{saved} of {all} bodies");
    }

    #[test]
    fn bodies_that_lie_in_each_other_at_the_start_cost_their_contacts() {
        let exact = "exact = true\ngrid = [40, 25]";
        assert_eq!(ms("", exact), 4.0, "two units apart");
        let heap = |radius: f32| {
            let text = format!(
                "title = \"Heap\"\nsize = [100, 100]\ngroups = [\"block\"]\npairs = [[\"block\", \"block\"]]\n\
                 [[layouts]]\nkind = \"block\"\ncount = 1000\narea = [[46, 46], [54, 54]]\n\
                 radius = {radius}\nexact = true\ngrid = [40, 25]\n"
            );
            WorstTick::of(
                &Scene::parse("heap.toml", &text).unwrap_or_else(|error| panic!("{error}")),
            )
        };
        assert_eq!(heap(0.09).ms, 4.0, "none touch");
        let all = heap(12.0);
        assert!(all.ms > 600.0, "{} ms for 499,500 contacts", all.ms);
        assert_eq!(all.field, "layouts[0].count");
        assert!(heap(1.0).ms > 20.0, "{} ms", heap(1.0).ms);
    }

    #[test]
    fn the_sentence_says_how_many_rooms_fit_a_core() {
        let says = |ms| WorstTick { ms, field: String::new() }.sentence();
        assert_eq!(says(0.25), "0.25 ms (0.01 of a tick; 66 rooms fit a core)");
        assert_eq!(says(2.6), "2.6 ms (0.16 of a tick; 6 rooms fit a core)");
        assert_eq!(says(9.7), "9.7 ms (0.58 of a tick; 1 room fits a core)");
        assert_eq!(says(50.0), "50.0 ms (3.0 ticks: late if all of it moves at once)");
    }
}
