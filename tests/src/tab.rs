//! One page in the browser: its state, its pictures, and a person's keys, mouse and fingers.
//!
//! Nothing here waits for a fixed time: [`Tab::until`] polls the page until a condition holds, and
//! fails at a deadline with the page's last state.

use crate::picture::Picture;
use crate::state::{Recorded, State};
use anyhow::{Context, Result, anyhow, bail};
use chromiumoxide::Page;
use chromiumoxide::cdp::browser_protocol::emulation::{
    SetDeviceMetricsOverrideParams, SetFocusEmulationEnabledParams, SetTouchEmulationEnabledParams,
};
use chromiumoxide::cdp::browser_protocol::input::{
    DispatchKeyEventParams, DispatchKeyEventType, DispatchMouseEventParams, DispatchMouseEventType,
    DispatchTouchEventParams, DispatchTouchEventReturns, DispatchTouchEventType, InsertTextParams,
    MouseButton, TouchPoint,
};
use chromiumoxide::cdp::browser_protocol::log::{EventEntryAdded, LogEntryLevel};
use chromiumoxide::cdp::browser_protocol::page::CaptureScreenshotFormat;
use chromiumoxide::cdp::js_protocol::runtime::{
    ConsoleApiCalledType, EvaluateParams, EventConsoleApiCalled, EventExceptionThrown, RemoteObject,
};
use chromiumoxide::page::ScreenshotParams;
use chromiumoxide::types::{Command, Method, MethodId};
use futures_util::StreamExt;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Much longer than anything takes on a busy machine with a software renderer.
const DEADLINE: Duration = Duration::from_secs(40);
const ASK_EVERY: Duration = Duration::from_millis(30);
/// Most screenshots taken until two of them are equal.
const PICTURES_MAX: usize = 40;

/// The page's state as JSON text, or null if there is none yet.
const STATE: &str = "(() => { const state = window.jostle?.state?.(); \
    return !state ? null : typeof state === 'string' ? state : JSON.stringify(state); })()";

/// Records the state in every frame, so that nothing is missed between two polls.
const RECORD: &str = r#"(() => {
    const recorded = window.recorded = {states: [], kinds: {}, particles: 0, emitters: 0};
    const look = () => {
        const said = window.jostle.state();
        const state = typeof said === 'string' ? JSON.parse(said) : said;
        if (!recorded.states.includes(state.state)) recorded.states.push(state.state);
        const kinds = {};
        for (const body of state.bodies ?? []) kinds[body.kind] = (kinds[body.kind] ?? 0) + 1;
        for (const kind in kinds)
            recorded.kinds[kind] = Math.max(recorded.kinds[kind] ?? 0, kinds[kind]);
        recorded.particles = Math.max(recorded.particles, state.particles ?? 0);
        recorded.emitters = Math.max(recorded.emitters, state.emitters ?? 0);
        requestAnimationFrame(look);
    };
    look();
    return true;
})()"#;

/// A screen size.
#[derive(Clone, Copy, Debug)]
pub struct Screen {
    /// CSS pixels.
    pub width: u32,
    /// CSS pixels.
    pub height: u32,
    /// Whether it is a phone: touched, not clicked.
    pub touch: bool,
}

impl Screen {
    /// Small, so that a software renderer keeps up.
    pub const SMALL: Screen = Screen { width: 640, height: 360, touch: false };
    /// The narrowest phone that is supported.
    pub const PHONE: Screen = Screen { width: 360, height: 740, touch: true };
    /// A laptop.
    pub const LAPTOP: Screen = Screen { width: 1280, height: 720, touch: false };
}

/// [`DispatchTouchEventParams`] without fingers: that type omits an empty list, which Chromium
/// refuses.
#[derive(Serialize)]
struct TouchEnd {
    #[serde(rename = "type")]
    kind: &'static str,
    #[serde(rename = "touchPoints")]
    touch_points: [(); 0],
}

impl Method for TouchEnd {
    fn identifier(&self) -> MethodId {
        DispatchTouchEventParams::IDENTIFIER.into()
    }
}

impl Command for TouchEnd {
    type Response = DispatchTouchEventReturns;
}

/// A page.
#[derive(Clone)]
pub struct Tab {
    page: Page,
    screen: Screen,
    errors: Arc<Mutex<Vec<String>>>,
}

impl Tab {
    /// Takes over an empty page.
    pub(crate) async fn new(page: Page, screen: Screen) -> Result<Tab> {
        let errors = Arc::default();
        listen(&page, &errors).await?;
        let (width, height) = (i64::from(screen.width), i64::from(screen.height));
        page.execute(SetDeviceMetricsOverrideParams::new(width, height, 1.0, screen.touch)).await?;
        if screen.touch {
            page.execute(SetTouchEmulationEnabledParams::new(true)).await?;
        }
        // Several windows play at once; each has to believe that it has the focus.
        page.execute(SetFocusEmulationEnabledParams::new(true)).await?;
        Ok(Tab { page, screen, errors })
    }

