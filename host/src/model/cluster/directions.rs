//! Movements that are performed in either direction.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::ClusterError;
use super::space::drawn;
use crate::model::{Fitted, LearnError, PartsError, Valid};

/// Steps of the alignment from one start, at most.
const STEPS: usize = 20;

/// Fits for a model that knows each class in both directions, as two components: `class#1` is the direction of most of
/// its demonstrations and `class#2` the other. `backward[i]` is the fit of the movement `forward[i]` performed
/// backwards ([`Demonstration::backwards`](crate::demonstration::Demonstration::backwards)). Each component is taught by
/// every demonstration of its class, turned where it must be, so that few performances in one direction profit from
/// many in the other; both directions are equally probable.
///
/// Which demonstrations are turned is found without labels of direction, class by class: the turns with the least sum of
/// squared distances from their mean, among those that repeated turning towards the mean reaches from each
/// demonstration.
///
/// # Errors
/// Fits of different number or length, or no fits.
pub fn both_ways(
    forward: &[Fitted],
    backward: &[Fitted],
    valid: &Valid,
) -> Result<Vec<Fitted>, ClusterError> {
    if forward.len() != backward.len() {
        return Err(ClusterError::Learn(LearnError::Parts(PartsError::Length {
            what: "the fits of the movements performed backwards",
            expected: forward.len(),
            got: backward.len(),
        })));
    }
    let columns = drawn(&[forward, backward].concat(), valid.get())?;
    let mut of_class: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (index, fit) in forward.iter().enumerate() {
        of_class.entry(&fit.class).or_default().push(index);
    }
    let mut both = Vec::with_capacity(columns.ncols());
    for members in of_class.values() {
        let turned = turned(&columns, members);
        for (&i, turned) in members.iter().zip(turned) {
            let (one, other) = if turned { (2, 1) } else { (1, 2) };
            both.push(component(&forward[i], one));
            both.push(component(&backward[i], other));
        }
    }
    Ok(both)
}

fn component(fit: &Fitted, number: usize) -> Fitted {
    Fitted {
        label: format!("{}#{number}", fit.class),
        ..fit.clone()
    }
}

/// Whether each member is performed in the direction of the fewer. The first half of the columns are the demonstrations,
/// the second half the same backwards.
fn turned(columns: &DMatrix<f64>, members: &[usize]) -> Vec<bool> {
    let half = columns.ncols() / 2;
    let side = |i: usize, turned: bool| columns.column(if turned { half + i } else { i });
    let mut best = (f64::INFINITY, vec![false; members.len()]);
    for &start in members {
        let mut mean: DVector<f64> = side(start, false).into_owned();
        let mut turns = vec![false; members.len()];
        for _ in 0..STEPS {
            let towards = |&i: &usize| {
                (side(i, true) - &mean).norm_squared() < (side(i, false) - &mean).norm_squared()
            };
            let next: Vec<bool> = members.iter().map(towards).collect();
            mean.fill(0.0);
            for (&i, &turned) in members.iter().zip(&next) {
                mean += side(i, turned) / members.len() as f64;
            }
            if next == turns {
                break;
            }
            turns = next;
        }
        let away = members.iter().zip(&turns);
        let away: f64 = away
            .map(|(&i, &t)| (side(i, t) - &mean).norm_squared())
            .sum();
        if away < best.0 {
            best = (away, turns);
        }
    }
    let turns = best.1;
    let many = 2 * turns.iter().filter(|turned| **turned).count() > turns.len();
    turns.into_iter().map(|turned| turned != many).collect()
}
