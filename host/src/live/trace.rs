//! Signals between two views.

use tonus_shared::wire::{Configuration, RawSemg, Stream};

use super::takes::seconds;
use super::view::Trace;

/// Most samples that wait for a view; older ones go: nobody looks.
const STREAM_SAMPLES: usize = 200;
const RAW_SAMPLES: usize = 4_000;

/// What came since the view before.
#[derive(Debug, Default)]
pub(super) struct Traces {
    newest: Trace,
}

impl Traces {
    pub(super) fn stream(&mut self, acquired_us: u64, stream: &Stream) {
        let trace = &mut self.newest;
        if trace.t_s.len() >= STREAM_SAMPLES {
            trace.t_s.clear();
            trace.envelopes.clear();
            trace.stiffness_n_per_m.clear();
        }
        let used = usize::from(stream.channels);
        trace.envelopes.resize_with(used, Vec::new);
        trace.stiffness_n_per_m.resize_with(3, Vec::new);
        trace.t_s.push(seconds(acquired_us));
        for (series, value) in trace.envelopes.iter_mut().zip(stream.envelopes) {
            series.push(value);
        }
        for (series, value) in (trace.stiffness_n_per_m.iter_mut()).zip(stream.stiffness_n_per_m) {
            series.push(value);
        }
    }

    /// `acquired_us`: of the newest scan in the packet.
    pub(super) fn raw(&mut self, acquired_us: u64, raw: &RawSemg, configuration: &Configuration) {
        let trace = &mut self.newest;
        if trace.raw_t_s.len() >= RAW_SAMPLES {
            trace.raw_t_s.clear();
            trace.raw_uv.clear();
        }
        let used = usize::from(raw.channels).max(1);
        trace.raw_uv.resize_with(used, Vec::new);
        let scans = raw.counts.len() / used;
        let period_s = 1.0 / f64::from(configuration.semg_hz);
        for (place, scan) in raw.counts.chunks_exact(used).enumerate() {
            #[allow(clippy::cast_precision_loss, reason = "a packet of scans")]
            let before_s = (scans - 1 - place) as f64 * period_s;
            trace.raw_t_s.push(seconds(acquired_us) - before_s);
            for (series, count) in trace.raw_uv.iter_mut().zip(scan) {
                let volts = f64::from(count - configuration.offset_counts)
                    * f64::from(configuration.volts_per_count);
                #[allow(clippy::cast_possible_truncation, reason = "for the screen")]
                series.push((volts * 1e6) as f32);
            }
        }
    }

    pub(super) fn take(&mut self) -> Trace {
        std::mem::take(&mut self.newest)
    }
}
