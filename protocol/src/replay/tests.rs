//! Checks that replays round-trip, and that truncated and altered files are refused with the offset of the problem.

use super::*;
use crate::Appearance;
use jostle_game::{Buttons, Input, Seat};
use jostle_sim::Rng;
use jostle_sim::Vec2;

fn ann() -> Appearance {
    Appearance::new("Ann", 3).unwrap()
}

fn start() -> Start {
    let [program, room, scene_name, scene] =
        ["0.1.0", "abc", "arena", "title = \"x\""].map(str::to_owned);
    Start { program, unix_s: 1_800_000_000, room, scene_name, scene, seed: 7, first_tick: 0 }
}

/// Ticks of a player whose pointer waves about, rests, leaves and returns.
fn play(first: u32, count: u32, rng: &mut Rng) -> Block {
    let mut at = Vec2::new(50.0, 40.0);
    let mut held = Buttons::default();
    let mut ticks = Vec::new();
    for number in first..first + count {
        let mut changes = Vec::new();
        if rng.below(20) == 0 {
            changes.push(Change::Join(Seat(rng.below(512) as u16), ann()));
            changes.push(Change::Leave(Seat(3)));
            changes.push(Change::Look(Seat(0), ann()));
        }
        if rng.below(3) > 0 {
            at += Vec2::new(rng.range(-4.0, 4.0), rng.range(-4.0, 4.0));
        }
        if rng.below(9) == 0 {
            held = Buttons(rng.next_u32() as u16 & Buttons::ALL.0);
        }
        let pointer = (rng.below(15) > 0).then_some(at);
        let mut inputs = Vec::new();
        if number % 100 < 90 {
            inputs.push((Seat(1), Input::new(held, pointer)));
        }
        if number % 7 < 5 {
            inputs.push((Seat(40), Input::default()));
        }
        let hash = u64::from(rng.next_u32()) << 32 | u64::from(rng.next_u32());
        let hash = if keeps_full_hash(number) { hash } else { hash & 0xffff };
        ticks.push(Tick { changes, inputs, hash });
    }
    Block { first, ticks }
}

fn keyframe(tick: u32) -> Keyframe {
    let members = vec![(Seat(1), ann()), (Seat(40), ann())];
    Keyframe { tick, hash: 9, members, state: (0..5000u32).map(|word| word as u8).collect() }
}

/// A 300-tick replay with a keyframe in the middle.
fn records() -> Vec<Record> {
    let mut rng = Rng::new(4, 0);
    vec![
        Record::Start(start()),
        Record::Ticks(play(1, 100, &mut rng)),
        Record::Ticks(play(101, 50, &mut rng)),
        Record::Keyframe(keyframe(150)),
        Record::Ticks(play(151, 150, &mut rng)),
        Record::End { tick: 300, hash: 77 },
    ]
}

fn file(records: &[Record]) -> Vec<u8> {
    let mut bytes = header();
    records.iter().for_each(|record| bytes.extend(record.seal()));
    bytes
}

#[test]
fn replays_round_trip() {
    let records = records();
    let replay = Replay::read(file(&records)).unwrap();
    assert_eq!(replay.ending(), Ending::Whole);
    assert_eq!(*replay.start(), start());
    assert_eq!((replay.first_tick(), replay.last_tick(), replay.end_hash()), (0, 300, Some(77)));
    for record in &records {
        if let Record::Ticks(block) = record {
            for tick in [block.first, block.last()] {
                assert_eq!(replay.block_with(tick).as_ref(), Some(block));
            }
        }
    }
    assert_eq!((replay.block_with(0), replay.block_with(301)), (None, None));
    assert_eq!(replay.keyframe_before(149), None);
    assert_eq!(replay.keyframe_before(299), Some(keyframe(150)));
    assert_eq!(replay.keyframe_after(150), Some(keyframe(150)));
    assert_eq!(replay.keyframe_after(151), None);
}

