//! Patches: the layers of tone and noise that make up each sound.

use super::cue::Sound;

/// The waveform of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoundSource {
    Sine,
    /// A tone with soft overtones.
    Triangle,
    /// Noise in a band around a frequency.
    Noise,
}

/// A tone or a noise band that glides between two frequencies while it fades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoundLayer {
    pub source: SoundSource,
    /// Frequency at the start, Hz.
    pub from_hz: f32,
    /// Frequency at the end, Hz.
    pub to_hz: f32,
    /// Peak gain, 0..=1.
    pub gain: f32,
    /// Start relative to that of the sound, seconds.
    pub start_s: f32,
    /// Time until the layer has faded out, seconds.
    pub length_s: f32,
}

const fn layer(
    source: SoundSource,
    from_hz: f32,
    to_hz: f32,
    gain: f32,
    length_s: f32,
) -> SoundLayer {
    SoundLayer { source, from_hz, to_hz, gain, start_s: 0.0, length_s }
}

const fn sine(from_hz: f32, to_hz: f32, gain: f32, length_s: f32) -> SoundLayer {
    layer(SoundSource::Sine, from_hz, to_hz, gain, length_s)
}

const fn noise(from_hz: f32, to_hz: f32, gain: f32, length_s: f32) -> SoundLayer {
    layer(SoundSource::Noise, from_hz, to_hz, gain, length_s)
}

const fn later(start_s: f32, layer: SoundLayer) -> SoundLayer {
    SoundLayer { start_s, ..layer }
}

/// A struck wooden bar, as on a marimba.
const fn bar(start_s: f32, hz: f32, gain: f32, length_s: f32) -> SoundLayer {
    SoundLayer { start_s, ..layer(SoundSource::Triangle, hz, hz, gain, length_s) }
}

/// A soft tock: a short tone that falls slightly, a dull overtone, and the knock itself.
const WOOD: [SoundLayer; 3] = [
    sine(345.0, 310.0, 0.62, 0.16),
    sine(880.0, 860.0, 0.16, 0.06),
    noise(1500.0, 900.0, 0.5, 0.025),
];
/// A bounce: a low tone that falls by more than half an octave.
const RUBBER: [SoundLayer; 2] = [sine(235.0, 150.0, 0.75, 0.18), noise(520.0, 300.0, 0.4, 0.03)];
/// A click of two high tones.
const GLASS: [SoundLayer; 2] = [sine(1050.0, 1040.0, 0.32, 0.1), sine(2470.0, 2460.0, 0.1, 0.045)];
const THROW: [SoundLayer; 2] = [noise(480.0, 1500.0, 0.6, 0.17), sine(250.0, 430.0, 0.14, 0.12)];
const BURST: [SoundLayer; 3] = [
    noise(1900.0, 260.0, 0.9, 0.34),
    sine(210.0, 62.0, 0.5, 0.24),
    later(0.03, noise(2600.0, 1200.0, 0.25, 0.12)),
];
const SPAWN: [SoundLayer; 1] = [sine(330.0, 640.0, 0.3, 0.11)];
const BREAK: [SoundLayer; 4] = [
    noise(1700.0, 500.0, 0.8, 0.26),
    sine(420.0, 370.0, 0.4, 0.1),
    later(0.05, sine(530.0, 480.0, 0.32, 0.1)),
    later(0.11, sine(300.0, 270.0, 0.34, 0.14)),
];
/// A rising C major chord.
const GOAL: [SoundLayer; 4] = [
    bar(0.0, 523.25, 0.3, 0.35),
    bar(0.09, 659.25, 0.3, 0.35),
    bar(0.18, 783.99, 0.3, 0.4),
    bar(0.27, 1046.5, 0.32, 0.7),
];
/// Two notes that slide down.
const OUT: [SoundLayer; 2] =
    [sine(392.0, 330.0, 0.34, 0.2), later(0.16, sine(294.0, 196.0, 0.34, 0.4))];
/// A quick step up.
const LEAD: [SoundLayer; 2] = [bar(0.0, 587.33, 0.24, 0.2), bar(0.08, 880.0, 0.26, 0.4)];
const LATE: [SoundLayer; 1] = [bar(0.0, 493.88, 0.24, 0.12)];
const COUNT: [SoundLayer; 2] = [bar(0.0, 392.0, 0.36, 0.22), noise(1200.0, 900.0, 0.2, 0.02)];
const GO: [SoundLayer; 2] = [bar(0.0, 784.0, 0.34, 0.5), bar(0.0, 587.33, 0.2, 0.5)];
/// The same chord from the fifth below to the fifth above, which rings on.
const WON: [SoundLayer; 4] = [
    bar(0.0, 392.0, 0.3, 0.4),
    bar(0.13, 523.25, 0.3, 0.4),
    bar(0.26, 659.25, 0.3, 0.5),
    bar(0.42, 783.99, 0.34, 1.1),
];
const LOST: [SoundLayer; 3] =
    [bar(0.0, 329.63, 0.3, 0.4), bar(0.18, 293.66, 0.3, 0.4), bar(0.36, 261.63, 0.34, 0.8)];

/// The layers of a sound at its default pitch.
pub fn layers(sound: Sound) -> &'static [SoundLayer] {
    match sound {
        Sound::Wood => &WOOD,
        Sound::Rubber => &RUBBER,
        Sound::Glass => &GLASS,
        Sound::Throw => &THROW,
        Sound::Burst => &BURST,
        Sound::Spawn => &SPAWN,
        Sound::Break => &BREAK,
        Sound::Goal => &GOAL,
        Sound::Out => &OUT,
        Sound::Lead => &LEAD,
        Sound::Late => &LATE,
        Sound::Count => &COUNT,
        Sound::Go => &GO,
        Sound::Won => &WON,
        Sound::Lost => &LOST,
    }
}

/// The length of a sound at its default pitch, seconds.
pub fn length_s(sound: Sound) -> f32 {
    layers(sound).iter().map(|layer| layer.start_s + layer.length_s).fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_sounds_are_soft_short_and_within_hearing() {
        for sound in Sound::ALL {
            assert!((0.05..2.0).contains(&length_s(sound)), "{sound:?}");
            for layer in layers(sound) {
                assert!(layer.from_hz.min(layer.to_hz) > 50.0, "{sound:?}");
                assert!(layer.from_hz.max(layer.to_hz) < 3000.0, "{sound:?} is shrill");
                assert!(layer.gain > 0.0 && layer.length_s > 0.0, "{sound:?}");
            }
        }
    }

    #[test]
    fn bodies_of_rubber_are_lower_than_those_of_wood_and_glass() {
        let pitch = |sound| layers(sound)[0].from_hz;
        assert!(pitch(Sound::Rubber) < pitch(Sound::Wood));
        assert!(pitch(Sound::Wood) < pitch(Sound::Glass));
    }
}
