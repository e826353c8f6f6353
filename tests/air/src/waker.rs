//! One waker for every timer.

use std::{
    future::{Future, poll_fn},
    pin::pin,
    task::Context,
};

/// Runs `future` with a clone of its waker.
///
/// Tokio's first waker and its clones do not take themselves for the same. The time driver keeps a clone, and with the first
/// one before it, it takes every timer for one of another task: its queue is full at once, what it throws out wakes the task, and
/// the program spins.
pub(crate) async fn with_one_waker<F: Future>(future: F) -> F::Output {
    let mut future = pin!(future);
    poll_fn(|context| {
        let waker = context.waker().clone();
        future.as_mut().poll(&mut Context::from_waker(&waker))
    })
    .await
}
