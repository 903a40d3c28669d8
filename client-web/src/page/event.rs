//! The page's two vocabularies: an [`Event`] is anything the browser, the network or the player does;
//! an [`Effect`] is anything the page asks of the browser. Between them stands `App::update`.

use crate::editor::update::Deed;
use crate::input::pad::PadState;
use crate::net::api::Request;
use crate::net::report::{Fetched, SocketEvent};
use crate::net::simulated_link::NetworkConditions;
use crate::page::drafts::Draft;
use crate::page::page_action::PageAction;
use crate::sound::task::{SoundEvent, SoundTask};
use jostle_game::Buttons;
use jostle_game::scene::SceneError;
use jostle_protocol::replay::ReplayError;
use jostle_sim::Vec2;

/// The part of the page's address that selects a screen.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Address {
    /// From the first slash on.
    pub path: String,
    /// From `?` on, or empty.
    pub query: String,
    /// From `#` on, or empty.
    pub hash: String,
}

/// The canvas of a frame, in device pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Canvas {
    /// Width and height, neither zero.
    pub pixels: [u32; 2],
    /// The parts at the top and at the bottom that the hud covers.
    pub top: u32,
    pub bottom: u32,
    /// Width in CSS pixels.
    pub css_width: u32,
}

/// A key that went down or up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    /// Its place on the keyboard (`KeyboardEvent.code`).
    pub code: String,
    pub letter: String,
    pub repeat: bool,
    /// Ctrl, Meta or Alt is held: the system may take the release.
    pub modified: bool,
    /// Ctrl or Meta is.
    pub command: bool,
    pub shift: bool,
    /// The kind of element that has the focus.
    pub focus: Focus,
}

/// The kind of element that has the focus when a key goes down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Focus {
    /// A field, slider, checkbox or radio button.
    Field,
    Button,
    /// Anything else, usually the canvas.
    Elsewhere,
}

/// A change of a pointer over the canvas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pointer {
    /// The kind of change.
    pub change: PointerChange,
    /// The browser's number of the pointer.
    pub id: i32,
    /// It is a finger.
    pub touch: bool,
    /// Position on the canvas, CSS pixels.
    pub at: Vec2,
    /// Size of the canvas, CSS pixels.
    pub canvas: Vec2,
    /// The primary or secondary button changed (0, 2), another did, or none (-1).
    pub button: i16,
    /// The primary or secondary button is down.
    pub pressed: bool,
    pub shift: bool,
    pub alt: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointerChange {
    /// A finger or the first button went down.
    Down,
    /// It moved, or a further button changed.
    Moved,
    /// A finger or the last button went up.
    Up,
    /// The mouse left the canvas.
    Left,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Form {
    /// The name as typed.
    pub name: String,
    pub color: u8,
    pub private: bool,
    /// Bots play too where the game is played alone.
    pub bots: bool,
}

/// Anything that happens to the page.
#[derive(Debug, PartialEq)]
pub enum Event {
    /// The address changed by the browser's buttons, or the page was opened.
    Navigated(Address),
    /// A fifth of a second passed.
    Pulse {
        hidden: bool,
    },
    /// The browser wants a frame; no canvas while nothing can be drawn.
    Frame(Option<Canvas>),
    /// The frame was drawn, or could not be.
    Drawn(bool),
    /// The network is back.
    Online,
    /// The page lost the focus: releases of keys and buttons may not arrive.
    FocusLost,
    /// The tab is closed, or loaded again.
    Closing,
    KeyDown(Key),
    KeyUp(Key),
    /// A pointer over the canvas changed.
    Pointer(Pointer),
    /// The wheel turned over the canvas: at this point, CSS pixels, by this many pixels.
    Wheel(Vec2, f32),
    /// A tool button of the touch screen was chosen for the next touch.
    ToolArmed(Buttons),
    /// A tool button of the touch screen went down or up.
    ToolPressed(Buttons, bool),
    /// Something with an action (`data-action`) was clicked, and its value (`data-value`).
    Clicked(PageAction, String),
    /// Name or colour changed.
    FormChanged(Form),
    PlayClicked(Form),
    /// A scene's card was pressed.
    SceneClicked(String, Form),
    /// A scene is to be played alone.
    AloneClicked(String, Form),
    /// The socket of a session changed.
    Socket(u32, SocketEvent),
    /// The connection is to be closed as a broken network would.
    ConnectionCut,
    /// The server answered a request, or did not.
    Answered(Request, Option<String>),
    /// The file of a scene came, by the scene's name, or did not.
    SceneFetched(String, Fetched),
    /// A replay came, by the address of its file, or did not.
    ReplayFetched(String, Fetched),
    /// A scene file of this machine was read, by the file's name, or could not be.
    SceneRead(String, Result<Vec<u8>, SceneError>),
    /// A replay file of this machine was read, or could not be.
    ReplayRead(String, Result<Vec<u8>, ReplayError>),
    /// A file is dragged over the page.
    FileDragged,
    /// The link was copied, or could not be.
    Copied(bool),
    /// The copy button shows its own label again.
    CopyShown,
    /// Nothing can be drawn: drawing could not be set up, or failed.
    GraphicsFailed,
    /// The browser took the drawing context.
    ContextLost,
    /// The browser gave the drawing context back.
    ContextRestored,
    /// A tick was chosen on the timeline of the replay.
    SeekChosen(u32),
    /// A speed was chosen for the replay.
    SpeedChosen(f64),
    /// Prediction was switched on or off.
    PredictionChosen(bool),
    ConditionsChosen(NetworkConditions),
    Sound(SoundEvent),
    Settings(SettingsEvent),
    /// Another tab wrote a value into the browser's storage, or forgot it: the key, and what is there now.
    StoredElsewhere(String, Option<String>),
    /// A draft was kept as that of the scene with this name, or of one's own; not at all if the storage is full or forbidden.
    DraftKept(Draft, Option<Option<String>>),
    /// Something was done to the scene that is edited.
    Edited(Deed),
    /// The controls of a field of the editor's form changed: its path, and their values.
    FieldChanged(String, Vec<String>),
}

/// A change of the settings.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingsEvent {
    Language(String),
    /// The file of a language came, or did not.
    LanguageCame(String, Option<String>),
    Calm(bool),
    /// The page got the whole screen, or gave it back.
    FullScreen(bool),
    /// The browser knows the letters of keys, by their places.
    Layout(Vec<(String, String)>),
    /// A gamepad was connected, or the last one is gone.
    PadConnected(bool),
    /// Once a frame while one is connected.
    Pad(PadState),
    DeadZone(u8),
}

