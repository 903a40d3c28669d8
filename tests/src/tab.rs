//! One page in the browser: its state and screenshots, and simulated keys, mouse and touch.
//!
//! Nothing here waits for a fixed time: [`Tab::until`] polls the page until a condition holds, or fails at a deadline
//! with the page's most recent state.

use crate::devtools::{Event, Session, text};
use crate::picture::Picture;
use crate::scripts::{FRAMES, MIDDLE, RECORD, STATE};
use crate::server::LONG;
use crate::state::{Recorded, State};
use crate::tab_events::{exception_text, listen};
use anyhow::{Context, Result, bail};
use data_encoding::BASE64;
use futures_util::future::try_join_all;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, watch};

const ASK_EVERY: Duration = Duration::from_millis(50);

#[derive(Clone, Copy, Debug)]
pub struct Screen {
    /// Width in CSS pixels.
    pub width: u32,
    /// Height in CSS pixels.
    pub height: u32,
    /// Whether it is a touch screen that is operated without a mouse.
    pub touch: bool,
    /// Device pixels per CSS pixel. Fewer pixels are faster to draw, and the layout depends only on CSS pixels.
    pub scale: f64,
}

impl Screen {
    /// A screen small enough for a software renderer to keep up.
    pub const SMALL: Screen = Screen { width: 640, height: 360, touch: false, scale: 0.5 };
    /// A screen so small that drawing costs almost nothing.
    pub const TINY: Screen = Screen { width: 64, height: 36, touch: false, scale: 1.0 };
    /// The narrowest supported phone.
    pub const PHONE: Screen = Screen { width: 360, height: 740, touch: true, scale: 0.5 };
    /// A phone in landscape orientation.
    pub const PHONE_ON_SIDE: Screen = Screen { width: 640, height: 360, touch: true, scale: 0.5 };
    pub const LAPTOP: Screen = Screen { width: 1280, height: 720, touch: false, scale: 0.5 };
    pub const LARGE: Screen = Screen { width: 3840, height: 2160, touch: false, scale: 0.25 };

    /// The same screen at full resolution, for tests that examine pictures.
    pub const fn sharp(self) -> Screen {
        Screen { scale: 1.0, ..self }
    }

    fn metrics(self) -> Value {
        // Pictures meant for people have full resolution.
        let Screen { width, height, touch, scale } =
            if std::env::var_os("JOSTLE_PICTURES").is_some() { self.sharp() } else { self };
        json!({"width": width, "height": height, "deviceScaleFactor": scale, "mobile": touch})
    }
}

#[derive(Clone)]
pub struct Tab {
    session: Session,
    screen: Screen,
    errors: Arc<Mutex<Vec<String>>>,
    /// Identifier of the most recently loaded document.
    loaded: watch::Receiver<String>,
    /// Session of the newest frame of another site.
    framed: watch::Receiver<String>,
}

impl Tab {
    /// Takes over an empty page.
    pub(crate) async fn new(
        session: Session,
        events: mpsc::UnboundedReceiver<Event>,
        screen: Screen,
    ) -> Result<Tab> {
        let errors = Arc::default();
        let (loads, loaded) = watch::channel(String::new());
        let (frames, framed) = watch::channel(String::new());
        tokio::spawn(listen(events, [loads, frames], Arc::clone(&errors)));
        let touch = screen.touch;
        for (method, params) in [
            ("Page.enable", json!({})),
            ("Page.setLifecycleEventsEnabled", json!({"enabled": true})),
            ("Runtime.enable", json!({})),
            ("Log.enable", json!({})),
            ("Emulation.setDeviceMetricsOverride", screen.metrics()),
            ("Emulation.setTouchEmulationEnabled", json!({"enabled": touch})),
            // Several windows run concurrently, and each has to believe that it has the focus.
            ("Emulation.setFocusEmulationEnabled", json!({"enabled": true})),
        ] {
            session.call(method, params).await?;
        }
        Ok(Tab { session, screen, errors, loaded, framed })
    }

