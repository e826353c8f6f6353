//! The server: files for everybody on this machine, the WebSocket for those who know the token.

use std::sync::Arc;

use axum::Router;
use axum::extract::{Request, State as Of, WebSocketUpgrade};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use tokio::sync::oneshot;

use super::feed::Feed;
use super::guard::{Guard, PROTOCOL, Refusal};
use super::socket::Takers;
use super::{assets, socket};

/// Browsers that may look at once: a few windows, and no way to make the program's work grow.
const VIEWERS: usize = 8;

/// What every request may need.
#[derive(Clone)]
pub(super) struct State {
    pub(super) guard: Arc<Guard>,
    pub(super) feed: Arc<Feed>,
    pub(super) takers: Takers,
}

/// What the page's thread is given.
pub(super) struct Serving {
    pub(super) listener: std::net::TcpListener,
    pub(super) state: State,
    pub(super) stopped: oneshot::Receiver<()>,
}

/// Serves until it is told to stop; connections end with it.
pub(super) fn run(runtime: tokio::runtime::Runtime, serving: Serving) {
    let Serving {
        listener,
        state,
        stopped,
    } = serving;
    runtime.block_on(async move {
        let listener = match tokio::net::TcpListener::from_std(listener) {
            Ok(listener) => listener,
            Err(error) => {
                eprintln!("the page cannot be served: {error}");
                return;
            }
        };
        // `serve` ends only with an error of the listener, and axum tries those again by itself.
        tokio::select! {
            _ = stopped => {}
            _ = axum::serve(listener, routes(state)) => {}
        }
    });
}

fn routes(state: State) -> Router {
    Router::new()
        .route("/socket", get(open_socket))
        .fallback(get(send_file))
        .layer(from_fn_with_state(state.clone(), admit))
        .with_state(state)
}

/// Turns away what is not for this server, and dresses every answer.
async fn admit(Of(state): Of<State>, request: Request, next: Next) -> Response {
    let mut response = match state.guard.admits(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    for (name, value) in dress(&state.guard) {
        response.headers_mut().insert(name, value);
    }
    response
}

async fn send_file(uri: Uri) -> Response {
    match assets::file(uri.path().trim_start_matches('/')) {
        Some((bytes, kind)) => ([(header::CONTENT_TYPE, kind)], bytes).into_response(),
        None => (StatusCode::NOT_FOUND, "no such file").into_response(),
    }
}

async fn open_socket(
    Of(state): Of<State>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    if let Err(refusal) = state.guard.knows_token(&headers) {
        return refusal.into_response();
    }
    let Some(viewer) = state.feed.look(VIEWERS) else {
        let text = format!("{VIEWERS} windows look already: close one");
        return (StatusCode::SERVICE_UNAVAILABLE, text).into_response();
    };
    upgrade
        .protocols([PROTOCOL])
        .max_message_size(socket::MOST_BYTES)
        .max_frame_size(socket::MOST_BYTES)
        .on_upgrade(move |socket| socket::converse(socket, state.feed, state.takers, viewer))
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.status(), self.text()).into_response()
    }
}

/// Headers of every answer: nothing from elsewhere, nothing inline, no frame around the page, nothing kept.
fn dress(guard: &Guard) -> Vec<(HeaderName, HeaderValue)> {
    let policy = format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self' {}; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        guard.sockets()
    );
    let mut all = vec![
        (
            header::X_CONTENT_TYPE_OPTIONS,
            HeaderValue::from_static("nosniff"),
        ),
        (header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY")),
        (
            header::REFERRER_POLICY,
            HeaderValue::from_static("no-referrer"),
        ),
        (header::CACHE_CONTROL, HeaderValue::from_static("no-store")),
        (
            HeaderName::from_static("cross-origin-resource-policy"),
            HeaderValue::from_static("same-origin"),
        ),
    ];
    if let Ok(policy) = HeaderValue::from_str(&policy) {
        all.push((header::CONTENT_SECURITY_POLICY, policy));
    }
    all
}
