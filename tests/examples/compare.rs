//! Times Tonus for `tests/compare/run`: prints medians in seconds, a few results for the cross-check, and peak
//! memory as one JSON object.

use std::hint::black_box;
use std::time::Instant;

use serde_json::json;
use tonus_tests::work::Work;

type Error = Box<dyn std::error::Error>;

/// Samples of which the median is taken, and seconds that each lasts at least.
const SAMPLES: usize = 101;
const SAMPLE_S: f64 = 5e-4;

fn main() -> Result<(), Error> {
    let work = Work::read()?;
    let learning = median(|| work.learn(&work.alike).map(drop))?;
    let model = work.without_residual(&work.alike)?;
    let view = model.view()?;
    let mut mixture = view.mixture()?;
    let condition = median(|| work.condition(&mut mixture))?;
    let mut curves = work.curves(&view);
    let trajectory = mixture.trajectory(0).ok_or("no skill")?;
    let moments = median(|| work.moments(&trajectory, &mut curves).map(drop))?;
    let drawn = work.moments(&trajectory, &mut curves)?;
    let means: Vec<f64> = drawn.iter().map(|moment| moment.mean).collect();
    let stds: Vec<f64> = drawn.iter().map(|moment| moment.variance).collect();

    let classes = work.without_residual(&work.labelled)?;
    let view = classes.view()?;
    let mut mixture = view.mixture()?;
    let mut log_posterior = vec![0.0; view.skills.len()];
    let recognition = median(|| work.recognise(&mut mixture, &mut log_posterior))?;
    // Some seconds: once, as that of the other package.
    let started = Instant::now();
    black_box(work.learn_em(&work.alike)?);
    let em = started.elapsed().as_secs_f64();

    let result = json!({
        "seconds": {
            "learn": learning,
            "em": em,
            "condition": condition,
            "moments": moments,
            "recognise": recognition,
        },
        "results": { "mean": means, "std": stds, "log_posterior": log_posterior },
        "peak_bytes": peak_bytes()?,
    });
    println!("{result}");
    Ok(())
}

/// Median seconds of one call.
fn median(mut call: impl FnMut() -> Result<(), Error>) -> Result<f64, Error> {
    let started = Instant::now();
    call()?;
    let once = started.elapsed().as_secs_f64().max(1e-9);
    let calls = (SAMPLE_S / once).ceil().max(1.0);
    let mut samples = Vec::with_capacity(SAMPLES);
    for _ in 0..SAMPLES {
        let started = Instant::now();
        for _ in 0..calls as usize {
            black_box(call()?);
        }
        samples.push(started.elapsed().as_secs_f64() / calls);
    }
    samples.sort_by(f64::total_cmp);
    Ok(samples[SAMPLES / 2])
}

/// The most memory this process ever held, from the kernel.
fn peak_bytes() -> Result<u64, Error> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib: u64 = line
        .and_then(|rest| rest.trim().strip_suffix("kB"))
        .ok_or("no VmHWM in /proc/self/status")?
        .trim()
        .parse()?;
    Ok(kib * 1024)
}