    /// Opens a page and returns the frame of another site in it, which runs a script before its own ones. Keys and the
    /// mouse reach the frame only through the page around it.
    pub async fn go_to_frame(&self, link: &str, script: &str) -> Result<Tab> {
        let params = json!({"autoAttach": true, "waitForDebuggerOnStart": true, "flatten": true});
        self.session.call("Target.setAutoAttach", params).await?;
        // The page counts as loaded only once its frame is.
        let (frame, ()) = tokio::try_join!(self.frame(script), self.go(link))?;
        Ok(frame)
    }

    async fn frame(&self, script: &str) -> Result<Tab> {
        let mut framed = self.framed.clone();
        let id = tokio::time::timeout(LONG, framed.wait_for(|id| !id.is_empty())).await;
        let id = id.context("no frame of another site")?.context("the page is gone")?.clone();
        let (session, events) = self.session.attached(id);
        let (loads, loaded) = watch::channel(String::new());
        let (frames, framed) = watch::channel(String::new());
        tokio::spawn(listen(events, [loads, frames], Arc::clone(&self.errors)));
        let frame = Tab { session, loaded, framed, ..self.clone() };
        // A frame that waits for the last command may not answer the others before.
        let calls = [
            ("Page.enable", json!({})),
            ("Runtime.enable", json!({})),
            ("Log.enable", json!({})),
            ("Page.addScriptToEvaluateOnNewDocument", json!({"source": script})),
            ("Runtime.runIfWaitingForDebugger", json!({})),
        ];
        try_join_all(calls.map(|(method, params)| frame.session.call(method, params))).await?;
        Ok(frame)
    }

    /// Navigates to a URL and waits until the page is loaded.
    pub async fn go(&self, link: &str) -> Result<()> {
        let answer = self.session.call("Page.navigate", json!({"url": link})).await?;
        if let Some(error) = answer["errorText"].as_str() {
            bail!("cannot open {link}: {error}");
        }
        // Without a new document, this is a navigation within the current page.
        if let Some(document) = answer["loaderId"].as_str() {
            let mut loaded = self.loaded.clone();
            let loaded = loaded.wait_for(|last| last == document);
            let loaded = tokio::time::timeout(LONG, loaded).await;
            loaded.with_context(|| format!("{link} is not loaded"))?.context("the page is gone")?;
        }
        Ok(())
    }

    /// Reloads the page and waits until it is loaded.
    pub async fn reload(&self) -> Result<()> {
        let mut loaded = self.loaded.clone();
        loaded.mark_unchanged();
        self.session.call("Page.reload", json!({})).await?;
        let again = tokio::time::timeout(LONG, loaded.changed()).await;
        again.context("the page is not loaded again")?.context("the page is gone")
    }

    /// Navigates to a path like a link within the page, without reloading.
    pub async fn go_within(&self, path: &str) -> Result<()> {
        let path = serde_json::to_string(path)?;
        let go = format!(
            "(history.pushState(null, '', {path}), dispatchEvent(new PopStateEvent('popstate')))"
        );
        self.eval::<bool>(&go).await.map(drop)
    }

    pub async fn link(&self) -> Result<String> {
        self.eval("location.href").await
    }

    /// Shows the page in a few colours that the visitor chose, as with the contrast themes of Windows.
    pub async fn force_colors(&self) -> Result<()> {
        let features = json!({"features": [{"name": "forced-colors", "value": "active"}]});
        self.session.call("Emulation.setEmulatedMedia", features).await.map(drop)
    }

    /// Evaluates a JavaScript expression; promises are awaited.
    pub async fn eval<T: DeserializeOwned>(&self, expression: &str) -> Result<T> {
        let params = json!({
            "expression": expression, "awaitPromise": true, "returnByValue": true,
            "userGesture": true,
        });
        let answer = self.session.call("Runtime.evaluate", params).await;
        let mut answer = answer.with_context(|| expression.to_owned())?;
        if let Some(exception) = answer.get("exceptionDetails") {
            bail!("{expression}: {}", exception_text(exception));
        }
        let value = answer["result"]["value"].take();
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
        let deadline = Instant::now() + LONG;
        loop {
            let state = self.state().await?;
            if test(&state) {
                return Ok(state);
            }
            if Instant::now() > deadline {
                bail!("not seen in {} s: {wanted}; last state {state:?}", LONG.as_secs());
            }
            tokio::time::sleep(ASK_EVERY).await;
        }
    }

