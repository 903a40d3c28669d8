//! The camera, which shows the whole world letterboxed, or smoothly follows the player's hero and stays within the
//! world's edges where possible.

use crate::view::frame::View;
use jostle_game::Scene;
use jostle_game::scene::Camera as CameraRule;
use jostle_room::{CAMERA_AHEAD_TICKS, CAMERA_CATCH_UP_TICKS};
use jostle_sim::{TICKS_PER_SECOND, Vec2};

/// Margin on each side when the whole world is shown, as a share of its size.
const MARGIN: f32 = 0.01;
/// How far the view looks ahead along the hero's motion, seconds.
const LOOK_AHEAD_S: f32 = CAMERA_AHEAD_TICKS as f32 / TICKS_PER_SECOND as f32;
/// Minimum width of a following view, as a multiple of its nominal height.
const FOLLOW_WIDTH_MIN: f32 = 0.9;
/// Threshold for portrait screens: the screen is taller than it is wide, and the view of the whole world would be more
/// than this many times as tall as the world.
const UPRIGHT: f32 = 1.5;
/// Height of a view that follows a hero on a portrait screen, as a multiple of the world's height.
const UPRIGHT_HEIGHT: f32 = 1.32;
/// Share of a portrait screen's height that the thumbs cover.
const THUMBS: f32 = 0.2;
/// Position of the world's centre on a portrait screen, as a share of the height from the top. The thumbs are below.
const UPRIGHT_MIDDLE: f32 = 0.42;

/// The moving camera of one game.
#[derive(Debug)]
pub struct Camera {
    rule: CameraRule,
    world: Vec2,
    center: Option<Vec2>,
    /// Whether the next view that follows a hero jumps to it.
    cut: bool,
}

/// The camera's input for one frame.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Canvas size in device pixels, neither zero.
    pub pixels: [u32; 2],
    /// Centre and velocity of the hero to follow.
    pub hero: Option<(Vec2, Vec2)>,
    /// Device pixels at the top covered by the HUD.
    pub top: u32,
    /// Device pixels at the bottom covered by the HUD when the whole world is shown.
    pub bottom: u32,
    /// Seconds since the previous frame.
    pub elapsed_s: f32,
}

/// Default height of the view around a followed player, as a share of the world's height.
const FOLLOW_SHARE: f32 = 0.6;

/// In a view this many times as tall as the world, everything is tiny.
const TINY: f32 = 2.5;

/// A spectator's camera, for the whole world or a hero.
pub fn watching_camera(scene: &Scene, follows: bool) -> Camera {
    let rule = match (follows, scene.camera) {
        (false, _) => CameraRule::Fit,
        (true, CameraRule::Fit | CameraRule::Whole) => {
            CameraRule::Follow { height: scene.size.y * FOLLOW_SHARE }
        }
        (true, follow) => follow,
    };
    Camera::new(rule, scene.size)
}

/// Whether a spectator initially follows a hero because the whole world would be tiny on this screen.
pub fn begins_with_a_hero(scene: &Scene, pixels: [u32; 2]) -> bool {
    let is_tiny = height_of_all(scene.size, pixels) > TINY * scene.size.y;
    is_tiny && scene.camera != CameraRule::Whole && scene.hero.is_some()
}

/// The height of a view of the whole world, world units.
fn height_of_all(world: Vec2, pixels: [u32; 2]) -> f32 {
    world.y.max(world.x * pixels[1] as f32 / pixels[0].max(1) as f32)
}

impl Camera {
    /// A camera for a world that spans (0, 0) to `world`.
    pub fn new(rule: CameraRule, world: Vec2) -> Camera {
        Camera { rule, world, center: None, cut: true }
    }

    /// Makes the view jump to the hero as soon as it appears, because its path there was not shown.
    pub fn cut(&mut self) {
        self.cut = true;
    }

    /// The view of this frame.
    pub fn view(&mut self, target: Target) -> View {
        let aspect = target.pixels[0] as f32 / target.pixels[1] as f32;
        match self.rule {
            CameraRule::Fit => self.fit(target, aspect),
            CameraRule::Whole => self.fit(Target { hero: None, ..target }, aspect),
            CameraRule::Follow { height } => self.follow(target, aspect, height),
        }
    }

