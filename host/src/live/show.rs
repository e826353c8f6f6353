//! What there is to see of an engine.

use tonus_shared::semg::quality::Quality;
use tonus_shared::wire::{StatusFlags, Stream, StreamFlags};

use super::engine::Engine;
use super::input::{LinkEvent, TrackerEvent};
use super::view::{
    ChannelView, ClockView, HandView, Lamp, LibraryView, LinkView, PathPoint, RecognitionView,
    RobotView, SemgView, TrackerView, View,
};
use crate::calibration::muscle_name;
use crate::session::Session;

/// Points of an expected path, and the time between them, seconds.
const PATH_POINTS: u32 = 8;
const PATH_STEP_S: f64 = 0.25;

impl Engine {
    /// Everything there is to see now. Signals since the view before are taken out.
    pub(super) fn view(&mut self, session: Option<&mut Session<'_>>) -> View {
        View {
            at_us: self.now_us,
            link: self.link_view(),
            clock: self.wearable.clock().map(|health| ClockView {
                rate_ppm: health.rate_ppm,
                residual_us: health.residual_us,
                uncertainty_us: health.uncertainty_us,
                round_trip_us: health.round_trip_us,
                late_us: health.late_us,
                settled: health.settled,
            }),
            tracker: self.tracker_view(),
            semg: self.semg_view(),
            trace: self.traces.take(),
            hand: self.hand.map(|hand| HandView {
                position_m: hand.position_m,
                age_ms: self.age_ms(hand.exposed_us),
                in_robot_m: self.hand_in_robot_m,
            }),
            calibration: self.calibrating.view(&self.wearable),
            teaching: self.teaching.view(),
            recording: self.take.as_ref().map(|take| take.view(self.now_us)),
            demonstrations: self.kept.iter().map(super::takes::Kept::view).collect(),
            library: self.library_view(),
            recognition: session.map(|session| self.recognition_view(session)),
            robot: self.robot_view(),
            file: None,
            // Whoever runs the engine has a clock.
            latency: None,
            story: None,
            messages: self.messages.clone(),
        }
    }

    #[allow(clippy::cast_precision_loss, reason = "milliseconds")]
    fn age_ms(&self, at_us: u64) -> f64 {
        self.now_us.saturating_sub(at_us) as f64 * 1e-3
    }

    fn link_view(&self) -> LinkView {
        let counts = self.wearable.counts();
        let status = self.wearable.status.as_ref();
        let mut view = LinkView {
            link: self.config.link.clone(),
            received: counts.received,
            lost: counts.lost,
            refused: self.wearable.refused,
            age_ms: (self.wearable.newest).map(|newest| self.age_ms(newest.acquired_us)),
            battery_mv: status.and_then(|status| status.battery_mv),
            warnings: status
                .map_or_else(Vec::new, |status| warnings(status.flags))
                .into_iter()
                .chain(self.unfaced().map(str::to_owned))
                .collect(),
            ..LinkView::default()
        };
        match &self.linked {
            None => "looking for the wearable".clone_into(&mut view.text),
            Some(LinkEvent::Up {
                name,
                mtu,
                interval_us,
            }) => {
                view.up = true;
                view.text.clone_from(name);
                view.mtu = *mtu;
                view.interval_ms = interval_us.map(|us| f64::from(us) * 1e-3);
            }
            Some(LinkEvent::Down { reason }) => view.text.clone_from(reason),
        }
        view
    }

    fn tracker_view(&self) -> TrackerView {
        let (up, text) = match &self.tracker {
            None => (false, "looking for the tracker".to_owned()),
            Some(TrackerEvent::Up { name }) => (true, name.clone()),
            Some(TrackerEvent::Down { reason }) => (false, reason.clone()),
        };
        TrackerView {
            up,
            text,
            age_ms: self.hand.map(|hand| self.age_ms(hand.exposed_us)),
            taught: self.config.tracker_to_robot.is_some(),
        }
    }

    fn semg_view(&self) -> Option<SemgView> {
        let newest = self.wearable.newest?;
        let stream = &newest.stream;
        let used = usize::from(stream.channels).min(stream.quality.len());
        let muscles = self.wearable.configuration.map(|c| c.muscles);
        let channels = (0..used).map(|channel| {
            let quality = stream.quality[channel];
            ChannelView {
                muscle: muscles.map_or_else(
                    || format!("channel {}", channel + 1),
                    |muscles| muscle_name(muscles[channel]).to_owned(),
                ),
                envelope: f64::from(stream.envelopes[channel]),
                lamp: lamp(quality),
                warnings: quality_warnings(quality),
            }
        });
        let held = StreamFlags::STIFFNESS_HELD.with(StreamFlags::ACTIVATION_HELD, true);
        let is_held = stream.flags.bits() & held.bits() != 0;
        Some(SemgView {
            channels: channels.collect(),
            activation: f64::from(stream.activation),
            co_contraction: f64::from(stream.co_contraction),
            stiffness_n_per_m: stream.stiffness_n_per_m.map(f64::from),
            hand_seen: stream.flags.contains(StreamFlags::HAND_SEEN),
            held: is_held,
            delay_ms: delay_ms(stream),
        })
    }

