//! Rain of N bodies, half circles and half boxes: Jostle's relaxation beside Box2D, stepped in
//! turns in one process, so that a busy machine slows both alike. Prints processor time a step and
//! what the result is worth; the ratio is the figure to quote.
//!
//! Usage: `cargo run --release -- [N...]` (default 1000).

mod box2d;
mod rain;

use jostle_sim::{Motion, Vec2, World};

/// Steps of a run; "settled" are those from [`SETTLED`] on.
const STEPS: usize = 600;
const SETTLED: usize = 300;

fn main() {
    let counts: Vec<u32> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let counts = if counts.is_empty() { vec![1000] } else { counts };
    println!(
        "processor time a step, median, microseconds; rms speed and deepest overlap at the end"
    );
    for count in counts {
        compare(count);
    }
}

fn compare(count: u32) {
    let scene = rain::Rain::new(count);
    let mut ours = rain::world(&scene);
    let mut theirs = box2d::Box2d::new(&scene);
    let (mut our_times, mut their_times) = (Vec::new(), Vec::new());
    for _ in 0..STEPS {
        our_times.push(timed(|| ours.step()));
        their_times.push(timed(|| theirs.step()));
    }
    for (phase, range) in [("falling", 0..120), ("settled", SETTLED..STEPS)] {
        let (a, b) = (median(&our_times[range.clone()]), median(&their_times[range]));
        println!("N {count} {phase}: Jostle {a:.1}, Box2D {b:.1}, ratio {:.2}", a / b);
    }
    let positions: Vec<Vec2> = dynamic(&ours).map(|id| ours.position(id)).collect();
    let speeds: Vec<Vec2> = dynamic(&ours).map(|id| ours.velocity(id)).collect();
    println!("  Jostle: rms {:.4}, deepest {:.4}", rms(&speeds), scene.deepest(&positions));
    let (positions, speeds) = theirs.state();
    println!("  Box2D:  rms {:.4}, deepest {:.4}", rms(&speeds), scene.deepest(&positions));
}

fn dynamic(world: &World) -> impl Iterator<Item = jostle_sim::BodyId> + '_ {
    world.ids().filter(|&id| world.motion(id) == Motion::Dynamic)
}

fn rms(speeds: &[Vec2]) -> f32 {
    let sum: f32 = speeds.iter().map(|speed| speed.length_squared()).sum();
    (sum / speeds.len() as f32).sqrt()
}

/// Processor time of this thread, microseconds: waiting for a busy core does not count.
fn timed(work: impl FnOnce()) -> f64 {
    let before = thread_time_us();
    work();
    thread_time_us() - before
}

fn thread_time_us() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a live timespec; the call writes it and nothing else.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
