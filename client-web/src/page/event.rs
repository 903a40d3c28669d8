//! The page's events and effects. An [`Event`] is anything that the browser, the network or the player does; an
//! [`Effect`] is anything that the page asks of the browser. `App::update` turns events into effects.

use crate::editor::update::EditorEvent;
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
    /// The path, including the leading slash.
    pub path: String,
    /// The query, including the `?`, or empty.
    pub query: String,
    /// The fragment, including the `#`, or empty.
    pub hash: String,
}

/// The canvas for a frame, in device pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Canvas {
    /// Width and height, neither zero.
    pub pixels: [u32; 2],
    /// The heights that the HUD covers at the top and at the bottom.
    pub top: u32,
    pub bottom: u32,
    /// Width in CSS pixels.
    pub css_width: u32,
}

/// A key that was pressed or released.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    /// The key's position on the keyboard (`KeyboardEvent.code`).
    pub code: String,
    pub letter: String,
    pub repeat: bool,
    /// Whether Ctrl, Meta or Alt is held; the system may then swallow the release.
    pub modified: bool,
    /// Whether Ctrl or Meta is held.
    pub command: bool,
    pub shift: bool,
    /// The kind of element that has the focus.
    pub focus: Focus,
}

impl Key {
    /// Whether the key only changes the meaning of others.
    pub fn is_modifier(&self) -> bool {
        matches!(
            self.letter.as_str(),
            "Shift" | "Control" | "Alt" | "Meta" | "AltGraph" | "CapsLock" | "Dead"
        )
    }
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

/// A change in the state of a pointer over the canvas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pointer {
    /// The kind of change.
    pub change: PointerChange,
    /// The browser's id for the pointer.
    pub id: i32,
    /// Whether the pointer is a finger.
    pub touch: bool,
    /// Position on the canvas, CSS pixels.
    pub at: Vec2,
    /// Size of the canvas, CSS pixels.
    pub canvas: Vec2,
    /// The changed button: primary (0), secondary (2), another one, or none (-1).
    pub button: i16,
    /// Whether the primary or secondary button is down.
    pub pressed: bool,
    pub shift: bool,
    pub alt: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointerChange {
    /// A finger or the first button went down.
    Down,
    /// The pointer moved, or another button changed.
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
    /// Whether the room to open is not listed.
    pub private: bool,
    /// Whether bots take part in games played alone.
    pub bots: bool,
}

/// Anything that happens to the page.
#[derive(Debug, PartialEq)]
pub enum Event {
    /// The page was opened, or its address changed through the browser's history.
    Navigated(Address),
    /// The periodic pulse, every fifth of a second.
    Pulse {
        hidden: bool,
    },
    /// The browser requests a frame. `None` while drawing is not possible.
    Frame(Option<Canvas>),
    /// The frame was drawn, or could not be.
    Drawn(bool),
    /// The network is back.
    Online,
    /// The page lost focus, so releases of keys and buttons may not arrive.
    FocusLost,
    /// The tab is closing or reloading.
    Closing,
    KeyDown(Key),
    KeyUp(Key),
    /// The state of a pointer over the canvas changed.
    Pointer(Pointer),
    /// The wheel turned at this point over the canvas, by this many CSS pixels.
    Wheel(Vec2, f32),
    /// An on-screen tool button was chosen for the next touch.
    ToolArmed(Buttons),
    /// An on-screen tool button was pressed or released.
    ToolPressed(Buttons, bool),
    /// An element with an action (`data-action`) was clicked; the string is its `data-value`.
    Clicked(PageAction, String),
    /// The name or colour changed.
    FormChanged(Form),
    PlayClicked(Form),
    /// Another name or colour was chosen in a room.
    LookChosen(String, u8),
    /// A scene's card was clicked.
    SceneClicked(String, Form),
    /// A scene should be played alone.
    AloneClicked(String, Form),
    /// The state of a session's socket changed.
    Socket(u32, SocketEvent),
    /// A test asks to break the connection as a network failure would.
    ConnectionCut,
    /// The server answered a request, or failed to.
    Answered(Request, Option<String>),
    /// An attempt to fetch a scene file by the scene's name succeeded or failed.
    SceneFetched(String, Fetched),
    /// An attempt to fetch a replay by its file address succeeded or failed.
    ReplayFetched(String, Fetched),
    /// An attempt to read a local scene file with this name succeeded or failed.
    SceneRead(String, Result<Vec<u8>, SceneError>),
    /// An attempt to read a local replay file succeeded or failed.
    ReplayRead(String, Result<Vec<u8>, ReplayError>),
    /// A file is dragged over the page.
    FileDragged,
    /// An attempt to copy the link succeeded or failed.
    Copied(bool),
    /// The copy button should show its normal label again.
    CopyShown,
    /// Drawing is not possible, because setting it up or drawing itself failed.
    GraphicsFailed,
    /// The browser took the drawing context away.
    ContextLost,
    /// The browser restored the drawing context.
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
    /// Another tab wrote or removed a value in the browser's storage: the key and its current value.
    StoredElsewhere(String, Option<String>),
    /// A draft was stored under this scene name, or under none for a new scene. The outer `None` means that the storage
    /// is full or blocked.
    DraftKept(Draft, Option<Option<String>>),
    /// Something happened in the editor.
    Edited(EditorEvent),
    /// The controls of a field in the editor's form changed: the field's path and their values.
    FieldChanged(String, Vec<String>),
    /// The words of the editor's form were fetched: the address of the documentation, and the file.
    WordsCame([String; 2]),
}

/// A change to the settings.
#[derive(Clone, Debug, PartialEq)]
pub enum SettingsEvent {
    Language(String),
    /// The request for a language file succeeded or failed.
    LanguageCame(String, Option<String>),
    Calm(bool),
    /// The page entered or left full-screen mode.
    FullScreen(bool),
    /// The browser reported the letters of the keys, by key code.
    Layout(Vec<(String, String)>),
    /// The first gamepad was connected, or the last one disconnected.
    PadConnected(bool),
    /// The gamepad's state, sent every frame while one is connected.
    Pad(PadState),
    DeadZone(u8),
}

/// Anything the page asks of the browser.
#[derive(Debug, PartialEq)]
pub enum Effect {
    /// Prevents the default action of the DOM event that caused this.
    PreventDefault,
    /// Indicates whether a dragged file would be accepted.
    OfferDrop(bool),
    /// Adds this path to the browser's history.
    PushAddress(String),
    Reload,
    /// Opens a file chooser for a replay or a scene.
    ChooseFile,
    CopyAddress,
    /// Gives the keyboard focus to the canvas.
    FocusStage,
    /// Opens the socket of a session, replacing any other.
    Connect {
        path: String,
        session: u32,
        /// Origin of the server; empty for the page's own.
        origin: String,
        /// Whether to use HTTP instead of a WebSocket.
        over_http: bool,
    },
    /// Sends a message if the socket is open.
    Send(Vec<u8>),
    Disconnect {
        /// Whether the player leaves on purpose, so that the server can tell this from a broken connection.
        leaving: bool,
    },
    SetConditions(NetworkConditions),
    Request(Request),
    /// Fetches a scene file by the scene's name.
    FetchScene(String),
    /// Fetches a replay by its file address.
    FetchReplay(String),
    /// Stores or removes a value for later visits.
    StoreLocal(String, Option<String>),
    /// Stores or removes a value for this tab.
    StoreSession(String, Option<String>),
    /// Stores the draft of a scene.
    StoreDraft(Draft),
    /// Drops everything created with the lost drawing context.
    DropGraphics,
    Sound(SoundTask),
    /// Fetches a language file.
    FetchLanguage(String),
    /// Fetches the words of the editor's form.
    FetchWords,
    /// Enters or leaves full-screen mode.
    FullScreen(bool),
    /// Saves a text as a file with this name.
    SaveFile(String, String),
    /// Saves a clip as a file.
    SaveClip(Vec<u8>),
    /// Copies a link to the clipboard.
    CopyLink(String),
    /// Focuses the edited text at this byte.
    FocusText(usize),
    /// Delivers an event after a delay in milliseconds.
    After(i32, Event),
    /// Writes a warning to the developer console.
    Warn(String),
}
