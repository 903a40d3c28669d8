//! The page: [`app::App`] is its state and [`event`] defines its events and effects, both plain Rust. `dom` renders the
//! state into the document, and `shell` passes events and effects between the two. Only `dom` and `shell` require wasm.

mod address;
mod app;
mod bests;
mod captions;
mod card;
mod context;
mod dialogs;
#[cfg(target_arch = "wasm32")]
mod dom;
mod drafts;
mod edit_screen;
mod emotes;
mod event;
#[cfg(any(test, target_arch = "wasm32"))]
mod file_kind;
mod frame_clock;
mod game;
#[cfg(target_arch = "wasm32")]
mod hooks;
mod lobby;
mod name;
mod page_action;
mod panels;
mod plot;
mod qr_code;
#[cfg(target_arch = "wasm32")]
mod queue;
mod records;
mod replay_screen;
mod round;
mod screen;
mod settings;
#[cfg(target_arch = "wasm32")]
mod shell;
mod sound_desk;
mod storage;
mod strings;
mod tools;
mod view;
