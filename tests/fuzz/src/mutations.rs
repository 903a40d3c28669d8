//! Mutated replays: each is either refused with a message or plays as far as it can be read, and none causes a panic or
//! takes long. Checksums detect plain changes; records that are changed and framed again get past them and reach all
//! code that reads a replay.

use jostle_game::{Buttons, Game, Input, Scene, Seat};
use jostle_protocol::Appearance;
use jostle_protocol::replay::{Block, Change, Keyframe, Record, Replay, Tick, frame, header};
use jostle_room::{Playback, Room, divergence};
use jostle_sim::Rng;
use jostle_sim::Vec2;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Number of ticks in each half of a replay.
const HALF_TICKS: u32 = 16;
/// Maximum number of ticks played from a mutated replay.
const TICKS_MAX: u32 = 40;
/// One in this many replays is also tested with seeking and full verification, including the search for the cause of a
/// divergence.
const THOROUGH_EVERY: u64 = 2048;

/// Counts the outcomes of the mutated replays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Number of replays that were not opened because the replay or its scene is invalid.
    pub refused: u64,
    /// Number of replays in which every tick was equal.
    pub equal: u64,
    /// Number of replays that were equal up to a tick that cannot be played.
    pub stopped: u64,
    /// Number of replays in which a tick, a keyframe or the end record differs.
    pub differs: u64,
    pub ticks: u64,
    /// Time taken by the slowest tick.
    pub slowest: Duration,
}

impl Tally {
    /// Number of mutated replays.
    pub fn count(&self) -> u64 {
        self.refused + self.equal + self.stopped + self.differs
    }

    pub fn add(&mut self, other: &Tally) {
        self.refused += other.refused;
        self.equal += other.equal;
        self.stopped += other.stopped;
        self.differs += other.differs;
        self.ticks += other.ticks;
        self.slowest = self.slowest.max(other.slowest);
    }
}

/// A replay to be mutated.
#[derive(Clone, Debug)]
pub struct Base {
    /// The scene's name, and whether the replay begins in the middle of a game.
    pub name: String,
    pub records: Vec<Record>,
    /// The framed records, cached because packing takes longer than everything else.
    framed: Vec<Vec<u8>>,
}

impl Base {
    /// Returns the bytes of the file.
    pub fn bytes(&self) -> Vec<u8> {
        file(&self.framed)
    }
}

fn file(framed: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = header();
    framed.iter().for_each(|record| bytes.extend(record));
    bytes
}

/// Creates small replays of every scene, from the start and from the middle of a game, each with a keyframe between two
/// blocks of ticks.
pub fn bases() -> Vec<Base> {
    let scenes = Scene::built_in().into_iter().map(Arc::new);
    scenes.flat_map(|scene| [base(&scene, 0), base(&scene, 90)]).collect()
}

fn base(scene: &Arc<Scene>, ticks_before: u32) -> Base {
    let mut room = Room::new("mutated", Arc::clone(scene), 5);
    let mut rng = Rng::new(u64::from(ticks_before), 0);
    let mut seq = 0;
    for number in 0..2 {
        let look = Appearance { name: format!("Player {number}").into(), color: number };
        room.join(look, None).expect("a free seat");
    }
    let mut play = |room: &mut Room, ticks: u32| {
        for _ in 0..ticks {
            seq += 1;
            for seat in 0..2 {
                room.input(Seat(seat), seq, wild(&mut rng, scene.size));
            }
            room.tick();
        }
    };
    play(&mut room, ticks_before);
    room.record("mutations", 0);
    play(&mut room, HALF_TICKS);
    let middle = keyframe(room.game());
    play(&mut room, HALF_TICKS);
    let mut records = Vec::new();
    for record in room.stop_recording() {
        match record {
            Record::Ticks(block) => records.extend(halves(block, middle.clone())),
            record => records.push(record),
        }
    }
    let framed = records.iter().map(Record::seal).collect();
    Base { name: format!("{} from tick {ticks_before}", scene.name), records, framed }
}

fn wild(rng: &mut Rng, size: Vec2) -> Input {
    let buttons = (rng.next_u32() & rng.next_u32()) as u16 & Buttons::ALL.0 & !Buttons::CLEAR.0;
    let pointer = Vec2::new(rng.range(0.0, size.x), rng.range(0.0, size.y));
    Input::new(Buttons(buttons), Some(pointer))
}