#[test]
fn the_last_notes_of_the_host_are_found_and_change_nothing_else() {
    let mut records = records();
    records.insert(1, Record::Host(b"early".to_vec()));
    let at = records.iter().position(|record| matches!(record, Record::Keyframe(_)));
    records.insert(at.unwrap(), Record::Host(b"late".to_vec()));
    let noted = Replay::read(file(&records)).unwrap();
    let Record::Keyframe(keyframe) = &records[at.unwrap() + 1] else { panic!("a keyframe") };
    assert_eq!(noted.host(), Some((keyframe.tick, &b"late"[..])));
    assert_eq!(noted.ending(), Ending::Whole);
    records.retain(|record| !matches!(record, Record::Host(_)));
    let plain = Replay::read(file(&records)).unwrap();
    assert_eq!(plain.host(), None);
    assert_eq!(plain.last_tick(), noted.last_tick());
    for tick in 1..=plain.last_tick() {
        assert_eq!(plain.block_with(tick), noted.block_with(tick), "{tick}");
    }
}

#[test]
fn a_room_that_was_open_for_days_is_read_too() {
    let first_tick = 1 << 24;
    let mut rng = Rng::new(4, 0);
    let records = [
        Record::Start(Start { first_tick, ..start() }),
        Record::Keyframe(keyframe(first_tick)),
        Record::Ticks(play(first_tick + 1, 30, &mut rng)),
    ];
    let replay = Replay::read(file(&records)).unwrap();
    assert_eq!((replay.first_tick(), replay.last_tick()), (first_tick, first_tick + 30));
}

#[test]
fn the_start_is_read_alone_and_the_sizes_add_up() {
    let records = records();
    let whole = file(&records);
    assert_eq!(Start::find(&whole), Ok(start()));
    assert_eq!(Start::find(&whole[..header().len() + records[0].seal().len()]), Ok(start()));
    assert!(Start::find(&whole[..header().len() + 5]).is_err());
    for length in [whole.len(), whole.len() - 1, whole.len() / 2] {
        let sizes = Replay::read(whole[..length].to_vec()).unwrap().sizes();
        let Sizes { start, hashes, inputs, keyframes, end, lost } = sizes;
        assert_eq!(start + hashes + inputs + keyframes + end + lost, length, "{sizes:?}");
        assert_eq!(lost == 0, length == whole.len());
    }
    let sizes = Replay::read(whole).unwrap().sizes();
    assert_eq!(sizes.hashes, 5 * 8 + 295 * 2);
    assert_eq!(sizes.keyframes, records[3].seal().len());
    assert_eq!(sizes.end, records[5].seal().len());
}

/// The longest start record has the longest texts and a scene that deflate cannot shorten.
#[test]
fn the_longest_start_fits_into_start_bytes_max() {
    use crate::limits::{PROGRAM_BYTES_MAX, ROOM_CODE_BYTES_MAX, SCENE_BYTES_MAX};
    let mut rng = Rng::new(1, 0);
    // Random characters from U+10000 upwards, as incompressible as valid text can be.
    let dense = std::iter::repeat_with(|| char::from_u32(0x10000 + rng.below(0xf_0000)).unwrap());
    let start = Start {
        program: "p".repeat(PROGRAM_BYTES_MAX),
        unix_s: u64::MAX,
        room: "r".repeat(ROOM_CODE_BYTES_MAX),
        scene_name: "s".repeat(crate::limits::SCENE_NAME_BYTES_MAX),
        scene: dense.take(SCENE_BYTES_MAX / 4).collect(),
        seed: u64::MAX,
        first_tick: u32::MAX,
    };
    let length = header().len() + Record::Start(start).seal().len();
    assert!(length <= START_BYTES_MAX, "{length}");
}

#[test]
fn only_sixteen_bits_of_most_hashes_are_kept() {
    let tick = |hash| Tick { changes: Vec::new(), inputs: Vec::new(), hash };
    assert!(tick(0x1234).agrees(59, 0xabcd_0000_0000_1234));
    assert!(!tick(0x1234).agrees(60, 0xabcd_0000_0000_1234));
    assert!(tick(0xabcd_0000_0000_1234).agrees(60, 0xabcd_0000_0000_1234));
}

