//! Properties of bytes that reach the server before a session: the head of a request, the code in a link, guest scenes,
//! runs and tokens.

use crate::part;
use jostle_game::Scene;
use jostle_protocol::replay::{frame, header};
use jostle_protocol::{Token, first_forbidden};
use jostle_room::run::RUN_TICKS_MAX;
use jostle_server::guests;
use jostle_server::host::rooms::is_code;
use jostle_server::host::token_signer::TokenSigner;
use jostle_server::limits::{GUEST_BUDGET, GUEST_SCENE_BYTES_MAX};
use jostle_server::net::http::{self, Opening, Upgrade};
use jostle_server::net::listen::speak_http;
use jostle_server::{Config, Parts, Phase, ServerState, log, runs};
use std::net::{IpAddr, Ipv4Addr};
use std::sync::{Arc, OnceLock};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::watch;

/// Capacity of a pipe to a slow reader, in bytes.
const PIPE_BYTES: usize = 1 << 16;

/// Checks the code in a link, as it appears in a path.
pub fn link(bytes: &[u8]) {
    let Ok(word) = std::str::from_utf8(bytes) else { return };
    if let Some(code) = http::meant_code(word) {
        assert!(is_code(&code), "{code:?}");
        assert_eq!(http::meant_code(&code).as_ref(), Some(&code));
    }
    if log::is_name(word) {
        assert!(!word.contains(['/', '.', '\\']), "{word:?} leads out of the directory");
    }
}

/// Checks everything that a peer sends before a session. The server must send an HTTP response and end the connection.
pub fn handshake(bytes: &[u8]) {
    let host = host();
    let answer = host.runtime.block_on(async {
        let (mut peer, server) = duplex(PIPE_BYTES);
        let talk = async {
            let (mut reads, mut writes) = tokio::io::split(&mut peer);
            let mut answer = Vec::new();
            let send = async {
                // The server may finish before it has read everything.
                let _ = writes.write_all(bytes).await;
                let _ = writes.shutdown().await;
            };
            let (_, read) = tokio::join!(send, reads.read_to_end(&mut answer));
            read.expect("a pipe in memory");
            answer
        };
        let serve = async {
            // After an upgrade the connection ends here.
            let address = IpAddr::V4(Ipv4Addr::LOCALHOST);
            let permit = host.state.shares.connections.admit(address).expect("the only one");
            let permit = Arc::new(permit);
            speak_http(server, address, &permit, &host.state).await.map(|taken| taken.upgrade)
        };
        let (upgrade, answer) = tokio::join!(serve, talk);
        if let Some(Upgrade { code, opening, .. }) = upgrade {
            assert!(code.is_empty() || is_code(&code));
            // The session sends the head of a stream.
            let is_accepted = answer.windows(12).any(|part| part == b"HTTP/1.1 101");
            assert_eq!(is_accepted, matches!(opening, Opening::WebSocket));
        }
        answer
    });
    assert!(answer.is_empty() || answer.starts_with(b"HTTP/1."), "{answer:?}");
}

/// Checks a guest's scene file: an accepted one must stay within the budget and have no deceptive text, and a refusal
/// must name one of its lines.
pub fn guest_scene(bytes: &[u8]) {
    match guests::read(bytes) {
        Ok(scene) => {
            assert!(bytes.len() <= GUEST_SCENE_BYTES_MAX);
            assert_eq!(GUEST_BUDGET.check(&scene), Ok(()));
            assert!(scene.world.bodies_max <= GUEST_BUDGET.bodies);
            assert!(scene.texts().iter().all(|(_, text)| first_forbidden(text).is_none()));
        }
        Err(error) => {
            let lines = 1 + bytes.iter().filter(|&&byte| byte == b'\n').count();
            assert!((1..=lines).contains(&error.line), "{error}");
            assert!(!error.field.is_empty() && !error.allowed.is_empty(), "{error}");
        }
    }
}

/// The scene of [`run`] and its corpus: a short flight to the right.
pub const RUN_SCENE: &str = "title = \"Hop\"\nsize = [40, 30]\ngravity = [0, 0]\ntools = [\"steer\"]\n\
    groups = [\"hero\"]\nround = { goal = 1, countdown = 0 }\n\
    hero = { size = [4, 4], spawns = [[10, 15]] }\n\
    zones = [{ name = \"post\", area = [[14, 0], [40, 30]] }]\n\
    rules = [{ enter = \"post\", score = 1 }]\n";

/// Checks the replay of a run, given as parts, which are given frames with correct checksums. A proven run must have a
/// winner and prove the same result again; a refusal must come with a message.
pub fn run(mut bytes: &[u8]) {
    let mut file = header();
    while let Some((kind, payload)) = part(&mut bytes) {
        file.extend(frame(kind, payload));
    }
    static SCENES: OnceLock<Vec<Arc<Scene>>> = OnceLock::new();
    let scenes = SCENES
        .get_or_init(|| vec![Arc::new(Scene::parse("hop.toml", RUN_SCENE).expect("a scene"))]);
    let prove = || runs::prove(file.clone(), scenes, Duration::from_secs(1), || true);
    match prove() {
        Ok((scene, run)) => {
            assert_eq!(scene.source, RUN_SCENE);
            assert!(run.begin < run.end && run.end <= RUN_TICKS_MAX, "{run:?}");
            assert!(run.points >= 1 && !run.players.is_empty(), "{run:?}");
            assert_eq!(prove().map(|(_, again)| again), Ok(run));
        }
        Err(reason) => assert!(!reason.to_string().is_empty()),
    }
}

/// The key used by [`token`], which the corpus needs too.
pub const SIGNING_KEY: [u8; 32] = [7; 32];

/// Checks a token for a seat, or a host key: only signed ones may be accepted, and the text form of an accepted token
/// must decode to the same token.
pub fn token(bytes: &[u8]) {
    let text = std::str::from_utf8(bytes).ok().and_then(Token::parse);
    if let Some(token) = text {
        assert_eq!(token.text().as_bytes(), bytes);
    }
    let Ok(token) = bytes.try_into().map(Token) else { return };
    assert_eq!(Token::parse(&token.text()), Some(token));
    let signer = TokenSigner::new(&SIGNING_KEY);
    let (claim, hosted) = (signer.seat_claim(&token), signer.hosted(&token));
    assert!(claim.is_none() || hosted.is_none());
    assert!(claim.is_none_or(|claim| signer.seat_token(claim) == token));
    assert!(hosted.is_none_or(|room| signer.host_key(room) == token));
}

struct Host {
    state: Arc<ServerState>,
    runtime: Runtime,
    /// Keeps the server running.
    _phase: watch::Sender<Phase>,
}

/// A server without scenes that is shutting down, so that no request opens a room or tries a guest scene, which would
/// start a thread.
fn host() -> &'static Host {
    static HOST: OnceLock<Host> = OnceLock::new();
    HOST.get_or_init(|| {
        let (sender, phase) = watch::channel(Phase::Draining);
        let config = Config { scenes: Vec::new(), ..Config::default() };
        let runtime = Builder::new_current_thread().enable_time().build();
        Host {
            state: Arc::new(ServerState::new(Parts::new(phase), config)),
            runtime: runtime.expect("a runtime of one thread"),
            _phase: sender,
        }
    })
}
