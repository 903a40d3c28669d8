//! The queue between the browser and the page. Listeners push events; the shell drains the queue and
//! handles them in order. An event that occurs while another is handled waits its turn: none is dropped.

use crate::page::event::Event;
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;

/// An event, and the DOM event that caused it.
pub struct QueuedEvent {
    pub event: Event,
    /// The DOM event, whose default may be prevented.
    pub source: Option<web_sys::Event>,
}

struct EventQueue {
    waiting: RefCell<VecDeque<QueuedEvent>>,
    /// Empties the queue, unless that is going on already.
    drain: fn(),
}

/// A handle on the queue. There is one queue, which lives as long as the page.
#[derive(Clone, Copy)]
pub struct Events(&'static EventQueue);

thread_local! {
    /// The program has ended by a mistake of its own: nothing is handled any more.
    static CRASHED: Cell<bool> = const { Cell::new(false) };
}

pub fn crash() {
    CRASHED.set(true);
}

pub fn has_crashed() -> bool {
    CRASHED.get()
}

impl Events {
    /// A queue that is emptied by `drain`.
    pub fn new(drain: fn()) -> Events {
        Events(Box::leak(Box::new(EventQueue { waiting: RefCell::default(), drain })))
    }

    /// Adds an event and has the queue emptied.
    pub fn push(self, event: Event) {
        self.add(QueuedEvent { event, source: None });
    }

    /// The same for an event that came with a DOM event.
    pub fn push_from(self, event: Event, source: &web_sys::Event) {
        self.add(QueuedEvent { event, source: Some(source.clone()) });
    }

    fn add(self, arrival: QueuedEvent) {
        if !has_crashed() {
            self.0.waiting.borrow_mut().push_back(arrival);
            (self.0.drain)();
        }
    }

    /// Takes the oldest event.
    pub fn pop(self) -> Option<QueuedEvent> {
        self.0.waiting.borrow_mut().pop_front()
    }
}
