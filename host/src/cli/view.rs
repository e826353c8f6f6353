//! The demo in the terminal, at the pace of the simulated time.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use ratatui::DefaultTerminal;
use ratatui::Frame;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::canvas::{Canvas, Circle};
use ratatui::widgets::{Bar, BarChart, BarGroup, Block, Gauge, Paragraph};
use tonus::demo::Snapshot;
use tonus::robot::gate::State;

/// Blue and orange: told apart by colour-blind eyes too.
const PERSON: Color = Color::Rgb(0x56, 0xb4, 0xe9);
const ROBOT: Color = Color::Rgb(0xe6, 0x9f, 0x00);
/// Full scale of the stiffness bars, N/m.
const STIFFNESS_SCALE_N_PER_M: u64 = 2000;

/// The terminal, taken over until [`View::close`].
pub(crate) struct View {
    terminal: DefaultTerminal,
    started: Instant,
}

impl View {
    /// Takes the terminal over; ratatui gives it back on a panic.
    pub(crate) fn open() -> std::io::Result<Self> {
        Ok(Self {
            terminal: ratatui::try_init()?,
            started: Instant::now(),
        })
    }

    /// Waits until it is time for this instant, then draws it. Breaks on `q`, Esc or Ctrl-C, or when the
    /// terminal is gone: the robot of this demo is simulated and stops with it.
    pub(crate) fn show(&mut self, snapshot: &Snapshot<'_>) -> ControlFlow<()> {
        let due = self.started + Duration::from_micros(snapshot.now_us);
        loop {
            let rest = due.saturating_duration_since(Instant::now());
            match event::poll(rest) {
                Ok(true) => {
                    if event::read().is_ok_and(|event| ends(&event)) {
                        return ControlFlow::Break(());
                    }
                }
                Ok(false) => break,
                Err(_terminal_gone) => return ControlFlow::Break(()),
            }
        }
        match self.terminal.draw(|frame| draw(frame, snapshot)) {
            Ok(_) => ControlFlow::Continue(()),
            Err(_terminal_gone) => ControlFlow::Break(()),
        }
    }

    /// Gives the terminal back.
    pub(crate) fn close(self) -> std::io::Result<()> {
        ratatui::try_restore()
    }
}

fn ends(event: &Event) -> bool {
    let Event::Key(key) = event else { return false };
    let interrupt = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
    key.kind == KeyEventKind::Press
        && (interrupt || matches!(key.code, KeyCode::Char('q') | KeyCode::Esc))
}

fn draw(frame: &mut Frame<'_>, snapshot: &Snapshot<'_>) {
    let [head, top, bottom, foot] = Layout::vertical([
        Constraint::Length(3),
        Constraint::Min(8),
        Constraint::Min(8),
        Constraint::Length(2),
    ])
    .areas(frame.area());
    let [signals, skills] = Layout::horizontal([Constraint::Percentage(50); 2]).areas(top);
    let [space, firmness] = Layout::horizontal([Constraint::Percentage(50); 2]).areas(bottom);
    action(frame, head, snapshot);
    envelopes(frame, signals, snapshot);
    posterior(frame, skills, snapshot);
    side_view(frame, space, snapshot);
    stiffness(frame, firmness, snapshot);
    footer(frame, foot, snapshot);
}

fn action(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot<'_>) {
    let (label, phase) = match snapshot.action {
        Some((skill, phase)) => (format!("the person does {}", skill.label()), phase),
        None => ("pause".to_owned(), 0.0),
    };
    let gauge = Gauge::default()
        .block(Block::bordered().title(" Tonus, simulated wearer "))
        .gauge_style(Style::new().fg(PERSON))
        .ratio(phase.clamp(0.0, 1.0))
        .label(label);
    frame.render_widget(gauge, area);
}

fn envelopes(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot<'_>) {
    let names = ["bi short", "bi long", "tri lat", "tri long"];
    let values = snapshot.stream.map_or([0.0; 8], |stream| stream.envelopes);
    let bars = names.iter().zip(values).map(|(name, value)| {
        let share = percent(f64::from(value));
        Bar::default()
            .label(Line::from(*name))
            .value(share)
            .text_value(format!("{share} %"))
    });
    chart(
        frame,
        area,
        " envelopes, % of maximum contraction ",
        bars.collect(),
        100,
        PERSON,
    );
}

