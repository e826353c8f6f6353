//! Power cuts at every write, rot at every bit, and what is refused.

mod calibration;
pub(crate) mod flash;
mod models;
mod refused_models;

use embassy_futures::block_on;

use super::*;
use flash::{Cut, FakeError, FakeFlash, How, Random};
use partitions::DK;

type Opened<'f> = Storage<&'f mut FakeFlash>;
type Error = StorageError<FakeError>;

fn open(flash: &mut FakeFlash) -> Opened<'_> {
    block_on(Storage::open(flash, DK)).unwrap()
}

/// Whether power was cut, the only way in which what is tested here may fail.
fn power_was_cut<T: core::fmt::Debug>(outcome: Result<T, Error>) -> bool {
    match outcome {
        Ok(_) => false,
        Err(StorageError::Flash {
            error: FakeError::PowerCut,
            ..
        }) => true,
        Err(error) => panic!("{error}"),
    }
}

/// Cuts power in each of the steps (a word written, a page erased) of `change`, before the step, within it in five
/// ways, and after it; each time the wearable starts again and `check` looks at it, told whether the change had been acknowledged.
/// Gives the number of steps.
fn cut_everywhere(
    base: &FakeFlash,
    change: impl Fn(&mut Opened<'_>) -> Result<(), Error>,
    check: impl Fn(&mut FakeFlash, bool),
) -> u64 {
    let mut uncut = base.clone();
    change(&mut open(&mut uncut)).unwrap();
    let steps = uncut.steps - base.steps;
    let ways = [How::Before, How::After]
        .into_iter()
        .chain((0..5).map(|seed| How::Within { seed }));
    for how in ways {
        for step in 0..steps {
            let mut flash = base.clone();
            flash.cut(Cut { step, how });
            let outcome = change(&mut open(&mut flash));
            let cut = power_was_cut(outcome);
            assert!(cut, "step {step} was not reached");
            flash.restart();
            check(&mut flash, false);
        }
    }
    check(&mut uncut, true);
    steps
}
