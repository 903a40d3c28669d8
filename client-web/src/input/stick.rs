//! The thumb stick, which turns the thumb's offset from where it touched down into four directions.

use jostle_game::Buttons;
use jostle_sim::Vec2;

/// Radius of the stick's ring, CSS pixels.
pub const RADIUS_PX: f32 = 56.0;
/// Dead zone as a fraction of the radius.
const DEAD_ZONE: f32 = 0.28;
/// Sine of the angle from an axis above which the second direction is added: 30 degrees.
const SECTOR: f32 = 0.5;

/// The directions for a thumb `offset` pixels from the centre (y down).
pub fn directions(offset: Vec2) -> Buttons {
    if offset.length() < DEAD_ZONE * RADIUS_PX {
        return Buttons::default();
    }
    sectors(offset)
}

/// The directions for an offset of any length (y down); none for zero.
pub fn sectors(offset: Vec2) -> Buttons {
    let unit = offset.normalize_or_zero();
    let mut bits = 0;
    if unit.x > SECTOR {
        bits |= Buttons::RIGHT.0;
    }
    if unit.x < -SECTOR {
        bits |= Buttons::LEFT.0;
    }
    if unit.y > SECTOR {
        bits |= Buttons::DOWN.0;
    }
    if unit.y < -SECTOR {
        bits |= Buttons::UP.0;
    }
    Buttons(bits)
}

/// The offset of the knob, which is that of the thumb limited to the ring.
pub fn knob(offset: Vec2) -> Vec2 {
    let length = offset.length();
    if length > RADIUS_PX { offset * (RADIUS_PX / length) } else { offset }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resting_thumb_steers_nowhere() {
        assert_eq!(directions(Vec2::new(8.0, -8.0)), Buttons::default());
    }

    #[test]
    fn eight_directions() {
        let both = |a: Buttons, b: Buttons| Buttons(a.0 | b.0);
        assert_eq!(directions(Vec2::new(50.0, 5.0)), Buttons::RIGHT);
        assert_eq!(directions(Vec2::new(-40.0, -40.0)), both(Buttons::LEFT, Buttons::UP));
        assert_eq!(directions(Vec2::new(3.0, 90.0)), Buttons::DOWN);
        assert_eq!(directions(Vec2::new(40.0, 40.0)), both(Buttons::RIGHT, Buttons::DOWN));
    }

    #[test]
    fn the_knob_stays_on_the_ring() {
        assert_eq!(knob(Vec2::new(0.0, 400.0)), Vec2::new(0.0, RADIUS_PX));
        assert_eq!(knob(Vec2::new(3.0, 4.0)), Vec2::new(3.0, 4.0));
    }
}
