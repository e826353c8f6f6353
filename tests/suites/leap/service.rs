//! A Leap service that does as it is told.

use std::net::{TcpListener, TcpStream};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tonus::leap::{Backoff, Config, Leap, Origin, Service, Side, Update, Wanted};
use tungstenite::handshake::server::{Request, Response};
use tungstenite::{Message, WebSocket, accept_hdr};

/// Between frames.
pub(crate) const FRAME: Duration = Duration::from_millis(9);

/// One client's connection, and the path it asked for.
pub(crate) struct Client {
    pub(crate) path: String,
    pub(crate) socket: WebSocket<TcpStream>,
}

impl Client {
    /// Waits for the next one.
    pub(crate) fn accept(listener: &TcpListener) -> Self {
        let (stream, _) = listener.accept().unwrap();
        let mut path = String::new();
        #[allow(clippy::result_large_err, reason = "the callback's signature")]
        let look = |request: &Request, response: Response| {
            path = request.uri().path().to_owned();
            Ok(response)
        };
        let socket = accept_hdr(stream, look).unwrap();
        Self { path, socket }
    }

    /// Whether the client still listens.
    pub(crate) fn say(&mut self, text: impl Into<String>) -> bool {
        self.socket.send(Message::text(text.into())).is_ok()
    }

    /// Frames in real time with what `text` makes of their number and time, until it makes none.
    pub(crate) fn play(&mut self, mut text: impl FnMut(i64, u64) -> Option<String>) {
        let began = Instant::now();
        for k in 0.. {
            let due = FRAME * u32::try_from(k).unwrap();
            std::thread::sleep(due.saturating_sub(began.elapsed()));
            let Some(text) = text(k, u64::try_from(due.as_micros()).unwrap()) else {
                return;
            };
            if !self.say(text) {
                return;
            }
        }
    }
}

/// Runs a service of so many connections, and a client of its right hand.
pub(crate) fn serve(script: impl FnOnce(&TcpListener) + Send + 'static) -> (Leap, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let service = Service {
        host: "127.0.0.1".to_owned(),
        port: listener.local_addr().unwrap().port(),
    };
    let running = std::thread::spawn(move || script(&listener));
    (client(service), running)
}

pub(crate) fn client(service: Service) -> Leap {
    follow(Origin::Service(service))
}

/// A client of a right hand.
pub(crate) fn follow(origin: Origin) -> Leap {
    let config = Config {
        origin,
        wanted: Wanted::Only(Side::Right),
        transport_us: 0,
        backoff: Backoff {
            first: Duration::from_millis(20),
            longest: Duration::from_millis(100),
        },
    };
    Leap::new(config, Instant::now())
}

/// What comes until `enough`, in at most `limit`. Of every hand given on the way, the age is checked.
pub(crate) fn updates(
    leap: &mut Leap,
    limit: Duration,
    mut enough: impl FnMut(&[Update]) -> bool,
) -> Vec<Update> {
    let until = Instant::now() + limit;
    let mut all = Vec::new();
    while Instant::now() < until && !enough(&all) {
        all.extend(leap.receive(Duration::from_millis(20)));
        if let Some(sight) = leap.hand() {
            // A little more than the limit: time goes on between the two calls.
            assert!(sight.age_us(leap.now_us()) < 150_000, "{sight:?}");
        }
    }
    all
}

pub(crate) fn seen(all: &[Update]) -> usize {
    all.iter()
        .filter(|update| matches!(update, Update::Seen(_)))
        .count()
}

pub(crate) fn connected(all: &[Update]) -> usize {
    all.iter()
        .filter(|update| matches!(update, Update::Connected { .. }))
        .count()
}
