//! Two patterns against each other.

use tonus_shared::wire::Muscle;

use super::{Pattern, Verdict, named};
use crate::statistics::median;

/// A logarithm's standard deviation from one donning to the next on the same spot.
const SPREAD: f64 = 0.3;
/// Beyond this many spreads a channel is off for a reason of its own, which another order need not explain.
const FAR: f64 = 3.5;
/// Logarithms of the odds against another order (one in four hundred, spread over all orders that it might be), and against
/// a channel that is dead (one in fifty).
const MOVED_ODDS: f64 = 6.0;
const DEAD_ODDS: f64 = 4.0;
/// A channel this many times louder or quieter than the others say sits elsewhere. Repeats of free gestures under a band
/// that nobody touched reach 2.6 now and then (suite `person`).
const SHIFTED: f64 = 3.0;
/// Levels below this many times the rest are not told apart from it.
const ABOVE_REST: f64 = 2.0;
/// As many channels make a band, which can be turned.
const BAND: usize = 6;

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// These channels answer no more.
    Dead(Vec<usize>),
    /// The first of each pair shows what the second showed.
    Swapped(Vec<(usize, usize)>),
    /// A band turned by so many channels: channel c shows what channel c + turn showed.
    Turned(usize),
    /// A channel, and how many times as loud as it was.
    Shifted(usize, f64),
    /// Nothing answers: the muscles were not used, or nothing is on the arm.
    Nothing,
}

pub(super) fn verdict(reference: &Pattern, seen: &Pattern, muscles: &[Muscle]) -> Verdict {
    let floor = ABOVE_REST * median(&reference.rest_v);
    let levels = |pattern: &Pattern| -> Vec<[f64; 2]> {
        let both = pattern.flex_v.iter().zip(&pattern.extend_v);
        both.map(|(flex, extend)| [flex.max(floor).ln(), extend.max(floor).ln()])
            .collect()
    };
    let (before, now) = (levels(reference), levels(seen));
    // A channel with a loud rest of its own is silent at that.
    let quiet = |c: usize| f64::max(floor, reference.rest_v[c]).ln() + SPREAD;
    let silent = |c: &usize, levels: &[[f64; 2]]| levels[*c].iter().all(|x| *x <= quiet(*c));
    let answered: Vec<usize> = (0..before.len())
        .filter(|c| before[*c].iter().any(|x| *x > quiet(*c) + SPREAD))
        .collect();
    let (dead, alive): (Vec<usize>, Vec<usize>) =
        answered.into_iter().partition(|c| silent(c, &now));
    let findings = if alive.is_empty() {
        vec![Finding::Nothing]
    } else {
        explained(&before, &now, &dead, floor.ln())
    };
    let text = text(&findings, muscles);
    Verdict { findings, text }
}

/// How badly `now` fits `before` in this order; a factor common to all channels of a task does not count.
fn misfit(before: &[[f64; 2]], now: &[[f64; 2]], channels: &[usize], order: &[usize]) -> f64 {
    let task = |task: usize| -> f64 {
        let pairs = channels.iter().zip(order);
        let apart: Vec<f64> = pairs
            .map(|(channel, from)| now[*channel][task] - before[*from][task])
            .collect();
        let effort = median(&apart);
        let cost = |x: &f64| 0.5 * ((x - effort) / SPREAD).powi(2).min(FAR * FAR);
        apart.iter().map(cost).sum()
    };
    task(0) + task(1)
}

/// The likeliest of: all in place but for the dead, a band turned, channels in any order with or without the dead.
fn explained(before: &[[f64; 2]], now: &[[f64; 2]], dead: &[usize], floor: f64) -> Vec<Finding> {
    let all: Vec<usize> = (0..before.len()).collect();
    let others: Vec<usize> = all.iter().copied().filter(|c| !dead.contains(c)).collect();
    let buried = DEAD_ODDS * dead.len() as f64;
    let in_place = misfit(before, now, &others, &others) + buried;
    let turned = best_turn(before, now).map(|(misfit, order)| (misfit, order, &all));
    let swapped = best_order(before, now, &all).map(|(misfit, order)| (misfit, order, &all));
    let both = best_order(before, now, &others).filter(|_| !dead.is_empty());
    let both = both.map(|(misfit, order)| (misfit + buried, order, &others));
    let moves = [turned, swapped, both].into_iter().flatten();
    let likeliest = moves.min_by(|a, b| a.0.total_cmp(&b.0));
    match likeliest.filter(|likeliest| likeliest.0 < in_place) {
        Some((_, order, channels)) => {
            let dead = (channels.len() < all.len()).then(|| Finding::Dead(dead.to_vec()));
            let moved = moved(&order, channels, before.len());
            dead.into_iter().chain([moved]).collect()
        }
        None => {
            let dead = (!dead.is_empty()).then(|| Finding::Dead(dead.to_vec()));
            let shifted = shifted(before, now, &others, floor);
            dead.into_iter().chain(shifted).collect()
        }
    }
}

