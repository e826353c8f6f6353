//! The line below all arrivals.

use std::collections::VecDeque;

/// Arrivals of so long, by host time, are represented by the earliest of them, microseconds. 200 packets of a stream: the
/// earliest of them is late by a two-hundredth of the jitter.
const BUCKET_US: f64 = 2_000_000.0;
/// Buckets that the line rests on: a minute, over which a crystal's rate is constant within a fraction of a part per
/// million.
const BUCKETS: usize = 32;
/// Complete buckets below which a rate is not taken from them.
const SETTLED: usize = 3;
/// No two clocks differ by more: crystals are good to 100 parts per million, RC oscillators are not followed.
const MAX_SKEW: f64 = 600e-6;
/// Complete buckets in a row whose floor is too high for the line: then the clock was set back.
const LATE_BUCKETS: u32 = 2;
/// Arrivals are late for so long at most until that is noticed, microseconds: those buckets, one that is open, and one that
/// was when it began.
pub(super) const NOTICED_US: f64 = (LATE_BUCKETS + 2) as f64 * BUCKET_US;
/// Too high is this much, six times the residual and twice the noise, microseconds.
const LATE_US: f64 = 5_000.0;
/// A delay longer than the shortest by more than this is a stall or garbage, not jitter, microseconds.
pub(super) const MAX_JITTER_US: f64 = 100_000.0;

/// `host = offset + (1 + skew) device`, both relative to the start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    pub(super) offset_us: f64,
    pub(super) skew: f64,
}

impl Line {
    pub(super) fn host_us(&self, x: f64) -> f64 {
        self.offset_us + x + self.skew * x
    }

    pub(super) fn device_us(&self, h: f64) -> f64 {
        (h - self.offset_us) / (1.0 + self.skew)
    }
}

/// An arrival: device time, and host time minus device time.
#[derive(Debug, Clone, Copy)]
struct Point {
    x: f64,
    offset: f64,
}

impl Point {
    fn above(&self, line: &Line) -> f64 {
        self.offset - line.offset_us - line.skew * self.x
    }
}

#[derive(Debug, Clone, Copy)]
struct Bucket {
    until: f64,
    floor: Point,
    /// The highest delay above the floor's that is jitter, microseconds.
    spread: f64,
    arrivals: u32,
    /// Its floor lies too high for the line, which does not rest on it.
    late: bool,
}

/// The earliest arrivals of the last minute and the line below them.
#[derive(Debug, Clone)]
pub(super) struct Floor {
    /// The last one is still open.
    buckets: VecDeque<Bucket>,
    line: Line,
    /// What the rate is before there is enough to tell.
    prior_skew: f64,
    residual_us: f64,
    late: u32,
    newest_x: f64,
}

impl Floor {
    pub(super) fn starting(prior_skew: f64) -> Self {
        let line = Line {
            offset_us: 0.0,
            skew: prior_skew,
        };
        let origin = Point {
            x: 0.0,
            offset: 0.0,
        };
        Self {
            buckets: VecDeque::from([Bucket::starting(0.0, origin)]),
            line,
            prior_skew,
            residual_us: 0.0,
            late: 0,
            newest_x: 0.0,
        }
    }

    pub(super) fn line(&self) -> Line {
        self.line
    }

    pub(super) fn skew(&self) -> f64 {
        self.line.skew
    }

    pub(super) fn newest_x(&self) -> f64 {
        self.newest_x
    }

    pub(super) fn settled(&self) -> bool {
        self.buckets.len() > SETTLED
    }

    pub(super) fn residual_us(&self) -> f64 {
        self.residual_us
    }

    pub(super) fn span_us(&self) -> f64 {
        match (self.buckets.front(), self.buckets.back()) {
            (Some(first), Some(last)) => last.floor.x - first.floor.x,
            _ => 0.0,
        }
    }

    /// How far the line may be off at a device time, microseconds: the residual, more outside the span that it rests
    /// on. Before a rate is known, all that was seen of the jitter and all that a rate could do.
    pub(super) fn uncertainty_us(&self, x: f64) -> f64 {
        let span = self.span_us().max(1.0);
        if !self.settled() {
            let jitter = self.buckets.iter().map(|bucket| bucket.spread);
            let age = self
                .buckets
                .front()
                .map_or(0.0, |first| (x - first.floor.x).abs());
            return jitter.fold(0.0, f64::max) + MAX_SKEW * age;
        }
        let middle = self.buckets.front().map_or(0.0, |first| first.floor.x) + span / 2.0;
        (2.0 * self.residual_us).max(self.noise_us(self.usual_arrivals()))
            * (1.0 + ((x - middle).abs() / (span / 2.0) - 1.0).max(0.0))
    }

    /// Takes an arrival at device time `x` and host time `h`. What it returns is how far the clock was set, when the
    /// floors of the last buckets say so.
    pub(super) fn push(&mut self, x: f64, h: f64) -> Option<f64> {
        let point = Point { x, offset: h - x };
        self.newest_x = self.newest_x.max(x);
        let line = self.line;
        let changed = match self.buckets.back_mut() {
            Some(open) if h < open.until => open.join(point, &line),
            _ => {
                let stepped = self.close();
                if stepped.is_some() {
                    return stepped;
                }
                self.buckets.push_back(Bucket::starting(h, point));
                while self.buckets.len() > BUCKETS {
                    self.buckets.pop_front();
                }
                true
            }
        };
        if changed {
            self.fit();
        }
        None
    }

