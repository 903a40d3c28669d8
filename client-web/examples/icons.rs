//! Paints the page's icons, a hero facing the viewer, into `assets/sprites`:
//! `cargo run -p jostle-client-web --example icons`.
//! It uses only + - * / and sqrt, so every machine paints the same pixels.

use jostle_client_web::view::palette::{self, INK, PAPER, PLAYERS, Rgb};
use jostle_sim::Vec2;

/// File names, side lengths in pixels, and whether the system may crop the corners. In order: browser tab, touch
/// screen, installed page, splash screen.
const ICONS: [(&str, u32, bool); 5] = [
    ("favicon.png", 64, false),
    ("icon-180.png", 180, false),
    ("icon-192.png", 192, false),
    ("icon-512.png", 512, false),
    ("icon-full-512.png", 512, true),
];
/// Share of each side of a cropped icon that is guaranteed to be visible.
const SURE: f32 = 0.8;

/// Samples per pixel on each axis.
const SAMPLES: u32 = 4;

fn main() -> std::io::Result<()> {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/sprites");
    ICONS.iter().try_for_each(|(name, side, is_cut)| {
        std::fs::write(folder.join(name), icon_png(*side, *is_cut))
    })
}

/// The icon as a PNG, `side` pixels square.
fn icon_png(side: u32, is_cut: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side, side);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header().expect("a vector takes every byte");
    writer.write_image_data(&icon_rgba(side, is_cut)).expect("the pixels match the header");
    writer.finish().expect("a vector takes every byte");
    bytes
}

fn icon_rgba(side: u32, is_cut: bool) -> Vec<u8> {
    let mut rgba = Vec::with_capacity((side * side * 4) as usize);
    for row in 0..side {
        for column in 0..side {
            rgba.extend(pixel([column, row], side, is_cut));
        }
    }
    rgba
}

/// The mean of a pixel's samples.
fn pixel([column, row]: [u32; 2], side: u32, is_cut: bool) -> [u8; 4] {
    let mut sum = [0.0_f32; 3];
    let mut covered = 0.0_f32;
    for sample in 0..SAMPLES * SAMPLES {
        let within = Vec2::new((sample % SAMPLES) as f32, (sample / SAMPLES) as f32);
        let at = Vec2::new(column as f32, row as f32) + (within + 0.5) / SAMPLES as f32;
        // The y axis points up, and the icon spans -1..1.
        let point = (at / side as f32 * 2.0 - 1.0) * Vec2::new(1.0, -1.0);
        let color = match is_cut {
            true => Some(paint(point / SURE).unwrap_or_else(|| ground(point / SURE))),
            false => paint(point),
        };
        if let Some(color) = color {
            covered += 1.0;
            for (total, channel) in sum.iter_mut().zip(color) {
                *total += f32::from(channel);
            }
        }
    }
    let mean = sum.map(|total| if covered > 0.0 { (total / covered + 0.5) as u8 } else { 0 });
    let alpha = covered / (SAMPLES * SAMPLES) as f32 * 255.0 + 0.5;
    [mean[0], mean[1], mean[2], alpha as u8]
}

/// The colour at a point; `None` outside the ground's rounded corners.
fn paint(point: Vec2) -> Option<Rgb> {
    if rounded_box(point, Vec2::ONE, 0.44) > 0.0 {
        return None;
    }
    let body = Vec2::new(0.52, 0.66);
    let depth = -rounded_box(point + Vec2::new(0.0, 0.04), body, 0.30);
    if depth < 0.0 {
        return Some(ground(point));
    }
    Some(face(point).unwrap_or_else(|| {
        let rim = 1.0 - (depth / 0.16).min(1.0);
        let shade = palette::mix(PLAYERS[0], INK[1], 0.10 - 0.06 * point.y);
        if point.y > 0.0 {
            palette::mix(shade, [255, 255, 255], 0.5 * rim * rim * point.y)
        } else {
            palette::mix(shade, INK[1], 0.5 * rim * rim * -point.y)
        }
    }))
}

/// The ground behind the hero. It continues beyond the corners.
fn ground(point: Vec2) -> Rgb {
    let height = (point.y.clamp(-1.0, 1.0) + 1.0) * 0.5;
    palette::mix(INK[0], INK[2], height * height)
}

fn face(point: Vec2) -> Option<Rgb> {
    let mirrored = Vec2::new(point.x.abs(), point.y);
    let eye = Vec2::new(0.22, 0.18);
    let look = Vec2::new(0.035, 0.02);
    let centre = point - Vec2::new(eye.x.copysign(point.x), eye.y);
    if oval(centre - look - Vec2::new(-0.03, 0.05), Vec2::splat(0.032)) {
        return Some(PAPER[0]);
    }
    if oval(centre - look, Vec2::splat(0.085)) {
        return Some(INK[0]);
    }
    if oval(mirrored - eye, Vec2::new(0.15, 0.185)) {
        return Some(PAPER[0]);
    }
    let mouth = point - Vec2::new(0.02, -0.02);
    let arc = (mouth.length() - 0.20).abs();
    (arc < 0.032 && mouth.y < -0.12).then_some(palette::mix(PLAYERS[0], INK[0], 0.75))
}

fn oval(point: Vec2, half: Vec2) -> bool {
    (point / half).length_squared() < 1.0
}

fn rounded_box(point: Vec2, half: Vec2, radius: f32) -> f32 {
    let q = point.abs() - half + radius;
    let outside = Vec2::new(if q.x > 0.0 { q.x } else { 0.0 }, if q.y > 0.0 { q.y } else { 0.0 });
    let inside = if q.x > q.y { q.x } else { q.y };
    outside.length() + if inside < 0.0 { inside } else { 0.0 } - radius
}
