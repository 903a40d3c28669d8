//! The player makes voices of the browser's audio nodes. The nodes are the same in a context that is heard and in
//! one that is only computed ([`rendered`]), which tests use.

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

/// Seconds in which a layer gets to its loudest, and in which a voice that is replaced goes silent. Shorter ones
/// would click.
const ATTACK_S: f64 = 0.003;
const RELEASE_S: f64 = 0.012;
/// Share of its loudest that is left at the end of a layer.
const FADED: f32 = 0.002;
/// Seconds of noise, which is repeated.
const NOISE_S: f32 = 1.0;
/// Bands of noise are about as wide as their frequency is high.
const NOISE_Q: f32 = 1.1;
/// A context that does not run this long after it was woken waits for a click or key, milliseconds.
const WAKE_MS: f64 = 1000.0;
/// Sample rate of what is computed only.
const RENDERED_HZ: u32 = 44_100;

/// All nodes of a context.
struct Graph {
    context: BaseAudioContext,
    noise: AudioBuffer,
    compressor: DynamicsCompressorNode,
    volume: GainNode,
    slots: [Option<Playing>; VOICES_MAX],
}

/// The nodes of a voice that must be reached before it ends.
struct Playing {
    level: GainNode,
    sources: Vec<AudioScheduledSourceNode>,
}

impl Graph {
    /// Voices go through a compressor, which catches what many of them add up to, and then the volume.
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

    /// Starts a voice at a time of the context. Its nodes end by themselves.
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
        // Neither fails for a time that is not negative.
        let _ = self.level.gain().set_target_at_time(0.0, at_s, RELEASE_S / 4.0);
        for source in self.sources {
            let _ = source.stop_with_when(at_s + RELEASE_S);
        }
    }
}

/// The same noise in every browser.
fn noise(context: &BaseAudioContext) -> Result<AudioBuffer, JsValue> {
    let rate = context.sample_rate();
    let mut rng = Rng::new(1, 0);
    let samples: Vec<f32> = (0..(rate * NOISE_S) as u32).map(|_| rng.range(-1.0, 1.0)).collect();
    let buffer = context.create_buffer(1, samples.len() as u32, rate)?;
    buffer.copy_to_channel(&samples, 0)?;
    Ok(buffer)
}

/// The sound that is heard.
#[derive(Default)]
pub struct Player {
    heard: Option<(AudioContext, Graph)>,
    /// Voices started so far.
    pub started: u64,
    woken_ms: f64,
}

/// Why there is no sound.
pub enum Silence {
    /// The browser has no sound for pages.
    Missing,
    /// The browser waits for a click or key.
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

    /// Does what the page asks for.
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
                    // Fails only for a negative time.
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
        // If the browser does not allow it yet, the promise waits until it does.
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
        // A context that cannot rest is silent all the same.
        let _ = context.suspend();
    }

    fn start(&mut self, voices: &[Voice]) -> Result<(), Silence> {
        debug_assert!(voices.len() <= STARTS_A_FRAME_MAX);
        let Some((context, graph)) = &mut self.heard else { return Err(Silence::Blocked) };
        // Its time stands still: all voices would come at once later.
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
    /// An `OfflineAudioContext` with the method that `web-sys` lacks.
    #[wasm_bindgen(js_name = OfflineAudioContext)]
    type Interruptible;
    /// Interrupts the computation at a time.
    #[wasm_bindgen(method, catch)]
    fn suspend(this: &Interruptible, at_s: f64) -> Result<Promise, JsValue>;
}

/// Computes the sound of voices with their times in seconds, in order: a promise of an `AudioBuffer`.
pub fn rendered(voices: &[(f64, Voice)], seconds: u32, gain: f32) -> Result<Promise, JsValue> {
    let context = OfflineAudioContext::new_with_number_of_channels_and_length_and_sample_rate(
        2,
        seconds * RENDERED_HZ,
        RENDERED_HZ as f32,
    )?;
    let graph = Rc::new(RefCell::new(Graph::build(&context, gain)?));
    // Nodes that wait for their time cost some too: each second is scheduled when the computation gets there.
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
            // A voice that fails is missing in the result, which tests find.
            let _ = start();
            let _ = going_on.resume();
        });
        let interrupted = context.unchecked_ref::<Interruptible>().suspend(begin_s)?;
        let _ = interrupted.then(&go_on);
        go_on.forget();
    }
    context.start_rendering()
}