    /// Looks at the bucket that is complete now.
    fn close(&mut self) -> Option<f64> {
        let complete = *self.buckets.back()?;
        let above = complete.floor.above(&self.line);
        let late = self.too_high(&complete);
        self.late = if late { self.late + 1 } else { 0 };
        self.buckets.back_mut()?.late = late;
        (self.late >= LATE_BUCKETS).then_some(-above)
    }

    /// Whether a floor lies higher than chance brings it; before there is a rate, than any jitter does.
    fn too_high(&self, bucket: &Bucket) -> bool {
        let limit_us = if self.settled() {
            LATE_US + 6.0 * self.residual_us + 2.0 * self.noise_us(bucket.arrivals)
        } else {
            MAX_JITTER_US
        };
        bucket.floor.above(&self.line) > limit_us
    }

    fn fit(&mut self) {
        let skew = if self.settled() {
            self.steepness()
        } else {
            self.prior_skew
        };
        let offsets = self.points().map(|point| point.offset - skew * point.x);
        let Some(offset_us) = offsets.reduce(f64::min) else {
            return; // all late: the line stays
        };
        self.line = Line { offset_us, skew };
        self.residual_us = self.scatter();
    }

    /// How far the earliest of so many arrivals may be late by chance, microseconds: for a uniform jitter 19 of 20 are
    /// nearer, because the earliest of n is later than k / n of the jitter with probability exp(-k).
    fn noise_us(&self, arrivals: u32) -> f64 {
        let spreads = self.buckets.iter().map(|bucket| bucket.spread);
        3.0 * spreads.fold(0.0, f64::max) / f64::from(arrivals.max(1))
    }

    /// Median of the arrivals in complete buckets.
    fn usual_arrivals(&self) -> u32 {
        let mut counts: Vec<u32> = self.complete().map(|bucket| bucket.arrivals).collect();
        counts.sort_unstable();
        counts.get(counts.len() / 2).copied().unwrap_or(1)
    }

    fn complete(&self) -> impl Iterator<Item = &Bucket> {
        self.buckets
            .iter()
            .take(self.buckets.len().saturating_sub(1))
    }

    /// What the line rests on: the open bucket as well, once an arrival in it is early enough.
    fn points(&self) -> impl Iterator<Item = Point> {
        let open = self.buckets.len().saturating_sub(1);
        let counts = move |(at, bucket): &(usize, &Bucket)| {
            !bucket.late && (*at != open || !self.too_high(bucket))
        };
        let all = self.buckets.iter().enumerate();
        all.filter(counts).map(|(_, bucket)| bucket.floor)
    }

    /// Slope of the line below all points that is nearest to them all together: that of the edge of their lower convex
    /// hull above or below their mean device time. Within [`MAX_SKEW`] nothing but the slope is lost, because the
    /// distance is convex in it.
    fn steepness(&self) -> f64 {
        let mut points: Vec<Point> = self.points().collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.offset.total_cmp(&b.offset)));
        let mean = points.iter().map(|point| point.x).sum::<f64>() / points.len().max(1) as f64;
        let mut hull: Vec<Point> = Vec::with_capacity(points.len());
        for point in points {
            if hull.last().is_some_and(|last| last.x >= point.x) {
                continue; // at the same device time, later
            }
            while let [.., a, b] = hull[..] {
                // Keep `b` only if it lies below the chord from `a`.
                if (b.offset - a.offset) * (point.x - a.x) < (point.offset - a.offset) * (b.x - a.x)
                {
                    break;
                }
                hull.pop();
            }
            hull.push(point);
        }
        let edge = hull
            .windows(2)
            .find(|edge| matches!(edge, [_, right] if right.x >= mean));
        match edge {
            Some([left, right]) => {
                ((right.offset - left.offset) / (right.x - left.x)).clamp(-MAX_SKEW, MAX_SKEW)
            }
            _ => self.prior_skew,
        }
    }

    /// Root mean square of the complete floors above the line, microseconds.
    fn scatter(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for bucket in self.complete().filter(|bucket| !bucket.late) {
            sum += bucket.floor.above(&self.line).powi(2);
            count += 1.0;
        }
        if count > 0.0 {
            (sum / count).sqrt()
        } else {
            0.0
        }
    }
}

impl Bucket {
    fn starting(h: f64, floor: Point) -> Self {
        Self {
            until: h + BUCKET_US,
            floor,
            spread: 0.0,
            arrivals: 1,
            late: false,
        }
    }

    /// Whether the floor is another now. Which arrival is earlier is judged along the line, not by its offset: over two
    /// seconds clocks part by as much as a millisecond.
    fn join(&mut self, point: Point, line: &Line) -> bool {
        let higher = point.above(line) - self.floor.above(line);
        self.arrivals = self.arrivals.saturating_add(1);
        if higher < 0.0 {
            self.floor = point;
            self.spread = (self.spread - higher).min(MAX_JITTER_US);
            return true;
        }
        if higher <= MAX_JITTER_US {
            self.spread = self.spread.max(higher);
        }
        false
    }
}
