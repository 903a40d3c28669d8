//! Touches on the canvas: the first finger in the stick's corner steers; another one aims with the tool that was armed
//! when it touched down.

use jostle_game::Buttons;
use jostle_sim::Vec2;

/// Fraction of the canvas's width that the stick uses.
const STICK_WIDTH: f32 = 0.45;
/// Fraction of the canvas's height, measured from the bottom, that the stick uses.
const STICK_HEIGHT: f32 = 0.6;

/// The role of a finger on the canvas.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Finger {
    Steers { pointer: i32, from: Vec2, at: Vec2 },
    Aims { pointer: i32, buttons: Buttons },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Touched {
    /// The thumb touched the stick at this position, CSS pixels.
    Grip(Vec2),
    /// The thumb on the stick moved to this offset from where it touched down, CSS pixels.
    Lean(Vec2),
    /// The stick was released.
    Loose,
    /// A tool is pressed or released at the finger's position.
    Aim(Buttons, bool),
    /// The aiming finger moved.
    Move,
    Nothing,
}

/// The fingers on the canvas: at most one steers and at most one aims.
#[derive(Debug, Default)]
pub struct Fingers {
    /// The tool that the next aiming finger uses.
    pub armed: Buttons,
    /// Whether the scene has a stick.
    pub steers: bool,
    down: Vec<Finger>,
}

impl Fingers {
    /// Creates a state without fingers. `steers` says whether there is a stick, and `armed` is the first aiming
    /// finger's tool.
    pub fn new(steers: bool, armed: Buttons) -> Fingers {
        Fingers { armed, steers, down: Vec::new() }
    }

    /// Handles a finger that touches down at this point on a canvas of this size (CSS pixels).
    pub fn down(&mut self, pointer: i32, at: Vec2, size: Vec2) -> Touched {
        let steering = self.down.iter().any(|f| matches!(f, Finger::Steers { .. }));
        let on_stick = at.x < size.x * STICK_WIDTH && at.y > size.y * (1.0 - STICK_HEIGHT);
        if self.steers && !steering && on_stick {
            self.down.push(Finger::Steers { pointer, from: at, at });
            return Touched::Grip(at);
        }
        if self.down.iter().any(|f| matches!(f, Finger::Aims { .. })) {
            return Touched::Nothing;
        }
        let buttons = self.armed;
        self.down.push(Finger::Aims { pointer, buttons });
        Touched::Aim(buttons, true)
    }

    pub fn moved(&mut self, pointer: i32, to: Vec2) -> Touched {
        for finger in &mut self.down {
            match finger {
                Finger::Steers { pointer: own, from, at } if *own == pointer => {
                    *at = to;
                    return Touched::Lean(to - *from);
                }
                Finger::Aims { pointer: own, .. } if *own == pointer => return Touched::Move,
                _ => {}
            }
        }
        Touched::Nothing
    }

    /// Where the thumb on the stick touched down, and its offset from there, CSS pixels.
    pub fn stick(&self) -> Option<(Vec2, Vec2)> {
        self.down.iter().find_map(|finger| match *finger {
            Finger::Steers { from, at, .. } => Some((from, at - from)),
            Finger::Aims { .. } => None,
        })
    }

    /// Handles a lifted finger by releasing the tool that it pressed, even if another tool has been armed since.
    pub fn up(&mut self, pointer: i32) -> Touched {
        let finger = self.finger(pointer);
        self.down.retain(|f| Some(*f) != finger);
        match finger {
            Some(Finger::Steers { .. }) => Touched::Loose,
            Some(Finger::Aims { buttons, .. }) => Touched::Aim(buttons, false),
            None => Touched::Nothing,
        }
    }

    pub fn release(&mut self) {
        self.down.clear();
    }

    fn finger(&self, wanted: i32) -> Option<Finger> {
        self.down.iter().copied().find(|finger| match finger {
            Finger::Steers { pointer, .. } | Finger::Aims { pointer, .. } => *pointer == wanted,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Vec2 = Vec2::new(400.0, 800.0);
    const CORNER: Vec2 = Vec2::new(60.0, 700.0);
    const WORLD: Vec2 = Vec2::new(300.0, 200.0);

    fn fingers() -> Fingers {
        Fingers { armed: Buttons::FIRE, steers: true, ..Fingers::default() }
    }

    #[test]
    fn a_finger_releases_what_it_pressed_though_another_tool_is_armed_by_then() {
        let mut fingers = fingers();
        assert_eq!(fingers.down(1, WORLD, SIZE), Touched::Aim(Buttons::FIRE, true));
        fingers.armed = Buttons::HOLD;
        assert_eq!(fingers.up(1), Touched::Aim(Buttons::FIRE, false));
        assert_eq!(fingers.down(1, WORLD, SIZE), Touched::Aim(Buttons::HOLD, true));
    }

    #[test]
    fn one_thumb_steers_and_one_finger_aims() {
        let mut fingers = fingers();
        assert_eq!(fingers.down(1, CORNER, SIZE), Touched::Grip(CORNER));
        let lean = Vec2::new(30.0, 0.0);
        assert_eq!(fingers.moved(1, CORNER + lean), Touched::Lean(lean));
        assert_eq!(fingers.down(2, CORNER, SIZE), Touched::Aim(Buttons::FIRE, true));
        assert_eq!(fingers.down(3, WORLD, SIZE), Touched::Nothing);
        assert_eq!(
            (fingers.moved(2, WORLD), fingers.moved(3, WORLD)),
            (Touched::Move, Touched::Nothing)
        );
        assert_eq!((fingers.up(3), fingers.up(1)), (Touched::Nothing, Touched::Loose));
    }

    #[test]
    fn without_a_stick_every_touch_aims() {
        let mut fingers = Fingers { steers: false, ..fingers() };
        assert_eq!(fingers.down(1, CORNER, SIZE), Touched::Aim(Buttons::FIRE, true));
        fingers.release();
        assert_eq!(fingers.up(1), Touched::Nothing);
    }
}
