//! One browser: views to it, acts from it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use axum::extract::ws::{Message, WebSocket};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use serde::Serialize;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};

use super::feed::{Feed, Glimpse, Viewer, joined};
use crate::live::{Act, DemonstrationView, View};

/// Longest message from a browser.
pub(super) const MOST_BYTES: usize = 16 * 1024;
/// Between two views to one browser.
const BETWEEN: Duration = Duration::from_millis(50);
/// Views on their way to a browser that has not said that it drew them.
const ON_THE_WAY: u64 = 2;
/// Refusals that wait to be told; more are not told.
const REFUSALS: usize = 8;

/// Takes what somebody typed, or says why not.
type TakePasskey = dyn Fn(&str) -> Result<(), String> + Send + Sync;

/// Who takes what people do.
#[derive(Clone)]
pub(super) struct Takers {
    pub(super) acts: Arc<dyn Fn(Act) -> Result<(), String> + Send + Sync>,
    pub(super) passkey: Arc<TakePasskey>,
}

/// What is sent at once.
#[derive(Serialize)]
struct Sent<'a> {
    number: u64,
    view: &'a View,
    /// Null while they are as they were: speed curves are long and seldom change.
    demonstrations: Option<&'a [DemonstrationView]>,
}

#[derive(Serialize)]
struct Refused {
    refused: String,
}

/// What a browser says.
enum Said {
    Act(Act),
    /// What somebody typed for a passkey.
    Passkey(String),
    Seen(u64),
}

/// Talks with one browser until either side ends it.
pub(super) async fn converse(socket: WebSocket, feed: Arc<Feed>, takers: Takers, _viewer: Viewer) {
    let (sink, stream) = socket.split();
    let (refusals, to_tell) = mpsc::channel(REFUSALS);
    let seen = AtomicU64::new(0);
    // Apart, because an act must be taken at once, also from a browser to which sending is stuck.
    tokio::select! {
        () = listen(stream, &takers, &seen, refusals) => {}
        () = tell(sink, &feed, &seen, to_tell) => {}
    }
}

async fn listen(
    mut stream: SplitStream<WebSocket>,
    takers: &Takers,
    seen: &AtomicU64,
    refusals: mpsc::Sender<String>,
) {
    while let Some(Ok(message)) = stream.next().await {
        let understood = match &message {
            Message::Text(text) => understand(text),
            Message::Binary(_) => Err("expected JSON as text, got binary".to_owned()),
            Message::Close(_) => return,
            Message::Ping(_) | Message::Pong(_) => continue,
        };
        let taken = understood.and_then(|said| {
            match said {
                Said::Act(act) => (takers.acts)(act)?,
                Said::Passkey(typed) => (takers.passkey)(&typed)?,
                Said::Seen(number) => seen.store(number, Ordering::Relaxed),
            }
            Ok(())
        });
        if let Err(reason) = taken {
            // Who sends faster nonsense than it reads the answers does not get them all.
            drop(refusals.try_send(reason));
        }
    }
}

async fn tell(
    mut sink: SplitSink<WebSocket, Message>,
    feed: &Feed,
    seen: &AtomicU64,
    mut to_tell: mpsc::Receiver<String>,
) {
    let mut ticks = interval(BETWEEN);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut told = Told::default();
    loop {
        let text = tokio::select! {
            Some(refused) = to_tell.recv() => serde_json::to_string(&Refused { refused }),
            _ = ticks.tick() => {
                if told.on_the_way(seen.load(Ordering::Relaxed)) >= ON_THE_WAY {
                    continue;
                }
                match feed.newer_than(told.number) {
                    Some(glimpse) => told.write(&glimpse),
                    None => continue,
                }
            }
        };
        // Views are plain data and always have a JSON; one that had none would be shown as a page that stands.
        let Ok(text) = text else { return };
        if sink.send(Message::Text(text.into())).await.is_err() {
            return;
        }
    }
}

/// What a browser was told.
#[derive(Debug, Default)]
struct Told {
    /// The newest view's number.
    number: u64,
    /// Numbers of views that it may not have drawn, oldest first.
    waiting: Vec<u64>,
    demonstrations: Option<Vec<DemonstrationView>>,
}

impl Told {
    /// Views that are not drawn, when the newest drawn is this one.
    fn on_the_way(&mut self, seen: u64) -> u64 {
        self.waiting.retain(|number| *number > seen);
        self.waiting.len() as u64
    }

    fn write(&mut self, glimpse: &Glimpse) -> serde_json::Result<String> {
        let mut view = View::clone(&glimpse.view);
        view.trace = joined(&glimpse.traces);
        let demonstrations = std::mem::take(&mut view.demonstrations);
        let news = self.demonstrations.as_ref() != Some(&demonstrations);
        let text = serde_json::to_string(&Sent {
            number: glimpse.number,
            view: &view,
            demonstrations: news.then_some(&demonstrations),
        });
        if news {
            self.demonstrations = Some(demonstrations);
        }
        self.number = glimpse.number;
        self.waiting.push(glimpse.number);
        text
    }
}

fn understand(text: &str) -> Result<Said, String> {
    let value: serde_json::Value =
        serde_json::from_str(text).map_err(|error| format!("this is no JSON: {error}"))?;
    if let Some(seen) = value.get("seen") {
        return seen
            .as_u64()
            .map(Said::Seen)
            .ok_or_else(|| format!("`seen` must be the number of a view, got {seen}"));
    }
    if let Some(passkey) = value.get("passkey") {
        // Not told again, whatever it is.
        let typed = passkey.as_str().map(str::to_owned).map(Said::Passkey);
        return typed.ok_or_else(|| "`passkey` must be a text of six digits".to_owned());
    }
    serde_json::from_value(value)
        .map(Said::Act)
        .map_err(|error| format!("this is nothing that can be done here: {error}"))
}