#[test]
fn a_file_truncated_anywhere_is_a_shorter_replay() {
    let records = records();
    let whole = file(&records);
    let mut ends = Vec::new();
    let mut at = header().len();
    for record in &records {
        at += record.seal().len();
        ends.push(at);
    }
    for length in 0..whole.len() {
        let cut = Replay::read(whole[..length].to_vec());
        if length < ends[0] {
            assert!(cut.is_err());
            continue;
        }
        let replay = cut.unwrap();
        let kept = ends.iter().filter(|&&end| end <= length).count();
        let last = [0, 100, 150, 150, 300][kept - 1];
        assert_eq!(replay.last_tick(), last);
        let Ending::Cut(error) = replay.ending() else { panic!("{length} is not whole") };
        assert_eq!(error.offset, ends[kept - 1]);
    }
}

/// A payload that ends with this many zeros, which deflate shrinks a thousandfold.
fn swollen(plain: impl FnOnce(&mut crate::wire::Writer), zeros: usize) -> Vec<u8> {
    let mut writer = crate::wire::Writer::new();
    plain(&mut writer);
    pack::pack(&mut writer, &vec![0; zeros]);
    writer.finish()
}

/// 32 keyframes and 32 blocks of ticks, each of which takes up a few kilobytes and claims the maximum length.
fn swollen_file() -> Vec<u8> {
    let mut bytes = file(&[Record::Start(start())]);
    let keyframe = swollen(
        |writer| {
            writer.leb32(0);
            writer.fixed64(0);
            writer.count(0);
        },
        crate::limits::REPLAY_RECORD_BYTES_MAX,
    );
    (0..32).for_each(|_| bytes.extend(frame(3, &keyframe)));
    for first in (1..).step_by(600).take(32) {
        let block = swollen(
            |writer| {
                writer.leb32(first);
                writer.count(600);
                writer.raw(&[0; 600 * 2 + 10 * 6]);
                writer.count(0);
            },
            4 << 20,
        );
        bytes.extend(frame(2, &block));
    }
    bytes
}

#[test]
fn reading_a_file_unpacks_nothing_but_its_scene() {
    let bytes = swollen_file();
    let length = bytes.len();
    assert!(length < 512 << 10, "{length}");
    pack::tests::unpacked();
    let replay = Replay::read(bytes).unwrap();
    assert_eq!(replay.last_tick(), 32 * 600);
    assert_eq!(pack::tests::unpacked(), start().scene.len());
    // Playing a tick or seeking a state unpacks only one record.
    assert_eq!(replay.block_with(1), None, "its columns have bytes left over");
    assert!(replay.keyframe_before(600).is_some());
    assert!(pack::tests::unpacked() <= (4 << 20) + crate::limits::REPLAY_RECORD_BYTES_MAX);
}

#[test]
fn counting_players_unpacks_no_state() {
    let bytes = file(&records());
    pack::tests::unpacked();
    let players = PlayerCount::of_beginning(&bytes);
    let unpacked = pack::tests::unpacked();
    assert!(players.most >= keyframe(150).members.len() as u32 && players.most > 0);
    let columns: usize = (records().iter())
        .filter_map(|record| match record {
            Record::Ticks(_) => Some(record.seal()),
            _ => None,
        })
        .map(|sealed| {
            Record::read(2, &sealed[record::FRAME_BYTES..]).unwrap();
            pack::tests::unpacked()
        })
        .sum();
    assert_eq!(unpacked, start().scene.len() + columns);
}

#[test]
fn few_ticks_cannot_claim_the_inputs_of_many() {
    let block = swollen(
        |writer| {
            writer.leb32(1);
            writer.count(1);
            writer.raw(&[0; 2]);
            writer.count(0);
        },
        1 << 20,
    );
    pack::tests::unpacked();
    assert!(Record::read(2, &block).is_err());
    let unpacked = pack::tests::unpacked();
    assert!(unpacked <= 256 << 10, "{unpacked} bytes for one tick");
}