    fn fit(&mut self, target: Target, aspect: f32) -> View {
        let needed = self.world * (1.0 + 2.0 * MARGIN);
        let (top, bottom) = (covered(target.top, target), covered(target.bottom, target));
        let height = (needed.y / (1.0 - top - bottom)).max(needed.x / aspect);
        if height <= needed.y * UPRIGHT || aspect >= 1.0 {
            let center = self.world * 0.5 + Vec2::new(0.0, 0.5 * (top - bottom) * height);
            return View { center, height, pixels: target.pixels };
        }
        // On a portrait phone, fitting the whole width would make everything tiny. With a hero to follow, the world is
        // as tall as the space above the thumbs allows.
        let mut view = match target.hero {
            Some(_) => self.walk(target, aspect, height.min(needed.y * UPRIGHT_HEIGHT)),
            None => View { center: self.world * 0.5, height, pixels: target.pixels },
        };
        let middle = UPRIGHT_MIDDLE.max(top + 0.5 * needed.y / view.height);
        view.center.y -= (0.5 - middle) * view.height;
        view
    }

    fn follow(&mut self, target: Target, aspect: f32, nominal: f32) -> View {
        let whole = height_of_all(self.world, target.pixels);
        let height = nominal.max(nominal * FOLLOW_WIDTH_MIN / aspect).min(whole);
        let mut view = self.walk(target, aspect, height);
        // At the ceiling, the view reaches beyond the world, so that the HUD does not cover the hero there.
        let room = covered(target.top, target) * height;
        let above = (view.center.y + 0.5 * height + room - self.world.y).clamp(0.0, room);
        let Some((hero, _)) = target.hero.filter(|_| aspect < 1.0) else {
            view.center.y += above;
            return view;
        };
        // Nor do the thumbs on the floor. A view that is as high as the world has no space for both at once.
        let room = THUMBS * height;
        let below = (room + 0.5 * height - view.center.y).clamp(0.0, room);
        let share = (hero.y / self.world.y).clamp(0.0, 1.0);
        view.center.y += above * share - below * (1.0 - share);
        view
    }

    /// A view of this height that follows the hero.
    fn walk(&mut self, target: Target, aspect: f32, height: f32) -> View {
        let half = Vec2::new(height * aspect, height) * 0.5;
        let last = self.center.unwrap_or(self.world * 0.5);
        let wanted = target.hero.map_or(last, |(at, speed)| at + speed * LOOK_AHEAD_S);
        let wanted = within(wanted, half, self.world);
        let jump = self.cut || (wanted - last).length() > height * 1.5;
        let share = if jump { 1.0 } else { caught_up(target.elapsed_s) };
        let center = within(last + (wanted - last) * share, half, self.world);
        if target.hero.is_some() {
            self.center = Some(center);
            self.cut = false;
        }
        View { center, height, pixels: target.pixels }
    }
}

/// The share of the picture's height that this many pixels of HUD cover. A HUD that covers more is not avoided.
fn covered(pixels: u32, target: Target) -> f32 {
    (pixels as f32 / target.pixels[1] as f32).min(0.25)
}

/// The share of the distance to the hero that the view covers in this many seconds. Each tick covers the same share of
/// the remaining distance.
fn caught_up(elapsed_s: f32) -> f32 {
    let left_a_tick = 1.0 - 1.0 / CAMERA_CATCH_UP_TICKS as f32;
    1.0 - left_a_tick.powf(elapsed_s * TICKS_PER_SECOND as f32)
}

/// Moves `center` so that a view of this half size stays inside the world. On an axis on which the view is larger than
/// the world, it is centred.
fn within(center: Vec2, half: Vec2, world: Vec2) -> Vec2 {
    let axis = |center: f32, half: f32, world: f32| {
        if half * 2.0 >= world { world * 0.5 } else { center.clamp(half, world - half) }
    };
    Vec2::new(axis(center.x, half.x, world.x), axis(center.y, half.y, world.y))
}

#[cfg(test)]
mod tests;
