//! Synthesises voices with the browser's audio nodes. The same nodes are used for playback and for offline rendering
//! ([`rendered`]), which tests use.

use super::mixer::{STARTS_A_FRAME_MAX, VOICES_MAX, Voice};
use super::patch::{SoundLayer, SoundSource, layers};
use super::task::SoundTask;
use crate::browser;
use jostle_sim::Rng;
use js_sys::Promise;
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::closure::Closure;
use wasm_bindgen::prelude::wasm_bindgen;
use wasm_bindgen::{JsCast, JsValue};
use web_sys::{
    AudioBuffer, AudioContext, AudioContextState, AudioNode, AudioParam, AudioScheduledSourceNode,
    BaseAudioContext, BiquadFilterType, DynamicsCompressorNode, GainNode, OfflineAudioContext,
    OscillatorType,
};

/// Attack time of a layer, and release time of a replaced voice, seconds. Shorter ones would click.
const ATTACK_S: f64 = 0.003;
const RELEASE_S: f64 = 0.012;
/// Share of the peak gain that remains at the end of a layer.
const FADED: f32 = 0.002;
/// Length of the looped noise, seconds.
const NOISE_S: f32 = 1.0;
/// Quality factor of the noise filter, which makes the bandwidth about as large as the frequency.
const NOISE_Q: f32 = 1.1;
/// Time after which a context that was resumed but does not run is considered blocked until a click or key press,
/// milliseconds.
const WAKE_MS: f64 = 1000.0;
/// Sample rate for offline rendering.
const RENDERED_HZ: u32 = 44_100;

/// All audio nodes of a context.
struct Graph {
    context: BaseAudioContext,
    noise: AudioBuffer,
    compressor: DynamicsCompressorNode,
    volume: GainNode,
    slots: [Option<Playing>; VOICES_MAX],
}

/// The nodes of a voice that are needed to end it early.
struct Playing {
    level: GainNode,
    sources: Vec<AudioScheduledSourceNode>,
}

impl Graph {
    /// Voices pass through a compressor, which limits the sum of many voices, and then through the volume control.
    fn build(context: &BaseAudioContext, gain: f32) -> Result<Graph, JsValue> {
        let compressor = context.create_dynamics_compressor()?;
        compressor.threshold().set_value(-20.0);
        compressor.knee().set_value(14.0);
        compressor.ratio().set_value(6.0);
        compressor.attack().set_value(0.003);
        compressor.release().set_value(0.16);
        let volume = context.create_gain()?;
        volume.gain().set_value(gain);
        compressor.connect_with_audio_node(&volume)?;
        volume.connect_with_audio_node(&context.destination())?;
        let noise = noise(context)?;
        let slots = [const { None }; VOICES_MAX];
        Ok(Graph { context: context.clone(), noise, compressor, volume, slots })
    }

    /// Starts a voice at this time on the context's clock. Its nodes stop by themselves.
    fn start(&mut self, voice: &Voice, at_s: f64) -> Result<(), JsValue> {
        if let Some(replaced) = self.slots[voice.slot].take() {
            replaced.end(at_s);
        }
        let level = self.context.create_gain()?;
        level.gain().set_value(voice.gain);
        let panner = self.context.create_stereo_panner()?;
        panner.pan().set_value(voice.pan);
        level.connect_with_audio_node(&panner)?;
        panner.connect_with_audio_node(&self.compressor)?;
        let layers = layers(voice.sound).iter();
        let sources = layers.map(|layer| self.layer(layer, voice, at_s, &level));
        let sources = sources.collect::<Result<_, _>>()?;
        self.slots[voice.slot] = Some(Playing { level, sources });
        Ok(())
    }

    fn layer(
        &self,
        layer: &SoundLayer,
        voice: &Voice,
        at_s: f64,
        into: &AudioNode,
    ) -> Result<AudioScheduledSourceNode, JsValue> {
        let at_s = at_s + f64::from(layer.start_s * voice.stretch);
        let end_s = at_s + f64::from(layer.length_s * voice.stretch);
        let glide = |frequency: &AudioParam| {
            frequency.set_value_at_time(layer.from_hz * voice.pitch, at_s)?;
            frequency.exponential_ramp_to_value_at_time(layer.to_hz * voice.pitch, end_s)
        };
        let envelope = self.context.create_gain()?;
        let gain = envelope.gain();
        gain.set_value_at_time(0.0, at_s)?;
        gain.linear_ramp_to_value_at_time(layer.gain, at_s + ATTACK_S)?;
        gain.exponential_ramp_to_value_at_time(layer.gain * FADED, end_s)?;
        envelope.connect_with_audio_node(into)?;
        let source: AudioScheduledSourceNode = if layer.source == SoundSource::Noise {
            let source = self.context.create_buffer_source()?;
            source.set_buffer(Some(&self.noise));
            source.set_loop(true);
            let band = self.context.create_biquad_filter()?;
            band.set_type(BiquadFilterType::Bandpass);
            band.q().set_value(NOISE_Q);
            glide(&band.frequency())?;
            source.connect_with_audio_node(&band)?;
            band.connect_with_audio_node(&envelope)?;
            source.into()
        } else {
            let source = self.context.create_oscillator()?;
            source.set_type(match layer.source {
                SoundSource::Triangle => OscillatorType::Triangle,
                _ => OscillatorType::Sine,
            });
            glide(&source.frequency())?;
            source.connect_with_audio_node(&envelope)?;
            source.into()
        };
        source.start_with_when(at_s)?;
        source.stop_with_when(end_s)?;
        Ok(source)
    }
}