#[test]
fn a_reader_goes_through_a_file_in_steps() {
    let mut bytes = file(&records()[..5]);
    let notes = Record::Host(vec![1; 100_000]).seal();
    (0..40).for_each(|_| bytes.extend(&notes));
    let mut reader = ReplayReader::new(bytes.clone()).unwrap();
    let mut progress = vec![reader.progress()];
    while reader.step() {
        progress.push(reader.progress());
    }
    let step = 400_000.0 / bytes.len() as f64;
    assert!(progress.windows(2).all(|pair| (0.0..step).contains(&(pair[1] - pair[0]))));
    assert!(progress.len() > 10 && reader.progress() == 1.0);
    let (stepped, whole) = (reader.finish(), Replay::read(bytes.clone()).unwrap());
    assert_eq!(format!("{stepped:?}"), format!("{whole:?}"));
    // The search after a cut also proceeds in steps.
    bytes.extend([5, 0, 0, 0x70, 0, 1, 2, 3, 4]);
    bytes.extend(vec![5; 2 << 20]);
    let mut reader = ReplayReader::new(bytes).unwrap();
    let steps = std::iter::from_fn(|| reader.step().then_some(())).count();
    assert!(steps > 20, "{steps}");
    assert!(matches!(reader.finish().ending(), Ending::Cut(_)));
}

#[test]
fn changed_bytes_are_found() {
    let records = records();
    let whole = file(&records);
    let end_bytes = records.last().map_or(0, |end| end.seal().len());
    let mut rng = Rng::new(8, 0);
    for _ in 0..20_000 {
        let mut bytes = whole.clone();
        let place = rng.below(bytes.len() as u32) as usize;
        bytes[place] ^= 1 << rng.below(8);
        if let Ok(replay) = Replay::read(bytes) {
            let error =
                replay.ending().error().unwrap_or_else(|| panic!("byte {place} went unseen"));
            assert!(error.offset <= place);
            let is_last = place >= whole.len() - end_bytes;
            let is_damaged = matches!(replay.ending(), Ending::Damaged(_));
            assert!(is_damaged || is_last, "byte {place}: {error}");
        }
    }
}

/// Random bytes with a valid checksum reach the record decoders.
#[test]
fn random_bytes_in_a_sealed_record_never_panic() {
    let mut rng = Rng::new(9, 0);
    let records = records();
    for round in 0..20_000 {
        let sealed = records[round % records.len()].seal();
        let (kind, mut payload) = (sealed[0], sealed[record::FRAME_BYTES..].to_vec());
        for _ in 0..=rng.below(3) {
            let place = rng.below(payload.len() as u32) as usize;
            payload[place] = rng.next_u32() as u8;
        }
        payload.truncate(payload.len() - rng.below(2) as usize * rng.below(9) as usize);
        if let Ok(record) = Record::read(kind, &payload) {
            // An accepted record can be encoded again.
            record.seal();
        }
    }
}

/// Random bytes replace the moves and the columns, which are then packed again. Most of the decoding happens there.
#[test]
fn random_bytes_in_the_columns_never_panic() {
    let mut rng = Rng::new(10, 0);
    let block = play(1, 80, &mut rng);
    let mut writer = crate::wire::Writer::new();
    block.write(&mut writer);
    let payload = writer.finish();
    let plain = 2 + 2 * 79 + 8;
    let mut reader = crate::wire::Reader::new(&payload[plain..]);
    let count = reader.count(usize::MAX, 1, "moves").unwrap();
    let moves = reader.raw(count, "moves").unwrap();
    let columns = reader.raw(reader.remaining(), "columns").unwrap();
    let columns = miniz_oxide::inflate::decompress_to_vec(columns).unwrap();
    assert!(moves.len() > 20 && columns.len() > 20);
    for round in 0..20_000 {
        let (mut moves, mut columns) = (moves.to_vec(), columns.clone());
        let changed = if round % 4 == 0 { &mut moves } else { &mut columns };
        let place = rng.below(changed.len() as u32) as usize;
        changed[place] = rng.next_u32() as u8;
        let mut writer = crate::wire::Writer::new();
        writer.raw(&payload[..plain]);
        writer.count(moves.len());
        writer.raw(&moves);
        pack::pack(&mut writer, &columns);
        if let Ok(record) = Record::read(2, &writer.finish()) {
            record.seal();
        }
    }
}

