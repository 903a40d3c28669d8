//! A player's input during a tick: keys and pointer.

use glam::Vec2;
use jostle_sim::particles::{dequantise, quantise};

/// A player's slot in a game, 0..[`SEATS_MAX`](crate::SEATS_MAX).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Seat(pub u16);

/// Keys and pointer buttons that are down, one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Buttons(pub u16);

impl Buttons {
    /// W or arrow up.
    pub const UP: Buttons = Buttons(1 << 0);
    /// A or arrow left.
    pub const LEFT: Buttons = Buttons(1 << 1);
    /// S or arrow down.
    pub const DOWN: Buttons = Buttons(1 << 2);
    /// D or arrow right.
    pub const RIGHT: Buttons = Buttons(1 << 3);
    /// Left or right pointer button: launch a pack or drag the selected body.
    pub const FIRE: Buttons = Buttons(1 << 4);
    /// Z: make a marble or a particle.
    pub const MAKE: Buttons = Buttons(1 << 5);
    /// X: hold the body under the pointer.
    pub const HOLD: Buttons = Buttons(1 << 6);
    /// C: shake all marbles.
    pub const AGITATE: Buttons = Buttons(1 << 7);
    /// V: remove all marbles.
    pub const CLEAR: Buttons = Buttons(1 << 8);
    /// H: select the hero.
    pub const PICK_HERO: Buttons = Buttons(1 << 9);
    /// M: select the minion.
    pub const PICK_MINION: Buttons = Buttons(1 << 10);
    /// P: select the platform.
    pub const PICK_PLATFORM: Buttons = Buttons(1 << 11);
    /// T: change to the next team.
    pub const TEAM: Buttons = Buttons(1 << 12);
    /// Return: start the next round once a round is over.
    pub const AGAIN: Buttons = Buttons(1 << 13);
    /// Buttons that even a stunned player may press.
    pub const OF_ROUND: Buttons = Buttons(Buttons::TEAM.0 | Buttons::AGAIN.0);
    /// All bits that have a meaning.
    pub const ALL: Buttons = Buttons((1 << 14) - 1);

    /// Returns whether all of `other` are down.
    pub fn contains(self, other: Buttons) -> bool {
        self.0 & other.0 == other.0
    }

    /// Returns 1, 0 or -1 for a pair of opposite keys.
    pub fn axis(self, positive: Buttons, negative: Buttons) -> f32 {
        f32::from(u8::from(self.contains(positive))) - f32::from(u8::from(self.contains(negative)))
    }
}

/// A player's input for one tick. It contains only known buttons, and the pointer is a multiple of [`POINTER_QUANTUM`].
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Input {
    buttons: Buttons,
    pointer: Option<Vec2>,
}

/// Resolution of pointers, world units. It is finer than anyone can point, yet compact to store.
pub const POINTER_QUANTUM: f32 = 1.0 / 16.0;
/// Largest absolute coordinate of a pointer, world units: 2^24 quanta.
pub const POINTER_MAX: f32 = 1_048_576.0;

impl Input {
    /// Creates an input, ignoring unknown buttons. The pointer is in world units and is rounded to multiples of
    /// [`POINTER_QUANTUM`]; `None` means that it is outside the view. A pointer that is not finite or lies beyond
    /// [`POINTER_MAX`] is ignored.
    pub fn new(buttons: Buttons, pointer: Option<Vec2>) -> Input {
        let usable =
            |pointer: &Vec2| pointer.x.abs() <= POINTER_MAX && pointer.y.abs() <= POINTER_MAX;
        let rounded = |pointer| dequantise(quantise(pointer, POINTER_QUANTUM), POINTER_QUANTUM);
        let pointer = pointer.filter(usable).map(rounded);
        Input { buttons: Buttons(buttons.0 & Buttons::ALL.0), pointer }
    }

    /// The buttons that are down.
    pub fn buttons(self) -> Buttons {
        self.buttons
    }

    /// The pointer, in world units.
    pub fn pointer(self) -> Option<Vec2> {
        self.pointer
    }

    /// Returns the same input with different buttons.
    #[must_use]
    pub fn with_buttons(self, buttons: Buttons) -> Input {
        Input::new(buttons, self.pointer)
    }
}