    fn library_view(&self) -> LibraryView {
        let skills = self.library.as_deref().map_or_else(Vec::new, |library| {
            let parts = library.model.parts();
            let labels = parts.labels.iter().cloned();
            labels.zip(parts.counts.iter().copied()).collect()
        });
        LibraryView {
            skills,
            learning: self.learning.is_some(),
            problem: self.learn_problem.clone(),
            held_out: self.library.as_deref().and_then(|library| library.held_out),
        }
    }

    fn recognition_view(&self, session: &mut Session<'_>) -> RecognitionView {
        let labels = self.library.as_deref().map(|l| l.model.labels().to_vec());
        let labels = labels.unwrap_or_default();
        let novelty = session.novelty();
        let decision = session.decision().and_then(|decision| {
            let label = labels.get(decision.skill)?.clone();
            Some((label, decision.after_s))
        });
        let mut view = RecognitionView {
            posterior: session.posterior(),
            under_way: session.under_way(),
            phase: session.phase(self.now_us),
            decision,
            unknown: session.unknown(),
            unjudged: session.unjudged(),
            nearest: (novelty.filter(|n| n.unknown)).map(|n| n.nearest.to_owned()),
            novelty: novelty.map(|n| n.score / n.threshold),
            history: self.history.clone(),
            labels,
            ..RecognitionView::default()
        };
        if !view.under_way {
            return view;
        }
        for step in 0..PATH_POINTS {
            let in_s = f64::from(step) * PATH_STEP_S;
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "two seconds"
            )]
            let at_us = self.now_us + (in_s * 1e6) as u64;
            // What cannot be foretold is not shown.
            let Ok(Some(expected)) = session.foretell(at_us) else {
                break;
            };
            view.human_path.push(PathPoint {
                in_s,
                mean_m: expected.hand.map(|p| p.mean),
                std_m: expected.hand.map(|p| p.std),
            });
            view.robot_path.push(PathPoint {
                in_s,
                mean_m: expected.robot.map(|(place, _)| place.mean),
                std_m: expected.robot.map(|(place, _)| place.std),
            });
            let firmness = expected.robot.map(|(_, firmness)| firmness.mean);
            view.robot_stiffness_n_per_m.push(firmness);
        }
        view
    }

    fn robot_view(&self) -> RobotView {
        let setpoint = self.follow.setpoint();
        let (state, reason) = self.follow.state();
        let newest = self.follow.newest.as_ref();
        RobotView {
            robot: self.config.robot.clone(),
            state: state.to_owned(),
            reason: reason.to_owned(),
            can_arm: self.follow.gate.may_arm(self.now_us) && self.unfollowable().is_none(),
            position_m: (self.follow.position_m(self.now_us)).unwrap_or(setpoint.position_m),
            joints_m: self.follow.joints_m(),
            setpoint_m: setpoint.position_m,
            stiffness_n_per_m: setpoint.stiffness_n_per_m,
            age_ms: newest.map(|command| self.age_ms(command.acquired_us)),
            refused: self.follow.gate.refused(),
        }
    }
}

/// How long before the newest scan the stiffness describes, ms.
fn delay_ms(stream: &Stream) -> f64 {
    f64::from(stream.describes_before_us) * 1e-3
}

fn lamp(quality: Quality) -> Lamp {
    if quality == Quality::GOOD {
        Lamp::Good
    } else if quality == Quality::HUM {
        Lamp::Warn
    } else {
        Lamp::Bad
    }
}

fn quality_warnings(quality: Quality) -> Vec<String> {
    let all = [
        (
            Quality::SATURATED,
            "saturated: lower the gain or tug at no cable",
        ),
        (Quality::FLAT, "flat: check the cable"),
        (
            Quality::HUM,
            "mains hum: move away from the mains, check the reference electrode",
        ),
        (Quality::LEAD_OFF, "off the skin: press the electrode on"),
    ];
    let raised = all.iter().filter(|(bit, _)| quality.contains(*bit));
    raised.map(|(_, text)| (*text).to_owned()).collect()
}

fn warnings(flags: StatusFlags) -> Vec<String> {
    let all = [
        (
            StatusFlags::LOW_BATTERY,
            "the battery will soon be empty: charge it",
        ),
        (
            StatusFlags::FRONT_END_FAILED,
            "the converter does not answer: restart the wearable",
        ),
        (
            StatusFlags::ATTITUDE_SENSOR_FAILED,
            "the attitude sensor does not answer: the arm is taken to hang",
        ),
        (
            StatusFlags::LAST_WORDS_WAIT,
            "the wearable restarted after a fault",
        ),
        (
            StatusFlags::NOT_CALIBRATED,
            "not calibrated: levels and arm are illustrative",
        ),
    ];
    let raised = all.iter().filter(|(flag, _)| flags.contains(*flag));
    raised.map(|(_, text)| (*text).to_owned()).collect()
}
