//! The HTTP side of the port: the page, its files, the lists of scenes and rooms, and the upgrade
//! that starts a session. Small on purpose; whatever is not listed in [`route`] is refused.

mod origin;
mod replays;

use crate::App;
use crate::assets::{self, File};
use crate::limits;
use crate::rooms::{CreateError, is_code};
use http_body_util::{BodyExt, Either, Full, LengthLimitError, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::header::{self, HeaderMap, HeaderValue};
use hyper::upgrade::OnUpgrade;
use hyper::{Method, Request, Response, StatusCode};
use serde::{Deserialize, Serialize};
use std::net::IpAddr;
use std::sync::atomic::Ordering;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::handshake::server::create_response_with_body;

/// What every answer is.
pub type Answer = Response<Body>;

/// Bytes in memory, or a file that is read as it is sent.
pub type Body = Either<Full<Bytes>, replays::FileBody>;

/// An accepted upgrade: the room's code, and the connection once hyper lets go of it.
pub struct Upgrade {
    /// The word in the path.
    pub code: String,
    /// Whom it counts for.
    pub address: IpAddr,
    /// Resolves when the answer was sent.
    pub connection: OnUpgrade,
}

/// Scripts and wasm come from here alone, sockets lead here alone, nobody may frame the page.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; \
    style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; media-src 'self'; font-src 'self'; \
    connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action 'none'; \
    frame-ancestors 'none'";

/// Why a page of another site is refused.
const FOREIGN: &str =
    "this page belongs to another site; its host can be allowed with --allow-origin";

/// Answers one request of `peer`. An upgrade is answered here and handed out for the connection to follow.
pub async fn answer(
    request: Request<Incoming>,
    peer: IpAddr,
    app: &App,
) -> (Answer, Option<Upgrade>) {
    let address = origin::client_address(request.headers(), peer, &app.trusted_proxies);
    let (mut answer, upgrade) = route(request, address, app).await;
    let headers = answer.headers_mut();
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers
        .insert(header::CONTENT_SECURITY_POLICY, HeaderValue::from_static(CONTENT_SECURITY_POLICY));
    (answer, upgrade)
}

async fn route(
    request: Request<Incoming>,
    address: IpAddr,
    app: &App,
) -> (Answer, Option<Upgrade>) {
    let path = request.uri().path().to_owned();
    // A CONNECT names no path, and `OPTIONS *` none with a slash.
    let word = path.strip_prefix('/').unwrap_or_default();
    let upgrades = request.headers().contains_key(header::UPGRADE);
    let reads = matches!(*request.method(), Method::GET | Method::HEAD);
    if (upgrades || !reads) && !origin::is_welcome(request.headers(), &app.origins) {
        app.metrics.turned_away("foreign_page");
        tracing::info!(%address, origin = ?request.headers().get(header::ORIGIN), "foreign page");
        return (failed(StatusCode::FORBIDDEN, FOREIGN), None);
    }
    if upgrades {
        return upgrade(request, word, address);
    }
    let answer = match path.as_str() {
        "/api/rooms" if *request.method() == Method::POST => {
            create_room(request, address, app).await
        }
        _ if !reads => not_allowed(&path),
        "/" => page(request.headers(), StatusCode::OK),
        "/api/scenes" => json(StatusCode::OK, &scenes(app)),
        "/api/rooms" => json(StatusCode::OK, &rooms(app)),
        "/api/replays" => replays::list(app),
        _ => other_path(request.headers(), word, app).await,
    };
    (answer, None)
}

/// Paths with a name in them.
async fn other_path(headers: &HeaderMap, word: &str, app: &App) -> Answer {
    match word.split_once('/') {
        Some(("assets", name)) => asset(headers, name),
        Some(("replays", file)) => replays::file(file, app).await,
        Some(("replay", name)) => page(headers, replays::page_status(name, app)),
        _ => room_page(headers, word, app),
    }
}

// The page and its files.

/// A room's link, or what somebody took for one. The page itself says when there is no such room;
/// the status says it to others.
fn room_page(headers: &HeaderMap, word: &str, app: &App) -> Answer {
    match meant_code(word) {
        _ if app.rooms.knows(word) => page(headers, StatusCode::OK),
        Some(code) if code != word => see(&code),
        _ => page(headers, StatusCode::NOT_FOUND),
    }
}

/// The code that a link was to name before it was typed by hand, capitalised by a phone, or copied
/// with the space or the slash after it.
pub fn meant_code(word: &str) -> Option<String> {
    let text = percent_decoded(word)?;
    let code = text.trim_matches(|c: char| c == '/' || c.is_whitespace()).to_ascii_lowercase();
    is_code(&code).then_some(code)
}

/// `None` if what stands after a `%` is no byte, or the bytes are no text.
fn percent_decoded(word: &str) -> Option<String> {
    let mut parts = word.split('%');
    let mut bytes = parts.next()?.as_bytes().to_vec();
    for part in parts {
        let (digits, rest) = part.split_at_checked(2)?;
        let byte = digits.bytes().all(|digit| digit.is_ascii_hexdigit()).then_some(digits)?;
        bytes.push(u8::from_str_radix(byte, 16).ok()?);
        bytes.extend_from_slice(rest.as_bytes());
    }
    String::from_utf8(bytes).ok()
}

/// Sends a browser to a room's own link.
fn see(code: &str) -> Answer {
    let mut answer = text(StatusCode::FOUND, "This room has another link.\n");
    let link = HeaderValue::try_from(format!("/{code}")).expect("codes are plain ASCII");
    answer.headers_mut().insert(header::LOCATION, link);
    answer
}

fn page(headers: &HeaderMap, status: StatusCode) -> Answer {
    match assets::find("index.html") {
        Some(file) => served(headers, file, status),
        None => {
            let mut answer = text(status, assets::NOT_BUILT);
            let html = HeaderValue::from_static(assets::content_type("index.html"));
            answer.headers_mut().insert(header::CONTENT_TYPE, html);
            answer
        }
    }
}

fn asset(headers: &HeaderMap, name: &str) -> Answer {
    assets::find(name).map_or_else(not_found, |file| served(headers, file, StatusCode::OK))
}

/// Names carry no hash, so browsers must ask again each time; the ETag makes that cheap.
fn served(headers: &HeaderMap, file: &'static File, status: StatusCode) -> Answer {
    served_from(headers, file, assets::find_brotli(file.name), status)
}

fn served_from(
    headers: &HeaderMap,
    file: &'static File,
    packed: Option<&'static File>,
    status: StatusCode,
) -> Answer {
    let chosen = packed.filter(|_| accepts_brotli(headers)).unwrap_or(file);
    let fresh = status == StatusCode::OK && has_etag(headers, chosen.etag);
    let (status, bytes) =
        if fresh { (StatusCode::NOT_MODIFIED, &[][..]) } else { (status, chosen.bytes) };
    let mut answer = respond(status, assets::content_type(file.name), Bytes::from_static(bytes));
    let answered = answer.headers_mut();
    answered.insert(header::ETAG, HeaderValue::from_static(chosen.etag));
    answered.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if packed.is_some() {
        answered.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
    }
    if !std::ptr::eq(chosen, file) {
        answered.insert(header::CONTENT_ENCODING, HeaderValue::from_static("br"));
    }
    answer
}

fn accepts_brotli(headers: &HeaderMap) -> bool {
    let values = headers.get_all(header::ACCEPT_ENCODING).iter();
    values.filter_map(|value| value.to_str().ok()).flat_map(|value| value.split(',')).any(
        |coding| {
            let (name, quality) = coding.split_once(';').unwrap_or((coding, "q=1"));
            let refused = quality.trim().strip_prefix("q=").is_some_and(|q| q.parse() == Ok(0.0));
            name.trim().eq_ignore_ascii_case("br") && !refused
        },
    )
}

fn has_etag(headers: &HeaderMap, etag: &str) -> bool {
    let values = headers.get_all(header::IF_NONE_MATCH).iter();
    values
        .filter_map(|value| value.to_str().ok())
        .flat_map(|value| value.split(','))
        .any(|held| held.trim().trim_start_matches("W/") == etag)
}

// The lists.

#[derive(Serialize)]
struct Scenes {
    scenes: Vec<SceneEntry>,
}

#[derive(Serialize)]
struct SceneEntry {
    name: String,
    title: String,
    about: String,
    players_max: u16,
    /// Path of the picture; `null` for scenes that have none.
    picture: Option<String>,
}

#[derive(Serialize)]
struct RoomList {
    rooms: Vec<RoomEntry>,
}

#[derive(Serialize)]
struct RoomEntry {
    code: String,
    scene: String,
    title: String,
    players: usize,
    players_max: u16,
}

fn scenes(app: &App) -> Scenes {
    let entry = |scene: &std::sync::Arc<jostle_sim::Scene>| {
        let picture = format!("pictures/{}.png", scene.name);
        SceneEntry {
            name: scene.name.clone(),
            title: scene.title.clone(),
            about: scene.about.clone(),
            players_max: scene.players_max,
            picture: assets::find(&picture).map(|file| format!("/assets/{}", file.name)),
        }
    };
    Scenes { scenes: app.rooms.scenes().iter().map(entry).collect() }
}

fn rooms(app: &App) -> RoomList {
    let entry = |facts: &std::sync::Arc<crate::rooms::Facts>| RoomEntry {
        code: facts.code.clone(),
        scene: facts.scene.name.clone(),
        title: facts.scene.title.clone(),
        players: facts.players.load(Ordering::Relaxed),
        players_max: facts.scene.players_max,
    };
    let open = app.rooms.list();
    RoomList { rooms: open.iter().filter(|facts| !facts.private).map(entry).collect() }
}

// Creating a room.

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Create {
    scene: String,
    /// Whether it is in no list.
    #[serde(default)]
    private: bool,
}

#[derive(Serialize)]
struct Created {
    code: String,
    /// What the creator's hello has to hold to be the host.
    host_key: String,
}

#[derive(Serialize)]
struct Failed {
    error: String,
}

async fn create_room(request: Request<Incoming>, address: IpAddr, app: &App) -> Answer {
    let body = match timeout(app.waits.http_body, read_body(request)).await {
        Ok(Ok(body)) => body,
        Ok(Err(answer)) => return answer,
        Err(_late) => {
            return failed(StatusCode::REQUEST_TIMEOUT, "the body came too slowly; send it again");
        }
    };
    let create: Create = match serde_json::from_slice(&body) {
        Ok(create) => create,
        Err(error) => {
            let text = format!(
                "the body must be {{\"scene\":\"NAME\"}}, with \"private\":true for a private room: {error}"
            );
            return failed(StatusCode::BAD_REQUEST, &text);
        }
    };
    match app.rooms.create(&create.scene, create.private, address) {
        Ok(room) => {
            let created = Created { code: room.code, host_key: room.host_key.text() };
            json(StatusCode::CREATED, &created)
        }
        Err(error) => {
            tracing::info!(%address, scene = ?create.scene, reason = ?error, "no room created");
            failed(refused_status(&error), &error.to_string())
        }
    }
}

fn refused_status(error: &CreateError) -> StatusCode {
    match error {
        CreateError::NoSuchScene(_) => StatusCode::NOT_FOUND,
        CreateError::TooManyOfAddress => StatusCode::TOO_MANY_REQUESTS,
        CreateError::TooMany | CreateError::NotNow => StatusCode::SERVICE_UNAVAILABLE,
    }
}

async fn read_body(request: Request<Incoming>) -> Result<Bytes, Answer> {
    let limited = Limited::new(request.into_body(), limits::HTTP_BODY_BYTES_MAX);
    match limited.collect().await {
        Ok(body) => Ok(body.to_bytes()),
        Err(error) if error.is::<LengthLimitError>() => {
            let text = format!("the body is longer than {} bytes", limits::HTTP_BODY_BYTES_MAX);
            Err(failed(StatusCode::PAYLOAD_TOO_LARGE, &text))
        }
        Err(_) => Err(failed(StatusCode::BAD_REQUEST, "the body could not be read")),
    }
}

// The upgrade.

/// Any word is accepted as a room here: only on the socket can the page be told what is wrong. One
/// that cannot be a code becomes none at all, which is no room either.
fn upgrade(
    mut request: Request<Incoming>,
    word: &str,
    address: IpAddr,
) -> (Answer, Option<Upgrade>) {
    let code = if is_code(word) { word } else { "" };
    match create_response_with_body(&request, || Body::Left(Full::default())) {
        Ok(answer) => {
            let connection = hyper::upgrade::on(&mut request);
            (answer, Some(Upgrade { code: code.to_owned(), address, connection }))
        }
        Err(error) => {
            let answer = failed(StatusCode::BAD_REQUEST, &format!("no WebSocket upgrade: {error}"));
            (answer, None)
        }
    }
}

// Answers.

fn respond(status: StatusCode, content_type: &'static str, body: Bytes) -> Answer {
    let mut answer = Response::new(Body::Left(Full::new(body)));
    *answer.status_mut() = status;
    answer.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(content_type));
    answer
}

