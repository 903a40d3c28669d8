use super::super::report::Report;
use super::*;
use crate::bots::socket::Socket;
use futures_util::SinkExt;
use jostle_game::Scene;
use jostle_protocol::WelcomeSeat;
use jostle_room::{Rate, Room};
use tokio::net::TcpListener;
use tokio::time::timeout;
use tokio_tungstenite::accept_async;
use tokio_tungstenite::tungstenite::Message;

const TOKEN: Token = Token([7; jostle_protocol::limits::TOKEN_BYTES]);

/// Longer than anything takes even on a starved machine.
const LONG: Duration = Duration::from_secs(120);

/// A server's answer to a hello, after which it closes the socket.
#[derive(Clone, Debug)]
enum Answer {
    Only(ServerMessage),
    /// A seat, a few snapshots, and then this message.
    Play(ServerMessage),
    /// A seat that lasts until the bot leaves.
    PlayOn,
}

/// A server on its own port that gives these answers, one per socket, and then disappears.
struct Node {
    listener: TcpListener,
    answers: Vec<Answer>,
}

impl Node {
    async fn new() -> Node {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        Node { listener, answers: Vec::new() }
    }

    fn origin(&self) -> String {
        format!("http://{}", self.listener.local_addr().expect("an address"))
    }

    /// Serves, and returns the tokens that arrived with the hellos.
    async fn serve(self) -> Vec<Option<Token>> {
        let mut tokens = Vec::new();
        for answer in self.answers {
            let (stream, _) = self.listener.accept().await.expect("a client");
            let mut socket = accept_async(stream).await.expect("a WebSocket");
            let hello = next(&mut socket).await.expect("a live socket").expect("a message");
            let hello = ClientMessage::decode(&hello);
            let Ok(ClientMessage::Hello { token, .. }) = hello else { panic!("{hello:?}") };
            tokens.push(token);
            match answer {
                Answer::Only(message) => say(&mut socket, &message).await,
                Answer::Play(message) => {
                    play(&mut socket, 5).await;
                    say(&mut socket, &message).await;
                }
                Answer::PlayOn => play(&mut socket, u32::MAX).await,
            }
        }
        tokens
    }
}

async fn say(socket: &mut Socket, message: &ServerMessage) {
    // The bot may already have left.
    let _ = socket.send(Message::Binary(message.encode().into())).await;
}

/// Plays a room with the bot for some ticks, or until the bot leaves.
async fn play(socket: &mut Socket, ticks: u32) {
    let scene = Scene::built_in().into_iter().find(|scene| scene.name == "impulse");
    let mut room = Room::new("impulse", Arc::new(scene.expect("a scene")), 1);
    let appearance = Appearance { name: "bot".into(), color: 0 };
    let seat = room.join(appearance, None).expect("a seat").claim.seat;
    room.tick();
    let (reader, keyframe) = room.subscribe_view(seat, Rate::Full);
    let welcome = room.welcome(Some(WelcomeSeat { seat, host: false, token: TOKEN }));
    let _ = socket.send(Message::Binary(welcome.into())).await;
    let _ = socket.send(Message::Binary(keyframe)).await;
    for _ in 0..ticks {
        // The bot's inputs set the pace; when they stop, the bot has left.
        if next(socket).await.is_err() {
            return;
        }
        room.tick();
        if let Some(bytes) = room.message(&reader) {
            let _ = socket.send(Message::Binary(bytes.clone())).await;
        }
    }
}