    /// Goes to an address.
    pub async fn go(&self, link: &str) -> Result<()> {
        self.page.goto(link).await.with_context(|| format!("cannot open {link}"))?;
        Ok(())
    }

    /// The address shown.
    pub async fn link(&self) -> Result<String> {
        self.eval("location.href").await
    }

    /// The value of a JavaScript expression; promises are awaited.
    pub async fn eval<T: DeserializeOwned>(&self, expression: &str) -> Result<T> {
        let params = EvaluateParams::builder()
            .expression(expression)
            .await_promise(true)
            .return_by_value(true)
            .user_gesture(true)
            .build()
            .map_err(|error| anyhow!(error))?;
        let answer = self.page.execute(params).await.with_context(|| expression.to_owned())?.result;
        if let Some(exception) = answer.exception_details {
            bail!("{expression}: {exception:?}");
        }
        let value = answer.result.value.unwrap_or_default();
        serde_json::from_value(value.clone())
            .with_context(|| format!("{expression} gave {value}, which is not what was expected"))
    }

    /// The page's state; empty while it is still loading.
    pub async fn state(&self) -> Result<State> {
        let text: Option<String> = self.eval(STATE).await?;
        match text {
            Some(text) => serde_json::from_str(&text).with_context(|| format!("state: {text}")),
            None => Ok(State::default()),
        }
    }

    /// Waits until the page's state satisfies `test`, and returns it.
    pub async fn until(&self, wanted: &str, test: impl Fn(&State) -> bool) -> Result<State> {
        let deadline = Instant::now() + DEADLINE;
        loop {
            let state = self.state().await?;
            if test(&state) {
                return Ok(state);
            }
            if Instant::now() > deadline {
                bail!("not seen in {} s: {wanted}; last state {state:?}", DEADLINE.as_secs());
            }
            tokio::time::sleep(ASK_EVERY).await;
        }
    }

    /// Waits until a JavaScript expression is true.
    pub async fn until_true(&self, expression: &str) -> Result<()> {
        let deadline = Instant::now() + DEADLINE;
        while !self.eval::<bool>(&format!("!!({expression})")).await? {
            if Instant::now() > deadline {
                let text: String = self.eval("document.body.innerText").await?;
                bail!("not true in {} s: {expression}; the page says: {text}", DEADLINE.as_secs());
            }
            tokio::time::sleep(ASK_EVERY).await;
        }
        Ok(())
    }

    /// Waits until this many more ticks were displayed: game time, independent of the machine.
    pub async fn ticks(&self, count: u32) -> Result<State> {
        let begin = self.state().await?.ticks();
        self.until(&format!("{count} ticks later"), |s| s.ticks() >= begin + count).await
    }

    /// Starts to record the page's state in every frame.
    pub async fn record(&self) -> Result<()> {
        self.eval::<bool>(RECORD).await.map(drop)
    }

    /// The recording so far.
    pub async fn recorded(&self) -> Result<Recorded> {
        self.eval("window.recorded").await
    }

    /// Runs a script in every page before its own scripts.
    pub async fn before_load(&self, script: &str) -> Result<()> {
        self.page.evaluate_on_new_document(script).await?;
        Ok(())
    }

    /// Position of a world point on the page, CSS pixels.
    pub async fn to_page(&self, point: [f32; 2]) -> Result<[f64; 2]> {
        let [x, y] = point;
        self.eval(&format!(
            "(() => {{ const p = window.jostle.to_page({x}, {y}); \
             const q = typeof p === 'string' ? JSON.parse(p) : p; \
             return [q[0] ?? q.x, q[1] ?? q.y]; }})()"
        ))
        .await
    }

    /// Presses a key and keeps it down: a letter, or a name such as `Escape`, `F3`.
    pub async fn key_down(&self, key: &str) -> Result<()> {
        self.key(key, DispatchKeyEventType::RawKeyDown).await
    }

    /// Releases a key.
    pub async fn key_up(&self, key: &str) -> Result<()> {
        self.key(key, DispatchKeyEventType::KeyUp).await
    }

    /// Presses a key, holds it for some ticks of the game, and releases it.
    pub async fn hold_key(&self, key: &str, ticks: u32) -> Result<()> {
        self.key_down(key).await?;
        self.ticks(ticks).await?;
        self.key_up(key).await
    }