fn keyframe(game: &Game) -> Keyframe {
    let look = |seat: Seat| Appearance { name: format!("Player {}", seat.0).into(), color: 0 };
    let members = game.players().map(|player| (player.seat, look(player.seat))).collect();
    Keyframe { tick: game.tick_count(), hash: game.hash(), members, state: game.save() }
}

fn halves(mut block: Block, middle: Keyframe) -> [Record; 3] {
    let later = block.ticks.split_off(HALF_TICKS as usize);
    let later = Block { first: middle.tick + 1, ticks: later };
    [Record::Ticks(block), Record::Keyframe(middle), Record::Ticks(later)]
}

/// Mutates and plays the replays with these numbers; a number always gives the same mutation. If playing a mutation
/// panics, this function panics with its number. `progress` is called occasionally.
pub fn run(
    bases: &[Base],
    numbers: impl Iterator<Item = u64>,
    mut progress: impl FnMut(&Tally),
) -> Tally {
    let mut tally = Tally::default();
    for (done, number) in numbers.enumerate() {
        let base = &bases[number as usize % bases.len()];
        let started = Instant::now();
        let one = catch_unwind(AssertUnwindSafe(|| {
            let mut rng = Rng::new(number, 77);
            let bytes = mutated(base, &mut rng);
            judge(bytes, number.is_multiple_of(THOROUGH_EVERY))
        }));
        let Ok(one) = one else { panic!("mutation {number} of {} panicked", base.name) };
        tally.add(&Tally { slowest: started.elapsed(), ..one });
        if done % 1000 == 999 {
            progress(&tally);
        }
    }
    progress(&tally);
    tally
}

// Changes.

fn mutated(base: &Base, rng: &mut Rng) -> Vec<u8> {
    match rng.below(8) {
        0 | 1 => {
            let mut bytes = base.bytes();
            change_bytes(&mut bytes, rng);
            bytes
        }
        2 | 3 => with_correct_checksum(base, rng),
        4 => shuffled(base, rng),
        _ => rewritten(base, rng),
    }
}

/// Flips, changes, inserts, removes or truncates bytes.
fn change_bytes(bytes: &mut Vec<u8>, rng: &mut Rng) {
    for _ in 0..=rng.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = rng.below(bytes.len() as u32) as usize;
        match rng.below(8) {
            0..=2 => bytes[at] ^= 1 << rng.below(8),
            3 | 4 => {
                bytes[at] = [0, 1, 0x7f, 0x80, 0xff, rng.next_u32() as u8][rng.below(6) as usize]
            }
            5 => bytes.insert(at, rng.next_u32() as u8),
            6 => drop(bytes.drain(at..(at + 1 + rng.below(16) as usize).min(bytes.len()))),
            _ => bytes.truncate(at),
        }
    }
}

/// Changes bytes of one payload and corrects its checksum.
fn with_correct_checksum(base: &Base, rng: &mut Rng) -> Vec<u8> {
    let mut framed = base.framed.clone();
    let chosen = &mut framed[rng.below(base.records.len() as u32) as usize];
    let mut payload = chosen[frame(0, &[]).len()..].to_vec();
    change_bytes(&mut payload, rng);
    let kind = if rng.below(20) == 0 { rng.below(6) as u8 } else { chosen[0] };
    *chosen = frame(kind, &payload);
    file(&framed)
}

/// Reorders, duplicates or removes entire records.
fn shuffled(base: &Base, rng: &mut Rng) -> Vec<u8> {
    let mut framed = base.framed.clone();
    let at = rng.below(framed.len() as u32) as usize;
    let other = rng.below(framed.len() as u32) as usize;
    match rng.below(3) {
        0 => framed.swap(at, other),
        1 => drop(framed.remove(at)),
        _ => framed.insert(at, base.framed[other].clone()),
    }
    file(&framed)
}