/// Runs a bot that starts at the first of these servers and follows its room to the last one. Returns the report and
/// the tokens that each server received.
async fn followed(nodes: Vec<Node>, until: usize) -> (Report, Vec<Vec<Option<Token>>>) {
    let url = nodes[0].origin().replace("http", "ws") + "/impulse";
    let target: BotTarget = url.parse().expect("an address");
    let (stage, watched) = watch::channel(CrowdStage::Playing(Instant::now()));
    let (seated, _waiting) = mpsc::channel(1);
    let (sender, mut snapshots) = mpsc::unbounded_channel();
    let bot = Bot {
        index: 0,
        seed: 1,
        target: target.clone(),
        from: None,
        waits: Duration::ZERO,
        idles: false,
        decodes: true,
        losses: Vec::new(),
        timeouts: ServerTimeouts { answer: LONG, silence: LONG },
        stage: watched,
        seated,
        snapshots: Some(sender),
    };
    let servers: Vec<_> = nodes.into_iter().map(|node| tokio::spawn(node.serve())).collect();
    let bot = tokio::spawn(bot.play());
    // The bot has already seen the first value, so this change is the one that starts the measurement.
    stage.send_replace(CrowdStage::Playing(Instant::now()));
    for _ in 0..until {
        let snapshot = timeout(LONG, snapshots.recv()).await.expect("in time");
        if snapshot.is_none() {
            break;
        }
    }
    stage.send_replace(CrowdStage::Over);
    let report = bot.await.expect("a bot does not panic");
    let mut tokens = Vec::new();
    for server in servers {
        tokens.push(server.await.expect("a server does not panic"));
    }
    (Report::new(&[target], 1, vec![report]), tokens)
}

fn moved(to: &Node) -> ServerMessage {
    ServerMessage::Moved { url: to.origin() }
}

fn refused(refusal: Refusal) -> ServerMessage {
    ServerMessage::Refused { refusal }
}

#[tokio::test]
async fn a_room_is_followed_with_the_token() {
    let (mut a, mut b) = (Node::new().await, Node::new().await);
    a.answers = vec![Answer::Play(moved(&b)), Answer::Play(moved(&b))];
    b.answers = vec![Answer::Play(moved(&a)), Answer::PlayOn];
    let (report, tokens) = followed(vec![a, b], 20).await;
    assert_eq!(report.failure(), None);
    assert_eq!(tokens, [[None, Some(TOKEN)], [Some(TOKEN), Some(TOKEN)]]);
    assert_eq!((report.returns.moves, report.returns.seats_lost), (3, 0));
    assert_eq!(report.returns.outage_ms.count, 3);
}

#[tokio::test]
async fn the_others_of_a_fleet_are_asked_when_a_server_dies() {
    let (mut a, mut b, mut c) = (Node::new().await, Node::new().await, Node::new().await);
    let urls = vec![b.origin(), c.origin()];
    a.answers = vec![Answer::Play(ServerMessage::Nodes { urls })];
    b.answers = vec![Answer::Only(refused(Refusal::Moving)), Answer::Only(moved(&c))];
    c.answers = vec![Answer::Only(refused(Refusal::Moving)), Answer::PlayOn];
    let (report, tokens) = followed(vec![a, b, c], 10).await;
    assert_eq!(report.failure(), None);
    assert_eq!(tokens[1..], [[Some(TOKEN), Some(TOKEN)], [Some(TOKEN), Some(TOKEN)]]);
    assert_eq!((report.returns.moves, report.returns.outage_ms.count), (1, 1));
}

#[tokio::test]
async fn a_refused_token_is_a_lost_seat() {
    let (mut a, mut b) = (Node::new().await, Node::new().await);
    a.answers = vec![Answer::Play(moved(&b))];
    b.answers = vec![Answer::Only(refused(Refusal::BadToken)), Answer::PlayOn];
    let (report, tokens) = followed(vec![a, b], 10).await;
    assert_eq!(tokens[1], [Some(TOKEN), None]);
    assert_eq!(report.returns.seats_lost, 1);
    assert!(report.failure().is_some());
}

#[tokio::test]
async fn the_loss_of_a_single_server_is_an_error() {
    let mut a = Node::new().await;
    a.answers = vec![Answer::Play(refused(Refusal::Closing))];
    let (report, _) = followed(vec![a], 20).await;
    assert!(report.failure().is_some_and(|text| text.contains("Closing")));
}
