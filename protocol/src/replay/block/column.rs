//! What one seat did in a block: when it was there, its buttons where they change, its pointer as
//! runs, and how far the pointer is each tick from where it was expected.

use crate::bits::{BitReader, BitWriter, Rice};
use crate::limits::QUANTA_MAX;
use crate::wire::{DecodeError, Gaps, Reader, Writer};
use jostle_sim::game::POINTER_QUANTUM;
use jostle_sim::{Buttons, Input, Vec2};

/// A pointer in quanta; `None` outside the view.
type Place = Option<[i32; 2]>;

/// What a pointer does for some ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Run {
    /// Nothing.
    Still = 0,
    /// It moves, or comes back.
    Moves = 1,
    /// It leaves the view.
    Leaves = 2,
}

impl Run {
    fn of(before: Place, now: Place) -> Run {
        match now {
            same if same == before => Run::Still,
            Some(_) => Run::Moves,
            None => Run::Leaves,
        }
    }
}

/// How the next place of a moving pointer is expected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Prediction {
    /// Where it is: for one that jumps.
    Stays,
    /// As far on as in the last tick.
    GoesOn,
    /// Gathering or losing speed as it did.
    Bends,
}

impl Prediction {
    const ALL: [Prediction; 3] = [Prediction::Stays, Prediction::GoesOn, Prediction::Bends];
}

/// Where a pointer is and how it came there.
#[derive(Clone, Copy, Default)]
struct Trail {
    place: [i32; 2],
    /// The last ways, the newest first; zero where it did not move.
    ways: [[i32; 2]; 3],
}

impl Trail {
    fn expected(&self, prediction: Prediction) -> [i32; 2] {
        let [one, two, three] = self.ways;
        let along = |axis: usize| {
            let way = match prediction {
                Prediction::Stays => 0,
                Prediction::GoesOn => one[axis],
                // The change of the last but one: that of the last is mostly a hand's shaking.
                Prediction::Bends => one[axis] + ((two[axis] - three[axis]) >> 1),
            };
            (self.place[axis] + way).clamp(-QUANTA_MAX, QUANTA_MAX)
        };
        [along(0), along(1)]
    }

    fn go(&mut self, place: [i32; 2]) {
        let way = [place[0] - self.place[0], place[1] - self.place[1]];
        self.ways = [way, self.ways[0], self.ways[1]];
        self.place = place;
    }

    fn rest(&mut self) {
        self.ways = [[0; 2]; 3];
    }
}

/// A pointer's moves, coded one after the other.
struct Moves {
    prediction: Prediction,
    trail: Trail,
    codes: [Rice; 2],
}

impl Moves {
    fn new(prediction: Prediction) -> Moves {
        Moves { prediction, trail: Trail::default(), codes: [Rice::new(); 2] }
    }

    fn write(&mut self, place: [i32; 2], bits: &mut BitWriter) {
        let expected = self.trail.expected(self.prediction);
        for axis in 0..2 {
            self.codes[axis].write(place[axis] - expected[axis], bits);
        }
        self.trail.go(place);
    }

    fn read(&mut self, bits: &mut BitReader) -> Result<[i32; 2], DecodeError> {
        let mut place = self.trail.expected(self.prediction);
        for (along, code) in place.iter_mut().zip(&mut self.codes) {
            *along = along.wrapping_add(code.read(bits, "pointer")?);
            if along.unsigned_abs() > QUANTA_MAX.unsigned_abs() {
                return Err(DecodeError::OutOfRange { field: "pointer" });
            }
        }
        self.trail.go(place);
        Ok(place)
    }
}

/// Writes what a seat did, tick by tick; `None` where it had no input.
pub fn write(inputs: &[Option<Input>], columns: &mut Writer, bits: &mut BitWriter) {
    let mut held = Input::default();
    // Where there is no input, nothing changes: that costs nothing.
    let inputs_held: Vec<Input> = inputs
        .iter()
        .map(|input| {
            held = input.unwrap_or(held);
            held
        })
        .collect();
    write_changes(inputs.iter().map(|input| u32::from(input.is_some())), columns);
    write_changes(inputs_held.iter().map(|input| u32::from(input.buttons.0)), columns);
    let places: Vec<Place> = inputs_held.iter().map(|input| input.pointer.map(in_quanta)).collect();
    write_runs(&places, columns);
    let coded = |prediction| {
        let mut trial = bits.clone();
        write_moves(&places, prediction, &mut trial);
        (prediction, trial)
    };
    let shortest = Prediction::ALL.into_iter().map(coded).min_by_key(|(_, trial)| trial.count());
    let (prediction, trial) = shortest.expect("there are predictions");
    columns.byte(prediction as u8);
    *bits = trial;
}

