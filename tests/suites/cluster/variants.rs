//! Classes performed in more than one way.

use tonus::demonstration::Demonstration;
use tonus::model::cluster::{ClusterConfig, adjusted_rand_index, variants};

use super::planted::{plane, planted};

#[test]
fn a_class_performed_in_two_ways_is_split_and_one_in_one_way_is_not() {
    for seed in 1..=5 {
        let (two_ways, ways) = planted(&[20, 20], 8.0, seed);
        let (one_way, _) = planted(&[30], 8.0, 50 + seed);
        let demonstrations: Vec<_> = two_ways
            .iter()
            .map(|d| d.with_label("wave"))
            .chain(one_way.iter().map(|d| d.with_label("push")))
            .collect();
        let config = ClusterConfig {
            most_components: 3,
            seed,
            ..ClusterConfig::default()
        };
        let split = variants(&demonstrations, &plane(), &config).expect("variants");
        let classes: Vec<_> = split.classes.iter().map(|one| one.class.as_str()).collect();
        assert_eq!(classes, ["push", "wave"]);
        assert_eq!(split.classes[0].sizes, [30], "seed {seed}");
        assert_eq!(split.classes[1].sizes, [20, 20], "seed {seed}");
        let labels: Vec<_> = split
            .demonstrations
            .iter()
            .map(Demonstration::label)
            .collect();
        assert!(labels[40..].iter().all(|label| *label == "push"));
        assert_eq!(adjusted_rand_index(&labels[..40], &ways), Some(1.0));
        assert_eq!(labels[0], "wave#1");
        assert!(labels[..40].contains(&"wave#2"));
    }
}
