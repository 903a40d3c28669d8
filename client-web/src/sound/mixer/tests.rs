use super::*;

const EAR: Ear = Ear { center: Vec2::new(100.0, 50.0), half: Vec2::new(100.0, 50.0) };

fn body(index: u32) -> BodyId {
    BodyId { index, generation: 0 }
}

fn strike(index: u32, x: f32, size: f32, speed: f32) -> Cue {
    let cue = Cue::of_body(Sound::Wood, Vec2::new(x, 50.0), size, body(index));
    Cue { speed, ..cue }
}

fn of(sound: Sound, index: u32) -> Cue {
    Cue { speed: 60.0, ..Cue::of_body(sound, Vec2::new(100.0, 50.0), 14.0, body(index)) }
}

/// The voices for cues that are all reported in one frame.
fn frame(mixer: &mut Mixer, now_s: f64, cues: impl IntoIterator<Item = Cue>) -> Vec<Voice> {
    cues.into_iter().for_each(|cue| mixer.hear(cue));
    mixer.frame(now_s, &EAR)
}

fn only(cue: Cue) -> Voice {
    let voices = frame(&mut Mixer::default(), 0.0, [cue]);
    assert_eq!(voices.len(), 1);
    voices[0]
}

#[test]
fn at_most_four_voices_begin_in_a_frame_the_loudest_ones() {
    let mut mixer = Mixer::default();
    let cues = (0..20).map(|index| strike(index, 100.0, 14.0, 10.0 + index as f32));
    let voices = frame(&mut mixer, 0.0, cues);
    assert_eq!(voices.len(), STARTS_A_FRAME_MAX);
    let alone = |speed| only(strike(19, 100.0, 14.0, speed)).gain;
    assert_eq!(voices[0].gain, alone(29.0));
    assert!(voices.windows(2).all(|pair| pair[0].gain > pair[1].gain));
    assert_eq!(frame(&mut mixer, 0.016, []), [], "the rest is never heard");
}

#[test]
fn at_most_six_voices_of_a_sound_run_and_a_louder_one_replaces_the_quietest() {
    let mut mixer = Mixer::default();
    let mut slots = Vec::new();
    for index in 0..6 {
        let voices = frame(&mut mixer, 0.0, [strike(index, 100.0, 14.0, 40.0 + index as f32)]);
        slots.push(voices[0].slot);
    }
    slots.sort_unstable();
    assert_eq!(slots, [0, 1, 2, 3, 4, 5]);
    assert_eq!(frame(&mut mixer, 0.0, [strike(7, 100.0, 14.0, 15.0)]), [], "too quiet");
    let loud = frame(&mut mixer, 0.0, [strike(8, 100.0, 60.0, 400.0)]);
    assert_eq!(loud.len(), 1);
    // Each voice started when more voices were already running than before, so the last one is the quietest.
    assert_eq!(loud[0].slot, 5);
    assert_eq!(mixer.running(0.0), VOICES_OF_SOUND_MAX);
    let other = frame(&mut mixer, 0.0, [of(Sound::Glass, 9)]);
    assert_eq!(other[0].slot, 6, "another sound has voices of its own");
}

#[test]
fn at_most_24_voices_run_and_the_important_ones_replace_the_others() {
    let mut mixer = Mixer::default();
    let sounds = [Sound::Wood, Sound::Rubber, Sound::Spawn, Sound::Glass];
    for index in 0..6 {
        let cues = (0..).zip(sounds).map(|(kind, sound)| of(sound, 10 * index + kind));
        // The quietest voices left at the end are those of glass, the shortest sound.
        assert_eq!(frame(&mut mixer, 0.001 * f64::from(index), cues).len(), 4);
    }
    assert_eq!(mixer.running(0.006), VOICES_MAX);
    let goal = frame(&mut mixer, 0.006, [Cue::of_room(Sound::Goal)]);
    assert_eq!(goal.len(), 1, "a goal is heard all the same");
    assert_eq!(mixer.running(0.006), VOICES_MAX);
    let replaced = goal[0].slot;
    let count = frame(&mut mixer, 0.007, [Cue::of_room(Sound::Count)]);
    assert_ne!(count[0].slot, replaced, "and not ended by the next");
    let quiet = Cue { speed: 0.5, ..of(Sound::Wood, 99) };
    assert_eq!(frame(&mut mixer, 0.007, [quiet]), []);
}

#[test]
fn a_strike_never_ends_a_goal() {
    let mut mixer = Mixer::default();
    let sounds = [Sound::Goal, Sound::Count, Sound::Go, Sound::Won];
    for _ in 0..6 {
        let voices = frame(&mut mixer, 0.0, sounds.map(Cue::of_room));
        assert_eq!(voices.len(), 4);
    }
    assert_eq!(frame(&mut mixer, 0.1, [strike(1, 100.0, 60.0, 1000.0)]), []);
}

#[test]
fn a_body_rests_for_80_milliseconds_and_bodies_that_meet_rest_both() {
    let mut mixer = Mixer::default();
    let meeting = Cue { bodies: [Some(body(1)), Some(body(2))], ..strike(1, 100.0, 14.0, 50.0) };
    assert_eq!(frame(&mut mixer, 1.0, [meeting, meeting]).len(), 1);
    for index in [1, 2] {
        assert_eq!(frame(&mut mixer, 1.079, [strike(index, 100.0, 14.0, 50.0)]), []);
    }
    assert_eq!(frame(&mut mixer, 1.079, [strike(3, 100.0, 14.0, 50.0)]).len(), 1);
    assert_eq!(frame(&mut mixer, 1.081, [strike(2, 100.0, 14.0, 50.0)]).len(), 1);
}