/// Anything the page asks of the browser.
#[derive(Debug, PartialEq)]
pub enum Effect {
    /// The browser is not to act on the DOM event that caused this.
    PreventDefault,
    /// A dragged file would be taken, or would not.
    OfferDrop(bool),
    /// The address becomes this path.
    PushAddress(String),
    /// Loads the page again.
    Reload,
    /// Lets the player choose a file: a replay or a scene.
    ChooseFile,
    CopyAddress,
    /// Gives the keyboard focus to the canvas.
    FocusStage,
    /// Opens the socket of a session in place of any other.
    Connect {
        path: String,
        session: u32,
        /// Origin of the server; empty for the page's own.
        origin: String,
    },
    /// Sends a message if the socket is open.
    Send(Vec<u8>),
    Disconnect {
        /// The player leaves on purpose, which the server can tell from a broken connection.
        leaving: bool,
    },
    SetConditions(NetworkConditions),
    Request(Request),
    /// Fetches the file of a scene by the scene's name.
    FetchScene(String),
    /// Fetches a replay by the address of its file.
    FetchReplay(String),
    /// Remembers a value for later visits, or forgets it.
    StoreLocal(String, Option<String>),
    /// Remembers a value for this tab, or forgets it.
    StoreSession(String, Option<String>),
    /// Keeps the draft of a scene.
    StoreDraft(Draft),
    /// Drops everything that was made with the lost drawing context.
    DropGraphics,
    Sound(SoundTask),
    /// Fetches the file of a language.
    FetchLanguage(String),
    /// Asks for the whole screen, or gives it back.
    FullScreen(bool),
    /// Saves a text as a file of this name.
    SaveFile(String, String),
    /// Saves a clip as a file.
    SaveClip(Vec<u8>),
    /// Puts a link into the clipboard.
    CopyLink(String),
    /// Gives the keyboard focus to the text that is edited, at this byte.
    FocusText(usize),
    /// Delivers an event later.
    After(i32, Event),
    /// Writes a line for developers.
    Warn(String),
}
