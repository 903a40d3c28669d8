//! Decides which cues become voices. The mixer is a pure function of cues and time: it reads no clock and produces no
//! sound.

use super::cue::{Cue, Sound};
use super::patch;
use crate::view::frame::View;
use jostle_sim::math::ordered_bits;
use jostle_sim::{BodyId, Vec2};

/// Maximum number of simultaneous voices.
pub const VOICES_MAX: usize = 24;
/// Maximum number of simultaneous voices of one sound.
pub const VOICES_OF_SOUND_MAX: usize = 6;
/// Maximum number of voices that start in one frame.
pub const STARTS_A_FRAME_MAX: usize = 4;
/// Minimum time between sounds from one body, seconds.
pub const BODY_REST_S: f64 = 0.08;
/// Maximum number of cues queued for a frame; further ones are dropped.
pub const WAITING_MAX: usize = 128;

/// Width of a body that sounds at the default pitch, world units.
const SIZE_MIDDLE: f32 = 14.0;
/// Exponent with which pitch falls as size grows.
const SIZE_EXPONENT: f32 = 0.6;
/// The lowest and highest pitch, as multiples of the default.
const PITCHES: [f32; 2] = [0.45, 2.2];
/// Maximum relative pitch difference between bodies of the same size.
const DETUNE: f32 = 0.05;
/// Closing speed at which an impact reaches half its maximum loudness, units/s.
const SPEED_KNEE: f32 = 40.0;
/// A voice may be replaced by one of equal importance once it has faded to this share of the new one's gain. Voices
/// that kept cutting each other off would sound like a roar.
const GIVES_WAY: f32 = 0.5;
/// Minimum gain of a voice.
const GAIN_MIN: f32 = 0.01;
/// Share of the stereo width that is used, so that no sound comes from one side only.
const PAN_MAX: f32 = 0.75;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ear {
    /// Centre of the view, world units.
    pub center: Vec2,
    /// Half the width and height of the view, world units.
    pub half: Vec2,
}

impl Ear {
    /// A listener in front of a view.
    pub fn of(view: &View) -> Ear {
        let [width, height] = view.pixels.map(|pixels| pixels as f32);
        let half = Vec2::new(width, height) * (0.5 * view.unit_per_pixel());
        Ear { center: view.center, half }
    }

    /// The pan of a position, -1 (left) to 1 (right), and its attenuation, 0..=1, which is 1 within the view.
    fn hear(&self, at: Vec2) -> (f32, f32) {
        let share = (at - self.center) / self.half.max(Vec2::splat(f32::MIN_POSITIVE));
        let beyond = (share.abs().max_element() - 1.0).max(0.0);
        (share.x.clamp(-1.0, 1.0) * PAN_MAX, 1.0 / (1.0 + 3.0 * beyond))
    }
}

/// A sound that starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Voice {
    /// The slot, below [`VOICES_MAX`]. A voice that still occupies this slot ends immediately.
    pub slot: usize,
    /// The kind of sound.
    pub sound: Sound,
    /// Multiple of the default pitch.
    pub pitch: f32,
    /// Multiple of the default length.
    pub stretch: f32,
    /// Gain, 0..=1.
    pub gain: f32,
    /// -1 (left) to 1 (right).
    pub pan: f32,
}

impl Voice {
    /// Seconds until the voice has faded out.
    pub fn length_s(&self) -> f32 {
        patch::length_s(self.sound) * self.stretch
    }
}

#[derive(Clone, Copy, Debug)]
struct Running {
    sound: Sound,
    gain: f32,
    since_s: f64,
    until_s: f64,
}

impl Running {
    /// The approximate loudness at this time.
    fn level(&self, now_s: f64) -> f32 {
        let left = (self.until_s - now_s) / (self.until_s - self.since_s);
        self.gain * left.clamp(0.0, 1.0) as f32
    }
}

/// Decides which cues are heard, and how.
#[derive(Debug, Default)]
pub struct Mixer {
    running: [Option<Running>; VOICES_MAX],
    waiting: Vec<Cue>,
    /// Bodies that made a sound within the last [`BODY_REST_S`], and when they may sound again.
    resting: Vec<(BodyId, f64)>,
}

impl Mixer {
    /// Queues a cue for the next frame.
    pub fn hear(&mut self, cue: Cue) {
        if self.waiting.len() < WAITING_MAX {
            self.waiting.push(cue);
        }
    }