#[test]
fn slots_are_free_again_once_voices_have_faded() {
    let mut mixer = Mixer::default();
    let first = frame(&mut mixer, 0.0, [strike(1, 100.0, 14.0, 50.0)])[0];
    let end_s = f64::from(first.length_s());
    assert_eq!(mixer.running(end_s - 0.001), 1);
    assert_eq!(mixer.running(end_s), 0);
    assert_eq!(frame(&mut mixer, end_s, [strike(1, 100.0, 14.0, 50.0)])[0].slot, first.slot);
}

#[test]
fn harder_strikes_are_louder_ever_more_slowly() {
    let gains = [12.0, 24.0, 48.0, 96.0, 192.0, 384.0]
        .map(|speed| only(strike(1, 100.0, 14.0, speed)).gain);
    let steps: Vec<f32> = gains.windows(2).map(|pair| pair[1] / pair[0]).collect();
    assert!(steps.iter().all(|&step| step > 1.0), "{gains:?}");
    assert!(steps.windows(2).all(|pair| pair[1] < pair[0]), "{gains:?}");
    assert!(gains[5] < 1.0, "{gains:?}");
}

#[test]
fn large_bodies_are_low_loud_and_ring_for_longer() {
    let [small, large] = [5.0, 50.0].map(|size| only(strike(1, 100.0, size, 50.0)));
    assert!(large.pitch < 0.6 * small.pitch && large.gain > small.gain, "{small:?} {large:?}");
    assert!(large.length_s() > small.length_s());
    let [one, other] = [1, 2].map(|index| only(strike(index, 100.0, 14.0, 50.0)).pitch);
    assert!(one != other && (one / other - 1.0).abs() < 0.11, "{one} {other}");
    let extreme = [0.01, 1e6].map(|size| only(strike(1, 100.0, size, 50.0)));
    assert!(extreme.iter().all(|voice| (0.4..2.4).contains(&voice.pitch) && voice.gain <= 1.0));
}

#[test]
fn sounds_are_panned_by_place_and_fade_beyond_the_view() {
    let [far_left, left, middle, right, far_right] =
        [-100.0, 0.0, 100.0, 200.0, 300.0].map(|x| only(strike(1, x, 14.0, 50.0)));
    assert_eq!([left.pan, middle.pan, right.pan], [-PAN_MAX, 0.0, PAN_MAX]);
    assert_eq!([far_left.pan, far_right.pan], [-PAN_MAX, PAN_MAX]);
    assert_eq!([left.gain, right.gain], [middle.gain; 2]);
    assert!((far_left.gain - 0.25 * middle.gain).abs() < 1e-6);
    assert_eq!(only(Cue::of_room(Sound::Goal)).pan, 0.0);
    let nowhere = Ear { center: Vec2::ZERO, half: Vec2::ZERO };
    let mut mixer = Mixer::default();
    mixer.hear(strike(1, 5.0, 14.0, 50.0));
    let unseen = mixer.frame(0.0, &nowhere);
    assert!(unseen.iter().all(|voice| voice.pan.is_finite()), "{unseen:?}");
}

/// A pile of 500 bodies with 32 impacts in every tick, for two seconds.
#[test]
fn a_shaken_pile_patters() {
    let mut mixer = Mixer::default();
    let (mut started, mut loudest) = (0, 0.0f32);
    for tick in 0..120 {
        let now_s = f64::from(tick) / 60.0;
        let cues = (0..32).map(|n| of(Sound::Glass, (tick * 32 + n * 7) % 500));
        let voices = frame(&mut mixer, now_s, cues);
        assert!(voices.len() <= STARTS_A_FRAME_MAX);
        started += voices.len();
        let running = mixer.running.iter().flatten();
        let power: f32 = running.map(|running| running.level(now_s).powi(2)).sum();
        loudest = loudest.max(power.sqrt());
    }
    let alone = only(of(Sound::Glass, 1)).gain;
    assert!((60..300).contains(&started), "{started} in two seconds");
    assert!(loudest < 1.6 * alone, "{loudest} instead of {alone}");
}

#[test]
fn the_same_cues_at_the_same_times_give_the_same_voices() {
    let play = || {
        let mut mixer = Mixer::default();
        let mut rng = jostle_sim::Rng::new(5, 0);
        let mut all = Vec::new();
        for tick in 0..600 {
            for _ in 0..rng.below(6) {
                let sound = Sound::ALL[rng.below(12) as usize];
                let at = Some(Vec2::new(rng.range(-50.0, 250.0), 50.0));
                let cue = Cue { at, speed: rng.range(5.0, 200.0), ..of(sound, rng.below(40)) };
                mixer.hear(cue);
            }
            let now_s = f64::from(tick) / 60.0;
            let voices = mixer.frame(now_s, &EAR);
            let alike =
                |sound| mixer.running.iter().flatten().filter(|voice| voice.sound == sound).count();
            assert!(Sound::ALL.into_iter().all(|sound| alike(sound) <= VOICES_OF_SOUND_MAX));
            assert!(voices.iter().all(|voice| voice.slot < VOICES_MAX && voice.gain <= 1.0));
            all.push(voices);
        }
        all
    };
    assert_eq!(play(), play());
    assert!(play().concat().len() > 500);
}

#[test]
fn cues_that_pile_up_between_frames_take_no_memory() {
    let mut mixer = Mixer::default();
    (0..10_000).for_each(|index| mixer.hear(of(Sound::Wood, index)));
    assert_eq!(mixer.waiting.len(), WAITING_MAX);
}
