//! The newest view, and the trace samples of the last seconds for whoever has not had them.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::live::{Trace, View};

/// Traces of so many views are kept: at fifty a second those of ten seconds, which a page that is loaded anew starts with.
pub(super) const KEPT: usize = 500;

/// What all browsers look at.
#[derive(Debug, Default)]
pub(super) struct Feed {
    newest: Mutex<Newest>,
    viewers: AtomicUsize,
}

#[derive(Debug, Default)]
struct Newest {
    /// How many views were shown.
    number: u64,
    /// The newest, without its trace.
    view: Option<Arc<View>>,
    /// Traces of the newest views, oldest first.
    traces: VecDeque<Arc<Trace>>,
}

/// A view for one browser.
#[derive(Debug)]
pub(super) struct Glimpse {
    /// Which view this is, counted from one.
    pub(super) number: u64,
    /// The view, without its trace.
    pub(super) view: Arc<View>,
    /// Traces that this browser has not had, oldest first.
    pub(super) traces: Vec<Arc<Trace>>,
}

/// Counts a browser for as long as it looks.
#[derive(Debug)]
pub(super) struct Viewer(Arc<Feed>);

impl Feed {
    pub(super) fn show(&self, view: &View) {
        let mut bare = view.clone();
        let trace = Arc::new(std::mem::take(&mut bare.trace));
        let mut newest = self.lock();
        newest.number += 1;
        newest.view = Some(Arc::new(bare));
        if newest.traces.len() == KEPT {
            newest.traces.pop_front();
        }
        newest.traces.push_back(trace);
    }

    /// The newest view, if it is newer than the one of this number.
    pub(super) fn newer_than(&self, number: u64) -> Option<Glimpse> {
        let newest = self.lock();
        if newest.number <= number {
            return None;
        }
        let missing = usize::try_from(newest.number - number).unwrap_or(usize::MAX);
        let had = newest.traces.len().saturating_sub(missing);
        Some(Glimpse {
            number: newest.number,
            view: Arc::clone(newest.view.as_ref()?),
            traces: newest.traces.range(had..).cloned().collect(),
        })
    }

    pub(super) fn viewers(&self) -> usize {
        self.viewers.load(Ordering::Relaxed)
    }

    /// Another browser, unless so many look already.
    pub(super) fn look(self: &Arc<Self>, most: usize) -> Option<Viewer> {
        let count = |viewers| (viewers < most).then_some(viewers + 1);
        self.viewers
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, count)
            .ok()
            .map(|_| Viewer(Arc::clone(self)))
    }

    /// A thread that panicked while it held this left a whole view: each field is replaced in one step.
    fn lock(&self) -> MutexGuard<'_, Newest> {
        self.newest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.0.viewers.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Traces one after the other. A channel that an earlier one has not is padded by NaN, which JSON writes as null.
pub(super) fn joined(traces: &[Arc<Trace>]) -> Trace {
    let mut all = Trace::default();
    for trace in traces {
        append(
            &mut all.envelopes,
            all.t_s.len(),
            &trace.envelopes,
            trace.t_s.len(),
        );
        append(
            &mut all.stiffness_n_per_m,
            all.t_s.len(),
            &trace.stiffness_n_per_m,
            trace.t_s.len(),
        );
        append(
            &mut all.raw_uv,
            all.raw_t_s.len(),
            &trace.raw_uv,
            trace.raw_t_s.len(),
        );
        all.t_s.extend_from_slice(&trace.t_s);
        all.raw_t_s.extend_from_slice(&trace.raw_t_s);
    }
    all
}

/// Appends `more` samples of `news` to `rows` of `before` samples, so that all rows stay equally long.
fn append(rows: &mut Vec<Vec<f32>>, before: usize, news: &[Vec<f32>], more: usize) {
    if rows.len() < news.len() {
        rows.resize(news.len(), vec![f32::NAN; before]);
    }
    for (channel, row) in rows.iter_mut().enumerate() {
        let samples = news.get(channel).map_or(&[][..], Vec::as_slice);
        row.extend(samples.iter().take(more));
        row.resize(before + more, f32::NAN);
    }
}
