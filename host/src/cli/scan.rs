//! `tonus scan`: which wearables and armbands are near by.

use std::time::Duration;

use anyhow::Context;
use serde_json::json;
use tonus::link::ble::platform::SystemCentral;
use tonus::link::ble::{Central, Found};
use tonus::link::myo;
use tonus_shared::gatt;

use super::options::positive;
use super::say;

const EXAMPLE: &str = "Example:
  tonus scan
  tonus scan --seconds 10 --json";

/// List the wearables and Myo armbands that advertise near by, the strongest first.
///
/// A wearable that is connected to a host does not advertise.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct ScanArgs {
    /// Listen for this time.
    #[arg(long, value_name = "SECONDS", default_value = "5", value_parser = positive)]
    seconds: f64,
}

impl ScanArgs {
    /// Listens, then lists. Nobody near by is no failure; no Bluetooth is one.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let limit = Duration::try_from_secs_f64(self.seconds).context("--seconds")?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .context("no thread for Bluetooth")?;
        let mut found = runtime.block_on(async {
            let mut central = SystemCentral::new().await?;
            central.scan(limit, &|_| false).await
        })?;
        found.retain(|found| link(found).is_some());
        found.sort_by_key(|found| std::cmp::Reverse(found.rssi_dbm));
        say(&if json { document(&found) } else { list(&found) })
    }
}

/// How `--link` names it, if it is one of ours.
fn link(found: &Found) -> Option<String> {
    if found.services.contains(&gatt::SERVICE) {
        Some(format!("ble:{}", found.id))
    } else {
        found
            .services
            .contains(&myo::SERVICE)
            .then(|| "myo".to_owned())
    }
}

fn document(found: &[Found]) -> String {
    let found = found.iter().map(|found| {
        json!({ "link": link(found), "name": found.name, "id": found.id, "rssi_dbm": found.rssi_dbm })
    });
    format!("{}\n", json!({ "found": found.collect::<Vec<_>>() }))
}

fn list(found: &[Found]) -> String {
    if found.is_empty() {
        return "nobody near by: switch the wearable on and bring it near; one that is connected to a host does not advertise\n"
            .to_owned();
    }
    let lines = found.iter().map(|found| {
        let name = found.name.as_deref().unwrap_or("nameless");
        let strength = found
            .rssi_dbm
            .map_or_else(String::new, |rssi_dbm| format!("  {rssi_dbm} dBm"));
        let link = link(found).unwrap_or_default();
        format!("{name:<16} --link {link}{strength}\n")
    });
    lines.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_listed_by_the_link_that_it_takes() {
        let wearable = Found {
            id: "C7:0A:70:5E:00:01".to_owned(),
            name: Some("Tonus".to_owned()),
            services: vec![gatt::SERVICE],
            rssi_dbm: Some(-51),
        };
        let armband = Found {
            id: "D0:00:00:00:00:02".to_owned(),
            name: None,
            services: vec![0xd506_0001_a904_deb9_4748_2c7f_4a12_4842],
            rssi_dbm: None,
        };
        let found = [wearable, armband];
        assert_eq!(
            list(&found),
            "Tonus            --link ble:C7:0A:70:5E:00:01  -51 dBm\nnameless         --link myo\n"
        );
        let parsed: serde_json::Value = serde_json::from_str(&document(&found)).unwrap();
        assert_eq!(parsed["found"][0]["rssi_dbm"], -51);
        assert_eq!(parsed["found"][1]["link"], "myo");
        assert!(list(&[]).contains("switch the wearable on"));
    }
}
