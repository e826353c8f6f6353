//! Classes performed in more than one way.

use std::collections::BTreeMap;

use super::{Candidate, ClusterConfig, ClusterError, cluster};
use crate::demonstration::Demonstration;
use crate::model::Valid;

/// What one class was split into.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassVariants {
    /// The class.
    pub class: String,
    /// Demonstrations of each of its components.
    pub sizes: Vec<usize>,
    /// Every number of components that was tried; empty for a class of too few demonstrations to split.
    pub table: Vec<Candidate>,
}

/// Demonstrations labelled by component.
#[derive(Clone, Debug, PartialEq)]
pub struct Variants {
    /// The demonstrations in their order. Those of a class with several components are labelled `class#1`, `class#2` ...
    /// by the order of the components' first demonstrations, the others by their class.
    pub demonstrations: Vec<Demonstration>,
    /// The classes, sorted by name.
    pub classes: Vec<ClassVariants>,
}

/// Splits each class into as many components as the held-out likelihood wants: people do a thing in more than
/// one way. A class of fewer than 4 demonstrations stays one.
///
/// # Errors
/// [`ClusterError`].
pub fn variants(
    demonstrations: &[Demonstration],
    valid: &Valid,
    config: &ClusterConfig,
) -> Result<Variants, ClusterError> {
    let mut of_class: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (index, demonstration) in demonstrations.iter().enumerate() {
        of_class
            .entry(demonstration.class())
            .or_default()
            .push(index);
    }
    let mut relabelled = demonstrations.to_vec();
    let mut classes = Vec::with_capacity(of_class.len());
    for (class, members) in of_class {
        let own: Vec<_> = members.iter().map(|&i| demonstrations[i].clone()).collect();
        let mut split = ClassVariants {
            class: class.to_owned(),
            sizes: vec![members.len()],
            table: Vec::new(),
        };
        if members.len() >= LEAST_TO_SPLIT.max(2 * config.least_components) {
            let clusters = cluster(&own, valid, &vec![None; own.len()], config)?;
            split.table = clusters.table;
            split.sizes = vec![0; clusters.components];
            for (&i, component) in members.iter().zip(clusters.assignment) {
                split.sizes[component] += 1;
                relabelled[i] = if clusters.components > 1 {
                    demonstrations[i].clone().component(component + 1)
                } else {
                    demonstrations[i].with_label(class)
                };
            }
        }
        classes.push(split);
    }
    Ok(Variants {
        demonstrations: relabelled,
        classes,
    })
}

/// Two components of two demonstrations.
const LEAST_TO_SPLIT: usize = 4;