/// The best turn of a band, with the odds against one.
fn best_turn(before: &[[f64; 2]], now: &[[f64; 2]]) -> Option<(f64, Vec<usize>)> {
    let count = before.len();
    if count < BAND {
        return None;
    }
    let all: Vec<usize> = (0..count).collect();
    let odds = MOVED_ODDS + (count as f64 - 1.0).ln();
    let turns = (1..count).map(|turn| {
        let order: Vec<usize> = (0..count).map(|c| (c + turn) % count).collect();
        (misfit(before, now, &all, &order) + odds, order)
    });
    turns.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// The best order but their own, with the odds against one.
fn best_order(
    before: &[[f64; 2]],
    now: &[[f64; 2]],
    channels: &[usize],
) -> Option<(f64, Vec<usize>)> {
    let mut best: Option<(f64, Vec<usize>)> = None;
    // Heap's algorithm (1963) without recursion: at most 8! orders, of eight channels.
    let mut order = channels.to_vec();
    let mut counters = vec![0; order.len()];
    let (mut at, mut orders) = (1, 1.0_f64);
    while at < order.len() {
        if counters[at] < at {
            let other = if at.is_multiple_of(2) {
                0
            } else {
                counters[at]
            };
            order.swap(other, at);
            orders += 1.0;
            let here = misfit(before, now, channels, &order);
            if best.as_ref().is_none_or(|best| here < best.0) {
                best = Some((here, order.clone()));
            }
            counters[at] += 1;
            at = 1;
        } else {
            counters[at] = 0;
            at += 1;
        }
    }
    best.map(|(misfit, order)| (misfit + MOVED_ODDS + orders.ln(), order))
}

fn moved(order: &[usize], channels: &[usize], count: usize) -> Finding {
    let turn = (order[0] + count - channels[0]) % count;
    let all_turned = channels
        .iter()
        .zip(order)
        .all(|(c, from)| (c + turn) % count == *from);
    if count >= BAND && all_turned {
        return Finding::Turned(turn);
    }
    let pairs = channels
        .iter()
        .zip(order)
        .filter(|(channel, from)| channel != from);
    Finding::Swapped(pairs.map(|(channel, from)| (*channel, *from)).collect())
}

/// Channels that are much louder or quieter than before, where they speak.
fn shifted(before: &[[f64; 2]], now: &[[f64; 2]], channels: &[usize], floor: f64) -> Vec<Finding> {
    let effort = [0, 1].map(|task| {
        let apart: Vec<f64> = channels
            .iter()
            .map(|c| now[*c][task] - before[*c][task])
            .collect();
        median(&apart)
    });
    let factor = |channel: &usize| {
        let louder = |task: &usize| before[*channel][*task].max(now[*channel][*task]);
        let task = [0, 1]
            .into_iter()
            .max_by(|a, b| louder(a).total_cmp(&louder(b)))?;
        let change = now[*channel][task] - before[*channel][task] - effort[task];
        let speaks = louder(&task) > floor + 2.0 * SPREAD;
        (speaks && change.abs() > SHIFTED.ln()).then(|| Finding::Shifted(*channel, change.exp()))
    };
    channels.iter().filter_map(factor).collect()
}

fn text(findings: &[Finding], muscles: &[Muscle]) -> String {
    let one = |finding: &Finding| {
        match finding {
        Finding::Nothing => {
            "No channel answers: is the wearable on the arm, and did the muscles work against the weight? Check again."
                .to_owned()
        }
        Finding::Dead(channels) => format!(
            "No signal from {}: press these electrodes on, check their cables, then check again.",
            named(channels, muscles)
        ),
        Finding::Turned(turn) => {
            let count = muscles.len();
            let (by, way) = if 2 * turn <= count {
                (*turn, "lower")
            } else {
                (count - turn, "higher")
            };
            format!(
                "The band is turned: every channel shows what was {by} channels on. Turn it back by {by} towards the \
                 {way} numbers, or calibrate again."
            )
        }
        Finding::Swapped(pairs) => {
            let pairs = pairs.iter().map(|(channel, from)| {
                format!("{} shows what {} did", named(&[*channel], muscles), named(&[*from], muscles))
            });
            format!(
                "Channels are swapped: {}. Put the cables or electrodes back, then check again.",
                pairs.collect::<Vec<_>>().join("; ")
            )
        }
        Finding::Shifted(channel, factor) => format!(
            "{} is {factor:.1} times as loud as it was: put its electrodes where they were, clean the skin, or calibrate \
             again.",
            named(&[*channel], muscles)
        ),
    }
    };
    if findings.is_empty() {
        return "The wearable sits as it did: use the calibration.".into();
    }
    findings.iter().map(one).collect::<Vec<_>>().join(" ")
}
