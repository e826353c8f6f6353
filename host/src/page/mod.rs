//! What is seen, in a browser: a page on 127.0.0.1, from files inside the program.
//!
//! **Who may.** The server listens on the loopback address alone, takes only requests that name it by that address
//! (against DNS rebinding), refuses every foreign `Origin`, and gives views and takes acts only over a WebSocket that knows
//! the token in [`Page::url`]. The token stands behind the `#`, so that no browser sends it along or keeps it in a log.
//!
//! **Newest wins.** [`Page::show`] replaces the view before and never waits. Each browser is sent the newest view at most
//! twenty times a second, and no further one while it has not handled two: a slow browser sees fewer views, not old ones.
//! Trace samples between two views are joined, as far back as the [`feed`] keeps them.
//!
//! **What is said.** To the browser: `{"number", "view", "demonstrations"}`, demonstrations null while they are as they were, or
//! `{"refused": why}`. From the browser: an [`Act`], `{"passkey": digits}` where the view asks for it, or `{"seen": number}` once
//! a view is drawn.

mod assets;
mod feed;
mod guard;
mod server;
mod socket;
#[cfg(test)]
mod tests;

use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;

use thiserror::Error;
use tokio::sync::oneshot;

use crate::live::{Act, View};
use feed::Feed;
use guard::Guard;
use socket::Takers;

/// Why there is no page.
#[derive(Debug, Error)]
pub enum PageError {
    /// The port cannot be listened on, and it is not because somebody else does.
    #[error("cannot listen on 127.0.0.1:{port}: {source}; give another port, or 0 for a free one")]
    Listen {
        /// The port asked for.
        port: u16,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The system gives no random numbers, and without a token anybody on this machine could arm the robot.
    #[error("the system gives no random numbers for the page's token: {reason}")]
    NoToken {
        /// The system's reason.
        reason: String,
    },
    /// The system gives no thread or no event queue.
    #[error("cannot start the page's thread: {0}")]
    Start(std::io::Error),
}

/// A page that is served until this is dropped.
#[derive(Debug)]
pub struct Page {
    url: String,
    feed: Arc<Feed>,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Page {
    /// Serves the page on 127.0.0.1 at this port, or at a free one if it is taken or zero. `acts` is called on the page's
    /// thread with what people do, says why it is not taken, and must not wait; neither may `passkey`, which is given what they typed in
    /// its field. It is no act, so that no recording holds it.
    ///
    /// # Errors
    /// [`PageError`]: no port, no random numbers, no thread.
    pub fn serve(
        port: u16,
        acts: impl Fn(Act) -> Result<(), String> + Send + Sync + 'static,
        passkey: impl Fn(&str) -> Result<(), String> + Send + Sync + 'static,
    ) -> Result<Self, PageError> {
        let (listener, address) =
            listen(port).map_err(|source| PageError::Listen { port, source })?;
        let guard = Guard::new(address.port())?;
        let url = format!("http://{address}/#{}", guard.token());
        let feed = Arc::new(Feed::default());
        let (stop, stopped) = oneshot::channel();
        let serving = server::Serving {
            listener,
            state: server::State {
                guard: Arc::new(guard),
                feed: Arc::clone(&feed),
                takers: Takers {
                    acts: Arc::new(acts),
                    passkey: Arc::new(passkey),
                },
            },
            stopped,
        };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(PageError::Start)?;
        let thread = std::thread::Builder::new()
            .name("page".into())
            .spawn(move || server::run(runtime, serving))
            .map_err(PageError::Start)?;
        Ok(Self {
            url,
            feed,
            stop: Some(stop),
            thread: Some(thread),
        })
    }

    /// Where the page is, with the token that lets a browser act.
    #[must_use]
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Shows this from now on. Never waits for a browser.
    pub fn show(&self, view: &View) {
        self.feed.show(view);
    }

    /// How many browsers look.
    #[must_use]
    pub fn viewers(&self) -> usize {
        self.feed.viewers()
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            // A thread that has ended needs no telling.
            let _ = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            // Its panic was printed when it happened; there is nobody to tell again.
            let _ = thread.join();
        }
    }
}

fn listen(port: u16) -> std::io::Result<(TcpListener, SocketAddr)> {
    let at = |port| TcpListener::bind((Ipv4Addr::LOCALHOST, port));
    let listener = match at(port) {
        Err(error) if error.kind() == std::io::ErrorKind::AddrInUse => at(0)?,
        other => other?,
    };
    listener.set_nonblocking(true)?;
    let address = listener.local_addr()?;
    Ok((listener, address))
}