/// Changes the contents of records in ways that no checksum or codec can detect.
fn rewritten(base: &Base, rng: &mut Rng) -> Vec<u8> {
    let at = rng.below(base.records.len() as u32) as usize;
    let mut record = base.records[at].clone();
    match &mut record {
        Record::Start(start) => match rng.below(4) {
            0 => start.seed ^= 1 << rng.below(64),
            1 => start.first_tick ^= 1 << rng.below(32),
            _ => {
                let mut scene = std::mem::take(&mut start.scene).into_bytes();
                change_text(&mut scene, rng);
                start.scene = String::from_utf8_lossy(&scene).into_owned();
            }
        },
        Record::Ticks(block) => {
            let tick = rng.below(block.ticks.len() as u32) as usize;
            change_tick(&mut block.ticks[tick], rng);
        }
        Record::Keyframe(keyframe) => match rng.below(8) {
            0 => keyframe.hash ^= 1 << rng.below(64),
            1 => keyframe.tick ^= 1 << rng.below(32),
            2 => drop(keyframe.members.pop()),
            _ => change_bytes(&mut keyframe.state, rng),
        },
        Record::End { tick, hash } => match rng.below(2) {
            0 => *tick ^= 1 << rng.below(32),
            _ => *hash ^= 1 << rng.below(64),
        },
        Record::Host(notes) => change_bytes(notes, rng),
    }
    let mut framed = base.framed.clone();
    framed[at] = record.seal();
    file(&framed)
}

/// Changes digits and lines of a scene, because most other changes are refused at once.
fn change_text(text: &mut Vec<u8>, rng: &mut Rng) {
    let digits: Vec<_> = (0..text.len()).filter(|&at| text[at].is_ascii_digit()).collect();
    match rng.below(4) {
        0 => change_bytes(text, rng),
        1 if !digits.is_empty() => {
            let at = digits[rng.below(digits.len() as u32) as usize];
            text.insert(at, b'0' + rng.below(10) as u8);
        }
        _ if !digits.is_empty() => {
            let at = digits[rng.below(digits.len() as u32) as usize];
            text[at] = b'0' + rng.below(10) as u8;
        }
        _ => text.clear(),
    }
}

fn change_tick(tick: &mut Tick, rng: &mut Rng) {
    let seat = Seat(rng.below(4) as u16);
    let look = Appearance { name: "Stranger".into(), color: 1 };
    match rng.below(6) {
        0 => tick.hash ^= 1 << rng.below(16),
        1 => tick.changes.push(Change::Join(seat, look)),
        2 => tick.changes.push(Change::Leave(seat)),
        3 => tick.changes.push(Change::Look(seat, look)),
        4 => drop(tick.inputs.pop()),
        _ => {
            if let Some((_, input)) = tick.inputs.first_mut() {
                let buttons = Buttons(input.buttons().0 ^ 1 << rng.below(12));
                let far = Vec2::new(rng.range(-1e6, 1e6), rng.range(-1e6, 1e6));
                *input = Input::new(buttons, (rng.below(2) == 0).then_some(far));
            }
        }
    }
}

// Playing.

fn judge(bytes: Vec<u8>, is_thorough: bool) -> Tally {
    let refused = Tally { refused: 1, ..Tally::default() };
    let Ok(replay) = Replay::read(bytes) else { return refused };
    let replay = Arc::new(replay);
    let Ok(mut playback) = Playback::new(Arc::clone(&replay)) else { return refused };
    let first = playback.tick();
    let outcome = play(&replay, &mut playback);
    if is_thorough {
        // Any result will do, as long as neither call panics.
        let _ = divergence::verify(&replay, |_| {});
        let _ = playback.seek(first + 1).and_then(|()| playback.seek(replay.last_tick()));
        playback.snapshot();
    }
    Tally { ticks: u64::from(playback.tick().saturating_sub(first)), ..outcome }
}

fn play(replay: &Replay, playback: &mut Playback) -> Tally {
    let end = playback.tick().saturating_add(TICKS_MAX);
    while playback.tick() < end {
        match playback.step() {
            Err(_) => return Tally { stopped: 1, ..Tally::default() },
            Ok(Some(played)) if !played.agrees => return Tally { differs: 1, ..Tally::default() },
            Ok(Some(_)) => {}
            Ok(None) => break,
        }
        let kept = replay.keyframe_before(playback.tick());
        let kept = kept.filter(|keyframe| keyframe.tick == playback.tick());
        if kept.is_some_and(|keyframe| keyframe.hash != playback.game().hash()) {
            return Tally { differs: 1, ..Tally::default() };
        }
    }
    let is_end = playback.tick() == replay.last_tick();
    let hash = replay.end_hash().filter(|_| is_end);
    if hash.is_some_and(|hash| hash != playback.game().hash()) {
        return Tally { differs: 1, ..Tally::default() };
    }
    Tally { equal: 1, ..Tally::default() }
}
