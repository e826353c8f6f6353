//! Teaching by touch in the scripted program: every touch lasts a second; what points teach is the program's own answer.

use tonus::live::{Act, PointView, TeachingView, TouchView};
use tonus::transform::{LEAST_POINTS, Touched, Transform};

/// The hand goes there and is still for so long, seconds.
const TOUCH_S: f64 = 1.2;

#[derive(Default)]
pub(crate) struct Taught {
    pub(crate) view: TeachingView,
    /// The place that is touched, none for the shoulder, and since when.
    touching: Option<(Option<[f64; 3]>, f64)>,
}

impl Taught {
    pub(crate) fn act(&mut self, act: &Act, now_s: f64) {
        match act {
            Act::TeachShoulder => self.touching = Some((None, now_s)),
            Act::TeachPoint { robot_m } => {
                self.touching = Some((Some(robot_m.unwrap_or([0.40, 0.0, 0.45])), now_s));
            }
            Act::TeachRemove { point } => {
                self.view.points.remove(point - 1);
            }
            Act::TeachUse => {
                self.view = TeachingView {
                    kept: Some("in use, and kept in /home/ada/tonus.toml".into()),
                    ..TeachingView::default()
                };
            }
            _ => {
                self.view = TeachingView::default();
                self.touching = None;
            }
        }
    }

    pub(crate) fn look(&mut self, now_s: f64) {
        if let Some((place, _)) = self
            .touching
            .take_if(|(_, since_s)| now_s > *since_s + TOUCH_S)
        {
            match place {
                None => self.view.shoulder_m = Some([0.231, 0.379, 0.424]),
                Some(robot_m) => self.view.points.push(PointView {
                    robot_m,
                    // A tracker on the table before the robot, a millimetre off now and then.
                    tracker_m: [-robot_m[1], robot_m[2] + 0.1, 0.6 - robot_m[0] + 0.001],
                    off_mm: None,
                }),
            }
        }
        self.view.touching = self.touching.map(|(place, since_s)| TouchView {
            what: place.map_or("the shoulder".into(), |[x, y, z]| {
                format!("{x:.3}, {y:.3}, {z:.3} m")
            }),
            still: ((now_s - since_s) / TOUCH_S).min(1.0),
        });
        let touched = self.view.points.iter().map(|point| Touched {
            tracker_m: point.tracker_m,
            robot_m: point.robot_m,
        });
        let touched: Vec<Touched> = touched.collect();
        let taught = (touched.len() >= LEAST_POINTS).then(|| Transform::teach(&touched));
        let (fits, refused) = match taught {
            None => (None, None),
            Some(Ok(taught)) => (Some(taught), None),
            Some(Err(error)) => (None, Some(error.to_string())),
        };
        self.view.residual_mm = fits.map(|taught| 1e3 * taught.residual_m);
        self.view.may_use = refused.is_none() && (fits.is_some() || self.view.shoulder_m.is_some());
        self.view.problem = refused;
        for (point, touched) in self.view.points.iter_mut().zip(&touched) {
            point.off_mm = fits.map(|taught| {
                let [x, y, z] = taught.transform.point_m(touched.tracker_m);
                let [a, b, c] = touched.robot_m;
                1e3 * (x - a).hypot(y - b).hypot(z - c)
            });
        }
    }
}