    /// The voices that start at `now_s`, chosen from the cues since the previous frame by importance, then by loudness.
    /// The rest are dropped, since playing them late would be worse.
    pub fn frame(&mut self, now_s: f64, ear: &Ear) -> Vec<Voice> {
        for slot in &mut self.running {
            slot.take_if(|running| running.until_s <= now_s);
        }
        self.resting.retain(|&(_, until_s)| until_s > now_s);
        let mut waiting = std::mem::take(&mut self.waiting);
        // Rank and loudness take 40 bits, and the queue is short.
        let keys = waiting.iter().zip(0u64..).map(|(cue, index)| {
            let gain = u64::from(ordered_bits(loudness(cue, ear)));
            let weight = u64::from(cue.sound.rank()) << 32 | gain;
            !weight << 24 | index
        });
        let mut order: Vec<u64> = keys.collect();
        order.sort_unstable();
        let mut voices = Vec::new();
        for key in order {
            if voices.len() == STARTS_A_FRAME_MAX {
                break;
            }
            voices.extend(self.start(&waiting[(key & 0xFF_FFFF) as usize], now_s, ear));
        }
        // Keeps the memory for the next frame.
        waiting.clear();
        self.waiting = waiting;
        voices
    }

    /// The number of voices sounding at this time.
    pub fn running(&self, now_s: f64) -> usize {
        self.running.iter().flatten().filter(|running| running.until_s > now_s).count()
    }

    fn start(&mut self, cue: &Cue, now_s: f64, ear: &Ear) -> Option<Voice> {
        let bodies = cue.bodies.into_iter().flatten();
        if bodies.clone().any(|body| self.resting.iter().any(|&(resting, _)| resting == body)) {
            return None;
        }
        let alike = self.running.iter().flatten().filter(|running| running.sound == cue.sound);
        // The total loudness of equal sounds grows much more slowly than their number, so a pile patters.
        let crowd = 1.0 + 0.8 * alike.count() as f32;
        let gain = loudness(cue, ear) / crowd.sqrt();
        if gain < GAIN_MIN {
            return None;
        }
        let slot = self.slot(cue.sound, gain, now_s)?;
        let pitch = pitch(cue);
        let pan = cue.at.map_or(0.0, |at| ear.hear(at).0);
        // Large bodies ring longer.
        let stretch = (1.0 / pitch).sqrt();
        let voice = Voice { slot, sound: cue.sound, pitch, stretch, gain, pan };
        let until_s = now_s + f64::from(voice.length_s());
        self.running[slot] = Some(Running { sound: cue.sound, gain, since_s: now_s, until_s });
        self.resting.extend(bodies.map(|body| (body, now_s + BODY_REST_S)));
        Some(voice)
    }

    /// The slot for a new voice: a free one, or that of the quietest voice that it may replace.
    fn slot(&self, sound: Sound, gain: f32, now_s: f64) -> Option<usize> {
        let alike = |running: &Running| running.sound == sound;
        if self.running.iter().flatten().filter(|running| alike(running)).count()
            >= VOICES_OF_SOUND_MAX
        {
            return self.quietest(alike, gain, now_s);
        }
        let free = self.running.iter().position(Option::is_none);
        free.or_else(|| {
            self.quietest(|running| running.sound.rank() < sound.rank(), f32::MAX, now_s)
        })
        .or_else(|| self.quietest(|running| running.sound.rank() == sound.rank(), gain, now_s))
    }

    /// The slot of the quietest voice that passes `may_end`, if a voice with this gain may replace it.
    fn quietest(&self, may_end: impl Fn(&Running) -> bool, gain: f32, now_s: f64) -> Option<usize> {
        let slots = self.running.iter().enumerate();
        let levels = slots.filter_map(|(slot, running)| {
            let running = running.as_ref().filter(|running| may_end(running))?;
            Some((slot, running.level(now_s)))
        });
        let (slot, level) = levels.min_by(|one, other| one.1.total_cmp(&other.1))?;
        (level < gain * GIVES_WAY).then_some(slot)
    }
}

/// The gain of a cue on its own. For impacts, it rises with speed and then levels off.
fn loudness(cue: &Cue, ear: &Ear) -> f32 {
    let heard = cue.at.map_or(1.0, |at| ear.hear(at).1);
    let size = (cue.size / SIZE_MIDDLE).clamp(0.1, 10.0);
    heard
        * match cue.sound {
            sound if sound.is_strike() => {
                let force = cue.speed / (cue.speed + SPEED_KNEE);
                (force * force.sqrt() * size.powf(0.35)).min(1.0)
            }
            Sound::Spawn => 0.45,
            Sound::Throw => 0.5,
            Sound::Burst => 0.8,
            Sound::Break => 0.7,
            _ => 0.9,
        }
}

/// The multiple of the default pitch: large bodies sound low, small ones high.
fn pitch(cue: &Cue) -> f32 {
    let [low, high] = PITCHES;
    let Some(body) = cue.bodies[0].filter(|_| cue.size > 0.0) else { return 1.0 };
    let sized = (SIZE_MIDDLE / cue.size).powf(SIZE_EXPONENT).clamp(low, high);
    // Knuth's multiplicative hash gives neighbouring indices different pitches.
    let spread = body.index.wrapping_mul(0x9E37_79B1) >> 16;
    sized * (1.0 + DETUNE * (spread as f32 / 32_768.0 - 1.0))
}

#[cfg(test)]
mod tests;
