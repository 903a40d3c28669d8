//! Limits on scenes, and the names that they may have.

/// Longest scene file, bytes.
pub const SCENE_BYTES_MAX: usize = 64 << 10;
/// Longest name of a scene, bytes.
pub const SCENE_NAME_BYTES_MAX: usize = 32;
/// Maximum number of players in a game.
pub const SEATS_MAX: usize = 512;
/// Maximum number of players in a game whose cameras follow them. Each of these players is sent different data, which
/// costs a server more.
pub const FOLLOWERS_MAX: u32 = 64;
/// Greatest width and height of a world or a body, world units.
pub const SIZE_MAX: f32 = 1.0e6;
/// Least width, height or radius of a body, world units.
pub const EXTENT_MIN: f32 = 1.0e-3;
/// Least mass of a body.
pub const MASS_MIN: f32 = 1.0e-6;
/// Greatest mass of a body.
pub const MASS_MAX: f32 = 1.0e6;
/// Greatest mass ratio with the conjugate solver.
pub const MASS_RATIO_MAX: f32 = 1.0e6;
/// Greatest speed of anything, units/s.
pub const SPEED_MAX: f32 = 1.0e4;
/// Greatest absolute value of each component of gravity, units/s^2.
pub const GRAVITY_MAX: f32 = 1000.0;
/// Greatest absolute value of the factor by which gravity acts on a body.
pub const GRAVITY_SCALE_MAX: f32 = 10.0;
/// Greatest absolute value of each component of the wind, units/s.
pub const WIND_MAX: f32 = 1000.0;
/// Least quantum of positions, world units.
pub const QUANTUM_MIN: f32 = 1.0 / 65_536.0;
/// Largest absolute coordinate that clients see, in quanta. Up to this value, an f32 represents integers exactly.
pub const QUANTA_MAX: i32 = 1 << 24;
/// Highest limit on bodies that a scene may set.
pub const BODIES_MAX: u32 = 20_000;
/// Highest limit on particles that a scene may set.
pub const PARTICLES_MAX: u32 = 20_000;
/// Highest limit on dye packs per player that a scene may set.
pub const PACKS_MAX: u32 = 64;
/// Maximum number of bodies in a layout.
pub const LAYOUT_COUNT_MAX: u32 = 4096;
/// Maximum number of entries in `springs`.
pub const SPRINGS_MAX: usize = 1024;
/// Maximum number of entries in `emitters`.
pub const EMITTERS_MAX: usize = 256;
/// Maximum number of tables in `recipes`, including presets in use.
pub const RECIPES_MAX: usize = 64;
/// Largest allowed product of the numbers of zones and bodies in a scene, which is the number of checks that zones make
/// in a tick.
pub const ZONE_LOOKS_MAX: usize = 262_144;
/// Largest number of ticks that a scene file may give.
pub(super) const TICKS_MAX: u32 = 1_000_000;

pub(super) const NAME_ALLOWED: &str = "1 to 32 lower-case letters, digits and dashes";

/// Returns whether a text is a valid name for a scene or recipe: 1 to 32 lower-case letters, digits and dashes.
pub fn is_name(text: &str) -> bool {
    let known = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
    (1..=SCENE_NAME_BYTES_MAX).contains(&text.len()) && text.bytes().all(known)
}
