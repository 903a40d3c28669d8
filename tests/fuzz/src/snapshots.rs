//! Snapshots that inputs start from.

use jostle_game::{Kind, Seat};
use jostle_protocol::limits::QUANTA_MAX;
use jostle_protocol::{Appearance, PlayerState, Snapshot, SnapshotBody, SnapshotStream};
use jostle_sim::{BodyId, Shape};
use std::sync::{Arc, OnceLock};

/// The streams that [`crate::delta`] starts from: empty, with bodies at rest, with moving bodies, and the same at the
/// limits of the world.
pub fn streams() -> &'static [SnapshotStream] {
    static STREAMS: OnceLock<Vec<SnapshotStream>> = OnceLock::new();
    STREAMS.get_or_init(|| {
        let after = |bodies: i32, way: i32, from: i32| {
            let mut stream = SnapshotStream::new(1);
            for tick in 0..5 {
                stream.encode(&Arc::new(sample(tick, bodies, way, from)), &[]);
            }
            stream
        };
        vec![
            SnapshotStream::default(),
            after(3, 0, 0),
            after(40, 9, -100),
            after(9, 1000, QUANTA_MAX - 4000),
            after(400, 1, 0),
        ]
    })
}

/// A snapshot with bodies, every other one of which moves by `way` quanta per tick, and with two players, one of whom
/// has a pointer.
pub fn sample(tick: u32, bodies: i32, way: i32, from: i32) -> Snapshot {
    let moved = way * tick as i32;
    let body = |index: i32| SnapshotBody {
        id: BodyId { index: index as u32, generation: 1 },
        kind: Kind::Block,
        owner: (index == 0).then_some(Seat(1)),
        group: 0,
        shape: Shape::circle(1.5),
        quanta: [from + if index % 2 == 0 { moved } else { 0 }, -from],
    };
    let player = |seat: u8| PlayerState {
        seat: Seat(seat.into()),
        appearance: Appearance { name: format!("P{seat}").into(), color: seat },
        connected: true,
        input_seq: tick,
        hero: None,
        selected: None,
        held: None,
        score: 7,
        pointer: (seat == 1).then_some([from + moved, 0]),
    };
    Snapshot {
        tick,
        bodies: (0..bodies).map(body).collect(),
        players: vec![player(1), player(4)],
        round: None,
    }
}