fn text(status: StatusCode, body: &'static str) -> Answer {
    respond(status, "text/plain; charset=utf-8", Bytes::from_static(body.as_bytes()))
}

fn json(status: StatusCode, value: &impl Serialize) -> Answer {
    let body = serde_json::to_vec(value).expect("these structs hold strings and numbers only");
    let mut answer = respond(status, "application/json", body.into());
    answer.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    answer
}

fn failed(status: StatusCode, error: &str) -> Answer {
    json(status, &Failed { error: error.to_owned() })
}

fn not_found() -> Answer {
    text(StatusCode::NOT_FOUND, "Nothing is here. The playground is at /\n")
}

fn not_allowed(path: &str) -> Answer {
    let allowed = if path == "/api/rooms" { "GET, HEAD, POST" } else { "GET, HEAD" };
    let mut answer = text(StatusCode::METHOD_NOT_ALLOWED, "This method is not allowed here.\n");
    answer.headers_mut().insert(header::ALLOW, HeaderValue::from_static(allowed));
    answer
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(name: header::HeaderName, value: &'static str) -> HeaderMap {
        HeaderMap::from_iter([(name, HeaderValue::from_static(value))])
    }

    #[test]
    fn brotli_is_used_only_where_it_is_welcome() {
        for yes in ["br", "gzip, deflate, br", "gzip;q=1.0, BR ; q=0.5"] {
            assert!(accepts_brotli(&headers(header::ACCEPT_ENCODING, yes)), "{yes}");
        }
        for no in ["gzip", "brotli", "br;q=0", "br; q=0.000", ""] {
            assert!(!accepts_brotli(&headers(header::ACCEPT_ENCODING, no)), "{no}");
        }
    }

    static PLAIN: File = File { name: "client.js", etag: "\"plain\"", bytes: b"let answer = 42;" };
    static PACKED: File = File { name: "client.js.br", etag: "\"packed\"", bytes: b"packed" };

    /// Status, ETag and coding of the answer to a browser that sends these two headers.
    fn asked(accepts: &'static str, holds: &'static str) -> (u16, String, bool) {
        let mut sent = headers(header::ACCEPT_ENCODING, accepts);
        sent.insert(header::IF_NONE_MATCH, HeaderValue::from_static(holds));
        let answer = served_from(&sent, &PLAIN, Some(&PACKED), StatusCode::OK);
        let got = answer.headers();
        assert_eq!(got[header::VARY], "accept-encoding");
        assert_eq!(got[header::CACHE_CONTROL], "no-cache");
        assert_eq!(got[header::CONTENT_TYPE], "text/javascript; charset=utf-8");
        let etag = got[header::ETAG].to_str().expect("text").to_owned();
        (answer.status().as_u16(), etag, got.contains_key(header::CONTENT_ENCODING))
    }

    #[test]
    fn the_variant_that_a_browser_holds_is_not_sent_again() {
        assert_eq!(asked("br", ""), (200, PACKED.etag.into(), true));
        assert_eq!(asked("gzip", ""), (200, PLAIN.etag.into(), false));
        assert_eq!(asked("br", "\"packed\""), (304, PACKED.etag.into(), true));
        assert_eq!(asked("br", "\"plain\""), (200, PACKED.etag.into(), true));
        assert_eq!(asked("gzip", "W/\"plain\""), (304, PLAIN.etag.into(), false));
    }

    #[test]
    fn odd_links_mean_a_room() {
        for word in ["ABC", "abc/", "/abc", "%20abc", "Abc%20/", "abc%C2%A0", "%41bc"] {
            assert_eq!(meant_code(word).as_deref(), Some("abc"), "{word}");
        }
        for word in ["", "/", "r/abc", "a%20c", "abc%00", "abc%2", "%zz", "%+1", "%ff", "\u{e4}bc"]
        {
            assert_eq!(meant_code(word), None, "{word}");
        }
    }

    #[test]
    fn a_held_etag_is_found_in_a_list() {
        let held = headers(header::IF_NONE_MATCH, "\"a\", W/\"b\"");
        assert!(has_etag(&held, "\"a\"") && has_etag(&held, "\"b\""));
        assert!(!has_etag(&held, "\"c\""));
    }
}
