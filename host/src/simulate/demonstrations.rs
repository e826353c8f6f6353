//! Labelled demonstrations, recorded through the whole chain: what arrives is joined by the time it describes.

use super::rig::{Rig, RigConfig, RigError};
use super::scripted::{self, RobotPoint};
use super::skills::DURATION_US;
use super::tracker::TrackedHand;
use super::wearer::{Action, Task};
use tonus_shared::wire::{Packet, Stream};

/// Positions are interpolated between frames at most this far apart, microseconds: a longer gap is an occlusion,
/// and the row is left out.
const LONGEST_GAP_US: u64 = 60_000;

/// One instant of a demonstration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Time since the action began, seconds.
    pub t_s: f64,
    /// Position of the hand as tracked: shoulder frame, metres.
    pub human_m: [f64; 3],
    /// Stiffness of the hand as streamed, N/m.
    pub human_n_per_m: [f64; 3],
    /// The robot's part, from the script.
    pub robot: RobotPoint,
}

/// One recorded action.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstration {
    /// What was done: the label is `action.skill.label()`.
    pub action: Action,
    /// Rows in increasing time: 100 a second but for lost packets and occlusions.
    pub rows: Vec<Row>,
}

/// Lets a wearer do the actions one after another and records each of them.
///
/// Human positions are the tracker's, interpolated to the time that the stiffness describes; human stiffness is the
/// stream packets'; the robot's columns are the script's ([`scripted`]) at that time.
///
/// # Errors
/// [`RigError`] as from [`Rig`].
pub fn record(actions: &[Action], config: &RigConfig) -> Result<Vec<Demonstration>, RigError> {
    let tasks: Vec<Task> = actions
        .iter()
        .map(|&action| Task::Perform(action))
        .collect();
    let mut rig = Rig::new(&tasks, config)?;
    let starts_us: Vec<u64> = rig.spans().iter().map(|span| span.start_us).collect();
    let (mut streams, mut hands) = (Vec::new(), Vec::new());
    while let Some(step) = rig.step()? {
        hands.extend(step.hand);
        for frame in step
            .arrivals
            .into_iter()
            .filter_map(|arrival| arrival.frame.ok())
        {
            if let Packet::Stream(stream) = frame.packet {
                let describes_us = stream.describes_us(frame.header.device_us);
                streams.push((describes_us, stream));
            }
        }
    }
    // Late and doubled packets: a recording can wait for their turn.
    streams.sort_by_key(|(describes_us, _)| *describes_us);
    streams.dedup_by_key(|(describes_us, _)| *describes_us);
    Ok(actions
        .iter()
        .zip(starts_us)
        .map(|(action, start_us)| Demonstration {
            action: *action,
            rows: rows(action, start_us, &streams, &hands),
        })
        .collect())
}

fn rows(
    action: &Action,
    start_us: u64,
    streams: &[(u64, Stream)],
    hands: &[TrackedHand],
) -> Vec<Row> {
    let from = streams.partition_point(|(at_us, _)| *at_us < start_us);
    let to = streams.partition_point(|(at_us, _)| *at_us <= start_us + DURATION_US);
    let row = |(describes_us, stream): &(u64, Stream)| {
        let human_m = hand_at(hands, *describes_us)?;
        #[allow(clippy::cast_precision_loss, reason = "at most two seconds")]
        let since_us = (describes_us - start_us) as f64;
        #[allow(clippy::cast_precision_loss, reason = "two seconds")]
        let robot = scripted::robot(action, since_us / DURATION_US as f64);
        Some(Row {
            t_s: since_us * 1e-6,
            human_m,
            human_n_per_m: stream.stiffness_n_per_m.map(f64::from),
            robot,
        })
    };
    streams
        .get(from..to)
        .unwrap_or_default()
        .iter()
        .filter_map(row)
        .collect()
}

/// The tracker's position at `at_us` by linear interpolation between the frames around it (in order of
/// exposure); none before the first, after the last, and across an occlusion.
#[must_use]
pub fn hand_at(hands: &[TrackedHand], at_us: u64) -> Option<[f64; 3]> {
    let next = hands.partition_point(|hand| hand.exposed_us < at_us);
    let after = hands.get(next)?;
    if after.exposed_us == at_us {
        return Some(after.position_m);
    }
    let before = hands.get(next.checked_sub(1)?)?;
    let gap_us = after.exposed_us - before.exposed_us;
    if gap_us > LONGEST_GAP_US {
        return None;
    }
    #[allow(clippy::cast_precision_loss, reason = "at most 60 ms")]
    let way = (at_us - before.exposed_us) as f64 / gap_us as f64;
    Some(std::array::from_fn(|axis| {
        before.position_m[axis] + way * (after.position_m[axis] - before.position_m[axis])
    }))
}
