//! The last ticks of a room as clients see them, and the coded way from each of them to now.

use crate::HISTORY_TICKS;
use jostle_protocol::limits::EVENTS_MAX;
use jostle_protocol::{ServerMessage, Snapshot, TimedEvent};
use jostle_sim::Event;
use std::collections::VecDeque;
use std::sync::Arc;

/// Snapshots of the last [`HISTORY_TICKS`] ticks; there is always one.
#[derive(Clone, Debug)]
pub struct History {
    moments: VecDeque<Moment>,
    /// Coded messages to the newest tick, by baseline. A search through at most `HISTORY_TICKS`
    /// entries is nothing next to an encoding.
    coded: Vec<(Option<u32>, Arc<[u8]>)>,
}

/// One tick.
#[derive(Clone, Debug)]
struct Moment {
    snapshot: Snapshot,
    events: Vec<TimedEvent>,
}

impl History {
    /// A history that begins with this snapshot.
    pub fn new(first: Snapshot) -> History {
        let moment = Moment { snapshot: first, events: Vec::new() };
        History { moments: VecDeque::from([moment]), coded: Vec::new() }
    }

    /// The newest snapshot.
    pub fn newest(&self) -> &Snapshot {
        &self.moments.back().expect("a history is never empty").snapshot
    }

    /// Files the snapshot of the next tick and what that tick reported.
    pub fn push(&mut self, snapshot: Snapshot, events: &[Event]) {
        let tick = snapshot.tick;
        debug_assert_eq!(tick, self.newest().tick + 1, "ticks must follow each other");
        let events = events.iter().map(|&event| TimedEvent { tick, event }).collect();
        if self.moments.len() == HISTORY_TICKS {
            self.moments.pop_front();
        }
        self.moments.push_back(Moment { snapshot, events });
        self.coded.clear();
    }

    /// The coded message that leads from a tick to the newest one; from nowhere if the tick is not
    /// kept, or if more happened since than one message may tell.
    pub fn since(&mut self, baseline: Option<u32>) -> Arc<[u8]> {
        if let Some((_, bytes)) = self.coded.iter().find(|(known, _)| *known == baseline) {
            return Arc::clone(bytes);
        }
        let place = baseline.and_then(|tick| self.place(tick));
        let events = place.map_or(Vec::new(), |place| self.events_after(place));
        let Some(place) = place.filter(|_| events.len() <= EVENTS_MAX) else {
            return self.keyframe(baseline);
        };
        let bytes = self.newest().encode(Some(&self.moments[place].snapshot), &events);
        self.share(baseline, bytes)
    }

    /// Place of a tick in `moments`, if it is kept.
    fn place(&self, tick: u32) -> Option<usize> {
        let age = self.newest().tick.checked_sub(tick)?;
        (self.moments.len() - 1).checked_sub(age as usize)
    }

    fn events_after(&self, place: usize) -> Vec<TimedEvent> {
        self.moments.range(place + 1..).flat_map(|moment| &moment.events).copied().collect()
    }

    /// A keyframe tells no past events. All who need one share it, whatever they asked for: only
    /// `None` is kept, so that invented baselines cannot fill the list.
    fn keyframe(&mut self, baseline: Option<u32>) -> Arc<[u8]> {
        if baseline.is_some() {
            return self.since(None);
        }
        let bytes = self.newest().encode(None, &[]);
        self.share(None, bytes)
    }

    fn share(&mut self, baseline: Option<u32>, snapshot: Vec<u8>) -> Arc<[u8]> {
        let bytes: Arc<[u8]> = ServerMessage::Snapshot(snapshot).encode().into();
        self.coded.push((baseline, Arc::clone(&bytes)));
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jostle_sim::Seat;

    fn snapshot(tick: u32) -> Snapshot {
        Snapshot { tick, ..Snapshot::default() }
    }

    /// A history of `ticks` ticks, each of which reports one event that tells them apart.
    fn history(ticks: u32) -> History {
        let mut history = History::new(snapshot(0));
        for tick in 1..=ticks {
            history.push(snapshot(tick), &[Event::Joined(Seat(tick as u8 % 64))]);
        }
        history
    }

    fn decode(bytes: &[u8], baseline: Option<u32>) -> (Snapshot, Vec<TimedEvent>) {
        let message = ServerMessage::decode(bytes).unwrap();
        let ServerMessage::Snapshot(bytes) = message else { panic!("{message:?}") };
        Snapshot::decode(&bytes, baseline.map(snapshot).as_ref()).unwrap()
    }

    #[test]
    fn a_late_client_gets_the_joined_delta_with_each_event_once() {
        let mut history = history(40);
        for baseline in [39, 38, 30, 0] {
            let (found, events) = decode(&history.since(Some(baseline)), Some(baseline));
            assert_eq!(found.tick, 40);
            let ticks: Vec<_> = events.iter().map(|event| event.tick).collect();
            assert_eq!(ticks, (baseline + 1..=40).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_newest_tick_is_a_baseline_too() {
        let (found, events) = decode(&history(5).since(Some(5)), Some(5));
        assert_eq!((found.tick, events), (5, Vec::new()));
    }

    #[test]
    fn who_is_too_late_or_from_the_future_gets_a_keyframe_without_events() {
        let mut history = history(200);
        let oldest = 200 - (HISTORY_TICKS as u32 - 1);
        assert_eq!(decode(&history.since(Some(oldest)), Some(oldest)).1.len(), HISTORY_TICKS - 1);
        let keyframe = history.since(None);
        assert_eq!(decode(&keyframe, None), (snapshot(200), Vec::new()));
        for baseline in [oldest - 1, 0, 201, u32::MAX] {
            assert!(Arc::ptr_eq(&history.since(Some(baseline)), &keyframe));
        }
    }

    #[test]
    fn bytes_are_shared_within_a_tick_and_only_there() {
        let mut history = history(10);
        let bytes = history.since(Some(7));
        assert!(Arc::ptr_eq(&bytes, &history.since(Some(7))));
        assert!(!Arc::ptr_eq(&bytes, &history.since(Some(8))));
        history.push(snapshot(11), &[]);
        assert_eq!(decode(&history.since(Some(7)), Some(7)).0.tick, 11);
    }

    #[test]
    fn more_events_than_a_message_may_hold_make_a_keyframe() {
        let mut history = history(1);
        history.push(snapshot(2), &vec![Event::Joined(Seat(0)); EVENTS_MAX]);
        assert_eq!(decode(&history.since(Some(1)), Some(1)).1.len(), EVENTS_MAX);
        let keyframe = history.since(None);
        assert!(Arc::ptr_eq(&history.since(Some(0)), &keyframe));
    }
}