    async fn key(&self, key: &str, kind: DispatchKeyEventType) -> Result<()> {
        let letter = key.chars().next().filter(|_| key.len() == 1);
        let (name, code, number) = match letter.map(|letter| letter.to_ascii_uppercase()) {
            Some(letter) => (key.to_ascii_lowercase(), format!("Key{letter}"), letter as i64),
            None => (key.to_owned(), key.to_owned(), number_of(key)),
        };
        let event = DispatchKeyEventParams::builder()
            .r#type(kind)
            .key(name)
            .code(code)
            .windows_virtual_key_code(number)
            .build()
            .map_err(|error| anyhow!(error))?;
        self.page.execute(event).await.with_context(|| format!("key {key}"))?;
        Ok(())
    }

    /// Moves the mouse to a world point; returns its position on the page.
    pub async fn aim(&self, point: [f32; 2]) -> Result<[f64; 2]> {
        let at = self.to_page(point).await?;
        self.move_to(at, false).await?;
        Ok(at)
    }

    /// Like [`Tab::until`], while the mouse stays on a world point, however the view moves.
    pub async fn until_aimed(
        &self,
        point: [f32; 2],
        held: bool,
        wanted: &str,
        test: impl Fn(&State) -> bool,
    ) -> Result<State> {
        let deadline = Instant::now() + DEADLINE;
        let mut aimed = None;
        loop {
            let at = self.to_page(point).await?;
            if aimed != Some(at) {
                self.move_to(at, held).await?;
                aimed = Some(at);
            }
            let state = self.state().await?;
            if test(&state) {
                return Ok(state);
            }
            if Instant::now() > deadline {
                bail!("not seen in {} s: {wanted}; last state {state:?}", DEADLINE.as_secs());
            }
            tokio::time::sleep(ASK_EVERY).await;
        }
    }

    /// Moves the mouse to a point of the page.
    pub async fn move_to(&self, [x, y]: [f64; 2], held: bool) -> Result<()> {
        let button = if held { MouseButton::Left } else { MouseButton::None };
        self.mouse(DispatchMouseEventType::MouseMoved, [x, y], button, held).await
    }

    /// Presses the left button at a point of the page.
    pub async fn mouse_down(&self, at: [f64; 2]) -> Result<()> {
        self.mouse(DispatchMouseEventType::MousePressed, at, MouseButton::Left, true).await
    }

    /// Releases the left button.
    pub async fn mouse_up(&self, at: [f64; 2]) -> Result<()> {
        self.mouse(DispatchMouseEventType::MouseReleased, at, MouseButton::Left, false).await
    }

    async fn mouse(
        &self,
        kind: DispatchMouseEventType,
        [x, y]: [f64; 2],
        button: MouseButton,
        held: bool,
    ) -> Result<()> {
        let moved = kind == DispatchMouseEventType::MouseMoved;
        let event = DispatchMouseEventParams::builder()
            .r#type(kind)
            .x(x)
            .y(y)
            .button(button)
            .buttons(i64::from(held))
            .click_count(i64::from(!moved))
            .build()
            .map_err(|error| anyhow!(error))?;
        self.page.execute(event).await.with_context(|| format!("mouse at {x}, {y}"))?;
        Ok(())
    }

    /// Clicks the first element that a CSS selector finds.
    pub async fn click_on(&self, selector: &str) -> Result<()> {
        let at = self.middle_of(selector).await?;
        self.move_to(at, false).await?;
        self.mouse_down(at).await?;
        self.mouse_up(at).await
    }

    /// Replaces the content of a field.
    pub async fn fill(&self, selector: &str, text: &str) -> Result<()> {
        self.click_on(selector).await?;
        self.eval::<bool>("(document.activeElement.select(), true)").await?;
        self.page.execute(InsertTextParams::new(text)).await?;
        Ok(())
    }

    /// Centre of the first element that a CSS selector finds, scrolled into view.
    pub async fn middle_of(&self, selector: &str) -> Result<[f64; 2]> {
        let quoted = serde_json::to_string(selector)?;
        let rectangle: Option<[f64; 2]> = self
            .eval(&format!(
                "(() => {{ const e = document.querySelector({quoted}); if (!e) return null; \
                 e.scrollIntoView({{block: 'nearest'}}); const r = e.getBoundingClientRect(); \
                 return r.width ? [r.x + r.width / 2, r.y + r.height / 2] : null; }})()"
            ))
            .await?;
        rectangle.with_context(|| format!("{selector} is not on the page"))
    }