    /// Waits until a JavaScript expression is true.
    pub async fn until_true(&self, expression: &str) -> Result<()> {
        let deadline = Instant::now() + LONG;
        while !self.eval::<bool>(&format!("!!({expression})")).await? {
            if Instant::now() > deadline {
                let text: String = self.eval("document.body.innerText").await?;
                bail!("not true in {} s: {expression}; the page says: {text}", LONG.as_secs());
            }
            tokio::time::sleep(ASK_EVERY).await;
        }
        Ok(())
    }

    /// Waits until `count` more ticks have been displayed, which is game time and does not depend on the machine.
    pub async fn ticks(&self, count: u32) -> Result<State> {
        let begin = self.state().await?.ticks();
        self.until(&format!("{count} ticks later"), |s| s.ticks() >= begin + count).await
    }

    /// Starts recording the page's state in every frame.
    pub async fn record(&self) -> Result<()> {
        self.eval::<bool>(RECORD).await.map(drop)
    }

    /// Returns the recording so far.
    pub async fn recorded(&self) -> Result<Recorded> {
        self.eval("window.recorded").await
    }

    /// Runs a script in every page before its own scripts.
    pub async fn before_load(&self, script: &str) -> Result<()> {
        let params = json!({"source": script});
        self.session.call("Page.addScriptToEvaluateOnNewDocument", params).await.map(drop)
    }

    /// Position of a world point on the page, in CSS pixels.
    pub async fn to_page(&self, point: [f32; 2]) -> Result<[f64; 2]> {
        let [x, y] = point;
        self.eval(&format!(
            "(() => {{ const p = window.jostle.to_page({x}, {y}); \
             const q = typeof p === 'string' ? JSON.parse(p) : p; \
             return [q[0] ?? q.x, q[1] ?? q.y]; }})()"
        ))
        .await
    }

    /// Whether a press at a world point hits the world rather than a page element above it.
    pub async fn is_open(&self, point: [f32; 2]) -> Result<bool> {
        let [x, y] = self.to_page(point).await?;
        self.eval(&format!("document.elementFromPoint({x}, {y})?.id === 'stage'")).await
    }

    /// Presses a key and keeps it down: a letter, or a name such as `Escape` or `F3`.
    pub async fn key_down(&self, key: &str) -> Result<()> {
        self.key(key, "rawKeyDown").await
    }

    pub async fn key_up(&self, key: &str) -> Result<()> {
        self.key(key, "keyUp").await
    }

    /// Presses a key, holds it for a number of the game's ticks, and releases it.
    pub async fn hold_key(&self, key: &str, ticks: u32) -> Result<()> {
        self.key_down(key).await?;
        self.ticks(ticks).await?;
        self.key_up(key).await
    }

    /// Presses and releases a key, with `Ctrl+`, `Shift+` or `Alt+` before its name if needed.
    pub async fn press(&self, chord: &str) -> Result<()> {
        let mut parts: Vec<&str> = chord.split('+').collect();
        let key = parts.pop().context("a key")?;
        let bit = |name: &&str| ["Alt", "Ctrl", "Meta", "Shift"].iter().position(|k| k == name);
        let modifiers = parts.iter().filter_map(bit).fold(0, |all, bit| all | 1 << bit);
        self.key_with(key, "rawKeyDown", modifiers).await?;
        if key == "Enter" {
            let event = json!({"type": "char", "text": "\r"});
            self.session.call("Input.dispatchKeyEvent", event).await?;
        }
        self.key_with(key, "keyUp", modifiers).await
    }

    async fn key(&self, key: &str, kind: &str) -> Result<()> {
        self.key_with(key, kind, 0).await
    }

    async fn key_with(&self, key: &str, kind: &str, modifiers: u32) -> Result<()> {
        let letter = key.chars().next().filter(|_| key.len() == 1);
        let (name, code, number) = match letter.map(|letter| letter.to_ascii_uppercase()) {
            Some(letter) => (key.to_ascii_lowercase(), format!("Key{letter}"), letter as i64),
            None => (key.to_owned(), key.to_owned(), number_of(key)),
        };
        let event = json!({
            "type": kind, "key": name, "code": code, "windowsVirtualKeyCode": number,
            "modifiers": modifiers,
        });
        let sent = self.session.call("Input.dispatchKeyEvent", event).await;
        sent.with_context(|| format!("key {key}")).map(drop)
    }