fn posterior(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot<'_>) {
    let bars = snapshot
        .labels
        .iter()
        .zip(snapshot.posterior)
        .map(|(label, p)| {
            let share = percent(*p);
            Bar::default()
                .label(Line::from(label.as_str()))
                .value(share)
                .text_value(format!("{share} %"))
        });
    let unknown = snapshot.novelty.filter(|novelty| novelty.unknown);
    let (title, color) = match unknown {
        Some(novelty) => (
            format!(
                " not in the library; nearest: {} ({:.1} sd) ",
                novelty.nearest, novelty.distance
            ),
            Color::DarkGray,
        ),
        None => (
            " what is it? posterior ".to_owned(),
            Color::Rgb(0, 0x9e, 0x73),
        ),
    };
    chart(frame, area, &title, bars.collect(), 100, color);
}

fn stiffness(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot<'_>) {
    let human = snapshot
        .stream
        .map_or([0.0; 3], |stream| stream.stiffness_n_per_m.map(f64::from));
    let robot = snapshot.setpoint.stiffness_n_per_m;
    let both = human
        .iter()
        .map(|k| (PERSON, k))
        .chain(robot.iter().map(|k| (ROBOT, k)));
    let names = ["you x", "you y", "you z", "robot x", "robot y", "robot z"];
    let bars = names.iter().zip(both).map(|(name, (color, k))| {
        let value = whole(*k);
        Bar::default()
            .label(Line::from(*name))
            .value(value)
            .text_value(value.to_string())
            .style(Style::new().fg(color))
    });
    chart(
        frame,
        area,
        " stiffness, N/m ",
        bars.collect(),
        STIFFNESS_SCALE_N_PER_M,
        ROBOT,
    );
}

fn chart(
    frame: &mut Frame<'_>,
    area: Rect,
    title: &str,
    bars: Vec<Bar<'_>>,
    full: u64,
    color: Color,
) {
    let count = u16::try_from(bars.len()).unwrap_or(u16::MAX).max(1);
    let width = (area.width.saturating_sub(2) / count)
        .saturating_sub(1)
        .max(1);
    let chart = BarChart::default()
        .block(Block::bordered().title(title))
        .data(BarGroup::default().bars(&bars))
        .bar_width(width)
        .bar_gap(1)
        .max(full)
        .bar_style(Style::new().fg(color));
    frame.render_widget(chart, area);
}

/// Both hands from the side: reach across, height up.
fn side_view(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot<'_>) {
    let hand = tonus::simulate::scripted::in_robot_frame(snapshot.hand_m);
    let (robot, goal) = (snapshot.robot_m, snapshot.setpoint.position_m);
    let canvas = Canvas::default()
        .block(Block::bordered().title(" side view: hand (blue), robot (orange) "))
        .marker(Marker::Braille)
        .x_bounds([0.2, 1.1])
        .y_bounds([0.0, 0.8])
        .paint(|context| {
            for (point, radius, color) in [
                (hand, 0.03, PERSON),
                (robot, 0.03, ROBOT),
                (goal, 0.012, ROBOT),
            ] {
                context.draw(&Circle {
                    x: point[0],
                    y: point[2],
                    radius,
                    color,
                });
            }
        });
    frame.render_widget(canvas, area);
}

fn footer(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot<'_>) {
    let gate = match snapshot.gate {
        State::Following => "following".to_owned(),
        State::Holding => "holding".to_owned(),
        State::FallingBack => "falling back".to_owned(),
        State::Disarmed(cause) => format!("disarmed ({cause:?})"),
    };
    let right = snapshot
        .scores
        .iter()
        .filter(|a| a.recognised == a.performed)
        .count();
    let last = snapshot.scores.last().map_or(String::new(), |score| {
        format!("; last: {} taken for {}", score.performed, score.recognised)
    });
    let named = (snapshot.outside.iter())
        .filter(|a| a.named_unknown)
        .count();
    let false_alarms = snapshot.scores.iter().filter(|a| a.unknown).count();
    let lines = vec![
        Line::from(format!(
            "recognised {right} of {}{last}; unknown named {named} of {}, {false_alarms} false alarms",
            snapshot.scores.len(),
            snapshot.outside.len()
        )),
        Line::from(format!(
            "robot {gate}   packets {} sent, {} lost, {} corrupt   q quits",
            snapshot.packets.sent, snapshot.packets.lost, snapshot.packets.corrupt
        )),
    ];
    let text = Paragraph::new(lines).style(Style::new().add_modifier(Modifier::BOLD));
    frame.render_widget(text, area);
}

fn percent(share: f64) -> u64 {
    whole(share * 100.0)
}

/// The nearest whole number, at least zero.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped below, and saturating above"
)]
fn whole(value: f64) -> u64 {
    value.max(0.0).round() as u64
}
