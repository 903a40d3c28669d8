//! One seat's columns in a block: changes in its presence and buttons, the runs of its pointer, and the difference
//! between each move and its prediction.

use crate::bits::{BitReader, BitWriter, Rice};
use crate::error::{DecodeError, check};
use crate::limits::QUANTA_MAX;
use crate::position_history::{Position, PositionHistory};
use crate::wire::{Gaps, Reader, Writer};
use jostle_game::{Buttons, Input, POINTER_QUANTUM};
use jostle_sim::Vec2;

/// A pointer position in quanta; `None` outside the view.
type Pointer = Option<Position>;

/// The movement of a pointer over consecutive ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PointerRun {
    Still = 0,
    /// The pointer moves or re-enters the view.
    Moves = 1,
    /// The pointer leaves the view.
    Leaves = 2,
}

impl PointerRun {
    fn of(before: Pointer, now: Pointer) -> PointerRun {
        match now {
            same if same == before => PointerRun::Still,
            Some(_) => PointerRun::Moves,
            None => PointerRun::Leaves,
        }
    }
}

/// How to predict a moving pointer's next position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Prediction {
    /// The position stays the same, for a pointer that jumps.
    Stays,
    /// The last displacement is repeated.
    GoesOn,
    /// The last displacement is repeated, adjusted by an earlier difference between displacements.
    Bends,
}

impl Prediction {
    const ALL: [Prediction; 3] = [Prediction::Stays, Prediction::GoesOn, Prediction::Bends];
}

/// The coder for a pointer's moves.
struct PointerMoveCoder {
    prediction: Prediction,
    history: PositionHistory,
    codes: [Rice; 2],
}

impl PointerMoveCoder {
    fn new(prediction: Prediction) -> PointerMoveCoder {
        PointerMoveCoder {
            prediction,
            history: PositionHistory::default(),
            codes: [Rice::new(); 2],
        }
    }

    fn expected(&self) -> Position {
        self.history.extrapolated(|[one, two, three]| match self.prediction {
            Prediction::Stays => 0,
            Prediction::GoesOn => one,
            // The older difference is used, because the newest one is mostly tremor.
            Prediction::Bends => one + ((two - three) >> 1),
        })
    }

    fn write(&mut self, position: Position, bits: &mut BitWriter) {
        let expected = self.expected();
        for axis in 0..2 {
            self.codes[axis].write(position[axis] - expected[axis], bits);
        }
        self.history.push(position);
    }

    fn read(&mut self, bits: &mut BitReader) -> Result<Position, DecodeError> {
        let mut position = self.expected();
        for (along, code) in position.iter_mut().zip(&mut self.codes) {
            *along = along.wrapping_add(code.read(bits, "pointer")?);
            check(along.unsigned_abs() <= QUANTA_MAX.unsigned_abs(), "pointer")?;
        }
        self.history.push(position);
        Ok(position)
    }

    /// Notes that the pointer does not move in this tick.
    fn rest(&mut self) {
        self.history = PositionHistory::resting(self.history.position());
    }
}

/// Writes a seat's inputs, tick by tick; `None` for ticks without input.
pub fn write(inputs: &[Option<Input>], columns: &mut Writer, bits: &mut BitWriter) {
    let mut held = Input::default();
    // If there is no input, the last one is repeated, so that it takes up no bytes.
    let inputs_held: Vec<Input> = inputs
        .iter()
        .map(|input| {
            held = input.unwrap_or(held);
            held
        })
        .collect();
    write_changes(inputs.iter().map(|input| u32::from(input.is_some())), columns);
    write_changes(inputs_held.iter().map(|input| u32::from(input.buttons().0)), columns);
    let pointers: Vec<Pointer> =
        inputs_held.iter().map(|input| input.pointer().map(in_quanta)).collect();
    write_runs(&pointers, columns);
    let coded = |prediction| {
        let mut trial = bits.clone();
        write_moves(&pointers, prediction, &mut trial);
        (prediction, trial)
    };
    let shortest = Prediction::ALL.into_iter().map(coded).min_by_key(|(_, trial)| trial.count());
    let (prediction, trial) = shortest.expect("there are predictions");
    columns.byte(prediction as u8);
    *bits = trial;
}

/// Writes the ticks in which a number changes, and the bits that change. The number starts at 0.
fn write_changes(numbers: impl Iterator<Item = u32>, columns: &mut Writer) {
    let mut before = 0;
    let changes: Vec<_> = (0u32..)
        .zip(numbers)
        .filter_map(|(index, number)| {
            let bits = number ^ before;
            before = number;
            (bits != 0).then_some((index, bits))
        })
        .collect();
    columns.count(changes.len());
    let mut gaps = Gaps::default();
    for (index, bits) in changes {
        gaps.write(columns, index);
        columns.leb32(bits);
    }
}

/// Writes the runs that make up the block, each as its length and behaviour.
fn write_runs(pointers: &[Pointer], columns: &mut Writer) {
    let mut before = None;
    let mut runs: Vec<(u32, PointerRun)> = Vec::new();
    for &pointer in pointers {
        let run = PointerRun::of(before, pointer);
        before = pointer;
        match runs.last_mut() {
            Some((length, last)) if *last == run => *length += 1,
            _ => runs.push((1, run)),
        }
    }
    for (length, run) in runs {
        columns.leb32(length << 2 | run as u32);
    }
}

fn write_moves(pointers: &[Pointer], prediction: Prediction, bits: &mut BitWriter) {
    let mut moves = PointerMoveCoder::new(prediction);
    let mut before = None;
    for &pointer in pointers {
        match pointer {
            Some(moved) if pointer != before => moves.write(moved, bits),
            _ => moves.rest(),
        }
        before = pointer;
    }
}

/// Reads a seat's inputs for `count` ticks.
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
    let mut moves = PointerMoveCoder::new(prediction);
    let mut pointer = None;
    let mut inputs = Vec::with_capacity(count);
    for (at, run) in runs.into_iter().enumerate() {
        match run {
            PointerRun::Moves => pointer = Some(moves.read(bits)?),
            PointerRun::Still | PointerRun::Leaves => moves.rest(),
        }
        if run == PointerRun::Leaves {
            pointer = None;
        }
        let input = Input::new(Buttons(buttons[at] as u16), pointer.map(in_units));
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
        let index = gaps.read(columns, count, field)? as usize;
        numbers[filled..index].fill(now);
        now ^= columns.leb_up_to(bits_max, field)?;
        filled = index;
    }
    numbers[filled..].fill(now);
    Ok(numbers)
}

fn read_runs(count: usize, columns: &mut Reader) -> Result<Vec<PointerRun>, DecodeError> {
    let field = "runs of a pointer";
    let mut runs = Vec::with_capacity(count);
    while runs.len() < count {
        let coded = columns.leb32(field)?;
        let run = match coded & 3 {
            0 => PointerRun::Still,
            1 => PointerRun::Moves,
            2 => PointerRun::Leaves,
            _ => return Err(DecodeError::OutOfRange { field }),
        };
        let length = (coded >> 2) as usize;
        check((1..=count - runs.len()).contains(&length), field)?;
        runs.resize(runs.len() + length, run);
    }
    Ok(runs)
}

/// Converts a pointer position that has already been rounded to quanta.
fn in_quanta(pointer: Vec2) -> Position {
    let quanta = pointer / POINTER_QUANTUM;
    [quanta.x as i32, quanta.y as i32]
}

fn in_units(quanta: Position) -> Vec2 {
    Vec2::new(quanta[0] as f32, quanta[1] as f32) * POINTER_QUANTUM
}