/// Where numbers change, from 0 on, and by which bits.
fn write_changes(numbers: impl Iterator<Item = u32>, columns: &mut Writer) {
    let mut before = 0;
    let changes: Vec<_> = (0u32..)
        .zip(numbers)
        .filter_map(|(place, number)| {
            let bits = number ^ before;
            before = number;
            (bits != 0).then_some((place, bits))
        })
        .collect();
    columns.count(changes.len());
    let mut gaps = Gaps::default();
    for (place, bits) in changes {
        gaps.write(columns, place);
        columns.leb32(bits);
    }
}

/// Runs that fill the block: length, and what the pointer does.
fn write_runs(places: &[Place], columns: &mut Writer) {
    let mut before = None;
    let mut runs: Vec<(u32, Run)> = Vec::new();
    for &place in places {
        let run = Run::of(before, place);
        before = place;
        match runs.last_mut() {
            Some((length, last)) if *last == run => *length += 1,
            _ => runs.push((1, run)),
        }
    }
    for (length, run) in runs {
        columns.leb32(length << 2 | run as u32);
    }
}

fn write_moves(places: &[Place], prediction: Prediction, bits: &mut BitWriter) {
    let mut moves = Moves::new(prediction);
    let mut before = None;
    for &place in places {
        match place {
            Some(moved) if place != before => moves.write(moved, bits),
            _ => moves.trail.rest(),
        }
        before = place;
    }
}

/// Reads what a seat did in so many ticks.
pub fn read(
    count: usize,
    columns: &mut Reader,
    bits: &mut BitReader,
) -> Result<Vec<Option<Input>>, DecodeError> {
    let present = read_changes(count, 1, columns, "presence")?;
    let buttons = read_changes(count, u32::from(Buttons::ALL.0), columns, "buttons")?;
    let runs = read_runs(count, columns)?;
    let prediction = usize::from(columns.byte("prediction")?);
    let prediction = Prediction::ALL.get(prediction).copied();
    let prediction = prediction.ok_or(DecodeError::OutOfRange { field: "prediction" })?;
    let mut moves = Moves::new(prediction);
    let mut pointer = None;
    let mut inputs = Vec::with_capacity(count);
    for (at, run) in runs.into_iter().enumerate() {
        match run {
            Run::Moves => pointer = Some(moves.read(bits)?),
            Run::Still | Run::Leaves => moves.trail.rest(),
        }
        if run == Run::Leaves {
            pointer = None;
        }
        let input = Input { buttons: Buttons(buttons[at] as u16), pointer: pointer.map(in_units) };
        inputs.push((present[at] != 0).then_some(input));
    }
    Ok(inputs)
}

fn read_changes(
    count: usize,
    bits_max: u32,
    columns: &mut Reader,
    field: &'static str,
) -> Result<Vec<u32>, DecodeError> {
    let mut numbers = vec![0; count];
    let mut gaps = Gaps::default();
    let (mut now, mut filled) = (0, 0);
    for _ in 0..columns.count(count, 2, field)? {
        let place = gaps.read(columns, count, field)? as usize;
        numbers[filled..place].fill(now);
        now ^= columns.leb_up_to(bits_max, field)?;
        filled = place;
    }
    numbers[filled..].fill(now);
    Ok(numbers)
}

fn read_runs(count: usize, columns: &mut Reader) -> Result<Vec<Run>, DecodeError> {
    let field = "runs of a pointer";
    let mut runs = Vec::with_capacity(count);
    while runs.len() < count {
        let coded = columns.leb32(field)?;
        let run = match coded & 3 {
            0 => Run::Still,
            1 => Run::Moves,
            2 => Run::Leaves,
            _ => return Err(DecodeError::OutOfRange { field }),
        };
        let length = (coded >> 2) as usize;
        if length == 0 || length > count - runs.len() {
            return Err(DecodeError::OutOfRange { field });
        }
        runs.resize(runs.len() + length, run);
    }
    Ok(runs)
}

/// A pointer that was rounded to the quantum, in quanta.
fn in_quanta(pointer: Vec2) -> [i32; 2] {
    let quanta = pointer / POINTER_QUANTUM;
    [quanta.x as i32, quanta.y as i32]
}

fn in_units(quanta: [i32; 2]) -> Vec2 {
    Vec2::new(quanta[0] as f32, quanta[1] as f32) * POINTER_QUANTUM
}