impl Playing {
    fn end(self, at_s: f64) {
        // These calls fail only for a negative time.
        let _ = self.level.gain().set_target_at_time(0.0, at_s, RELEASE_S / 4.0);
        for source in self.sources {
            let _ = source.stop_with_when(at_s + RELEASE_S);
        }
    }
}

/// White noise that is identical in every browser.
fn noise(context: &BaseAudioContext) -> Result<AudioBuffer, JsValue> {
    let rate = context.sample_rate();
    let mut rng = Rng::new(1, 0);
    let samples: Vec<f32> = (0..(rate * NOISE_S) as u32).map(|_| rng.range(-1.0, 1.0)).collect();
    let buffer = context.create_buffer(1, samples.len() as u32, rate)?;
    buffer.copy_to_channel(&samples, 0)?;
    Ok(buffer)
}

#[derive(Default)]
pub struct Player {
    heard: Option<(AudioContext, Graph)>,
    /// Voices started so far.
    pub started: u64,
    woken_ms: f64,
}

/// Why sound cannot be played.
pub enum Silence {
    /// The browser does not support sound.
    Missing,
    /// The browser blocks sound until a click or key press.
    Blocked,
}

impl Player {
    /// State of the context: `none`, `suspended` or `running`.
    pub fn state(&self) -> &'static str {
        match self.heard.as_ref().map(|(context, _)| context.state()) {
            None => "none",
            Some(AudioContextState::Running) => "running",
            Some(_) => "suspended",
        }
    }

    /// Performs a task for the page.
    pub fn carry_out(&mut self, task: &SoundTask) -> Result<(), Silence> {
        match task {
            SoundTask::Wake(gain) => self.wake(*gain).map_err(|_| Silence::Missing),
            SoundTask::Rest => {
                self.rest();
                Ok(())
            }
            SoundTask::Gain(gain) => {
                if let Some((context, graph)) = &self.heard {
                    let now_s = context.current_time();
                    // This fails only for a negative time.
                    let _ = graph.volume.gain().set_target_at_time(*gain, now_s, RELEASE_S);
                }
                Ok(())
            }
            SoundTask::Start(voices) => self.start(voices),
        }
    }

    fn wake(&mut self, gain: f32) -> Result<(), JsValue> {
        self.woken_ms = browser::now_ms();
        let (context, graph) = match &self.heard {
            Some(heard) => heard,
            None => {
                let context = AudioContext::new()?;
                let graph = Graph::build(&context, gain)?;
                self.heard.insert((context, graph))
            }
        };
        graph.volume.gain().set_target_at_time(gain, context.current_time(), RELEASE_S)?;
        // If the browser does not allow sound yet, the promise waits until it does.
        context.resume().map(drop)
    }

    fn rest(&mut self) {
        let Some((context, graph)) = &mut self.heard else { return };
        let now_s = context.current_time();
        for slot in &mut graph.slots {
            if let Some(playing) = slot.take() {
                playing.end(now_s);
            }
        }
        // A context that cannot be suspended is silent anyway.
        let _ = context.suspend();
    }

    fn start(&mut self, voices: &[Voice]) -> Result<(), Silence> {
        debug_assert!(voices.len() <= STARTS_A_FRAME_MAX);
        let Some((context, graph)) = &mut self.heard else { return Err(Silence::Blocked) };
        // The context's clock is stopped, so all voices would sound at once when it resumes.
        if context.state() != AudioContextState::Running {
            let waits = browser::now_ms() - self.woken_ms > WAKE_MS;
            return if waits { Err(Silence::Blocked) } else { Ok(()) };
        }
        for voice in voices {
            graph.start(voice, context.current_time()).map_err(|_| Silence::Missing)?;
            self.started += 1;
        }
        Ok(())
    }
}

#[wasm_bindgen]
extern "C" {
    /// An `OfflineAudioContext` with a method missing from `web-sys`.
    #[wasm_bindgen(js_name = OfflineAudioContext)]
    type Interruptible;
    /// Suspends rendering at this time.
    #[wasm_bindgen(method, catch)]
    fn suspend(this: &Interruptible, at_s: f64) -> Result<Promise, JsValue>;
}

/// Renders voices, sorted by their start times in seconds, offline. Returns a promise of an `AudioBuffer`.
pub fn rendered(voices: &[(f64, Voice)], seconds: u32, gain: f32) -> Result<Promise, JsValue> {
    let context = OfflineAudioContext::new_with_number_of_channels_and_length_and_sample_rate(
        2,
        seconds * RENDERED_HZ,
        RENDERED_HZ as f32,
    )?;
    let graph = Rc::new(RefCell::new(Graph::build(&context, gain)?));
    // Waiting nodes also cost time, so each second is scheduled only when rendering reaches it.
    for second in voices.chunk_by(|one, other| one.0.floor() == other.0.floor()) {
        let (second, graph) = (second.to_vec(), Rc::clone(&graph));
        let begin_s = second[0].0.floor();
        let start = move || {
            let mut graph = graph.borrow_mut();
            second.iter().try_for_each(|(at_s, voice)| graph.start(voice, *at_s))
        };
        if begin_s == 0.0 {
            start()?;
            continue;
        }
        let going_on = context.clone();
        let go_on = Closure::<dyn FnMut(JsValue)>::new(move |_| {
            // A voice that fails is missing from the result, which tests detect.
            let _ = start();
            let _ = going_on.resume();
        });
        let interrupted = context.unchecked_ref::<Interruptible>().suspend(begin_s)?;
        let _ = interrupted.then(&go_on);
        go_on.forget();
    }
    context.start_rendering()
}
