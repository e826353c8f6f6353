//! Labels for what clustering found.

use std::collections::BTreeSet;

use super::{ClusterConfig, ClusterError, Clusters, cluster};
use crate::demonstration::Demonstration;
use crate::model::Valid;

/// Demonstrations that all have a label.
#[derive(Clone, Debug, PartialEq)]
pub struct Labelled {
    /// The demonstrations in their order, labelled.
    pub demonstrations: Vec<Demonstration>,
    /// Name of each component.
    pub names: Vec<String>,
    /// How they came about.
    pub clusters: Clusters,
}

/// Labels the demonstrations whose `label()` is empty, by [`cluster`]: they join one of the labelled classes or make
/// new ones, called `skill1`, `skill2` ... (a name that a label has is left out).
///
/// # Errors
/// [`ClusterError`].
pub fn label(
    demonstrations: &[Demonstration],
    valid: &Valid,
    config: &ClusterConfig,
) -> Result<Labelled, ClusterError> {
    let known = demonstrations.iter().map(Demonstration::class);
    let known: BTreeSet<&str> = known.filter(|class| !class.is_empty()).collect();
    let index = |d: &Demonstration| known.iter().position(|class| *class == d.class());
    let labels: Vec<Option<usize>> = demonstrations.iter().map(index).collect();
    let clusters = cluster(demonstrations, valid, &labels, config)?;
    let fresh = (1..)
        .map(|number| format!("skill{number}"))
        .filter(|name| !known.contains(name.as_str()));
    let old = known.iter().map(|&class| class.to_owned());
    let names: Vec<String> = old.chain(fresh).take(clusters.components).collect();
    let pairs = demonstrations.iter().zip(&clusters.assignment);
    Ok(Labelled {
        demonstrations: pairs
            .map(|(demonstration, &of)| demonstration.with_label(&names[of]))
            .collect(),
        names,
        clusters,
    })
}
