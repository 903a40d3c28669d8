//! The replays of a server: lines to the files of rooms, and clips.

use super::store::ReplayStore;
use super::writer::LogWriter;
use crate::host::random;
use crate::limits;
use crate::limits::address_rate_limiter::AddressRateLimiter;
use crate::limits::networks::widest;
use jostle_protocol::ClipRefusal;
use jostle_protocol::replay::{Record, Replay, Start, header};
use jostle_room::log::{CLIP_TICKS, cut};
use std::io;
use std::net::IpAddr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, UNIX_EPOCH};

/// Clips of one address in a minute, in all rooms: as many as those of one room, as a class that plays together asks for.
const ADDRESS_CLIPS_PER_MINUTE_MAX: u32 = 8;

/// A server's replays, as its rooms know them.
pub struct Recording {
    store: Arc<ReplayStore>,
    writer: Arc<LogWriter>,
    /// Clips that wait, or are being cut.
    waiting_clips: Arc<AtomicUsize>,
    /// Limits on how many clips each address asks for.
    clip_rates: Mutex<AddressRateLimiter>,
}

/// The clips of each address, for all rooms of a server.
pub(super) fn clip_rates() -> AddressRateLimiter {
    let per_second = f64::from(ADDRESS_CLIPS_PER_MINUTE_MAX) / 60.0;
    AddressRateLimiter::new(per_second, ADDRESS_CLIPS_PER_MINUTE_MAX as usize)
}

impl Recording {
    /// Has this writer keep replays.
    pub fn new(store: Arc<ReplayStore>, writer: Arc<LogWriter>) -> Recording {
        let (waiting_clips, clip_rates) = (Arc::default(), Mutex::new(clip_rates()));
        Recording { store, writer, waiting_clips, clip_rates }
    }

    pub fn store(&self) -> &Arc<ReplayStore> {
        &self.store
    }

    /// Seconds since 1970.
    pub fn unix_s(&self) -> u64 {
        let wall = (self.store.settings().wall)();
        wall.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO).as_secs()
    }

    /// Counts a clip that a client of this address asks for; `false` if there were too many in all rooms.
    pub fn admit_clip(&self, address: IpAddr, now: Instant) -> bool {
        self.clip_rates.lock().unwrap_or_else(PoisonError::into_inner).admit(address, now)
    }

    /// Has a clip cut out of these records and kept. The answer comes from the writer's thread, or at once if it has too
    /// much to do. A clip that is not listed is a private room's: its name and its file do not tell the room's code, which
    /// lets in whom it is shown.
    pub fn keep_clip(
        &self,
        mut records: Vec<Arc<Record>>,
        listed: bool,
        asked_by: Option<IpAddr>,
        answer: impl Fn(Result<String, ClipRefusal>) + Clone + Send + 'static,
    ) {
        let waiting = Arc::clone(&self.waiting_clips);
        if waiting.fetch_add(1, Ordering::Relaxed) >= limits::CLIPS_WAITING_MAX {
            waiting.fetch_sub(1, Ordering::Relaxed);
            return answer(Err(ClipRefusal::TooMany));
        }
        let answer = move |kept| {
            waiting.fetch_sub(1, Ordering::Relaxed);
            answer(kept);
        };
        if let Some(Record::Start(start)) =
            records.first_mut().filter(|_| !listed).map(Arc::make_mut)
        {
            start.room = format!("{:016x}", random());
        }
        let (store, asked_by) = (Arc::clone(&self.store), asked_by.map(widest));
        let answer_kept = answer.clone();
        let queued = self.writer.once(move || {
            let kept = clip(&records)
                .and_then(|(start, bytes)| store.keep_clip(&start, listed, asked_by, &bytes));
            answer_kept(kept.map_err(|error| {
                store.policy().failed(&error);
                ClipRefusal::Failed
            }));
        });
        if !queued {
            answer(Err(ClipRefusal::Failed));
        }
    }
}

/// The start of a clip, and its bytes: the last ticks of a replay.
fn clip(records: &[Arc<Record>]) -> io::Result<(Start, Vec<u8>)> {
    let bytes = header().into_iter().chain(records.iter().flat_map(|record| record.seal()));
    let replay = Replay::read(bytes.collect()).map_err(io::Error::other)?;
    let (start, to) = (replay.start().clone(), replay.last_tick());
    let clip = cut(replay, to.saturating_sub(CLIP_TICKS), to).map_err(io::Error::other)?;
    Ok((start, clip))
}
