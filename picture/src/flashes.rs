//! Counts the flashes of moving pictures, by the rule of WCAG 2.2, success criterion 2.3.1, which protects people with
//! photosensitive epilepsy: no more than three flashes in any second over a large part of the picture.
//!
//! A flash is a pair of opposing changes in relative luminance of at least a tenth of its maximum, where the darker
//! picture is below 0.8; or a pair of opposing changes to or from a saturated red. The rule concerns a quarter of any
//! 10 degrees of the visual field; here it is a quarter of the picture, which people see from close by.

use crate::{Headless, HeadlessError, Picture};
use jostle_client_web::replay::player::ReplayPlayer;
use jostle_client_web::view::draw::DrawList;
use jostle_sim::TICKS_PER_SECOND;

/// Maximum number of flashes in a second.
pub const FLASHES_MAX: u32 = 3;
/// The share of a picture that has to change for a flash to count.
const SHARE: f32 = 0.25;
/// Changes within this time count as simultaneous, seconds.
const TOGETHER_S: f32 = 0.1;
/// The change of each channel that counts: of relative luminance, and of redness.
const CHANGES: [f32; 2] = [0.1, 20.0];
/// Luminance above this counts as equal, so that only changes count whose darker picture is below 0.8.
const LUMINANCE_MAX: f32 = 0.9;
/// The size of the pictures of a replay, pixels.
const SIZE: [u32; 2] = [96, 54];
/// A colour with at least this share of red is saturated.
const SATURATED: f32 = 0.8;

/// Counts the flashes of consecutive pictures of the same size.
pub struct FlashMeter {
    /// How many frames a second and [`TOGETHER_S`] are.
    second: u32,
    together: u32,
    /// The number of the next frame.
    frame: u32,
    /// Luminance, then redness.
    channels: [Channel; 2],
    worst: Flashes,
}

/// The second with the most flashes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flashes {
    /// Number of flashes, each a pair of opposing changes.
    pub flashes: u32,
    /// The number of the last frame of this second, from 0.
    pub frame: u32,
}

/// One quantity in all pixels.
#[derive(Default)]
struct Channel {
    pixels: Vec<Swing>,
    /// The frames of the last second at which a large part of the picture turned up or down.
    turns: Vec<u32>,
    was_up: Option<bool>,
}

/// The course of a quantity in one pixel.
#[derive(Clone, Copy)]
struct Swing {
    /// The extremes since the last change that counts.
    low: f32,
    high: f32,
    /// The direction and the frame of that change.
    last: Option<(bool, u32)>,
}

impl FlashMeter {
    /// A meter for pictures that are shown at this rate per second.
    pub fn new(rate: f32) -> FlashMeter {
        FlashMeter {
            second: rate.round() as u32,
            together: (TOGETHER_S * rate).ceil() as u32,
            frame: 0,
            channels: Default::default(),
            worst: Flashes::default(),
        }
    }

    /// Adds the next picture.
    pub fn note(&mut self, picture: &Picture) {
        let frame = self.frame;
        self.frame += 1;
        for (channel, (change, value)) in
            self.channels.iter_mut().zip(CHANGES.into_iter().zip([luminance, redness]))
        {
            let pixels = picture.rgba.chunks_exact(4);
            let values = pixels.map(|pixel| value([0, 1, 2].map(|at| linear(pixel[at]))));
            channel.note(values, change, frame, self.together);
            channel.turns.retain(|&turn| frame - turn < self.second);
            let flashes = channel.turns.len() as u32 / 2;
            if flashes > self.worst.flashes {
                self.worst = Flashes { flashes, frame };
            }
        }
    }

    /// The second with the most flashes so far, the first of several.
    pub fn worst(&self) -> Flashes {
        self.worst
    }
}

/// Counts the flashes of a replay, every tick of which is drawn with 96 x 54 pixels. The frame of the result counts from
/// the replay's first tick.
pub fn of_replay(
    headless: &mut Headless,
    player: &mut ReplayPlayer,
) -> Result<Flashes, HeadlessError> {
    let mut meter = FlashMeter::new(TICKS_PER_SECOND as f32);
    let mut list = DrawList::new();
    for tick in player.first_tick()..=player.last_tick() {
        player.seek(tick);
        list.fill(&player.frame(player.still_view(SIZE, 0)));
        meter.note(&headless.picture(SIZE, &list)?);
    }
    Ok(meter.worst())
}

impl Channel {
    fn note(&mut self, values: impl Iterator<Item = f32>, change: f32, frame: u32, together: u32) {
        let mut changed = [0_u32; 2];
        for (index, value) in values.enumerate() {
            if index == self.pixels.len() {
                self.pixels.push(Swing { low: value, high: value, last: None });
            }
            let pixel = &mut self.pixels[index];
            pixel.note(value, change, frame);
            if let Some((is_up, _)) = pixel.last.filter(|&(_, at)| frame - at < together) {
                changed[usize::from(is_up)] += 1;
            }
        }
        for is_up in [false, true] {
            let share = changed[usize::from(is_up)] as f32 / self.pixels.len() as f32;
            if share > SHARE && self.was_up != Some(is_up) {
                self.was_up = Some(is_up);
                self.turns.push(frame);
            }
        }
    }
}

impl Swing {
    /// Follows the extremes, and notes a change away from one of them.
    fn note(&mut self, value: f32, change: f32, frame: u32) {
        let was_up = self.last.map(|last| last.0);
        self.low = self.low.min(value);
        self.high = self.high.max(value);
        let is_up = match was_up {
            // The way on in the same direction only moves the extreme.
            Some(true) if self.high - value < change => return,
            Some(false) if value - self.low < change => return,
            Some(was_up) => !was_up,
            None if self.high - self.low < change => return,
            None => value == self.high,
        };
        *self = Swing { low: value, high: value, last: Some((is_up, frame)) };
    }
}

/// The relative luminance of a linear colour.
fn luminance([r, g, b]: [f32; 3]) -> f32 {
    (0.2126 * r + 0.7152 * g + 0.0722 * b).min(LUMINANCE_MAX)
}

/// How red a saturated linear colour is, in the units of the rule; 0 for all others.
fn redness([r, g, b]: [f32; 3]) -> f32 {
    if r >= SATURATED * (r + g + b) { 320.0 * (r - g - b).max(0.0) } else { 0.0 }
}

/// The linear intensity of an sRGB channel, 0 to 1.
fn linear(channel: u8) -> f32 {
    let value = f32::from(channel) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests;
