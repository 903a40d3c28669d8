//! The event queue between the browser and the page. Listeners push events; the shell drains the queue and handles them
//! in order. Events that occur while another is being handled wait; none are dropped.

use crate::page::event::Event;
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;

/// An event and the DOM event that caused it.
pub struct QueuedEvent {
    pub event: Event,
    /// The DOM event, so that its default action can be prevented.
    pub source: Option<web_sys::Event>,
}

struct EventQueue {
    waiting: RefCell<VecDeque<QueuedEvent>>,
    /// Drains the queue, unless that is already in progress.
    drain: fn(),
}

/// A handle to the queue. There is only one queue, which lives as long as the page.
#[derive(Clone, Copy)]
pub struct Events(&'static EventQueue);

thread_local! {
    /// Whether the program has crashed, so that no more events are handled.
    static CRASHED: Cell<bool> = const { Cell::new(false) };
}

pub fn crash() {
    CRASHED.set(true);
}

pub fn has_crashed() -> bool {
    CRASHED.get()
}

impl Events {
    /// Creates a queue that is drained by `drain`.
    pub fn new(drain: fn()) -> Events {
        Events(Box::leak(Box::new(EventQueue { waiting: RefCell::default(), drain })))
    }

    /// Adds an event and drains the queue.
    pub fn push(self, event: Event) {
        self.add(QueuedEvent { event, source: None });
    }

    /// Like [`Events::push`], for an event caused by a DOM event.
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
