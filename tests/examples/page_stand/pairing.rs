//! Pairing of the scripted program: the exchange is the program's own, the wearable that shows the passkey is not there.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use tonus::link::ble::{BleError, Passkeys};
use tonus::live::{LinkView, PasskeyView};

/// People have so long here; the program gives them longer.
const LIMIT: Duration = Duration::from_secs(15);
/// Between a pairing that failed and the next.
const PAUSE: Duration = Duration::from_secs(2);

pub(crate) struct Pairing {
    passkeys: Passkeys,
    /// Why there is no link: while pairing is under way, and once it ended.
    told: Receiver<Option<String>>,
    down: Option<String>,
}

impl Pairing {
    /// So many times the wearable asks, until somebody gives six digits; after that there is a link.
    pub(crate) fn begin(passkeys: Passkeys, times: usize) -> Self {
        let (sender, told) = channel();
        let asking = passkeys.clone();
        std::thread::spawn(move || {
            for _ in 0..times {
                if asking
                    .ask("Tonus 7", &(Arc::new(|_: &str| None) as _), LIMIT)
                    .is_some()
                {
                    break;
                }
                let _nobody_looks = sender.send(Some(BleError::NoPasskey.to_string()));
                std::thread::sleep(PAUSE);
            }
            let _nobody_looks = sender.send(None);
        });
        Self {
            passkeys,
            told,
            down: (times > 0).then(|| "looking for the wearable".to_owned()),
        }
    }

    pub(crate) fn link(&mut self, view: &mut LinkView) {
        if let Some(told) = self.told.try_iter().last() {
            self.down = told;
        }
        view.passkey = self.passkeys.wanted().map(|wanted| PasskeyView {
            wanted_by: wanted.by,
            left_s: wanted.left.as_secs_f64(),
        });
        if let Some(why) = &self.down {
            *view = LinkView {
                link: "ble".into(),
                text: why.clone(),
                passkey: view.passkey.clone(),
                ..LinkView::default()
            };
        }
    }
}
