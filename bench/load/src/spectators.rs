//! Spectators of a room, which read every snapshot and acknowledge four times per second.

use anyhow::{Result, anyhow};
use jostle_cli::bots::socket::{next, send, watch};
use jostle_cli::bots::target::BotTarget;
use jostle_game::Input;
use jostle_protocol::{Appearance, ClientMessage, SnapshotStream};
use tokio::task::JoinHandle;

/// Snapshots per acknowledgement.
const ACK_EVERY: u64 = 15;
/// Bits in a message's first byte that mark a snapshot and a keyframe.
const SNAPSHOT: u8 = 0x80;
const KEYFRAME: u8 = 0x40;

/// Traffic received by one spectator.
#[derive(Clone, Copy, Debug, Default)]
pub struct Watched {
    pub snapshots: u64,
    pub bytes: u64,
}

pub struct Spectators(Vec<JoinHandle<Result<Watched>>>);

impl Spectators {
    /// Connects `count` spectators to a room.
    pub async fn come(count: u32, target: &BotTarget) -> Result<Spectators> {
        let mut tasks = Vec::new();
        for _ in 0..count {
            let appearance = Appearance { name: "eye".into(), color: 0 };
            let socket = watch(target, appearance).await.map_err(|end| anyhow!("{end}"))?;
            tasks.push(tokio::spawn(read(socket)));
        }
        Ok(Spectators(tasks))
    }

    /// Disconnects the spectators; fails if any of them has lost its socket.
    pub async fn go(self) -> Result<()> {
        for task in self.0 {
            if task.is_finished() {
                task.await??;
            } else {
                task.abort();
            }
        }
        Ok(())
    }
}

async fn read(mut socket: jostle_cli::bots::socket::Socket) -> Result<Watched> {
    let (mut watched, mut tick, mut seq) = (Watched::default(), 0u32, 0);
    loop {
        let Some(bytes) = next(&mut socket).await.map_err(|end| anyhow!("{end}"))? else {
            continue;
        };
        watched.bytes += bytes.len() as u64;
        match bytes.first() {
            Some(kind) if kind & (SNAPSHOT | KEYFRAME) == SNAPSHOT | KEYFRAME => {
                let mut stream = SnapshotStream::default();
                stream.decode(&bytes)?;
                tick = stream.newest().map_or(tick, |newest| newest.tick);
            }
            Some(kind) if kind & SNAPSHOT != 0 => {
                tick += u32::from(bytes.get(1).map_or(0, |low| low.wrapping_sub(tick as u8)));
            }
            _ => continue,
        }
        watched.snapshots += 1;
        if watched.snapshots.is_multiple_of(ACK_EVERY) {
            seq += 1;
            let (ack_tick, input) = (tick as u16, Input::default());
            let ack = ClientMessage::Input { seq, ack_tick, input };
            send(&mut socket, &ack).await.map_err(|end| anyhow!("{end}"))?;
        }
    }
}
