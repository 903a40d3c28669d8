//! Draws a picture without a window: `cargo run -p jostle-client-web --example picture -- OUT.png
//! [WIDTH HEIGHT]` shows a hand-made scene with one of everything.

use jostle_client_web::draw::DrawList;
use jostle_client_web::frame::{Effect, EffectKind, Frame, FrameBody, View};
use jostle_client_web::render::headless::{Headless, Picture};
use jostle_sim::{BodyId, EmitterDef, Kind, Particles, Recipe, Shape, Source, Vec2};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let out = arguments.first().ok_or("usage: picture OUT.png [WIDTH HEIGHT] [bounds]")?;
    let number = |at: usize, other: u32| match arguments.get(at) {
        Some(text) => text.parse(),
        None => Ok(other),
    };
    let size = [number(1, 1280)?, number(2, 720)?];
    let bounds = arguments.iter().any(|a| a == "bounds");
    let mut headless = Headless::open()?;
    let (bodies, effects) = demo();
    let particles = fire(Vec2::new(128.0, 40.0));
    let mut list = DrawList::new();
    let world = Vec2::new(200.0, 112.5);
    let height = world.y.max(world.x * size[1] as f32 / size[0] as f32);
    let frame = Frame {
        view: View { center: world * 0.5, height, pixels: size },
        world_size: world,
        bodies: &bodies,
        particles: &particles,
        recipes: &[],
        particle_lead: 0.0,
        effects: &effects,
        time: 2.0,
        bounds,
        calm: false,
        own_seat: None,
        pointer: None,
        dimmed: false,
    };
    list.fill(&frame);
    let picture = headless.picture(size, &list)?;
    write_png(out, &picture)?;
    println!("{out}: {} x {} by {}", size[0], size[1], headless.adapter());
    Ok(())
}

fn write_png(path: &str, picture: &Picture) -> Result<(), Box<dyn Error>> {
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, picture.size[0], picture.size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    let rgb: Vec<u8> = picture.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    encoder.write_header()?.write_image_data(&rgb)?;
    Ok(())
}

fn body(index: u32, kind: Kind, shape: Shape, x: f32, y: f32) -> FrameBody {
    FrameBody {
        id: BodyId { index, generation: 0 },
        kind,
        color: None,
        shape,
        center: Vec2::new(x, y),
        velocity: Vec2::ZERO,
        age: 10.0,
        gaze: None,
        touching: false,
        hidden: false,
        hot: false,
    }
}

fn demo() -> (Vec<FrameBody>, Vec<Effect>) {
    let slab = Shape::rect;
    let mut all = vec![
        (Kind::Wall, slab(200.0, 3.5), 100.0, 1.75),
        (Kind::Wall, slab(200.0, 3.0), 100.0, 111.0),
        (Kind::Wall, slab(3.0, 112.5), 1.5, 56.25),
        (Kind::Wall, slab(3.0, 112.5), 198.5, 56.25),
        (Kind::Platform, slab(30.0, 3.0), 40.0, 32.0),
        (Kind::Platform, slab(30.0, 3.0), 92.0, 62.0),
        (Kind::Platform, slab(30.0, 3.0), 150.0, 38.0),
        (Kind::Platform, slab(42.0, 3.0), 160.0, 80.0),
        (Kind::Platform, slab(30.0, 3.0), 38.0, 78.0),
        (Kind::Minion, Shape::circle(6.5), 70.0, 88.0),
        (Kind::Minion, Shape::circle(6.5), 110.0, 25.0),
        (Kind::Minion, Shape::circle(6.5), 178.0, 58.0),
        (Kind::Minion, Shape::circle(6.5), 20.0, 55.0),
    ];
    for i in 0..6 {
        all.push((Kind::Dumb, Shape::circle(4.0), 60.0 + 7.8 * i as f32, 7.5));
    }
    for i in 0..5 {
        all.push((Kind::Dumb, Shape::circle(4.0), 63.9 + 7.8 * i as f32, 14.3));
    }
    for i in 0..3 {
        for j in 0..(3 - i) {
            let x = 168.0 + 9.1 * j as f32 + 4.5 * i as f32;
            all.push((Kind::Block, slab(9.0, 9.0), x, 8.0 + 9.1 * i as f32));
        }
    }
    all.push((Kind::Block, Shape::circle(5.0), 160.0, 86.6));
    all.push((Kind::Block, Shape::circle(3.0), 168.5, 84.6));
    all.push((Kind::Block, slab(14.0, 6.0), 36.0, 36.6));
    let mut bodies: Vec<FrameBody> = all
        .into_iter()
        .enumerate()
        .map(|(i, (kind, shape, x, y))| body(i as u32, kind, shape, x, y))
        .collect();
    let heroes = [(24.0, 14.5, 0), (92.0, 74.5, 1), (140.0, 16.0, 4), (44.0, 90.5, 6)];
    for (i, (x, y, color)) in heroes.into_iter().enumerate() {
        let mut hero = body(100 + i as u32, Kind::Hero, slab(16.0, 22.0), x, y);
        hero.color = Some(color);
        hero.gaze = Some(Vec2::new(128.0, 40.0));
        bodies.push(hero);
    }
    let packs = [(62.0, 46.0, 0, -0.4), (112.0, 92.0, 1, 2.6), (150.0, 60.0, 6, -1.9)];
    for (i, (x, y, color, angle)) in packs.into_iter().enumerate() {
        let mut pack = body(120 + i as u32, Kind::Pack, Shape::circle(1.5), x, y);
        pack.color = Some(color);
        pack.velocity = Vec2::from_angle(angle) * 30.0;
        bodies.push(pack);
    }
    for minion in bodies.iter_mut().filter(|b| b.kind == Kind::Minion) {
        minion.velocity = Vec2::new(5.0, 0.0);
    }
    bodies[8].hot = true;
    bodies[21].hot = true;
    bodies[10].touching = true;
    let effect = |kind, x, y, age, color, strength| Effect {
        kind,
        point: Vec2::new(x, y),
        age,
        color,
        strength,
        body: Some(BodyId { index: 102, generation: 0 }),
    };
    let effects = vec![
        effect(EffectKind::Splash, 128.0, 40.0, 0.18, Some(0), 30.0),
        effect(EffectKind::Spark, 32.0, 3.5, 0.06, None, 40.0),
        effect(EffectKind::Spark, 80.0, 63.5, 0.03, None, 70.0),
        effect(EffectKind::Gone, 180.0, 100.0, 0.2, None, 0.0),
    ];
    (bodies, effects)
}

/// The chapter's explosion, half a second in.
fn fire(point: Vec2) -> Particles {
    let mut particles = Particles::new(vec![Recipe::default()], 4096);
    particles.start(EmitterDef { recipe: 0, count: 200, seed: 7, source: Source::Point(point) });
    for _ in 0..26 {
        particles.step(&[], |_| None);
    }
    particles
}
