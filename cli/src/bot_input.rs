//! The input of bots, which use mouse and keyboard like a person, but never pause. The same seed and index produce the
//! same input, bit for bit.

use jostle_game::{Buttons, Input};
use jostle_sim::Rng;
use jostle_sim::Vec2;

/// Maximum tremor of the hand per tick, world units: a pixel or two on the page.
const TREMOR: f32 = 0.06;
/// The fraction of the tremor that carries over to the next tick.
const TREMOR_KEPT: f32 = 0.8;

/// One bot's pointer and keys.
pub struct BotInput {
    rng: Rng,
    size: Vec2,
    reach: Reach,
    tremor: Vec2,
    steer: HeldButtons,
    act: HeldButtons,
}

/// Buttons that stay pressed for a few more ticks.
#[derive(Clone, Copy, Default)]
struct HeldButtons {
    buttons: u16,
    ticks: u32,
}

/// A movement of the pointer. Like a hand, it speeds up and then slows down.
#[derive(Clone, Copy)]
struct Reach {
    from: Vec2,
    to: Vec2,
    /// Ticks since the movement began, and the movement's length in ticks.
    tick: u32,
    ticks: u32,
}

impl Reach {
    /// The current position, on the minimum-jerk path 10 s^3 - 15 s^4 + 6 s^5 (Flash and Hogan, 1985).
    fn position(&self) -> Vec2 {
        let s = self.tick as f32 / self.ticks as f32;
        let share = s * s * s * (10.0 + s * (6.0 * s - 15.0));
        self.from + (self.to - self.from) * share
    }
}

impl BotInput {
    /// Creates bot `index` in a world of this size.
    pub fn new(seed: u64, index: u32, size: Vec2) -> BotInput {
        let rng = Rng::new(seed, index.into());
        let middle = size * 0.5;
        let reach = Reach { from: middle, to: middle, tick: 1, ticks: 1 };
        let (steer, act) = (HeldButtons::default(), HeldButtons::default());
        BotInput { rng, size, reach, tremor: Vec2::ZERO, steer, act }
    }

    /// The buttons and pointer for the next tick.
    pub fn next_input(&mut self) -> Input {
        self.point();
        if self.steer.ticks == 0 {
            self.steer = self.choose_direction();
        }
        if self.act.ticks == 0 {
            self.act = self.choose_act();
        }
        self.steer.ticks -= 1;
        self.act.ticks -= 1;
        let position = self.reach.position() + self.tremor;
        let pointer = position.clamp(Vec2::ZERO, self.size);
        Input::new(Buttons(self.steer.buttons | self.act.buttons), Some(pointer))
    }

    fn point(&mut self) {
        if self.reach.tick >= self.reach.ticks {
            let from = self.reach.to;
            let to = Vec2::new(self.rng.unit() * self.size.x, self.rng.unit() * self.size.y);
            self.reach = Reach { from, to, tick: 0, ticks: 20 + self.rng.below(50) };
        }
        self.reach.tick += 1;
        let shake = Vec2::new(self.rng.range(-TREMOR, TREMOR), self.rng.range(-TREMOR, TREMOR));
        self.tremor = self.tremor * TREMOR_KEPT + shake;
    }

    /// Chooses a direction, or none, and how long to hold it.
    fn choose_direction(&mut self) -> HeldButtons {
        let none = Buttons::default();
        let sideways = [Buttons::LEFT, Buttons::RIGHT, none][self.rng.below(3) as usize];
        let upright = [Buttons::UP, Buttons::DOWN, none][self.rng.below(3) as usize];
        HeldButtons { buttons: sideways.0 | upright.0, ticks: 15 + self.rng.below(60) }
    }

    /// Clicks are common, tools less so, and clearing the whole room is rare.
    fn choose_act(&mut self) -> HeldButtons {
        let (button, ticks) = match self.rng.below(512) {
            0..=149 => (Buttons::FIRE, 4 + self.rng.below(6)),
            150..=179 => (Buttons::FIRE, 20 + self.rng.below(40)),
            180..=229 => (Buttons::MAKE, 2 + self.rng.below(20)),
            230..=289 => (Buttons::HOLD, 15 + self.rng.below(50)),
            290..=299 => (Buttons::AGITATE, 5 + self.rng.below(20)),
            300 => (Buttons::CLEAR, 2),
            _ => (Buttons::default(), 5 + self.rng.below(30)),
        };
        HeldButtons { buttons: button.0, ticks }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn play(seed: u64, index: u32) -> Vec<Input> {
        let mut input = BotInput::new(seed, index, Vec2::new(180.0, 90.0));
        (0..60_000).map(|_| input.next_input()).collect()
    }

    #[test]
    fn hands_are_never_still_and_use_everything() {
        let inputs = play(1, 0);
        let moved = inputs.windows(2).filter(|pair| pair[0].pointer() != pair[1].pointer()).count();
        assert!(moved * 10 > inputs.len() * 9, "{moved}");
        let used = inputs.iter().fold(0, |used, input| used | input.buttons().0);
        assert_eq!(used, (1 << 9) - 1);
        let clears = inputs.windows(2).filter(|pair| {
            !pair[0].buttons().contains(Buttons::CLEAR)
                && pair[1].buttons().contains(Buttons::CLEAR)
        });
        assert!(clears.count() < 30, "seldom");
        let inside = |pointer: Vec2| pointer.x >= 0.0 && pointer.x <= 180.0 && pointer.y <= 90.0;
        assert!(inputs.iter().all(|input| input.pointer().is_some_and(inside)));
    }

    #[test]
    fn seed_and_index_say_it_all() {
        assert!(play(1, 0) == play(1, 0));
        assert!(play(1, 0) != play(1, 1) && play(1, 0) != play(2, 0));
    }
}