/// In a replay of a player with a mouse, the pointer takes up most of the bytes.
#[test]
fn a_steady_hand_takes_little_more_than_its_hashes() {
    let mut rng = Rng::new(11, 0);
    let (mut at, mut way) = (Vec2::new(50.0, 40.0), Vec2::ZERO);
    let tick = |_| {
        way = way * 0.98 + Vec2::new(rng.range(-0.2, 0.2), rng.range(-0.2, 0.2));
        at += way;
        let input = Input::new(Buttons::FIRE, Some(at));
        Tick { changes: Vec::new(), inputs: vec![(Seat(2), input)], hash: 0 }
    };
    let block = Block { first: 1, ticks: (0..300).map(tick).collect() };
    let bytes = Record::Ticks(block).seal().len() - 295 * 2 - 5 * 8;
    assert!(bytes < 350, "{bytes} bytes for 300 ticks");
}

#[test]
fn other_files_are_refused() {
    let problem = |bytes: &[u8]| Replay::read(bytes.to_vec()).unwrap_err().problem;
    assert_eq!(problem(b""), Problem::NotAReplay);
    assert_eq!(problem(b"GIF89a and so on"), Problem::NotAReplay);
    let mut later = header();
    later[8] = 9;
    assert_eq!(problem(&later), Problem::Format { found: 9 });
    let mut bomb = header();
    bomb.extend([1, 0xff, 0xff, 0xff, 0xff, 0, 0, 0, 0]);
    assert_eq!(problem(&bomb), Problem::LongRecord { bytes: u32::MAX as usize });
}

#[test]
fn records_in_the_wrong_order_end_the_replay() {
    let all = records();
    let ending = |records: &[&Record]| {
        let records: Vec<Record> = records.iter().map(|&record| record.clone()).collect();
        Replay::read(file(&records)).map(|replay| replay.ending())
    };
    assert!(ending(&[&all[1]]).is_err());
    for wrong in [[0, 2], [0, 3], [0, 5], [0, 0]] {
        let Ok(Ending::Damaged(error)) = ending(&wrong.map(|at| &all[at])) else {
            panic!("{wrong:?}")
        };
        assert!(matches!(error.problem, Problem::Order(_)), "{error}");
    }
    let late = Record::Start(Start { first_tick: 100, ..start() });
    let Ok(Ending::Damaged(error)) = ending(&[&late, &all[2]]) else { panic!("needs a keyframe") };
    assert!(error.to_string().contains("must begin with a keyframe"));
}

#[test]
fn the_end_record_is_found_in_the_last_bytes_of_a_file() {
    let mut rng = Rng::new(9, 0);
    for bits in 0..32 {
        let tick = 1 << bits | rng.below(1 << bits);
        let hash = u64::from(rng.next_u32()) << 32 | u64::from(rng.next_u32());
        let end = Record::End { tick, hash }.seal();
        assert!(end.len() <= END_BYTES_MAX);
        let file = [&Record::Ticks(play(1, 30, &mut rng)).seal()[..], &end[..]].concat();
        assert_eq!(Record::last_tick(&file[file.len() - END_BYTES_MAX..]), Some(tick));
        assert_eq!(Record::last_tick(&file), Some(tick));
        assert_eq!(Record::last_tick(&end), Some(tick));
        for cut in 1..=END_BYTES_MAX {
            assert_eq!(Record::last_tick(&file[..file.len() - cut]), None);
        }
        let mut changed = end;
        let at = rng.below(changed.len() as u32) as usize;
        changed[at] ^= 1 << rng.below(8);
        assert_eq!(Record::last_tick(&changed), None);
    }
}