    /// Moves the mouse to a world point; returns its position on the page.
    pub async fn aim(&self, point: [f32; 2]) -> Result<[f64; 2]> {
        let at = self.to_page(point).await?;
        self.move_to(at, false).await?;
        Ok(at)
    }

    /// Like [`Tab::until`], but keeps the mouse over a world point while the view moves.
    pub async fn until_aimed(
        &self,
        point: [f32; 2],
        held: bool,
        wanted: &str,
        test: impl Fn(&State) -> bool,
    ) -> Result<State> {
        let deadline = Instant::now() + LONG;
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
                bail!("not seen in {} s: {wanted}; last state {state:?}", LONG.as_secs());
            }
            tokio::time::sleep(ASK_EVERY).await;
        }
    }

    /// Moves the mouse to a point on the page.
    pub async fn move_to(&self, at: [f64; 2], held: bool) -> Result<()> {
        self.mouse("mouseMoved", at, held).await
    }

    /// Presses the left mouse button at a point on the page.
    pub async fn mouse_down(&self, at: [f64; 2]) -> Result<()> {
        self.mouse("mousePressed", at, true).await
    }

    /// Releases the left mouse button.
    pub async fn mouse_up(&self, at: [f64; 2]) -> Result<()> {
        self.mouse("mouseReleased", at, false).await
    }

    async fn mouse(&self, kind: &str, [x, y]: [f64; 2], held: bool) -> Result<()> {
        let moved = kind == "mouseMoved";
        let event = json!({
            "type": kind, "x": x, "y": y, "button": if moved && !held { "none" } else { "left" },
            "buttons": u8::from(held), "clickCount": u8::from(!moved),
        });
        let sent = self.session.call("Input.dispatchMouseEvent", event).await;
        sent.with_context(|| format!("mouse at {x}, {y}")).map(drop)
    }

    /// Clicks the first element that matches a CSS selector.
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
        self.session.call("Input.insertText", json!({"text": text})).await.map(drop)
    }

    /// Scrolls the first element that matches a CSS selector into view and returns its centre.
    pub async fn middle_of(&self, selector: &str) -> Result<[f64; 2]> {
        let quoted = serde_json::to_string(selector)?;
        let middle: Option<[f64; 2]> = self.eval(&format!("({MIDDLE})({quoted})")).await?;
        middle.with_context(|| format!("{selector} is not on the page"))
    }

    /// Starts or moves a touch.
    pub async fn touch(&self, [x, y]: [f64; 2], moved: bool) -> Result<()> {
        let kind = if moved { "touchMove" } else { "touchStart" };
        let sent = self.fingers(kind, json!([{"x": x, "y": y}])).await;
        sent.with_context(|| format!("finger at {x}, {y}"))
    }

    /// Drags with the left mouse button from one point on the page to another, in several steps.
    pub async fn drag(&self, from: [f64; 2], to: [f64; 2]) -> Result<()> {
        self.move_to(from, false).await?;
        self.mouse_down(from).await?;
        for at in way(from, to) {
            self.move_to(at, true).await?;
        }
        self.mouse_up(to).await
    }

    /// Drags with a finger.
    pub async fn swipe(&self, from: [f64; 2], to: [f64; 2]) -> Result<()> {
        self.touch(from, false).await?;
        for at in way(from, to) {
            self.touch(at, true).await?;
        }
        self.lift().await
    }

    pub async fn lift(&self) -> Result<()> {
        self.fingers("touchEnd", json!([])).await.context("no finger lifted")
    }

    async fn fingers(&self, kind: &str, points: Value) -> Result<()> {
        let event = json!({"type": kind, "touchPoints": points});
        self.session.call("Input.dispatchTouchEvent", event).await.map(drop)
    }

    pub async fn picture(&self) -> Result<Picture> {
        Picture::decode(&self.png().await?)
    }

    /// Saves a screenshot as `NAME.png` in the directory named by `JOSTLE_PICTURES`, if that is set.
    pub async fn keep(&self, name: &str) -> Result<()> {
        let Some(dir) = std::env::var_os("JOSTLE_PICTURES") else { return Ok(()) };
        // Wait until the latest changes are drawn.
        self.eval::<bool>(FRAMES).await?;
        self.picture().await?.save(&Path::new(&dir).join(format!("{name}.png")))
    }

    /// Saves screenshots for a phone, a laptop and a large screen, as `NAME-WIDTH.png`, and then for the tab's own
    /// screen.
    pub async fn keep_on_all_screens(&self, name: &str) -> Result<()> {
        if std::env::var_os("JOSTLE_PICTURES").is_none() {
            return Ok(());
        }
        let all = [Screen::PHONE, Screen::LAPTOP, Screen::LARGE];
        for screen in all.into_iter().chain([self.screen]) {
            self.resize(screen).await?;
            self.keep(&format!("{name}-{}", screen.width)).await?;
        }
        Ok(())
    }

    /// Gives the page another screen of the same kind.
    pub async fn resize(&self, screen: Screen) -> Result<()> {
        let metrics = screen.metrics();
        self.session.call("Emulation.setDeviceMetricsOverride", metrics).await.map(drop)
    }

    /// Closes the page, which cannot be used afterwards.
    pub(crate) async fn close(&self) -> Result<()> {
        self.session.call("Page.close", json!({})).await.map(drop)
    }

    /// Whether both tabs refer to the same page.
    pub(crate) fn is(&self, other: &Tab) -> bool {
        Arc::ptr_eq(&self.errors, &other.errors)
    }

    /// Takes screenshots until two in a row are equal, so that fonts and pictures are loaded.
    pub async fn steady_picture(&self) -> Result<Picture> {
        let deadline = Instant::now() + LONG;
        let mut before = self.png().await?;
        while Instant::now() <= deadline {
            let after = self.png().await?;
            if after == before {
                return Picture::decode(&after);
            }
            before = after;
        }
        bail!("the page still changes after {} s", LONG.as_secs())
    }

    /// Waits until a screenshot satisfies `test`, and returns it.
    pub async fn until_seen(
        &self,
        wanted: &str,
        test: impl Fn(&Picture) -> bool,
    ) -> Result<Picture> {
        let deadline = Instant::now() + LONG;
        loop {
            let picture = self.picture().await?;
            if test(&picture) {
                return Ok(picture);
            }
            if Instant::now() > deadline {
                bail!("not seen on the screen in {} s: {wanted}", LONG.as_secs());
            }
        }
    }

    /// Takes a screenshot and returns it as a PNG.
    pub async fn png(&self) -> Result<Vec<u8>> {
        self.session.call("Page.bringToFront", json!({})).await?;
        let params = json!({"format": "png", "optimizeForSpeed": true});
        let answer = self.session.call("Page.captureScreenshot", params).await?;
        BASE64.decode(text(&answer, "data")?.as_bytes()).context("a screenshot of another kind")
    }

    pub fn screen(&self) -> Screen {
        self.screen
    }

    /// The console errors and exceptions so far.
    pub fn errors(&self) -> Vec<String> {
        self.errors.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Waits until the console shows such an error.
    pub async fn until_error(&self, test: impl Fn(&str) -> bool) -> Result<()> {
        let deadline = Instant::now() + LONG;
        while !self.errors().iter().any(|error| test(error)) {
            if Instant::now() > deadline {
                bail!("no such error in {} s, but {:?}", LONG.as_secs(), self.errors());
            }
            tokio::time::sleep(ASK_EVERY).await;
        }
        Ok(())
    }

    /// Discards errors that a test caused on purpose.
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
        "ArrowLeft" => 37,
        "ArrowUp" => 38,
        "ArrowRight" => 39,
        "ArrowDown" => 40,
        "Delete" => 46,
        _ => 0,
    }
}

/// Points along the way from one point to another, including the latter.
fn way(from: [f64; 2], to: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
    const STEPS: u32 = 6;
    (1..=STEPS).map(move |step| {
        let share = f64::from(step) / f64::from(STEPS);
        std::array::from_fn(|axis| from[axis] + (to[axis] - from[axis]) * share)
    })
}
