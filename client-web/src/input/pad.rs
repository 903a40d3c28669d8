//! Gamepads in the browser's standard mapping. The state of a pad is turned into pressed buttons and an aim.

use crate::input::action::{Action, PAD};
use crate::input::stick;
use jostle_game::Buttons;
use jostle_sim::Vec2;

/// The number of buttons in the standard mapping.
pub const BUTTONS: u8 = 17;
/// The d-pad always steers, regardless of bindings.
const CROSS: [(u8, Buttons); 4] =
    [(12, Buttons::UP), (13, Buttons::DOWN), (14, Buttons::LEFT), (15, Buttons::RIGHT)];
/// Buttons that cannot be bound: the two stick buttons, which are easily pressed by mistake while steering, and the
/// system button.
const DEAD: [u8; 3] = [10, 11, 16];
/// The default dead zone as a percentage of a stick's range.
pub const DEAD_ZONE: u8 = 25;
/// The range of dead zones that can be chosen.
pub const DEAD_ZONES: [u8; 2] = [5, 60];

/// The raw state of a gamepad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PadState {
    /// One bit per button.
    pub buttons: u32,
    /// Left and right stick, from -1 to 1, y down.
    pub sticks: [Vec2; 2],
}

/// The actions, buttons and aim that result from a pad's state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PadInput {
    /// One bit per [`Action`].
    pub actions: u32,
    /// All game buttons that are pressed.
    pub buttons: Buttons,
    /// Direction of the right stick, y up, with a length of at most 1; zero while it rests.
    pub aim: Vec2,
}

/// The gamepad buttons that the player chose.
#[derive(Clone, Debug, PartialEq)]
pub struct PadBindings {
    /// The action of each button.
    actions: [Option<Action>; BUTTONS as usize],
    /// The dead zone as a percentage of a stick's range.
    pub dead_zone: u8,
}

impl Default for PadBindings {
    fn default() -> PadBindings {
        let mut actions = [None; BUTTONS as usize];
        for (button, action) in PAD {
            actions[usize::from(button)] = Some(action);
        }
        PadBindings { actions, dead_zone: DEAD_ZONE }
    }
}

impl PadBindings {
    /// Parses the output of [`PadBindings::text`]; anything invalid falls back to the defaults.
    pub fn parse(text: &str) -> PadBindings {
        let mut bindings = PadBindings::default();
        let Some((zone, entries)) = text.split_once(';') else { return bindings };
        bindings.dead_zone = zone.parse().unwrap_or(DEAD_ZONE);
        bindings.dead_zone = bindings.dead_zone.clamp(DEAD_ZONES[0], DEAD_ZONES[1]);
        for (button, id) in (0..BUTTONS).zip(entries.split(',')) {
            let action = Action::of_id(id).filter(|_| is_free(button));
            bindings.actions[usize::from(button)] = action;
        }
        bindings
    }

    /// Formats the bindings as a line for storage.
    pub fn text(&self) -> String {
        let ids = self.actions.iter().map(|action| action.map_or("", Action::id));
        format!("{};{}", self.dead_zone, ids.collect::<Vec<_>>().join(","))
    }

    /// The button of an action.
    pub fn button(&self, action: Action) -> Option<u8> {
        (0..BUTTONS).find(|button| self.actions[usize::from(*button)] == Some(action))
    }

    /// Gives an action this button. If another action had this button, the two actions swap buttons, and that action is
    /// returned.
    pub fn assign(&mut self, action: Action, button: u8) -> Option<Action> {
        if !is_free(button) {
            return None;
        }
        let former = self.button(action);
        let other = self.actions[usize::from(button)].replace(action);
        if let Some(former) = former {
            self.actions[usize::from(former)] = other;
        }
        // Assigning an action its current button changes nothing.
        if former == Some(button) {
            self.actions[usize::from(button)] = Some(action);
        }
        other.filter(|other| *other != action)
    }
}

/// Whether a button can be bound.
pub fn is_free(button: u8) -> bool {
    button < BUTTONS
        && !DEAD.contains(&button)
        && !CROSS.iter().any(|(crossed, _)| *crossed == button)
}

/// Interprets the state of a pad.
pub fn read(state: &PadState, bindings: &PadBindings) -> PadInput {
    let is_down = |button: u8| state.buttons >> button & 1 == 1;
    let zone = f32::from(bindings.dead_zone) / 100.0;
    let mut input = PadInput::default();
    let mut pressed = stick::sectors(beyond(state.sticks[0], zone)).0;
    for (_, steers) in CROSS.iter().filter(|(button, _)| is_down(*button)) {
        pressed |= steers.0;
    }
    for (button, action) in (0..BUTTONS).zip(bindings.actions) {
        if let Some(action) = action.filter(|_| is_down(button)) {
            input.actions |= 1 << action as u32;
            pressed |= action.buttons().0;
        }
    }
    input.buttons = Buttons(pressed);
    input.aim = beyond(state.sticks[1], zone) * Vec2::new(1.0, -1.0);
    input
}