    /// Puts a finger down, or moves it.
    pub async fn touch(&self, [x, y]: [f64; 2], moved: bool) -> Result<()> {
        let kind = if moved {
            DispatchTouchEventType::TouchMove
        } else {
            DispatchTouchEventType::TouchStart
        };
        let points = vec![TouchPoint::new(x, y)];
        let event = DispatchTouchEventParams::new(kind, points);
        self.page.execute(event).await.with_context(|| format!("finger at {x}, {y}"))?;
        Ok(())
    }

    /// Lifts all fingers.
    pub async fn lift(&self) -> Result<()> {
        let event = TouchEnd { kind: "touchEnd", touch_points: [] };
        self.page.execute(event).await.context("no finger lifted")?;
        Ok(())
    }

    /// A screenshot.
    pub async fn picture(&self) -> Result<Picture> {
        Picture::decode(&self.png().await?)
    }

    /// Saves a screenshot as `NAME.png` in the directory that `JOSTLE_PICTURES` names, if it is
    /// set.
    pub async fn keep(&self, name: &str) -> Result<()> {
        let Some(dir) = std::env::var_os("JOSTLE_PICTURES") else { return Ok(()) };
        self.picture().await?.save(&Path::new(&dir).join(format!("{name}.png")))
    }

    /// A screenshot, as soon as two in a row are equal: fonts and pictures are loaded.
    pub async fn steady_picture(&self) -> Result<Picture> {
        let mut before = self.png().await?;
        for _ in 0..PICTURES_MAX {
            let after = self.png().await?;
            if after == before {
                return Picture::decode(&after);
            }
            before = after;
        }
        bail!("the page still changes after {PICTURES_MAX} pictures")
    }

    /// Waits until a screenshot satisfies `test`, and returns it.
    pub async fn until_seen(
        &self,
        wanted: &str,
        test: impl Fn(&Picture) -> bool,
    ) -> Result<Picture> {
        let deadline = Instant::now() + DEADLINE;
        loop {
            let picture = self.picture().await?;
            if test(&picture) {
                return Ok(picture);
            }
            if Instant::now() > deadline {
                bail!("not seen on the screen in {} s: {wanted}", DEADLINE.as_secs());
            }
        }
    }

    /// A screenshot, as a PNG.
    pub async fn png(&self) -> Result<Vec<u8>> {
        let format = CaptureScreenshotFormat::Png;
        let params = ScreenshotParams::builder().format(format).build();
        self.page.screenshot(params).await.context("no screenshot")
    }

    /// Its screen.
    pub fn screen(&self) -> Screen {
        self.screen
    }

    /// Errors and exceptions of its console so far.
    pub fn errors(&self) -> Vec<String> {
        self.errors.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Removes errors that a test caused on purpose.
    pub fn ignore_errors(&self, expected: impl Fn(&str) -> bool) {
        let mut errors = self.errors.lock().unwrap_or_else(PoisonError::into_inner);
        errors.retain(|error| !expected(error));
    }
}

fn number_of(key: &str) -> i64 {
    match key {
        "Tab" => 9,
        "Enter" => 13,
        "Escape" => 27,
        "F2" => 113,
        "F3" => 114,
        "F4" => 115,
        "ArrowDown" => 40,
        _ => 0,
    }
}

/// Collects every error of the page's console.
async fn listen(page: &Page, errors: &Arc<Mutex<Vec<String>>>) -> Result<()> {
    let mut calls = page.event_listener::<EventConsoleApiCalled>().await?;
    let mut exceptions = page.event_listener::<EventExceptionThrown>().await?;
    let mut entries = page.event_listener::<EventEntryAdded>().await?;
    let errors = Arc::clone(errors);
    let file = move |error: String| {
        errors.lock().unwrap_or_else(PoisonError::into_inner).push(error);
    };
    let also = file.clone();
    tokio::spawn(async move {
        while let Some(call) = calls.next().await {
            if call.r#type == ConsoleApiCalledType::Error {
                let shown = |arg: &RemoteObject| match (&arg.value, &arg.description) {
                    (Some(value), _) => value.to_string(),
                    (None, description) => description.clone().unwrap_or_default(),
                };
                also(call.args.iter().map(shown).collect::<Vec<_>>().join(" "));
            }
        }
    });
    let also = file.clone();
    tokio::spawn(async move {
        while let Some(thrown) = exceptions.next().await {
            let details = &thrown.exception_details;
            let error = details.exception.as_ref().and_then(|error| error.description.as_ref());
            also(format!("{} {}", details.text, error.map_or("", String::as_str)));
        }
    });
    tokio::spawn(async move {
        while let Some(added) = entries.next().await {
            if added.entry.level == LogEntryLevel::Error {
                let url = added.entry.url.as_deref().unwrap_or("");
                file(format!("{} {url}", added.entry.text));
            }
        }
    });
    Ok(())
}
