//! Particle recipes that every scene may use by name.

use glam::Vec2;
use jostle_sim::Recipe;

/// Recipes that every scene may use by name.
pub fn presets() -> Vec<Recipe> {
    vec![fire(), ember(), torch(), explosion(), spark(), fountain()]
}

/// The chapter's recipe (A3.18): discs that flare up, turn pink and sink (A3.22).
pub(super) fn fire() -> Recipe {
    Recipe {
        name: "fire".into(),
        life_ticks: [30, 230],
        color_start: [1.0, 0.0, 0.0, 1.0],
        color_end: [[3.5, 0.4, 0.3, 0.6], [4.5, 0.5, 0.4, 0.6]],
        size: [5.5, 6.0],
        size_factor: 0.98,
        velocity: [Vec2::new(-10.0, 0.0), Vec2::new(10.0, 10.0)],
        round: false,
        acceleration: Vec2::new(0.0, -50.0),
        drag: 0.95,
    }
}

/// Glowing flakes that drift upwards for a long time.
fn ember() -> Recipe {
    Recipe {
        name: "ember".into(),
        life_ticks: [60, 160],
        color_start: [1.0, 0.6, 0.2, 1.0],
        color_end: [[0.5, 0.05, 0.0, 0.0], [0.8, 0.12, 0.0, 0.0]],
        size: [1.2, 2.2],
        size_factor: 0.995,
        velocity: [Vec2::new(-5.0, 4.0), Vec2::new(5.0, 16.0)],
        round: true,
        acceleration: Vec2::new(0.0, 9.0),
        drag: 0.98,
    }
}

/// A flame that burns upwards.
fn torch() -> Recipe {
    Recipe {
        name: "torch".into(),
        life_ticks: [26, 62],
        color_start: [0.9, 0.4, 0.12, 0.8],
        color_end: [[0.8, 0.05, 0.0, 0.0], [1.0, 0.1, 0.05, 0.0]],
        size: [5.0, 7.5],
        size_factor: 0.96,
        velocity: [Vec2::new(-5.0, 8.0), Vec2::new(5.0, 22.0)],
        round: false,
        acceleration: Vec2::new(0.0, 24.0),
        drag: 0.96,
    }
}

/// A dye pack's burst, flung evenly to all sides.
fn explosion() -> Recipe {
    Recipe {
        name: "explosion".into(),
        life_ticks: [30, 110],
        color_start: [1.0, 0.45, 0.1, 1.0],
        color_end: [[1.6, 0.1, 0.05, 0.0], [2.4, 0.3, 0.1, 0.0]],
        size: [4.0, 6.5],
        size_factor: 0.97,
        velocity: [Vec2::new(-60.0, -45.0), Vec2::new(60.0, 70.0)],
        round: true,
        acceleration: Vec2::new(0.0, -40.0),
        drag: 0.95,
    }
}

/// Small, fast and soon gone.
fn spark() -> Recipe {
    Recipe {
        name: "spark".into(),
        life_ticks: [10, 34],
        color_start: [1.5, 1.3, 0.8, 1.0],
        color_end: [[1.0, 0.3, 0.0, 0.0], [1.2, 0.5, 0.1, 0.0]],
        size: [1.0, 1.8],
        size_factor: 0.97,
        velocity: [Vec2::new(-50.0, -20.0), Vec2::new(50.0, 60.0)],
        round: true,
        acceleration: Vec2::new(0.0, -80.0),
        drag: 0.98,
    }
}

/// A cool jet that rises and falls back.
fn fountain() -> Recipe {
    Recipe {
        name: "fountain".into(),
        life_ticks: [70, 110],
        color_start: [0.25, 0.6, 1.0, 0.7],
        color_end: [[0.05, 0.2, 0.7, 0.0], [0.1, 0.4, 0.9, 0.0]],
        size: [2.0, 3.4],
        size_factor: 0.995,
        velocity: [Vec2::new(-8.0, 50.0), Vec2::new(8.0, 66.0)],
        round: false,
        acceleration: Vec2::new(0.0, -50.0),
        drag: 0.995,
    }
}