/// A stick's offset measured from the edge of the dead zone, with a length of at most 1.
fn beyond(offset: Vec2, zone: f32) -> Vec2 {
    let length = offset.length();
    if !length.is_finite() || length <= zone {
        return Vec2::ZERO;
    }
    offset / length * ((length - zone) / (1.0 - zone)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pad(buttons: &[u8], left: Vec2, right: Vec2) -> PadState {
        PadState {
            buttons: buttons.iter().fold(0, |all, button| all | 1 << button),
            sticks: [left, right],
        }
    }

    fn both(a: Buttons, b: Buttons) -> Buttons {
        Buttons(a.0 | b.0)
    }

    #[test]
    fn the_left_stick_and_the_cross_steer() {
        let usual = PadBindings::default();
        let steers = |state: &PadState| read(state, &usual).buttons;
        assert_eq!(steers(&pad(&[], Vec2::new(0.2, -0.1), Vec2::ZERO)), Buttons::default());
        assert_eq!(steers(&pad(&[], Vec2::new(0.9, 0.1), Vec2::ZERO)), Buttons::RIGHT);
        let aslant = pad(&[], Vec2::new(-0.7, -0.7), Vec2::ZERO);
        assert_eq!(steers(&aslant), both(Buttons::LEFT, Buttons::UP));
        assert_eq!(
            steers(&pad(&[13, 15], Vec2::ZERO, Vec2::ZERO)),
            both(Buttons::DOWN, Buttons::RIGHT)
        );
    }

    #[test]
    fn the_right_stick_aims_from_the_edge_of_the_dead_zone_on() {
        let usual = PadBindings::default();
        let aim = |x, y| read(&pad(&[], Vec2::ZERO, Vec2::new(x, y)), &usual).aim;
        assert_eq!(aim(0.25, 0.0), Vec2::ZERO);
        assert!(aim(0.26, 0.0).x > 0.0 && aim(0.26, 0.0).x < 0.02);
        assert_eq!(aim(0.0, 1.0), Vec2::new(0.0, -1.0), "down on the pad is down in the world");
        assert!((aim(1.0, 1.0).length() - 1.0).abs() < 1e-6, "corners reach no further");
        assert_eq!(aim(f32::NAN, 0.0), Vec2::ZERO);
    }

    #[test]
    fn buttons_press_and_clicks_of_the_sticks_do_not() {
        let usual = PadBindings::default();
        let input = read(&pad(&[0, 7, 9], Vec2::ZERO, Vec2::ZERO), &usual);
        assert_eq!(input.buttons, both(Buttons::UP, Buttons::FIRE));
        assert_ne!(input.actions & 1 << Action::Again as u32, 0);
        assert_eq!(read(&pad(&[10, 11, 16], Vec2::ZERO, Vec2::ZERO), &usual), PadInput::default());
        let mut chosen = PadBindings::default();
        for dead in [10, 11, 12, 16, 17] {
            assert_eq!(chosen.assign(Action::Up, dead), None);
            assert_eq!(chosen, usual, "button {dead} is not to be had");
        }
    }

    #[test]
    fn a_button_that_is_taken_is_swapped() {
        let mut chosen = PadBindings::default();
        assert_eq!(chosen.assign(Action::Up, 7), Some(Action::Fire));
        assert_eq!((chosen.button(Action::Up), chosen.button(Action::Fire)), (Some(7), Some(0)));
        assert_eq!(chosen.assign(Action::Hero, 7), Some(Action::Up), "which had none to give");
        assert_eq!((chosen.button(Action::Hero), chosen.button(Action::Up)), (Some(7), None));
        assert_eq!(chosen.assign(Action::Hero, 7), None);
        assert_eq!(chosen.button(Action::Hero), Some(7), "the same again");
    }

    #[test]
    fn choices_are_remembered() {
        let mut chosen = PadBindings::default();
        chosen.assign(Action::Up, 7);
        chosen.dead_zone = 40;
        assert_eq!(PadBindings::parse(&chosen.text()), chosen);
        assert_eq!(PadBindings::parse("?"), PadBindings::default());
        let extreme = PadBindings::parse("99;,,,,,,,,,,up");
        assert_eq!((extreme.dead_zone, extreme.button(Action::Up)), (DEAD_ZONES[1], None));
    }
}
